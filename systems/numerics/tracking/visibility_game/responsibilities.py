"""Which pursuer is responsible for which evaders, where there are more evaders than pursuers.

Sight is lost with the first evader that nobody sees, so every evader needs a pursuer. The time for
which a pursuer can keep its evaders is known from the solved games for one (`guaranteed_times`) and
for two (`two_evaders`); for more it is taken as the least over pairs of them, an overestimate. Of
all ways to share the evaders out the team takes the one whose least time is the largest, and of
several the one whose second least time is, and so on. It changes the shares if that makes the least
time longer by a tenth and some steps. While a pursuer does not see an evader of its own, a teammate
that does watches it instead, and a change is compared with the time that the team keeps in this
way. So losing an evader for a moment at a corner changes nothing, and an evader that nobody sees
stays with its pursuer: nobody else can do more for it.

Source: ours.
"""

from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from .board import (
    Board,
    distance_to_losing,
    make_board,
    nearest_evader_node,
    nearest_node,
    nearest_place,
)
from .bottleneck import GAIN
from .guaranteed_times import GuaranteedTimes
from .planes import FOR_EVER, worst_reply
from .pursuit import LIKENESS, STEP, velocity_after
from .regain import steps_to_guard
from .triples import Roads, Triples, worst_reply_of_two
from .two_evaders import GuaranteedTimesOfTwo

# Pursuer of evaders for which no pursuer is responsible.
NOBODY = -1

# Time that stands for "for ever" in comparisons [s].
AGES = 1e6

# New shares have to make the least time longer by a tenth and this number of steps of the game of
# two evaders. Its grid is coarse: a time is known only to a step or two.
STEPS_GAINED = 3

# Most ways of sharing evaders out that are all tried; beyond, a local search is used.
MOST_WAYS = 20000


class TeamBoard(NamedTuple):
    """Both solved games, as compiled code looks them up; make one with `make_team_board`.

    Attributes:
        single: The game of one evader.
        triples, roads: The game of two evaders, see `triples`; so are the next four.
        numbers: Number of the place in each row and column, or -1, shape (rows, columns).
        places: Nodes of the pursuer, shape (n, 2) [m].
        pursuer_frame, evader_frame: x and y of the first node, and spacing, shape (3,) [m].
        evader_numbers: Number of the evader node in each row and column, or -1, shape (rows,
            columns).
        steps: Duration of a step in the games of one and of two evaders, shape (2,) [s].
    """

    single: Board
    triples: Triples
    roads: Roads
    numbers: np.ndarray
    places: np.ndarray
    pursuer_frame: np.ndarray
    evader_frame: np.ndarray
    evader_numbers: np.ndarray
    steps: np.ndarray


def make_team_board(single: GuaranteedTimes, double: GuaranteedTimesOfTwo) -> TeamBoard:
    """The tables of both games.

    Args:
        single, double: By the middle bound, of the same world and robots.

    Raises:
        InvalidInput: See `make_board`.
    """
    grid, fine = double.pursuer_grid, double.evader_grid
    numbers = np.full((grid.rows, grid.columns), -1)
    numbers[grid.nearest(double.places)] = np.arange(len(double.places))
    return TeamBoard(
        make_board(single),
        double.triples,
        double.roads,
        numbers,
        double.places,
        np.array([grid.x, grid.y, grid.spacing]),
        np.array([fine.x, fine.y, fine.spacing]),
        double.evader_numbers,
        np.array([single.step, double.step]),
    )


