"""Everything known that a picture shows."""

from dataclasses import dataclass

import cv2
import numpy as np

from ...vision.estimation.pictures import as_rgb
from .alignment import align
from .detections import LandmarkDetection, Stance, stance_of
from .matching import Matches, match
from .references import MARKER, References
from .verification import FEWEST, find_square, homography_of, map_square

# Least correlation of a detection, and the least share of it that must be compared.
_CORRELATION, _VISIBLE = 0.8, 0.12
# Cameras are level, so the sides of a square on a wall hang straight, or it is none: their ends are
# beside each other by this share of the height at most.
_SLANT = 0.12
# The evader's block shows at most three sides that can be told from one another.
_COPIES = 3


@dataclass(frozen=True, eq=False)
class Recognition:
    """What came of looking at one picture.

    Attributes:
        detections: At most one of each landmark, and perhaps several of the marker.
        matches: All that came of matching, false ones included.
    """

    detections: tuple[LandmarkDetection, ...]
    matches: Matches

    @property
    def landmarks(self) -> tuple[LandmarkDetection, ...]:
        """Those that are no markers."""
        return tuple(each for each in self.detections if each.subject != MARKER)

    @property
    def markers(self) -> tuple[LandmarkDetection, ...]:
        """Copies of the evader's marker."""
        return tuple(each for each in self.detections if each.subject == MARKER)


NOTHING = Recognition((), Matches(np.zeros(0, int), np.zeros((0, 2)), np.zeros((0, 2))))


def recognise(picture: np.ndarray, references: References) -> Recognition:
    """Find landmarks and markers in a picture.

    Args:
        picture: Red, green, blue and perhaps alpha, shape (height, width, 3 or 4), uint8.
        references: Of `maze_references`.

    Raises:
        InvalidInput: Not a picture.
    """
    grey = cv2.cvtColor(as_rgb(picture), cv2.COLOR_RGB2GRAY)
    matches = match(references.finder.find(grey), references)
    light = grey.astype(np.float32)
    found: list[LandmarkDetection] = []
    for subject in references.subjects:
        own = matches.where(matches.subject == subject)
        for _ in range(_COPIES if subject == MARKER else 1):
            if len(own) < FEWEST:
                break
            square = find_square(own)
            if square is None:
                break
            corners, on = square
            detection = _detect(light, references.pictures[subject], corners, own.where(on))
            if detection is not None and not _is_known(detection, found):
                found.append(detection)
                on = on | _within(detection.corners, own.pixel)
            own = own.where(~on)
    return Recognition(tuple(found), matches)


def _detect(
    picture: np.ndarray, reference: np.ndarray, corners: np.ndarray, on: Matches
) -> LandmarkDetection | None:
    """Align a square and judge it."""
    aligned = align(picture, reference, corners, on)
    if aligned is None or aligned.correlation < _CORRELATION or aligned.visible < _VISIBLE:
        return None
    stance = stance_of(aligned.corners, _SLANT)
    if stance is Stance.TILTED:
        return None
    return LandmarkDetection(
        subject=int(on.subject[0]),
        corners=aligned.corners,
        covariance=aligned.covariance,
        correlation=aligned.correlation,
        visible=aligned.visible,
        stance=stance,
        places=on.place,
        pixels=on.pixel,
    )


def _within(corners: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """Which pixels lie in a square, shape (n,)."""
    places = map_square(np.linalg.inv(homography_of(corners)), pixels)
    return np.all((places > 0) & (places < 1), axis=1)


def _is_known(detection: LandmarkDetection, found: list[LandmarkDetection]) -> bool:
    """Whether a copy of the same subject has been found there."""
    middle = detection.corners.mean(axis=0)
    return any(
        each.subject == detection.subject and bool(_within(each.corners, middle[None])[0])
        for each in found
    )
