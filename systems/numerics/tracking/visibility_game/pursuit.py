"""Pursuit by the solved visibility game.

The pursuer takes the step that leaves the longest time, whatever the evader does. That alone is a
poor objective: all places from which the evader is kept for ever have the same value, and the
pursuer would drift to the border of this set. So of several such steps it takes the one after which
the evader is farthest from all nodes at which it would not be kept for ever, and of equal ones the
one most along the pursuit field. Where the table has no answer the field alone decides.

Source: ours.
"""

import math

import numpy as np

from ...compiled import compiled, kernel
from ...geometry.segment_sight import segment_is_clear
from .board import Board, distance_to_losing, nearest_evader_node, nearest_place, steps_from_now
from .planes import FOR_EVER, worst_reply
from .regain import way_to_guard

# Weights: one step of time counts more than any distance; the field only breaks ties.
STEP, LIKENESS = 1000.0, 1e-3


@compiled
def guarantee_velocities(
    board: Board,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    visible: np.ndarray,
    assignment: np.ndarray,
    field: np.ndarray,
    speed: float,
    period: float,
) -> np.ndarray:
    """Velocities of a team, each member after its own evader.

    A pursuer that does not see its own evader goes to where it could guard it. As long as none of
    an evader's own pursuers sees it, the pursuer that can best keep it together with its own minds
    both.

    Args:
        board: The solved game.
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        visible: Who sees whom, shape (n, m), bool.
        assignment: Each pursuer's evader, -1 for none, shape (n,).
        field: Velocities by a pursuit field, shape (2 n,) [m/s].
        speed: Pursuers' top speed [m/s].
        period: For how long a velocity is held, 0 for continuous time [s].

    Returns:
        Shape (2 n,) [m/s].
    """
    nodes = nodes_of(board, evaders)
    minded = who_minds_whom(board, pursuers, nodes, visible, assignment)
    velocities = field.copy()
    for i in range(len(assignment)):
        px, py, vx, vy = pursuers[2 * i], pursuers[2 * i + 1], field[2 * i], field[2 * i + 1]
        j = int(assignment[i])
        velocities[2 * i], velocities[2 * i + 1] = velocity_minding(
            board, px, py, evaders, nodes, minded[i], j, vx, vy, speed, period
        )
    return velocities


@compiled
def velocity_minding(
    board: Board,
    px: float,
    py: float,
    evaders: np.ndarray,
    nodes: np.ndarray,
    minded: np.ndarray,
    j: int,
    vx: float,
    vy: float,
    speed: float,
    period: float,
) -> tuple[float, float]:
    """One pursuer's velocity for keeping the evaders that it minds, or for guarding its own.

    Args:
        board: The solved game.
        px, py: The pursuer [m].
        evaders: Positions, shape (2 m,) [m].
        nodes: Of the evaders, from `nodes_of`.
        minded: Which evaders it minds, from `who_minds_whom`, shape (m,), bool.
        j: Its own evader, -1 for none.
        vx, vy: Velocity by a pursuit field, for where the table has no answer [m/s].
        speed, period: See `guarantee_velocities`.
    """
    chosen = -1
    if minded.any():
        chosen = _where_to_go(board, px, py, evaders, nodes, minded, vx, vy)
    elif j >= 0:
        chosen = way_to_guard(board, px, py, evaders[2 * j], evaders[2 * j + 1])
    if chosen < 0:
        return vx, vy
    return _straight(px, py, board.places[chosen], speed, period)


@compiled
def time_of_team(
    board: Board,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    visible: np.ndarray,
    assignment: np.ndarray,
) -> float:
    """For how long a team keeps all evaders, including those that a teammate has to mind.

    Args:
        board: The solved game.
        pursuers, evaders, visible, assignment: See `guarantee_velocities`.

    Returns:
        Steps from now, infinite if for ever, 0 where one is lost at once. For a pursuer that minds
        several evaders it is the least of their times, which is an overestimate.
    """
    nodes = nodes_of(board, evaders)
    minded = who_minds_whom(board, pursuers, nodes, visible, assignment)
    longest = np.zeros(len(nodes))
    for i in range(len(minded)):
        if minded[i].any():
            px, py = pursuers[2 * i], pursuers[2 * i + 1]
            steps, _, _ = _best_step(board, px, py, nodes, minded[i], 0.0, 0.0)
            for j in range(len(nodes)):
                if minded[i, j]:
                    longest[j] = max(longest[j], steps_from_now(steps))
    return longest.min()


