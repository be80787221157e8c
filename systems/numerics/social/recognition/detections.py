"""What a picture shows: a subject, where its corners are, how surely, and which way up."""

from dataclasses import dataclass
from enum import Enum

import numpy as np


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
        corners: Its top left, top right, bottom right, bottom left by its own picture, perhaps
            outside the frame; shape (4, 2) [px].
        covariance: Of the corners, row by row, shape (8, 8) [px^2].
        correlation: Of the subject's picture with this one, where it is seen; at most 1.
        visible: Share of the square that looks as it should: inside the frame, and not hidden.
        stance: Which way up.
        places: Points of the subject's unit square that matched, shape (n, 2).
        pixels: And where in the picture, shape (n, 2) [px].
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
