"""The moment at which a team loses sight of a target, located exactly between two samples.

Between samples everyone moves in a straight line at constant speed. The line between two movers
can only become blocked (or clear) when it touches a vertex, which is a quadratic equation in
time, or, where bodies block sight, the rim of a third robot's body, which is a quartic equation.
The roots cut the interval into pieces in which every line of sight keeps its state. The first
piece in which nobody sees the target starts at the moment of loss. So even a short loss within a
long step is found.
"""

import math
from typing import NamedTuple

import numpy as np

from ..compiled import compiled, kernel
from .edge_index import START, TOLERANCE, EdgeIndex
from .segment_sight import segment_is_clear
from .team_sight import disc_blocks, require_a_radius_each, rim_times

# Pieces of the unit interval shorter than this are grazing contacts, at which sight is kept.
SHORTEST_PIECE = 1e-12


class Motion(NamedTuple):
    """Everyone's positions at both ends of the interval.

    Attributes:
        viewers, viewers_after: Shape (2 n,) [m].
        targets, targets_after: Shape (2 m,) [m].
    """

    viewers: np.ndarray
    viewers_after: np.ndarray
    targets: np.ndarray
    targets_after: np.ndarray


def first_loss(
    index: EdgeIndex,
    viewers: np.ndarray,
    viewers_after: np.ndarray,
    targets: np.ndarray,
    targets_after: np.ndarray,
    radii: np.ndarray | None = None,
) -> tuple[float, int]:
    """Return when the first target is lost from everybody's sight, and which target that is.

    Args:
        index: Edges of the world that blocks sight.
        viewers, viewers_after: Positions at both ends of the interval, shape (2 n,) [m].
        targets, targets_after: The same of the targets, shape (2 m,) [m].
        radii: Of the bodies that block sight, viewers first, shape (n + m,) [m]; None: none does.

    Returns:
        The fraction of the interval in [0, 1] at which sight is lost, and the target's number;
        (inf, -1) when every target stays in someone's sight.

    Raises:
        InvalidInput: There is not one radius for each robot.
    """
    if radii is None:
        return _first_loss(*index, viewers, viewers_after, targets, targets_after)
    require_a_radius_each(radii, viewers, targets)
    return _first_loss_past_bodies(*index, viewers, viewers_after, targets, targets_after, radii)


# Passing the arrays one by one costs Numba a fraction of the time of a named tuple.
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
    return _first_of_all(index, Motion(viewers, viewers_after, targets, targets_after), None)


@compiled
def _first_loss_past_bodies(
    edges: np.ndarray,
    frame: np.ndarray,
    starts: np.ndarray,
    items: np.ndarray,
    probes: np.ndarray,
    viewers: np.ndarray,
    viewers_after: np.ndarray,
    targets: np.ndarray,
    targets_after: np.ndarray,
    radii: np.ndarray,
) -> tuple[float, int]:
    index = EdgeIndex(edges, frame, starts, items, probes)
    return _first_of_all(index, Motion(viewers, viewers_after, targets, targets_after), radii)


# The functions below are compiled twice: if `radii` is None, Numba leaves out the code for bodies.
@compiled
def _first_of_all(index: EdgeIndex, motion: Motion, radii: np.ndarray | None) -> tuple[float, int]:
    first, lost = np.inf, -1
    for j in range(0, len(motion.targets), 2):
        loss = loss_of_target(index, motion, radii, j)
        if loss < first:
            first, lost = loss, j // 2
    return first, lost


