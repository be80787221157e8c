"""Motion among walls: a step that would enter an obstacle slides along it instead.

A step is straight. It ends at a small distance, the skin, from the first wall that it meets; the
rest of it continues along that wall. The whole step is then replaced by its chord, which is taken
only if it is clear too. So a point that starts in free space never leaves it, at any speed or
step, not even between samples.
"""

import math

import numpy as np

from ..compiled import compiled, kernel
from .edge_index import (
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
from .segment_sight import segment_is_clear

# Distance kept from walls, in tolerances of the world: well above rounding, far below the size of
# any robot.
SKIN = 1000.0

# Most walls met in one step; the rest of the step is then dropped.
MAX_CONTACTS = 4


@kernel
def slide(index: EdgeIndex, x: float, y: float, dx: float, dy: float) -> tuple[float, float]:
    """Return the displacement (dx, dy) of a point, slid along walls where they block it (kernel).

    A point that is not free is moved towards the free side of the nearest wall instead, by at most
    the desired length.

    Args:
        index: Edges of the region in which the point may be.
        x, y: The point [m].
        dx, dy: The desired displacement [m].
    """
    length = math.sqrt(dx * dx + dy * dy)
    if length == 0.0:
        return 0.0, 0.0
    if not point_is_free(index, x, y):
        return _towards_free_space(index, x, y, length)
    at_x, at_y, left_x, left_y = x, y, dx, dy
    first_x, first_y = 0.0, 0.0
    for contact in range(MAX_CONTACTS):
        part, tx, ty = first_contact(index, at_x, at_y, left_x, left_y)
        at_x += part * left_x
        at_y += part * left_y
        if contact == 0:
            first_x, first_y = part * dx, part * dy
        if part == 1.0:
            break
        along = (1.0 - part) * (left_x * tx + left_y * ty)
        left_x, left_y = along * tx, along * ty
    if segment_is_clear(index, x, y, at_x, at_y) and point_is_free(index, at_x, at_y):
        return at_x - x, at_y - y
    if segment_is_clear(index, x, y, x + first_x, y + first_y):
        return first_x, first_y
    return 0.0, 0.0


@kernel
def first_contact(
    index: EdgeIndex, x: float, y: float, dx: float, dy: float
) -> tuple[float, float, float]:
    """How far along a displacement the first wall is met, and that wall's direction (kernel).

    Args:
        index: Edges of the region in which the point may be.
        x, y: The point [m].
        dx, dy: The displacement [m].

    Returns:
        The fraction in [0, 1] of the displacement (1: no wall), and the unit tangent (0, 0: none).
    """
    edges, frame, starts, items, _ = index
    skin = SKIN * frame[TOLERANCE]
    cell, columns, rows = frame[CELL], int(frame[COLUMNS]), int(frame[ROWS])
    x_low, x_high = min(x, x + dx) - 2.0 * skin, max(x, x + dx) + 2.0 * skin
    y_low, y_high = min(y, y + dy) - 2.0 * skin, max(y, y + dy) + 2.0 * skin
    # Rounding must not make a course along a wall meet that wall again.
    parallel = 1e-9 * math.sqrt(dx * dx + dy * dy)
    first, tangent_x, tangent_y = 1.0, 0.0, 0.0
    for j in range(
        max(0, int((y_low - frame[Y_MIN]) / cell)),
        min(rows, int((y_high - frame[Y_MIN]) / cell) + 1),
    ):
        for i in range(
            max(0, int((x_low - frame[X_MIN]) / cell)),
            min(columns, int((x_high - frame[X_MIN]) / cell) + 1),
        ):
            at = j * columns + i
            for k in range(starts[at], starts[at + 1]):
                e = items[k]
                cx, cy = edges[e, START] - x, edges[e, START + 1] - y
                ex, ey = edges[e, END] - edges[e, START], edges[e, END + 1] - edges[e, START + 1]
                size = math.sqrt(ex * ex + ey * ey)
                tx, ty = ex / size, ey / size
                approach = ty * dx - tx * dy
                height = ty * cx - tx * cy
                if approach <= parallel or height < 0.0 or height - approach >= skin:
                    continue  # leaves or follows the wall, is behind it, or stops short of it
                part = max(0.0, (height - skin) / approach)
                along = tx * (part * dx - cx) + ty * (part * dy - cy)
                if -skin <= along <= size + skin and part < first:
                    first, tangent_x, tangent_y = part, tx, ty
    return first, tangent_x, tangent_y


@kernel
def _towards_free_space(index: EdgeIndex, x: float, y: float, length: float) -> tuple[float, float]:
    """Displacement of at most `length` to just beyond the nearest wall, on its free side."""
    edges = index.edges
    nearest, best_x, best_y = np.inf, 0.0, 0.0
    for e in range(len(edges)):
        ex, ey = edges[e, END] - edges[e, START], edges[e, END + 1] - edges[e, START + 1]
        px, py = x - edges[e, START], y - edges[e, START + 1]
        t = min(1.0, max(0.0, (px * ex + py * ey) / (ex * ex + ey * ey)))
        distance = math.hypot(px - t * ex, py - t * ey)
        if distance < nearest:
            skin = 2.0 * SKIN * index.frame[TOLERANCE] / math.hypot(ex, ey)
            nearest = distance
            best_x = t * ex - px - skin * ey
            best_y = t * ey - py + skin * ex
    scale = min(1.0, length / math.hypot(best_x, best_y))
    return scale * best_x, scale * best_y


@compiled
def stop_team(index: EdgeIndex, poses: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """The fraction of each member's straight step that is clear of walls.

    Args:
        index: Edges of the region for the robots' centres.
        poses: x, y and heading of each member, shape (3 n,) [m], [m], [rad].
        steps: Change of the poses in the step, shape (3 n,).

    Returns:
        Shape (n,), each in [0, 1]; 0 from a point that is not free.
    """
    parts = np.zeros(len(poses) // 3)
    for i in range(len(parts)):
        x, y, dx, dy = poses[3 * i], poses[3 * i + 1], steps[3 * i], steps[3 * i + 1]
        if point_is_free(index, x, y):
            part = first_contact(index, x, y, dx, dy)[0]
            if segment_is_clear(index, x, y, x + part * dx, y + part * dy):
                parts[i] = part
    return parts
