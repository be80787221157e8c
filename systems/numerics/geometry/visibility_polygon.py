"""Visibility polygon of a point: all that a camera of unlimited range sees from there.

A ray is cast towards every vertex. Just clockwise and just counter-clockwise of the ray the view
ends at two distances, which differ where the vertex is a silhouette. These end points, sorted by
angle, are the polygon's vertices. What is seen along a single ray only (between two obstacles
that touch the ray from either side) has no area and is left out.
"""

import numpy as np

from ..compiled import compiled, kernel
from ..errors import InvalidInput, require
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
from .segment_sight import leaves_through_obstacle


def visibility_polygon(index: EdgeIndex, point: object) -> np.ndarray:
    """Return the polygon that is seen from a point of the free region.

    Args:
        index: The world's edges, from `build_edge_index`.
        point: Shape (2,) [m]; on the boundary it sees what lies on the free side.

    Returns:
        Vertices counter-clockwise, shape (n, 2) [m].

    Raises:
        InvalidInput: The point is not in the free region.
    """
    at = np.asarray(point, dtype=float)
    require(at.shape == (2,), "point", "have shape (2,)", at.shape)
    if not (np.isfinite(at).all() and point_is_free(index, at[0], at[1])):
        raise InvalidInput(f"`point` must be in the free region; got {at.tolist()}")
    return _visibility_polygon(index, at[0], at[1])


@compiled
def _visibility_polygon(index: EdgeIndex, x: float, y: float) -> np.ndarray:
    edges, frame = index.edges, index.frame
    tolerance = frame[TOLERANCE]
    events = np.empty((len(edges), 5))
    count = 0
    for e in range(len(edges)):
        dx, dy = edges[e, START] - x, edges[e, START + 1] - y
        distance = np.hypot(dx, dy)
        if distance <= tolerance:
            continue
        clockwise, counter = cast_ray(index, x, y, dx / distance, dy / distance)
        if distance <= max(clockwise, counter) + tolerance:
            events[count, 0] = np.arctan2(dy, dx)
            events[count, 1], events[count, 2] = dx / distance, dy / distance
            events[count, 3], events[count, 4] = clockwise, counter
            count += 1
    order = np.argsort(events[:count, 0])
    polygon = np.empty((2 * count + 1, 2))
    filled = 0
    for k in range(count):
        event = events[order[k]]
        # Skip a vertex on the ray of the one before; at +-pi that one may be the first in order.
        if (k > 0 and _same_ray(event, events[order[k - 1]], tolerance)) or (
            k > 1 and k == count - 1 and _same_ray(event, events[order[0]], tolerance)
        ):
            continue
        for side in (3, 4):
            polygon[filled, 0] = x + event[side] * event[1]
            polygon[filled, 1] = y + event[side] * event[2]
            filled += filled == 0 or _apart(polygon, filled, filled - 1, tolerance)
    while filled > 1 and not _apart(polygon, filled - 1, 0, tolerance):
        filled -= 1
    return polygon[:filled].copy()


@kernel
def _same_ray(event: np.ndarray, other: np.ndarray, tolerance: float) -> bool:
    """Whether two events (angle, ux, uy, ends of view) lie in one direction."""
    if event[1] * other[1] + event[2] * other[2] <= 0.0:
        return False
    reach = max(event[3], event[4])
    return abs(event[1] * other[2] - event[2] * other[1]) * reach <= tolerance


@kernel
def _apart(points: np.ndarray, i: int, j: int, tolerance: float) -> bool:
    """Whether two points of an array are farther apart than the tolerance."""
    return np.hypot(points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]) > tolerance


