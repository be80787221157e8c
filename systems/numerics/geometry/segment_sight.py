"""Line of sight: is a segment clear, and which corners of the obstacles are seen?

A segment is clear when the closed free region covers it. So a segment that grazes a vertex, runs
along an edge, starts or ends on the boundary, or passes between two obstacles that touch it from
either side is clear; a segment of zero length is clear when its point is free. Penetrations up to
the world's tolerance count as touching, so that the answer does not change when the scene is
rotated, moved or mirrored, or when its vertices are listed in another order.

The test is local. Coming from free space, a segment enters an obstacle either by crossing the
interior of an edge, or at a vertex that it touches, when it leaves (or reaches) that vertex through
the obstacle's wedge.

In a small world it is faster to try every edge than to walk a grid: the side of each edge's line on
which a corner lies is computed beforehand, and the viewer's side once for all corners. Cases within
the tolerance of an edge are left to `segment_is_clear`, so both methods give the same answers.
"""

import math
from typing import NamedTuple

import numpy as np

from ..compiled import compiled, kernel
from ..errors import InvalidInput
from .edge_index import (
    BEFORE,
    CELL,
    COLUMNS,
    END,
    ROWS,
    START,
    TOLERANCE,
    X_MIN,
    Y_MIN,
    EdgeIndex,
    point_is_free,
)
from .world import World

# Effect of an edge on a segment.
APART, TOUCHES, BLOCKS = 0, 1, 2


def are_clear(index: EdgeIndex, starts: object, ends: object) -> np.ndarray:
    """Whether each segment is clear.

    Args:
        index: The world's edges, from `build_edge_index`.
        starts: Shape (n, 2) [m]; points outside the free region see nothing.
        ends: Shape (n, 2) [m].

    Returns:
        Shape (n,), bool.

    Raises:
        InvalidInput: The shapes differ, or a coordinate is not finite.
    """
    a = np.ascontiguousarray(starts, dtype=float)
    b = np.ascontiguousarray(ends, dtype=float)
    if a.ndim != 2 or a.shape[1] != 2 or a.shape != b.shape:
        raise InvalidInput(f"`starts` and `ends` must both be (n, 2); got {a.shape}, {b.shape}")
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise InvalidInput("`starts` and `ends` must be finite; got NaN or infinity")
    return _are_clear(index, a, b)


@compiled
def _are_clear(index: EdgeIndex, starts: np.ndarray, ends: np.ndarray) -> np.ndarray:
    clear = np.empty(len(starts), dtype=np.bool_)
    for i in range(len(starts)):
        clear[i] = segment_is_clear(index, starts[i, 0], starts[i, 1], ends[i, 0], ends[i, 1])
    return clear


@kernel
def segment_is_clear(index: EdgeIndex, ax: float, ay: float, bx: float, by: float) -> bool:
    """Whether the closed free region covers the segment from a to b (kernel).

    Args:
        index: The world's edges.
        ax, ay: One end of the segment [m].
        bx, by: The other [m].
    """
    edges, frame, starts, items, _ = index
    cell, tolerance = frame[CELL], frame[TOLERANCE]
    columns, rows = int(frame[COLUMNS]), int(frame[ROWS])
    # Walk the cells under the segment (Amanatides & Woo, Eurographics 1987), in cell units.
    x, y = (ax - frame[X_MIN]) / cell, (ay - frame[Y_MIN]) / cell
    x_end, y_end = (bx - frame[X_MIN]) / cell, (by - frame[Y_MIN]) / cell
    if min(x, x_end) < 0.0 or min(y, y_end) < 0.0:
        return False
    if max(x, x_end) >= columns or max(y, y_end) >= rows:
        return False
    i, j, i_end, j_end = int(x), int(y), int(x_end), int(y_end)
    length = math.sqrt((bx - ax) * (bx - ax) + (by - ay) * (by - ay))
    if length <= tolerance:
        return point_is_free(index, ax, ay)
    ux, uy = (bx - ax) / length, (by - ay) / length
    dx, dy = x_end - x, y_end - y
    i_step, j_step = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    i_next = (i + (dx > 0) - x) / dx if i != i_end else np.inf
    j_next = (j + (dy > 0) - y) / dy if j != j_end else np.inf
    beyond = length + tolerance
    touched = False
    while True:
        at = j * columns + i
        for k in range(starts[at], starts[at + 1]):
            e = items[k]
            c_side = ux * (edges[e, START + 1] - ay) - uy * (edges[e, START] - ax)
            d_side = ux * (edges[e, END + 1] - ay) - uy * (edges[e, END] - ax)
            if min(c_side, d_side) > tolerance or max(c_side, d_side) < -tolerance:
                continue  # on one side of the segment's line, as most edges are
            c_along = ux * (edges[e, START] - ax) + uy * (edges[e, START + 1] - ay)
            d_along = ux * (edges[e, END] - ax) + uy * (edges[e, END + 1] - ay)
            if max(c_along, d_along) < -tolerance or min(c_along, d_along) > beyond:
                continue  # before its start or after its end
            contact = _contact(edges, e, ax, ay, bx, by, ux, uy, length, c_side, d_side, tolerance)
            if contact == BLOCKS:
                return False
            if contact == TOUCHES:
                touched = True
        if i == i_end and j == j_end:
            break
        if i_next < j_next:
            i += i_step
            i_next = (i + (dx > 0) - x) / dx if i != i_end else np.inf
        else:
            j += j_step
            j_next = (j + (dy > 0) - y) / dy if j != j_end else np.inf
    # If the boundary was touched, the local tests have shown that the segment is in free space.
    return touched or point_is_free(index, ax, ay)