@compiled
def velocity_after(
    board: Board,
    pursuer: np.ndarray,
    evader: np.ndarray,
    field: np.ndarray,
    speed: float,
    period: float,
) -> tuple[float, float]:
    """One pursuer's velocity after one evader: its best step, or towards where it could guard it.

    Args:
        board: The solved game.
        pursuer, evader: Positions, shape (2,) [m].
        field: Velocity by a pursuit field, for where the table has no answer, shape (2,) [m/s].
        speed, period: See `guarantee_velocities`.
    """
    nodes, own = nodes_of(board, evader), np.ones(1, dtype=np.bool_)
    px, py = pursuer
    chosen = _where_to_go(board, px, py, evader, nodes, own, field[0], field[1])
    if chosen < 0:
        chosen = way_to_guard(board, px, py, evader[0], evader[1])
    if chosen < 0:
        return field[0], field[1]
    return _straight(px, py, board.places[chosen], speed, period)


@compiled
def who_minds_whom(
    board: Board,
    pursuers: np.ndarray,
    nodes: np.ndarray,
    visible: np.ndarray,
    assignment: np.ndarray,
) -> np.ndarray:
    """Which evaders each pursuer minds, that is takes care to keep in sight, shape (n, m), bool.

    Args:
        board, pursuers, visible, assignment: See `guarantee_velocities`.
        nodes: Of the evaders, from `nodes_of`.
    """
    n, m = visible.shape
    minded = np.zeros((n, m), dtype=np.bool_)
    for i in range(n):
        if assignment[i] >= 0 and visible[i, int(assignment[i])]:
            minded[i, int(assignment[i])] = True
    for j in range(m):
        if minded[:, j].any():
            continue
        most, keeper = 0.0, -1
        for i in range(n):
            if visible[i, j]:
                before = minded[i, j]
                minded[i, j] = True
                px, py = pursuers[2 * i], pursuers[2 * i + 1]
                steps, distance, _ = _best_step(board, px, py, nodes, minded[i], 0.0, 0.0)
                minded[i, j] = before
                if STEP * steps + distance > most:
                    most, keeper = STEP * steps + distance, i
        if keeper >= 0:
            minded[keeper, j] = True
    return minded


@kernel
def _straight(px, py, to, speed, period):
    """Velocity straight to a node, slower if it would be reached within the period."""
    dx, dy = to[0] - px, to[1] - py
    distance = math.sqrt(dx * dx + dy * dy)
    if distance == 0.0:
        return 0.0, 0.0
    pace = min(speed, distance / period) if period > 0.0 else speed
    return pace * dx / distance, pace * dy / distance


