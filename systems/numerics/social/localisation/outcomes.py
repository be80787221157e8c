"""What came of looking for the evader in a picture."""

from enum import IntEnum


class Outcome(IntEnum):
    """Whether there is a location, and why not. The first two come with one."""

    LOCATED = 0
    # It seemed to be a little inside a wall, and is given at the nearest place where it can be.
    AT_A_WALL = 1
    # Not bytes of a picture of the camera's size.
    NO_PICTURE = 2
    NO_EVADER = 3
    NO_LANDMARK = 4
    # Landmarks, but none that hangs as the map says.
    NOT_UPRIGHT = 5
    # No place in the maze explains the landmarks.
    CAMERA_OUTSIDE = 6
    EVADER_OUTSIDE = 7
    # A wall of the map stands between.
    BEHIND_A_WALL = 8
    # The evader could be almost anywhere.
    TOO_UNSURE = 9

    @property
    def has_location(self) -> bool:
        """Whether a location comes with it."""
        return self <= Outcome.AT_A_WALL

    @property
    def words(self) -> str:
        """For people: as "no evader"."""
        return self.name.lower().replace("_", " ")