@compiled
def loss_of_target(index: EdgeIndex, motion: Motion, radii: np.ndarray | None, j: int) -> float:
    """The fraction of the interval at which one target is first seen by nobody, or infinity.

    Args:
        index: Edges of the world that blocks sight.
        motion: Of everybody.
        radii: Of the bodies that block sight, shape (n + m,) [m], or None.
        j: Index of the target's x coordinate in `motion.targets`.
    """
    viewers = len(motion.viewers)
    cuts = np.empty(2 * len(index.edges) + 2)
    for i in range(0, viewers, 2):
        if not _pair_is_clear(index, motion, radii, i, j, 0.5):
            continue
        if _contact_times(index, motion, i, j, cuts):
            continue
        if radii is None or len(_rim_times(motion, radii, i, j)) == 0:
            return np.inf  # this viewer sees it all the time
    times = [0.0, 1.0]
    for i in range(0, viewers, 2):
        count = _contact_times(index, motion, i, j, cuts)
        for k in range(count):
            times.append(cuts[k])
        if radii is not None:
            times.extend(_rim_times(motion, radii, i, j))
    times.sort()
    for k in range(len(times) - 1):
        if times[k + 1] - times[k] <= SHORTEST_PIECE:
            continue
        middle = 0.5 * (times[k] + times[k + 1])
        seen = False
        for i in range(0, viewers, 2):
            if _pair_is_clear(index, motion, radii, i, j, middle):
                seen = True
                break
        if not seen:
            return times[k]
    return np.inf


@kernel
def _pair_is_clear(
    index: EdgeIndex, motion: Motion, radii: np.ndarray | None, i: int, j: int, t: float
) -> bool:
    """Whether viewer i sees target j at the fraction t of the interval."""
    viewers, viewers_after, targets, targets_after = motion
    clear = segment_is_clear(
        index,
        viewers[i] + t * (viewers_after[i] - viewers[i]),
        viewers[i + 1] + t * (viewers_after[i + 1] - viewers[i + 1]),
        targets[j] + t * (targets_after[j] - targets[j]),
        targets[j + 1] + t * (targets_after[j + 1] - targets[j + 1]),
    )
    if radii is not None and clear:
        line, line_rate = _relative(motion, i, len(viewers) + j)
        at = (line[0] + t * line_rate[0], line[1] + t * line_rate[1])
        for k in range(0, 2 * len(radii), 2):
            if k not in (i, len(viewers) + j):
                centre, rate = _relative(motion, i, k)
                body = (centre[0] + t * rate[0], centre[1] + t * rate[1])
                if disc_blocks(at, body, radii[k // 2] - index.frame[TOLERANCE]):
                    return False
    return clear


@kernel
def _relative(motion: Motion, i: int, k: int) -> tuple[tuple[float, float], tuple[float, float]]:
    """Initial position of robot k relative to viewer i, and its change over the interval [m]."""
    viewers, viewers_after, targets, targets_after = motion
    before, after = viewers, viewers_after
    at = k
    if k >= len(viewers):
        before, after, at = targets, targets_after, k - len(viewers)
    x, y = before[at] - viewers[i], before[at + 1] - viewers[i + 1]
    x_after = after[at] - viewers_after[i]
    y_after = after[at + 1] - viewers_after[i + 1]
    return (x, y), (x_after - x, y_after - y)


@compiled
def _rim_times(motion: Motion, radii: np.ndarray, i: int, j: int) -> list[float]:
    """The fractions at which the line of sight touches the rim of a third robot's body."""
    target = len(motion.viewers) + j
    line, line_rate = _relative(motion, i, target)
    times = [0.0 for _ in range(0)]
    for k in range(0, 2 * len(radii), 2):
        if k in (i, target):
            continue
        centre, centre_rate = _relative(motion, i, k)
        for t in rim_times(line, line_rate, centre, centre_rate, radii[k // 2]):
            if 0.0 < t < 1.0:
                times.append(t)
    return times


@kernel
def _contact_times(index: EdgeIndex, motion: Motion, i: int, j: int, times: np.ndarray) -> int:
    """Fill `times` with the fractions at which the line of sight touches a vertex; count them."""
    viewers, viewers_after, targets, targets_after = motion
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
            # Generous at the ends of the line: an extra cut does no harm.
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
