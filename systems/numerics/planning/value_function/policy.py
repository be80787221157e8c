"""The way down a table: what the roll-out, the feedback system and the command drive.

The best descents of the table, and the quickest word of three arcs, are words of held controls; the
durations of each are chosen anew to take the least time into the goal box, exactly, so that errors
of the table decide at most which word is taken. Among walls a path is searched down the table too,
and durations are chosen among those whose words keep clear. A cart that follows a word keeps to it
while it still leads into the box, and clear of walls, chooses its durations anew when it does not,
and takes another only when that does not help.
"""

import math
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arc_words.candidates import car_words, keeps_limit, quickest_words, rank
from ..arc_words.quickest import LONGEST, ArcWord, quickest_word, word_path
from ..arc_words.shortened import OVERLAP, Clearance, after, end_of, merged, shortened, word_of
from ..arc_words.words import control_set
from ..goal import Goal
from ..plan import TrailerPath
from ..trailer import Trailer, hold_beta, shift_of
from .descents import descents
from .obstacles import SPARE, room_along, room_of, with_spare
from .value_function import ValueFunction, word_known
from .walled_search import search_path

# Number of descents whose durations are optimised.
WAYS = 4
# Words of a car are tried if they take at most this much longer than the quickest descent
# [1 / turn rate].
LONGER_CAR_PATH = 2.0
# How much longer the word that is followed may get when its durations are chosen anew: relative
# to its time, plus a constant [1 / turn rate].
LONGER, SLACK = 0.1, 0.2
# How much longer a way that keeps off the edge of the box may take than one into the whole box
# [1 / turn rate].
DETOUR = 0.5
# Share of the margin that the word being followed has to keep, or its durations are chosen anew.
HALF = 0.5
# For how long controls are held at the beginnings of other ways [1 / turn rate].
HELD = (0.4, 0.8)
# Room that a cart beside a wall may lose by rounding at its start, in lengths of the trailer.
_ROUNDING = 1e-9
# Part of its radius that a disc may be in a wall at the start.
_SHRUNK = 0.99
# No arcs: the cart is there.
STANDSTILL = ArcWord(np.zeros((0, 2)), np.zeros(0))


def best_word(value: ValueFunction, state, margin: float = 0.0) -> ArcWord | None:
    """The quickest way into the goal box that the table knows of; None where it knows none.

    Args:
        value: The table.
        state: x, y, theta, beta [m], [m], [rad], [rad].
        margin: Share of the half-widths of the box to keep off its edge, in [0, 1); walls are kept
            off by the same distance as in x and y. It is given up where it would cost a detour.
    """
    local = value.to_table(state)
    whole = _best_into(value, local, value.goal, _spare(value, local, 0.0))
    if margin == 0.0 or whole is None:
        return whole
    inner = _best_into(value, local, _inner(value.goal, margin), _spare(value, local, margin))
    if inner is None or inner.time > whole.time + DETOUR / value.trailer.turn_rate:
        return whole
    return inner


def attained_times(value: ValueFunction, states: ArrayLike) -> np.ndarray:
    """Time in which a cart really gets into the goal box from each state [s].

    It is that of `best_word`: the duration of a path that ends in the box when it is driven. So it
    is an upper bound of the least time, whatever the grid, and in the open mostly equal to it. Each
    state costs about as much as a roll-out: a tenth of a second, among walls half a second.

    Args:
        value: The table.
        states: x, y, theta, beta, shape (..., 4) [m], [m], [rad], [rad].

    Returns:
        Shape (...); infinite where the table knows no way.
    """
    each = np.asarray(states, dtype=float)
    times = np.full(each.shape[:-1], math.inf)
    for place in np.ndindex(times.shape):
        word = best_word(value, each[place])
        times[place] = math.inf if word is None else word.time
    return times


def way_time(value: ValueFunction, state: np.ndarray) -> float:
    """Attained time of one state; infinite in a wall, though a roll-out leads out of it [s].

    Args:
        value: A table among walls.
        state: x, y, theta, beta, shape (4,) [m], [m], [rad], [rad].
    """
    if value.walls is not None and room_of(value.walls, state) < -OVERLAP * value.trailer.length:
        return math.inf
    return float(attained_times(value, state))


