"""The moment at which a team loses sight of a target, located exactly between two samples.

Between samples everyone moves in a straight line at constant speed. The line between two movers
can only become blocked (or clear) when it touches a vertex, which is a quadratic equation in
time. Its roots cut the interval into pieces in which every line of sight keeps its state; the
first piece in which nobody sees the target starts at the moment of loss. Nothing is missed,
however long the step: neither the moment nor a short loss inside it.
"""

import math

import numpy as np

from ..compiled import compiled, kernel
from .edge_index import START, EdgeIndex
from .segment_sight import segment_is_clear

# Pieces of the unit interval shorter than this are grazing contacts, at which sight is kept.
SHORTEST_PIECE = 1e-12


def first_loss(
    index: EdgeIndex,
    viewers: np.ndarray,
    viewers_after: np.ndarray,
    targets: np.ndarray,
    targets_after: np.ndarray,
) -> tuple[float, int]:
    """When, and which target is first seen by nobody.

    Args:
        index: Edges of the world that blocks sight.
        viewers, viewers_after: Positions at both ends of the interval, shape (2 n,) [m].
        targets, targets_after: The same of the targets, shape (2 m,) [m].

    Returns:
        The fraction of the interval in [0, 1] at which sight is lost, and the target's number;
        (inf, -1) when every target stays in someone's sight.
    """
    return _first_loss(*index, viewers, viewers_after, targets, targets_after)


# Numba takes the arrays one by one in a fraction of the time that it takes a named tuple.
@compiled
def _first_loss(
    edges: np.ndarray,
    frame: np.ndarray,
    starts: np.ndarray,
    items: np.ndarray,
    probes: np.ndarray,
    viewers: np.ndarray,
    viewers_after: np.ndarray,
    targets: np.ndarray,
    targets_after: np.ndarray,
) -> tuple[float, int]:
    index = EdgeIndex(edges, frame, starts, items, probes)
    first, lost = np.inf, -1
    for j in range(0, len(targets), 2):
        loss = _loss_of(index, viewers, viewers_after, targets, targets_after, j)
        if loss < first:
            first, lost = loss, j // 2
    return first, lost


@compiled
def _loss_of(
    index: EdgeIndex,
    viewers: np.ndarray,
    viewers_after: np.ndarray,
    targets: np.ndarray,
    targets_after: np.ndarray,
    j: int,
) -> float:
    cuts = np.empty(2 * len(index.edges) + 2)
    for i in range(0, len(viewers), 2):
        if _pair_is_clear(
            index, viewers, viewers_after, targets, targets_after, i, j, 0.5
        ) and not _contact_times(index, viewers, viewers_after, targets, targets_after, i, j, cuts):
            return np.inf  # this viewer sees it all the time
    times = [0.0, 1.0]
    for i in range(0, len(viewers), 2):
        count = _contact_times(index, viewers, viewers_after, targets, targets_after, i, j, cuts)
        for k in range(count):
            times.append(cuts[k])
    times.sort()
    for k in range(len(times) - 1):
        if times[k + 1] - times[k] <= SHORTEST_PIECE:
            continue
        middle = 0.5 * (times[k] + times[k + 1])
        seen = False
        for i in range(0, len(viewers), 2):
            if _pair_is_clear(index, viewers, viewers_after, targets, targets_after, i, j, middle):
                seen = True
                break
        if not seen:
            return times[k]
    return np.inf


@kernel
def _pair_is_clear(
    index: EdgeIndex,
    viewers: np.ndarray,
    viewers_after: np.ndarray,
    targets: np.ndarray,
    targets_after: np.ndarray,
    i: int,
    j: int,
    t: float,
) -> bool:
    """Whether viewer i sees target j at the fraction t of the interval."""
    return segment_is_clear(
        index,
        viewers[i] + t * (viewers_after[i] - viewers[i]),
        viewers[i + 1] + t * (viewers_after[i + 1] - viewers[i + 1]),
        targets[j] + t * (targets_after[j] - targets[j]),
        targets[j + 1] + t * (targets_after[j + 1] - targets[j + 1]),
    )


@kernel
def _contact_times(
    index: EdgeIndex,
    viewers: np.ndarray,
    viewers_after: np.ndarray,
    targets: np.ndarray,
    targets_after: np.ndarray,
    i: int,
    j: int,
    times: np.ndarray,
) -> int:
    """Fill `times` with the fractions at which the line of sight touches a vertex; count them."""
    edges = index.edges
    px, py = viewers[i], viewers[i + 1]
    vx, vy = viewers_after[i] - px, viewers_after[i + 1] - py
    dx, dy = targets[j] - px, targets[j + 1] - py
    wx = targets_after[j] - viewers_after[i] - dx
    wy = targets_after[j + 1] - viewers_after[i + 1] - dy
    x_low = min(px, targets[j], viewers_after[i], targets_after[j])
    x_high = max(px, targets[j], viewers_after[i], targets_after[j])
    y_low = min(py, targets[j + 1], viewers_after[i + 1], targets_after[j + 1])
    y_high = max(py, targets[j + 1], viewers_after[i + 1], targets_after[j + 1])
    square = wy * vx - wx * vy
    count = 0
    for e in range(len(edges)):
        x, y = edges[e, START], edges[e, START + 1]
        if x < x_low or x > x_high or y < y_low or y > y_high:
            continue
        # cross(d + w t, c - v t) = 0, with c the vertex seen from the viewer at t = 0.
        cx, cy = x - px, y - py
        constant = dx * cy - dy * cx
        linear = wx * cy - wy * cx - dx * vy + dy * vx
        for root in _roots(square, linear, constant):
            if not 0.0 < root < 1.0:
                continue
            lx, ly = dx + root * wx, dy + root * wy
            along = lx * (cx - root * vx) + ly * (cy - root * vy)
            # Generous at the ends of the line: a cut too many costs nothing.
            if -1e-9 <= along <= (lx * lx + ly * ly) * (1.0 + 1e-9):
                times[count] = root
                count += 1
    return count


@kernel
def _roots(a: float, b: float, c: float) -> tuple[float, float]:
    """Real roots of a t^2 + b t + c, without cancellation; inf where there are fewer."""
    discriminant = b * b - 4.0 * a * c
    if discriminant < 0.0:
        return np.inf, np.inf
    q = -0.5 * (b + math.copysign(math.sqrt(discriminant), b))
    first = q / a if a != 0.0 else np.inf
    second = c / q if q != 0.0 else np.inf
    return first, second
