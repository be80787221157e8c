"""Which corners of the obstacles are seen from a point.

In a small world it is faster to try every edge than to walk a grid: on which side of each edge's
line a corner lies is known beforehand, and a viewer's own side is found once for all corners. What
comes within the tolerance of anything is left to `segment_is_clear`, so the answers are its own.
"""

import math
from typing import NamedTuple

import numpy as np

from ..compiled import kernel
from .edge_index import END, START, TOLERANCE, EdgeIndex
from .segment_sight import leaves_through_obstacle, segment_is_clear
from .world import World

# Up to this many edges, trying them all is faster than the grid.
SMALL_WORLD = 64


class CornerIndex(NamedTuple):
    """Corners of a world and what is known of them; make one with `build_corner_index`.

    Attributes:
        points: Shape (k, 2) [m].
        numbers: The edge that starts at each corner, shape (k,).
        lines: Of each edge, the unit normal and offset of its line, its start and its end, x and
            y each [m], shape (7, e); (7, 0) in large worlds.
        heights: Height of each corner over each edge's line [m], infinite for the edges that meet
            at the corner, shape (k, e); (k, 0) in large worlds.
    """

    points: np.ndarray
    numbers: np.ndarray
    lines: np.ndarray
    heights: np.ndarray


def build_corner_index(world: World, index: EdgeIndex) -> CornerIndex:
    """Index the corners of a world whose edges are indexed already."""
    points = np.ascontiguousarray(world.corners.points)
    edges = index.edges
    starts, ends = edges[:, START : START + 2], edges[:, END : END + 2]
    numbers = np.argmin(np.abs(starts[None] - points[:, None]).sum(axis=2), axis=1)
    if len(edges) > SMALL_WORLD:
        return CornerIndex(points, numbers, np.zeros((7, 0)), np.zeros((len(points), 0)))
    along = (ends - starts) / np.hypot(*(ends - starts).T)[:, None]
    normals = np.column_stack([-along[:, 1], along[:, 0]])
    offsets = -(normals * starts).sum(axis=1)
    heights = points @ normals.T + offsets
    for corner, number in enumerate(numbers):
        meeting = (starts == points[corner]).all(axis=1) | (ends == points[corner]).all(axis=1)
        meeting[number] = True
        heights[corner, meeting] = np.inf
    lines = np.concatenate([normals.T, offsets[None], starts.T, ends.T])
    return CornerIndex(points, numbers, np.ascontiguousarray(lines), heights)


@kernel
def see_corners(
    index: EdgeIndex,
    corners: CornerIndex,
    viewers: np.ndarray,
    own: np.ndarray,
    seen: np.ndarray,
) -> None:
    """Fill in which corner each viewer sees (kernel).

    Args:
        index: The world's edges.
        corners: Its corners.
        viewers: Shape (2 n,), x and y of each viewer [m]; in the free region.
        own: Scratch, shape (m,), with as many entries as `corners.lines` has columns.
        seen: Filled with 1.0 and 0.0, shape (n, k).
    """
    lines = corners.lines
    for i in range(len(viewers) // 2):
        x, y = viewers[2 * i], viewers[2 * i + 1]
        for e in range(len(own)):
            own[e] = lines[0, e] * x + lines[1, e] * y + lines[2, e]
        for c in range(len(corners.points)):
            seen[i, c] = _sees(index, corners, c, x, y, own)


@kernel
def _sees(
    index: EdgeIndex, corners: CornerIndex, c: int, x: float, y: float, own: np.ndarray
) -> bool:
    """Whether corner c is seen from a point whose heights over the edges' lines are `own`."""
    edges, tolerance = index.edges, index.frame[TOLERANCE]
    cx, cy = corners.points[c, 0], corners.points[c, 1]
    dx, dy = cx - x, cy - y
    length = math.sqrt(dx * dx + dy * dy)
    if length <= tolerance:
        return True
    # Most corners that are not seen are hidden by their own obstacle.
    number = corners.numbers[c]
    if leaves_through_obstacle(edges, number, -dx / length, -dy / length, length, tolerance):
        return False
    if len(own) == 0:
        return segment_is_clear(index, x, y, cx, cy)
    # Without a branch in the loop, so that the compiler can take several edges at a time.
    lines, heights, margin = corners.lines, corners.heights, tolerance * length
    crossed, doubtful = False, False
    for e in range(len(own)):
        # The edge's line between viewer and corner, or near one of them? An edge that meets at
        # the corner is infinitely far: its wedge was asked above.
        low, high = min(own[e], heights[c, e]), max(own[e], heights[c, e])
        beside = (low > tolerance) | (high < -tolerance) | (high == np.inf)
        # The line of sight between the edge's ends, or near one of them?
        start = dx * (lines[4, e] - y) - dy * (lines[3, e] - x)
        end = dx * (lines[6, e] - y) - dy * (lines[5, e] - x)
        left, right = max(start, end), min(start, end)
        apart = beside | (right > margin) | (left < -margin)
        proper = (low < -tolerance) & (high > tolerance) & (right < -margin) & (left > margin)
        crossed |= proper & ~apart
        doubtful |= ~proper & ~apart
    if crossed:
        return False
    return segment_is_clear(index, x, y, cx, cy) if doubtful else True