def next_word(
    value: ValueFunction, state, word: ArcWord | None, margin: float = 0.0
) -> ArcWord | None:
    """The way to go on from a state for a cart that has followed a word so far.

    Args:
        value: The table.
        state: x, y, theta, beta, perhaps not quite where the word was to lead.
        word: What is left of the word; None: none was followed.
        margin: See `best_word`.

    Returns:
        A word; without arcs: the cart has arrived; None: the table knows no way.
    """
    local = value.to_table(state)
    if word is None or not len(word.durations):
        # Standing in the box, it does not set out again to be farther from its edge.
        there = word is not None and bool(value.goal.contains(local))
        return STANDSTILL if there else best_word(value, state, margin)
    end, spare = end_of(value.trailer, local, word), _spare(value, local, HALF * margin)
    if _inner(value.goal, HALF * margin).contains(end) and _is_clear(value, local, word, spare):
        return word
    longest = (1 + LONGER) * word.time + SLACK / value.trailer.turn_rate
    for part in (margin, 0.0):
        goal, spare = _inner(value.goal, part), _spare(value, local, part)
        anew = shortened(value.trailer, local, word, goal, _clearance(value, spare))
        if anew is not None and anew.time <= longest and _allowed(value, local, anew, spare):
            return anew
    best = best_word(value, state, margin)
    if best is None and _is_clear(value, local, word, 0.0):
        # Off the grid, the word that it follows leads back.
        return word
    return best


def _best_into(value: ValueFunction, local: np.ndarray, aim: Goal, spare: float) -> ArcWord | None:
    if aim.contains(local):
        return STANDSTILL
    trailer = value.trailer
    at_home = replace(value, placement=(0.0, 0.0, 0.0))
    ways = [word_of(way.path) for way in descents(at_home, local, aim=aim)[:WAYS]]
    if value.walls is not None:
        search = search_path(at_home, with_spare(value.walls, spare), local, aim)
        if search.path is not None:
            ways.append(word_of(search.path))
    known = word_known(at_home, local)
    # The known word may lead through channels narrower than a cell.
    ways += [] if known is None or not aim.contains(end_of(trailer, local, known)) else [known]
    ways.sort(key=lambda word: word.time)
    words = list(ways)
    # Where descents miss a channel, the promised time still accounts for it.
    promised = float(at_home.interpolated(local)) if known is None else known.time
    least = min([promised, *(word.time for word in ways)])
    if least * trailer.turn_rate < LONGEST:
        entry = quickest_word(trailer, local, aim)
        words += [] if entry is None else [entry]
    longest = LONGER_CAR_PATH + ways[0].time * trailer.turn_rate if ways else math.inf
    words += car_words(trailer, local, aim, longest)

    def allowed(word: ArcWord) -> bool:
        return _allowed(value, local, word, spare)

    near = quickest_words(trailer, local, words, aim, allowed, _clearance(value, spare))
    # A descent arrives with its own durations too, should no better ones be found.
    if value.walled:
        ways = [word for word in ways if _is_clear(value, local, word, spare)]
    return min([*near, *ways], key=lambda word: rank(word, trailer), default=None)


def _allowed(value: ValueFunction, local: np.ndarray, word: ArcWord, spare: float) -> bool:
    """Whether a word keeps on the grid, clear of walls and within the jackknife limit."""
    states = word_path(value.trailer, local, word).states if len(word.durations) else local[None]
    x_min, y_min, x_max, y_max = value.grid.bounds
    x, y = states[:, 0], states[:, 1]
    on_grid = (x >= x_min) & (x <= x_max) & (y >= y_min) & (y <= y_max)
    kept = bool(on_grid.all()) and keeps_limit(value.trailer, local, word)
    return kept and _is_clear(value, local, word, spare)


def _spare(value: ValueFunction, local: np.ndarray, margin: float) -> float:
    """How far to keep off walls; a cart that is nearer comes no nearer [m]."""
    if value.walls is None:
        return 0.0
    length = value.trailer.length
    wanted = SPARE * length + margin * min(value.goal.tolerance[:2])
    # From deeper in a wall there is no way: something has to be left of every disc.
    deepest = -_SHRUNK * float(value.walls.discs[:, 1].min())
    return max(min(wanted, room_of(value.walls, local) - _ROUNDING * length), deepest)


