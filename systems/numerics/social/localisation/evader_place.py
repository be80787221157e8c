"""Where the evader stands before the camera, from the markers on it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..landmarks.forward_camera import ForwardCamera
from ..landmarks.maze import MarkerBlock
from ..recognition.detections import LandmarkDetection
from .edges import middle_by_size
from .perspective import slopes
from .relative import relative_poses

_NUDGE = 0.05
# Two copies of the marker must agree on the evader's axis within this many deviations, squared.
_AGREE = 25.0
# Where both poses of a square fit, the worse one counts by its cost, tempered.
_TEMPER = 4.0


@dataclass(frozen=True, eq=False)
class EvaderPlace:
    """The evader's axis before the camera.

    Attributes:
        place: Ahead and left, shape (2,) [m].
        covariance: Shape (2, 2) [m^2].
        copies: How many copies of the marker it rests on.
    """

    place: np.ndarray
    covariance: np.ndarray
    copies: int


def evader_place(
    camera: ForwardCamera, block: MarkerBlock, markers: Sequence[LandmarkDetection], method: str
) -> EvaderPlace | None:
    """Average over the copies of the marker that agree with the surest one.

    By "thesis" and "edges" the marker's distance follows from its apparent size, and the evader's
    axis is behind its middle; the other methods know how the marker is turned.

    Args:
        camera: Its optics.
        block: What the evader wears.
        markers: Detections, upright.
        method: One of METHODS of `relative`.

    Returns:
        None if no marker gives a place.
    """
    by_size = method in ("thesis", "edges")
    found = []
    for each in markers:
        one = (
            _by_size(camera, block, each, method)
            if by_size
            else _by_pose(camera, block, each, method)
        )
        found += [] if one is None else [one]
    if not found:
        return None
    found.sort(key=lambda each: float(np.trace(each.covariance)))
    best = found[0]
    information, pull, copies = np.zeros((2, 2)), np.zeros(2), 0
    for each in found:
        away = each.place - best.place
        if away @ np.linalg.solve(each.covariance + best.covariance, away) < _AGREE:
            weight = np.linalg.inv(each.covariance)
            information, pull, copies = information + weight, pull + weight @ away, copies + 1
    covariance = np.linalg.inv(information)
    return EvaderPlace(best.place + covariance @ pull, covariance, copies)


def _by_size(
    camera: ForwardCamera, block: MarkerBlock, detection: LandmarkDetection, method: str
) -> EvaderPlace | None:
    def axis(corners: np.ndarray, printed: bool = method == "thesis") -> np.ndarray:
        middle = middle_by_size(camera, corners.reshape(4, 2), block.side, printed=printed)
        if middle is None:
            return np.full(2, math.nan)
        return middle * (1 + block.depth / float(np.hypot(*middle)))

    place = axis(detection.corners.ravel())
    slope = slopes(axis, detection.corners.ravel(), _NUDGE)
    if not np.isfinite(slope).all():
        return None
    # The side may be turned away by half the angle between two sides, and the axis with it.
    out = place / float(np.hypot(*place))
    aside = np.array([-out[1], out[0]])
    turn = math.pi / block.copies / math.sqrt(3)
    spread = np.outer(aside, aside) * (block.depth * math.sin(turn)) ** 2
    spread += np.outer(out, out) * (block.depth * (1 - math.cos(turn))) ** 2
    if method == "thesis":
        # It says of itself how wrong it is, if not which way.
        off = axis(detection.corners.ravel()) - axis(detection.corners.ravel(), printed=False)
        spread += float(off @ off) * np.eye(2)
    return EvaderPlace(place, slope @ detection.covariance @ slope.T + spread, 1)


def _by_pose(
    camera: ForwardCamera, block: MarkerBlock, detection: LandmarkDetection, method: str
) -> EvaderPlace | None:
    def axis(pose: np.ndarray) -> np.ndarray:
        return pose[:2] - block.depth * np.array([math.cos(pose[2]), math.sin(pose[2])])

    poses = relative_poses(camera, detection, block.side, block.middle_height, method)
    if not poses:
        return None
    places, spreads, likely = [], [], []
    for each in poses:
        slope = slopes(axis, each.pose)
        places.append(axis(each.pose))
        spreads.append(slope @ each.covariance @ slope.T)
        likely.append(math.exp(-0.5 * (each.cost - poses[0].cost) / _TEMPER))
    share = np.array(likely) / sum(likely)
    place = share @ np.array(places)
    covariance = np.zeros((2, 2))
    for k, each, spread in zip(share, places, spreads, strict=True):
        covariance += k * (spread + np.outer(each - place, each - place))
    return EvaderPlace(place, covariance, 1)
