"""Detection of landmarks and markers in a picture: their corners, with covariances."""

from dataclasses import dataclass
from enum import Enum

import cv2
import numpy as np

from ...vision.estimation.pictures import as_rgb
from .alignment import align
from .matching import FEWEST, Matches, find_square, homography_of, map_square, match
from .references import MARKER, References


class Stance(Enum):
    """How a square hangs, seen by a level camera."""

    UPRIGHT = "upright"
    UPSIDE_DOWN = "upside down"
    # Its left and right edges are not vertical in the picture: this is no level camera's view of a
    # wall.
    TILTED = "tilted"


@dataclass(frozen=True, eq=False, kw_only=True)
class LandmarkDetection:
    """A landmark or a marker in a picture.

    Attributes:
        subject: Number of the landmark, or MARKER.
        corners: Top left, top right, bottom right, bottom left of the subject's own picture,
            perhaps outside the frame; shape (4, 2) [px].
        covariance: Covariance of the corners, row by row, shape (8, 8) [px^2].
        correlation: Correlation of the subject's picture with this one, where visible; at most 1.
        visible: Share of the square that is inside the frame and not hidden.
        stance: Which way up it is.
        places: Matched points on the subject's unit square, shape (n, 2).
        pixels: The same points in the picture, shape (n, 2) [px].
    """

    subject: int
    corners: np.ndarray
    covariance: np.ndarray
    correlation: float
    visible: float
    stance: Stance
    places: np.ndarray
    pixels: np.ndarray


def stance_of(corners: np.ndarray, tolerance: float) -> Stance:
    """Which way up a square hangs.

    Args:
        corners: Shape (4, 2) [px].
        tolerance: How far the lower end of an edge may be beside the upper one, as a part of
            its height.
    """
    edges = corners[[3, 2]] - corners[[0, 1]]
    if (np.abs(edges[:, 0]) > tolerance * np.abs(edges[:, 1])).any():
        return Stance.TILTED
    if (edges[:, 1] > 0).all():
        return Stance.UPRIGHT
    return Stance.UPSIDE_DOWN if (edges[:, 1] < 0).all() else Stance.TILTED


# Least correlation of a detection, and least visible share.
_CORRELATION, _VISIBLE = 0.8, 0.12
# Cameras are level, so the left and right edges of a square on a wall must be vertical: their ends
# may differ sideways by at most this share of the height.
_SLANT = 0.12
# Most sides of the evader's block that can be detected in one picture.
_COPIES = 3


@dataclass(frozen=True, eq=False)
class Recognition:
    """What was recognised in one picture.

    Attributes:
        detections: At most one of each landmark, and perhaps several of the marker.
        matches: All matches, false ones included.
    """

    detections: tuple[LandmarkDetection, ...]
    matches: Matches

    @property
    def landmarks(self) -> tuple[LandmarkDetection, ...]:
        """Detections of landmarks."""
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
    """Align a square; None if correlation, visible share or stance rule it out."""
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