@compiled
def prospects(
    board: TeamBoard, pursuers: np.ndarray, evaders: np.ndarray, visible: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """For how long each pursuer can keep each evader, and each pair of evaders, in sight.

    Args:
        board: The solved games.
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        visible: Who sees whom, shape (n, m), bool.

    Returns:
        Shapes (n, m) and (n, m, m) [s]: AGES for ever, zero out of sight.
    """
    n, m = visible.shape
    one, two = np.zeros((n, m)), np.zeros((n, m, m))
    single = board.single
    for i in range(n):
        here = nearest_place(single, pursuers[2 * i], pursuers[2 * i + 1])
        coarse = nearest_node(
            board.numbers, board.pursuer_frame, pursuers[2 * i], pursuers[2 * i + 1]
        )
        for j in range(m):
            if not visible[i, j]:
                continue
            row, column = nearest_evader_node(single, evaders[2 * j], evaders[2 * j + 1])
            best = 0
            if here >= 0 and row >= 0:
                for k in range(
                    single.rules.neighbour_starts[here], single.rules.neighbour_starts[here + 1]
                ):
                    q = single.rules.neighbours[k]
                    best = max(best, worst_reply(single.planes, q, row, column))
            one[i, j] = _seconds(best, board.steps[0])
            e1 = _evader_number(board, evaders, j)
            for other in range(j):
                if not visible[i, other]:
                    continue
                e2 = _evader_number(board, evaders, other)
                best = 0
                if coarse >= 0 and e1 >= 0 and e2 >= 0:
                    for k in range(
                        board.roads.neighbour_starts[coarse],
                        board.roads.neighbour_starts[coarse + 1],
                    ):
                        q = board.roads.neighbours[k]
                        best = max(best, worst_reply_of_two(board.triples, q, e1, e2))
                two[i, j, other] = two[i, other, j] = _seconds(best, board.steps[1])
    return one, two


@kernel
def _seconds(steps, step):
    """Time from now, given W after the pursuer's step; sight ends in the middle of the last one."""
    return AGES if steps == FOR_EVER else (steps + 0.5) * step


@compiled
def responsibilities(
    one: np.ndarray, two: np.ndarray, visible: np.ndarray, held: np.ndarray, step: float
) -> np.ndarray:
    """The pursuer that is responsible for each evader.

    Args:
        one, two: From `prospects`, shapes (n, m), (n, m, m) [s].
        visible: Who sees whom, shape (n, m), bool.
        held: The pursuer responsible so far, or NOBODY, shape (m,), int.
        step: Duration of a step in the game of two evaders [s].

    Returns:
        Shape (m,), int; an evader that nobody sees keeps the value in `held`.
    """
    now = watchers(one, two, visible, held)
    best = watchers(one, two, visible, np.full_like(held, NOBODY))
    # These times count only evaders that somebody sees.
    before, after = np.empty(len(one)), np.empty(len(one))
    _times(one, two, now, before)
    _times(one, two, best, after)
    if after[0] > (1.0 + GAIN) * before[0] + STEPS_GAINED * step:
        return np.where(best == NOBODY, held, best)
    return np.where(held == NOBODY, now, held)


@compiled
def watchers(
    one: np.ndarray, two: np.ndarray, visible: np.ndarray, owners: np.ndarray
) -> np.ndarray:
    """Who watches each evader: its own pursuer if that sees it, otherwise the best of the others.

    Args:
        one, two, visible: See `responsibilities`.
        owners: The pursuer responsible for each evader, or NOBODY, shape (m,), int.

    Returns:
        Shape (m,), int; NOBODY for an evader that nobody sees.
    """
    n, m = visible.shape
    found, best = np.full(m, NOBODY), np.full(m, NOBODY)
    times, most = np.empty(n), np.full(n, -1.0)
    seers, counts = np.zeros((m, n), dtype=np.int64), np.zeros(m, dtype=np.int64)
    ways = 1.0
    for j in range(m):
        bound = owners[j] >= 0 and visible[owners[j], j]
        for i in range(n):
            if visible[i, j] and (not bound or i == owners[j]):
                seers[j, counts[j]] = i
                counts[j] += 1
                # Initial choice: the pursuer that keeps it longest.
                if best[j] < 0 or one[i, j] > one[best[j], j]:
                    best[j] = i
        ways *= max(counts[j], 1)
    _times(one, two, best, most)
    if ways <= MOST_WAYS:
        for way in range(int(ways)):
            left = way
            for j in range(m):
                if counts[j] > 0:
                    found[j] = seers[j, left % counts[j]]
                    left //= counts[j]
            _times(one, two, found, times)
            if _exceed(times, most):
                best[:] = found
                most[:] = times
        return best
    climbing = True
    while climbing:
        climbing = False
        for j in range(m):
            for k in range(counts[j]):
                found[:] = best
                found[j] = seers[j, k]
                _times(one, two, found, times)
                if _exceed(times, most):
                    best[j], climbing = found[j], True
                    most[:] = times
    return best


@kernel
def _times(one, two, owners, times):
    """Write to `times` how long each pursuer keeps all its evaders, sorted, the least first [s]."""
    for i in range(len(times)):
        least, alone, count = AGES, AGES, 0
        for j in range(len(owners)):
            if owners[j] == i:
                count += 1
                alone = one[i, j]
                for k in range(j):
                    if owners[k] == i:
                        least = min(least, two[i, j, k])
        times[i] = alone if count == 1 else least
        a = i
        while a > 0 and times[a] < times[a - 1]:
            times[a], times[a - 1] = times[a - 1], times[a]
            a -= 1


@kernel
def _exceed(times, others):
    """Whether sorted times are lexicographically greater than others."""
    for i in range(len(times)):
        if times[i] != others[i]:
            return times[i] > others[i]
    return False


@compiled
def shared_certificate(one: np.ndarray, two: np.ndarray, owners: np.ndarray) -> float:
    """For how long all evaders can be kept in sight by the pursuers that watch them [s].

    Args:
        one, two: From `prospects`, shapes (n, m), (n, m, m) [s].
        owners: Who watches each evader, or NOBODY, shape (m,), int.

    Returns:
        Infinite if for ever; zero where nobody watches an evader.
    """
    if (owners == NOBODY).any():
        return 0.0
    times = np.empty(len(one))
    _times(one, two, owners, times)
    return np.inf if times[0] >= AGES else times[0]


@compiled
def hardest(one: np.ndarray, owners: np.ndarray) -> np.ndarray:
    """Of the evaders that each pursuer watches, the one that it can keep for the shortest time.

    Args:
        one: From `prospects`, shape (n, m) [s].
        owners: Who watches each evader, or NOBODY, shape (m,), int.

    Returns:
        Shape (n,), -1 for pursuers that watch none.
    """
    found = np.full(len(one), -1)
    for j in range(len(owners)):
        i = owners[j]
        if i >= 0 and (found[i] < 0 or one[i, j] < one[i, found[i]]):
            found[i] = j
    return found


@compiled
def team_velocities(
    board: TeamBoard,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    owners: np.ndarray,
    watching: np.ndarray,
    field: np.ndarray,
    speed: float,
    period: float,
) -> np.ndarray:
    """Velocities of a team whose members are responsible for any number of evaders each.

    A pursuer that watches no evader goes to where it could guard one of its own, or else to where
    it could relieve a teammate that watches several.

    Args:
        board: The solved games.
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        owners: The pursuer responsible for each evader, or NOBODY, shape (m,), int.
        watching: Who watches each, from `watchers`, shape (m,), int.
        field: Velocities by a pursuit field, shape (2 n,) [m/s].
        speed: Pursuers' top speed [m/s].
        period: For how long a velocity is held, 0 for continuous time [s].

    Returns:
        Shape (2 n,) [m/s].
    """
    velocities = field.copy()
    for i in range(len(pursuers) // 2):
        own = np.flatnonzero(watching == i)
        at, wish = pursuers[2 * i : 2 * i + 2], field[2 * i : 2 * i + 2]
        vx, vy = wish
        if len(own) > 1:
            vx, vy = _velocity_for_several(board, at[0], at[1], evaders, own, vx, vy, speed, period)
        else:
            j = (
                own[0]
                if len(own) == 1
                else _whom_to_relieve(board, i, at, evaders, owners, watching)
            )
            if j >= 0:
                evader = evaders[2 * j : 2 * j + 2]
                vx, vy = velocity_after(board.single, at, evader, wish, speed, period)
        velocities[2 * i], velocities[2 * i + 1] = vx, vy
    return velocities


@compiled
def _whom_to_relieve(board, i, pursuer, evaders, owners, watching):
    """For a pursuer that watches no evader, the one that it could guard soonest: of its own, else
    of those whose watcher has others too; -1 for none."""
    m = len(owners)
    wanted, own = np.zeros((1, m), dtype=np.bool_), False
    for j in range(m):
        wanted[0, j] = watching[j] >= 0 and owners[j] == i
        own = own or wanted[0, j]
    if not own:
        for j in range(m):
            wanted[0, j] = watching[j] >= 0 and np.count_nonzero(watching == watching[j]) > 1
    steps = steps_to_guard(board.single, pursuer, evaders, wanted)[0]
    j = int(np.argmin(steps))
    return j if steps[j] < np.inf else -1


@kernel
def _velocity_for_several(board, px, py, evaders, own, vx, vy, speed, period):
    """One pursuer's velocity after several evaders."""
    here = nearest_node(board.numbers, board.pursuer_frame, px, py)
    if here < 0:
        return vx, vy
    most, chosen, longest = -np.inf, -1, 0
    for k in range(board.roads.neighbour_starts[here], board.roads.neighbour_starts[here + 1]):
        q = board.roads.neighbours[k]
        steps = _least_steps(board, q, evaders, own)
        longest = max(longest, steps)
        x, y = board.places[q, 0], board.places[q, 1]
        worth = STEP * steps + _least_distance(board, x, y, evaders, own)
        worth += LIKENESS * ((x - px) * vx + (y - py) * vy)
        if worth > most:
            most, chosen = worth, q
    dx, dy = board.places[chosen, 0] - px, board.places[chosen, 1] - py
    distance = np.hypot(dx, dy)
    if distance == 0.0:
        return 0.0, 0.0
    pace = min(speed, distance / period) if period > 0.0 else speed
    return pace * dx / distance, pace * dy / distance


@kernel
def _least_steps(board, q, evaders, own):
    """Least W at a place over the pairs of some evaders."""
    least = FOR_EVER
    for a in range(len(own)):
        e1 = _evader_number(board, evaders, own[a])
        for b in range(a):
            e2 = _evader_number(board, evaders, own[b])
            steps = worst_reply_of_two(board.triples, q, e1, e2) if e1 >= 0 and e2 >= 0 else 0
            least = min(least, steps)
    return least


@kernel
def _evader_number(board, evaders, j):
    return nearest_node(
        board.evader_numbers, board.evader_frame, evaders[2 * j], evaders[2 * j + 1]
    )


@kernel
def _least_distance(board, x, y, evaders, own):
    """Least distance to losing over some evaders, each by the game of one evader [cells]."""
    single, least = board.single, 255.0
    p = nearest_place(single, x, y)
    for a in range(len(own)):
        row, column = nearest_evader_node(single, evaders[2 * own[a]], evaders[2 * own[a] + 1])
        if p >= 0 and row >= 0:
            least = min(least, float(distance_to_losing(single, p, row, column)))
    return least