def _clearance(value: ValueFunction, spare: float) -> Clearance | None:
    """The room that words must keep off walls, as the search for durations wants it."""
    if value.walls is None:
        return None
    return partial(room_along, with_spare(value.walls, spare), value.trailer)


def _is_clear(value: ValueFunction, local: np.ndarray, word: ArcWord, spare: float) -> bool:
    """Whether a word keeps off walls, to the tolerance of the search for durations."""
    clearance = _clearance(value, spare)
    if clearance is None or not len(word.durations):
        return True
    least = float(clearance(local, word, True)(word.durations)[0].min())
    return least >= -OVERLAP * value.trailer.length


def _inner(goal: Goal, margin: float) -> Goal:
    """The goal with its box drawn in by part of its half-widths."""
    if margin == 0.0:
        return goal
    x, y, theta, beta = ((1 - margin) * width for width in goal.tolerance)
    return replace(goal, tolerance=(x, y, theta, beta))


# A path that takes this many times the promised time, and half a radian's turn more, shows that the
# table is not to be believed there.
LATE = 1.3
_LATE_TURN = 0.5


@dataclass(frozen=True, eq=False)
class Rollout:
    """A path driven down a value function.

    Attributes:
        path: Into the goal box; the start alone where the table knows no way.
        arrived: Whether its end is inside the goal box of the table.
        promised: Time to go at the start by the table, interpolated among walls; infinite:
            unreachable [s].
    """

    path: TrailerPath
    arrived: bool
    promised: float


def roll_out(value: ValueFunction, start) -> Rollout:
    """Drive the way that `best_word` takes.

    Args:
        value: Whose trailer drives.
        start: x, y, theta, beta [m], [m], [rad], [rad].
    """
    state = np.array(start, dtype=float)
    promised = float(value.looked_up(state))
    word = best_word(value, state)
    if word is None or not len(word.durations):
        path = TrailerPath(np.zeros(1), state[None], np.zeros((0, 2)))
    else:
        path = word_path(value.trailer, state, word)
    return Rollout(path, word is not None, promised)


def other_ways(value: ValueFunction, start) -> list[TrailerPath]:
    """Ways down a table among walls that begin with each control, held for each of some times.

    Beside walls a table's times are off by more than the ways differ: which way is quickest is told
    only by paths that begin as they do. Their beginnings may run into walls.

    Args:
        value: The table; in the open field there are none.
        start: x, y, theta, beta [m], [m], [rad], [rad].
    """
    if value.walls is None:
        return []
    trailer, walls = value.trailer, with_spare(value.walls, 0.0)
    local = value.to_table(start)
    at_home = replace(value, placement=(0.0, 0.0, 0.0))
    ways = []
    for held, (v, omega) in product(HELD, control_set(trailer)):
        control, duration = (v * trailer.speed, omega * trailer.turn_rate), held / trailer.turn_rate
        begun = drive(trailer, local, *control, duration)
        path = search_path(at_home, walls, begun, value.goal).path
        if path is not None:
            rest = word_of(path)
            controls = np.vstack([[control], rest.controls])
            word = merged(ArcWord(controls, np.append(duration, rest.durations)))
            ways.append(word_path(trailer, np.array(start, dtype=float), word))
    return ways


def inside(value: ValueFunction, states) -> np.ndarray:
    """Whether states are in the table's goal box, shape (..., 4) -> (...,)."""
    return value.goal.contains(value.to_table(states))


def is_late(value: ValueFunction, promised: float, time: float) -> bool:
    """Whether a path took so much longer than promised that the promise is not to be believed.

    Args:
        value: The table.
        promised: Time to go at the start [s].
        time: Of the path [s].
    """
    return time > LATE * promised + _LATE_TURN / value.trailer.turn_rate