@compiled
def pair_worths(
    board: Board, pursuers: np.ndarray, evaders: np.ndarray, visible: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """How long each pursuer could keep each evader, and a value for comparing pairs.

    Args:
        board: The solved game.
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        visible: Whether pursuer i sees evader j, shape (n, m), bool.

    Returns:
        Steps from now, infinite if for ever, 0 where the pursuer does not see the evader or loses
        it at once; and the value by which a pursuer ranks its steps: first the time, then the
        distance to losing; positive wherever it sees the evader. Shapes (n, m).
    """
    n, m = visible.shape
    times, worths = np.zeros((n, m)), np.zeros((n, m))
    nodes, alone = nodes_of(board, evaders), np.zeros(m, dtype=np.bool_)
    for i in range(n):
        for j in range(m):
            if not visible[i, j]:
                continue
            alone[:] = False
            alone[j] = True
            px, py = pursuers[2 * i], pursuers[2 * i + 1]
            steps, distance, _ = _best_step(board, px, py, nodes, alone, 0.0, 0.0)
            times[i, j] = steps_from_now(steps)
            worths[i, j] = 1.0 + STEP * steps + distance
    return times, worths


@kernel
def _best_step(board, px, py, nodes, minded, vx, vy):
    """A pursuer's best step for the evaders that it minds: the least W over them [steps], their
    least distance to losing [cells], and the node; -1 where the table has no answer."""
    here = nearest_place(board, px, py)
    if here < 0:
        return 0, 0, -1
    most, longest, farthest, chosen = -np.inf, 0, 0, -1
    for k in range(board.rules.neighbour_starts[here], board.rules.neighbour_starts[here + 1]):
        q = board.rules.neighbours[k]
        worth, steps, distance = _worth(board, px, py, q, nodes, minded, vx, vy)
        if steps > 0 and worth > most:
            most, longest, farthest, chosen = worth, steps, distance, q
    return longest, farthest, chosen


# Where to go, from anywhere between nodes.
#
# The table has steps from node to node. A pursuer between nodes may face a corner that the table's
# step does not pass, so steps that would hide an evader on the way are avoided if there are others.
# From node to node it would also zigzag, and go some 4% farther than necessary. So straight ways
# over several steps are tried too, as long as evaders can be kept for ever. While the pursuer goes
# one cell, an evader goes one of its own, smaller cells: at the end of a way of k cells the evader
# is kept if its present node is more than k cells from losing there. Ways are ranked by that
# distance less a PRICE for each cell of the way. A straight way is taken only if it leads farther
# from losing than the best step: otherwise the price could keep the pursuer where it is for ever.
# If the best step leaves an AMPLE distance, a few percent do not matter.
#
# Source: ours.

# Longest straight way, price of each cell of it, distance from which on none is tried, and spacing
# of the points of a way at which sight of evaders is tested [cells].
FAR, PRICE, AMPLE, APART = 5.0, 0.5, 15, 0.5


@kernel
def _where_to_go(board, px, py, evaders, nodes, minded, vx, vy):
    """The node to which a pursuer goes straight to keep the evaders that it minds, -1 for none."""
    longest, farthest, chosen = _best_step(board, px, py, nodes, minded, vx, vy)
    if longest == FOR_EVER and farthest < AMPLE:
        far = _straight_way(board, px, py, evaders, nodes, minded, farthest)
        if far >= 0:
            return far
    if chosen < 0 or not _hides(board, px, py, chosen, evaders, minded):
        return chosen
    here = nearest_place(board, px, py)
    most, in_sight = -np.inf, chosen
    for k in range(board.rules.neighbour_starts[here], board.rules.neighbour_starts[here + 1]):
        q = board.rules.neighbours[k]
        worth, steps, _ = _worth(board, px, py, q, nodes, minded, vx, vy)
        if steps > 0 and worth > most and not _hides(board, px, py, q, evaders, minded):
            most, in_sight = worth, q
    return in_sight


@kernel
def _straight_way(board, px, py, evaders, nodes, minded, farthest):
    """The best node to go straight to, of those farther from losing than `farthest`, or -1."""
    # Testing a way costs more than looking up the value of its end: try the best ends first.
    most, before = np.inf, -1
    while True:
        worth, q = _best_end(board, px, py, nodes, minded, farthest, most, before)
        if q < 0 or _keeps_all_along(board, px, py, q, evaders, nodes, minded):
            return q
        most, before = worth, q


@kernel
def _best_end(board, px, py, nodes, minded, farthest, most, before):
    """Best end of a straight way among those ranked after a given one (worth less, or as much with
    a higher number): its worth and its number, -1 for none."""
    x, y, spacing = board.pursuer_frame
    i, j, reach = int(np.round((px - x) / spacing)), int(np.round((py - y) / spacing)), int(FAR)
    best, chosen = -np.inf, -1
    for row in range(max(j - reach, 0), min(j + reach + 1, board.numbers.shape[0])):
        for column in range(max(i - reach, 0), min(i + reach + 1, board.numbers.shape[1])):
            q = board.numbers[row, column]
            if q < 0:
                continue
            cells = math.hypot(x + column * spacing - px, y + row * spacing - py) / spacing
            if cells > FAR:
                continue
            distance = _nearest_to_losing(board, q, nodes, minded)
            if distance <= max(cells, farthest):
                continue
            worth = distance - PRICE * cells
            if (
                worth > best
                and (worth < most or (worth == most and q > before))
                and _least(board, q, nodes, minded)[0] == FOR_EVER
            ):
                best, chosen = worth, q
    return best, chosen


@kernel
def _keeps_all_along(board, px, py, q, evaders, nodes, minded):
    """Whether a way is free, hides nobody, and leads over cells that keep evaders for ever."""
    qx, qy = board.places[q]
    if not segment_is_clear(board.pursuer_region, px, py, qx, qy):
        return False
    x, y, spacing = board.pursuer_frame
    cells = math.hypot(qx - px, qy - py) / spacing
    pieces = math.ceil(cells)
    for k in range(1, pieces):
        i = math.floor((px + (qx - px) * k / pieces - x) / spacing)
        j = math.floor((py + (qy - py) * k / pieces - y) / spacing)
        if not _cell_keeps(board, i, j, cells * k / pieces, nodes, minded):
            return False
    return not _hides(board, px, py, q, evaders, minded)


@kernel
def _cell_keeps(board, i, j, cells, nodes, minded):
    """Whether evaders are kept for ever at all corners of a cell, after a way of `cells` [cells].

    The nearest corner alone is not enough: another one of the cell may lose the evader.
    """
    for row in range(max(j, 0), min(j + 2, board.numbers.shape[0])):
        for column in range(max(i, 0), min(i + 2, board.numbers.shape[1])):
            q = board.numbers[row, column]
            if q >= 0:
                steps, distance = _least(board, q, nodes, minded)
                if steps < FOR_EVER or distance < cells:
                    return False
    return True


@kernel
def _hides(board, px, py, q, evaders, minded):
    """Whether a standing evader would be hidden at some point of the way to a node."""
    qx, qy = board.places[q]
    cells = math.hypot(qx - px, qy - py) / board.pursuer_frame[2]
    pieces = max(math.ceil(cells / APART), 1)
    for j in range(len(minded)):
        if minded[j]:
            for k in range(1, pieces + 1):
                x, y = px + (qx - px) * k / pieces, py + (qy - py) * k / pieces
                if not segment_is_clear(board.sight, x, y, evaders[2 * j], evaders[2 * j + 1]):
                    return True
    return False


@kernel
def _worth(board, px, py, q, nodes, minded, vx, vy):
    """Value of a step to a node, the least W after it, and the least distance to losing."""
    steps, distance = _least(board, q, nodes, minded)
    dx, dy = board.places[q, 0] - px, board.places[q, 1] - py
    return STEP * steps + distance + LIKENESS * (dx * vx + dy * vy), steps, distance


@kernel
def _nearest_to_losing(board, q, nodes, minded):
    """Least distance to losing over the minded evaders, with the pursuer at a place [cells]."""
    nearest = 255
    for j in range(len(minded)):
        if minded[j]:
            row, column = nodes[j, 0], nodes[j, 1]
            if row < 0:
                return 0
            nearest = min(nearest, distance_to_losing(board, q, row, column))
    return nearest


@kernel
def _least(board, q, nodes, minded):
    """Least W [steps] and least distance to losing [cells] over the minded evaders, at a place."""
    least, nearest = FOR_EVER, 255
    for j in range(len(minded)):
        if not minded[j]:
            continue
        row, column = nodes[j, 0], nodes[j, 1]
        steps = worst_reply(board.planes, q, row, column) if row >= 0 else 0
        if steps == 0:
            return 0, 0
        least = min(least, steps)
        nearest = min(nearest, distance_to_losing(board, q, row, column))
    return least, nearest


@compiled
def nodes_of(board: Board, evaders: np.ndarray) -> np.ndarray:
    """Row and column of each evader's nearest node, -1 where there is none, shape (m, 2)."""
    nodes = np.empty((len(evaders) // 2, 2), dtype=np.int64)
    for j in range(len(nodes)):
        nodes[j] = nearest_evader_node(board, evaders[2 * j], evaders[2 * j + 1])
    return nodes
