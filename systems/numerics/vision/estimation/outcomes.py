"""What came of looking for a shell: an estimate, a doubtful one, or none and why."""

from enum import IntEnum


class Outcome(IntEnum):
    """What came of looking for one colour of shell in one picture.

    The first three come with an estimate, the others with none.
    """

    SEEN = 0
    # Narrower than a shell at its range: something hides a side of it.
    PARTLY_HIDDEN = 1
    # A little outside the calibrated range: the estimate is an extrapolation.
    OUTSIDE_CALIBRATION = 2
    # An empty picture: the camera dropped the frame.
    NO_PICTURE = 3
    NO_BLOB = 4
    TWO_BLOBS = 5
    # The blob reaches the border of the picture.
    CUT_OFF = 6
    # No shell has that outline: a box, a mat or a poster has the colour, or the base is hidden.
    NO_SHELL_SHAPE = 7
    # Wider than a shell at its range: its base is hidden and it is nearer, or it is two shells.
    TOO_WIDE = 8
    # So narrow that there is no telling where its middle is.
    MOSTLY_HIDDEN = 9
    # Far outside the calibrated range, or above the model's horizon.
    OUT_OF_RANGE = 10
    # Of several shells of one colour fewer are seen than there are; all that is seen is measured.
    NOT_ANOTHER = 11
    # The picture is so blurred that an outline tells nothing.
    BLURRED = 12

    @property
    def has_estimate(self) -> bool:
        """Whether an estimate comes with it."""
        return self <= Outcome.OUTSIDE_CALIBRATION

    @property
    def words(self) -> str:
        """For people: as "two blobs"."""
        return self.name.lower().replace("_", " ")