@kernel
def cast_ray(index: EdgeIndex, x: float, y: float, ux: float, uy: float) -> tuple[float, float]:
    """Distances at which the view ends just clockwise and just counter-clockwise of a ray [m].

    The start must be in the free region and u a unit vector (kernel).

    Args:
        index: The world's edges.
        x, y: The start [m].
        ux, uy: Direction of the ray, no unit.
    """
    edges, frame, starts, items, _ = index
    cell = frame[CELL]
    columns, rows = int(frame[COLUMNS]), int(frame[ROWS])
    cx, cy = (x - frame[X_MIN]) / cell, (y - frame[Y_MIN]) / cell
    i, j = int(np.floor(cx)), int(np.floor(cy))
    x_inverse = 1.0 / ux if ux != 0.0 else np.inf
    y_inverse = 1.0 / uy if uy != 0.0 else np.inf
    i_step, j_step = (1 if ux > 0 else -1), (1 if uy > 0 else -1)
    i_next = (i + (ux > 0) - cx) * x_inverse if ux != 0.0 else np.inf
    j_next = (j + (uy > 0) - cy) * y_inverse if uy != 0.0 else np.inf
    clockwise, counter = np.inf, np.inf
    while 0 <= i < columns and 0 <= j < rows:
        at = j * columns + i
        for k in range(starts[at], starts[at + 1]):
            right, left = _ends_of_view(edges, items[k], x, y, ux, uy, frame[TOLERANCE])
            clockwise, counter = min(clockwise, right), min(counter, left)
        if max(clockwise, counter) <= min(i_next, j_next) * cell:
            break
        if i_next < j_next:
            i += i_step
            i_next += abs(x_inverse)
        else:
            j += j_step
            j_next += abs(y_inverse)
    return clockwise, counter


@kernel
def _ends_of_view(
    edges: np.ndarray, e: int, x: float, y: float, ux: float, uy: float, tolerance: float
) -> tuple[float, float]:
    """Where edge `e` and the vertex at its start end the view to the right and left of a ray."""
    far = np.inf
    cx, cy = edges[e, START] - x, edges[e, START + 1] - y
    dx, dy = edges[e, END] - x, edges[e, END + 1] - y
    c_side, d_side = ux * cy - uy * cx, ux * dy - uy * dx
    if (c_side > tolerance and d_side > tolerance) or (c_side < -tolerance and d_side < -tolerance):
        return far, far
    c_along, d_along = ux * cx + uy * cy, ux * dx + uy * dy
    if abs(c_side) > tolerance and abs(d_side) > tolerance:
        ex, ey = dx - cx, dy - cy
        height = (ey * cx - ex * cy) / np.hypot(ex, ey)
        if abs(height) <= tolerance:  # the start is on the edge: does the ray enter the obstacle?
            return (0.0, 0.0) if ex * uy - ey * ux < 0.0 else (far, far)
        along = c_along + (d_along - c_along) * c_side / (c_side - d_side)
        return (along, along) if along > 0.0 else (far, far)
    right, left = far, far
    within = min(c_along, d_along) < -tolerance and max(c_along, d_along) > tolerance
    if abs(c_side) <= tolerance and abs(d_side) <= tolerance and within:
        # The ray runs along the edge from inside it: the obstacle is beside it from the start.
        right, left = (0.0, far) if d_along > 0.0 else (far, 0.0)
    if abs(c_side) > tolerance or c_along < -tolerance:
        return right, left
    px, py = edges[e, BEFORE] - x, edges[e, BEFORE + 1] - y
    p_side, p_along = ux * py - uy * px, ux * px + uy * py
    if c_along <= tolerance:  # the start is the vertex
        if leaves_through_obstacle(edges, e, ux, uy, max(d_along, p_along, tolerance), tolerance):
            return 0.0, 0.0
        if abs(d_side) <= tolerance and d_along > 0.0:
            right = 0.0
        if abs(p_side) <= tolerance and p_along > 0.0:
            left = 0.0
        return right, left
    if min(d_side, p_side) < -tolerance:
        right = min(right, c_along)
    if max(d_side, p_side) > tolerance:
        left = min(left, c_along)
    return right, left