@kernel
def _contact(
    edges: np.ndarray,
    e: int,
    ax: float,
    ay: float,
    bx: float,
    by: float,
    ux: float,
    uy: float,
    length: float,
    c_side: float,
    d_side: float,
    tolerance: float,
) -> int:
    """Effect of edge `e`, whose ends lie c_side and d_side left of the line a-b, on a-b."""
    cx, cy = edges[e, START] - ax, edges[e, START + 1] - ay
    dx, dy = edges[e, END] - ax, edges[e, END + 1] - ay
    if abs(c_side) > tolerance and abs(d_side) > tolerance:
        # The edge crosses the segment's line; on which sides of the edge are a and b?
        ex, ey = dx - cx, dy - cy
        scale = 1.0 / math.sqrt(ex * ex + ey * ey)
        a_side = (ey * cx - ex * cy) * scale
        b_side = (ex * (by - ay - cy) - ey * (bx - ax - cx)) * scale
        low, high = min(a_side, b_side), max(a_side, b_side)
        if low > tolerance or high < -tolerance:
            return APART
        return BLOCKS if low < -tolerance else TOUCHES
    # One end is on the segment's line. Each vertex is judged once, as the start of its edge.
    along = ux * cx + uy * cy
    if abs(c_side) > tolerance or along < -tolerance or along > length + tolerance:
        return APART
    if along < length - tolerance and leaves_through_obstacle(
        edges, e, ux, uy, length - along, tolerance
    ):
        return BLOCKS
    if along > tolerance and leaves_through_obstacle(edges, e, -ux, -uy, along, tolerance):
        return BLOCKS
    return TOUCHES


@kernel
def leaves_through_obstacle(
    edges: np.ndarray, e: int, ux: float, uy: float, reach: float, tolerance: float
) -> bool:
    """Whether direction u, from the start of edge `e`, points into the obstacle there.

    A course that stays within `tolerance` of one of the two edges over the distance `reach` runs
    along that edge and does not enter the obstacle.

    Args:
        edges: Of an `EdgeIndex`, shape (n, 6) [m].
        e: Number of the edge.
        ux, uy: The direction, a unit vector, no unit.
        reach: Length of the course [m].
        tolerance: Of the world [m].
    """
    vx, vy = edges[e, START], edges[e, START + 1]
    nx, ny = edges[e, END] - vx, edges[e, END + 1] - vy
    px, py = edges[e, BEFORE] - vx, edges[e, BEFORE + 1] - vy
    n_side = ux * ny - uy * nx
    p_side = ux * py - uy * px
    # |n_side| * min(1, reach / |n|) <= tolerance, without roots.
    square = tolerance * tolerance
    near = square * reach * reach
    if ux * nx + uy * ny > 0.0 and n_side * n_side * reach * reach <= max(
        near, square * (nx * nx + ny * ny)
    ):
        return False
    if ux * px + uy * py > 0.0 and p_side * p_side * reach * reach <= max(
        near, square * (px * px + py * py)
    ):
        return False
    # The obstacle is swept counter-clockwise from `before` to the edge's end.
    if px * ny - py * nx > 0.0:
        return p_side < 0.0 and n_side > 0.0
    return p_side < 0.0 or n_side > 0.0


# Up to this many edges, trying them all is faster than the grid.
SMALL_WORLD = 64


class CornerIndex(NamedTuple):
    """Corners of a world with precomputed geometry; make one with `build_corner_index`.

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
    """Precompute the corners of a world whose edges are indexed already."""
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
    # Most hidden corners are hidden by their own obstacle: test that first.
    number = corners.numbers[c]
    if leaves_through_obstacle(edges, number, -dx / length, -dy / length, length, tolerance):
        return False
    if len(own) == 0:
        return segment_is_clear(index, x, y, cx, cy)
    # No branch in the loop, so that the compiler can vectorise it.
    lines, heights, margin = corners.lines, corners.heights, tolerance * length
    crossed, doubtful = False, False
    for e in range(len(own)):
        # Is the edge's line between viewer and corner, or near one of them? Edges that meet at
        # the corner have infinite height: their wedge was tested above.
        low, high = min(own[e], heights[c, e]), max(own[e], heights[c, e])
        beside = (low > tolerance) | (high < -tolerance) | (high == np.inf)
        # Is the line of sight between the edge's ends, or near one of them?
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