def drive(trailer: Trailer, state, v: float, omega: float, duration: float) -> np.ndarray:
    """The state after a held control, shape (4,).

    Args:
        trailer: Which drives.
        state: x, y, theta, beta [m], [m], [rad], [rad].
        v, omega: The control [m/s], [rad/s].
        duration: For how long it is held [s].
    """
    x, y, theta, beta = (float(value) for value in state)
    dx, dy = shift_of(theta, v, omega, duration)
    steps = max(1, math.ceil(20 * duration * (trailer.turn_rate + trailer.speed / trailer.length)))
    beta = hold_beta(beta, v, omega, duration, steps, trailer)[-1]
    return np.array([x + dx, y + dy, theta + omega * duration, beta])


class Following(NamedTuple):
    """What a cart that goes down a table remembers.

    Attributes:
        word: What is left of the word that it follows; None: it follows none.
        given: Controls of the last periods, the newest last, shape (n, 2) [m/s], [rad/s].
        estimate: State at the last measurement, estimated from all of them, shape (4,); None: not
            known.
    """

    word: ArcWord | None
    given: np.ndarray
    estimate: np.ndarray | None

    @property
    def control(self) -> np.ndarray:
        """The control of this period: v, omega, shape (2,) [m/s], [rad/s]."""
        return self.given[-1]


AT_REST = Following(None, np.zeros((0, 2)), None)


def follow(
    value: ValueFunction,
    before: Following,
    measured,
    *,
    period: float,
    delay: float = 0.0,
    margin: float = 0.0,
    trust: float = 1.0,
) -> Following:
    """What to do for the next period.

    Where a switch falls within the period, the control is the mean over it.

    Args:
        value: The table.
        before: What was remembered until now; at first `AT_REST`.
        measured: x, y, theta, beta [m], [m], [rad], [rad].
        period: For how long the control is held [s].
        delay: From the moment of the measurement until the control acts [s]; the state is
            predicted over it from the controls given meanwhile.
        margin: See `next_word`.
        trust: Weight of a measurement against the state predicted from those before it and the
            controls since, in (0, 1].
    """
    measured = np.array(measured, dtype=float)
    estimate = _estimate(value.trailer, before, measured, period, delay, trust)
    state = _carried_on(value.trailer, estimate, before.given, period, delay)
    word = next_word(value, state, before.word, margin)
    if word is None:
        control = np.zeros(2)
    else:
        control = _mean_control(word, period)
        word = after(word, period)
    kept = math.ceil(delay / period) + 1
    return Following(word, np.vstack([before.given, control])[-kept:], estimate)


def _estimate(
    trailer: Trailer,
    before: Following,
    measured: np.ndarray,
    period: float,
    delay: float,
    trust: float,
) -> np.ndarray:
    """Where the cart was at a measurement, shape (4,)."""
    if trust == 1.0 or before.estimate is None:
        return measured
    # The controls that acted between the last measurement and this one were given a delay earlier.
    count = math.ceil(delay / period - 1e-9) + 1
    held = np.vstack([np.zeros((max(count - len(before.given), 0), 2)), before.given[-count:]])
    durations = np.full(count, period)
    if count > 1:
        first = delay - (count - 2) * period
        durations[:2] = first, period - first
        durations[2:] = 0.0
    expected = end_of(trailer, before.estimate, ArcWord(held, durations))
    gaps = measured - expected
    gaps[2:] = np.remainder(gaps[2:] + math.pi, math.tau) - math.pi
    return expected + trust * gaps


def _mean_control(word: ArcWord, period: float) -> np.ndarray:
    """Mean control of a word over a period, shape (2,); after its end the cart stands."""
    # Without a switch, exactly the control that is held.
    if len(word.durations) and word.durations[0] >= period:
        return word.controls[0]
    begun = np.cumsum(word.durations) - word.durations
    return np.clip(period - begun, 0.0, word.durations) @ word.controls / period


def _carried_on(
    trailer: Trailer, measured, given: np.ndarray, period: float, delay: float
) -> np.ndarray:
    """Predict a state over a delay, from the controls of the last periods, shape (4,)."""
    if delay == 0.0:
        return np.array(measured, dtype=float)
    count = math.ceil(delay / period - 1e-9)
    # Before the first control, it stood.
    held = np.vstack([np.zeros((max(count - len(given), 0), 2)), given[-count:]])
    durations = np.full(count, period)
    durations[0] = delay - (count - 1) * period
    return end_of(trailer, measured, ArcWord(held, durations))
