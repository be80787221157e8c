"""Poses of a recognised square, and of the evader that carries such squares, before the camera.

There are four methods for a square's pose, each with a covariance.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import require_one_of
from ..landmarks.forward_camera import ForwardCamera
from ..landmarks.maze import MarkerBlock
from ..recognition.recognition import LandmarkDetection
from .perspective import (
    fit_square,
    middle_by_size,
    slopes,
    square_by_edges,
    square_by_pnp,
    starting_poses,
)

# thesis: two vertical edges by (2.14) as printed. edges: by (2.14) corrected. pnp: plain solvePnP.
# level: weighted least squares, given that the camera is level and the heights of lens and square.
METHODS = ("thesis", "edges", "pnp", "level")

# Step of a corner's coordinates for numerical derivatives [px].
_NUDGE = 0.05
# Two fits nearer than this are one [m or rad].
_SAME = 1e-3


@dataclass(frozen=True, eq=False)
class Relative:
    """A square's pose before the camera.

    Attributes:
        pose: Ahead and left [m], direction of the front from the camera's heading [rad]; (3,).
        covariance: Shape (3, 3).
        cost: Remaining sum of squares, in units of the variances; 0 if not known.
    """

    pose: np.ndarray
    covariance: np.ndarray
    cost: float


def relative_poses(
    camera: ForwardCamera,
    detection: LandmarkDetection,
    side: float,
    middle_height: float,
    method: str,
) -> list[Relative]:
    """Possible poses of a square.

    Args:
        camera: Its optics.
        detection: Detection of the square, which must be upright.
        side, middle_height: Side of the square, and height of its middle [m].
        method: One of METHODS.

    Returns:
        None to two; the best first.

    Raises:
        InvalidInput: No such method.
    """
    require_one_of("method", method, METHODS)
    corners, covariance = detection.corners, detection.covariance
    if method in ("thesis", "edges"):

        def by_edges(moved: np.ndarray) -> np.ndarray | None:
            return square_by_edges(camera, moved, side, printed=method == "thesis")

        found = _with_doubt(by_edges, corners, covariance)
        exact = square_by_edges(camera, corners, side) if method == "thesis" else None
        if found and exact is not None:
            # The printed equation's error is known, and is added to the covariance.
            off = found[0].pose - exact
            turn = math.remainder(off[2], 2 * math.pi)
            far = float(off[:2] @ off[:2])
            doubt = np.diag([far, far, turn**2])
            found = [Relative(found[0].pose, found[0].covariance + doubt, 0.0)]
        return found
    found = []
    for start in starting_poses(camera, corners, side):
        one = (
            _by_pnp(camera, corners, covariance, side, start)
            if method == "pnp"
            else _fitted(camera, corners, covariance, side, middle_height, start)
        )
        if one is not None and all(np.abs(one.pose - each.pose).max() > _SAME for each in found):
            found.append(one)
    return sorted(found, key=lambda each: each.cost)


def _fitted(
    camera: ForwardCamera,
    corners: np.ndarray,
    covariance: np.ndarray,
    side: float,
    middle_height: float,
    start: np.ndarray,
) -> Relative | None:
    fitted = fit_square(camera, corners, covariance, side, middle_height, start)
    return Relative(*fitted) if fitted is not None and _faces(fitted[0]) else None


def _by_pnp(
    camera: ForwardCamera,
    corners: np.ndarray,
    covariance: np.ndarray,
    side: float,
    start: np.ndarray,
) -> Relative | None:
    first = square_by_pnp(camera, corners, side, start)
    if first is None:
        return None

    def near(moved: np.ndarray) -> np.ndarray | None:
        found = square_by_pnp(camera, moved, side, first[0])
        return None if found is None else found[0]

    # solvePnP is unweighted: it takes all corners as equally precise.
    cost = first[1] / float(np.mean(np.diag(covariance)))
    poses = _with_doubt(near, corners, covariance)
    return Relative(poses[0].pose, poses[0].covariance, cost) if poses else None


def _faces(pose: np.ndarray) -> bool:
    """Whether a square is ahead of the camera, with its front turned to it."""
    return pose[0] > 0 and -(pose[0] * math.cos(pose[2]) + pose[1] * math.sin(pose[2])) > 0


def _with_doubt(
    function: Callable[[np.ndarray], np.ndarray | None], corners: np.ndarray, covariance: np.ndarray
) -> list[Relative]:
    """Pose that a function gives for corners, with the covariance propagated from theirs."""

    def flat(values: np.ndarray) -> np.ndarray:
        pose = function(values.reshape(4, 2))
        return np.full(3, math.nan) if pose is None else pose

    pose = flat(corners.ravel())
    if not np.isfinite(pose).all() or not _faces(pose):
        return []
    slope = slopes(flat, corners.ravel(), _NUDGE)
    if not np.isfinite(slope).all():
        return []
    return [Relative(pose, slope @ covariance @ slope.T, 0.0)]


# Copies of the marker must agree on the evader's axis within this squared Mahalanobis distance.
_AGREE = 25.0
# If both poses of a square fit, they are weighted by their costs, divided by this.
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
    """Average over the copies of the marker that agree with the most certain one.

    With "thesis" and "edges" the marker's distance follows from its apparent size, and the evader's
    axis is assumed straight behind its middle; the other methods use the marker's orientation.

    Args:
        camera: Its optics.
        block: The evader's marker block.
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
    # The side may be turned away by up to half the angle between two sides, which moves the axis.
    out = place / float(np.hypot(*place))
    aside = np.array([-out[1], out[0]])
    turn = math.pi / block.copies / math.sqrt(3)
    spread = np.outer(aside, aside) * (block.depth * math.sin(turn)) ** 2
    spread += np.outer(out, out) * (block.depth * (1 - math.cos(turn))) ** 2
    if method == "thesis":
        # The printed equation's error is known, and is added to the covariance.
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
