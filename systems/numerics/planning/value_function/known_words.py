"""Time to go by words: from a state down the table to nodes whose word into the goal is known.

Close to the goal the nodes know their words, by which their times are exact. From a state a descent
leads there; then the node's word is appended, and all durations are chosen anew to take the least
time from the state itself. So nothing is interpolated: the table says no more than which words to
try, of which the quickest counts, and what is on either side of a jump never mixes.
"""

import math
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ..arc_words.linear_steps import KEPT, ROOM, Aim, merge, refine, shorten, stays
from ..arc_words.quickest import ArcWord, quickest_word
from ..arc_words.shortened import Cart, advance
from ..arc_words.words import control_set
from ..goal import Goal
from ..trailer import Trailer
from .grid import StateGrid

TURN = 2.0 * math.pi
# Nodes within this time of the goal know their words, and their times are held fixed: updated from
# other nodes, they would be too short beside the faces of the box [1 / turn rate].
HELD = 2.0
# Arcs of such a word at most.
MOST_ARCS = 12
# A descent ends when it is nearer than this, so that nodes around know their words.
CLOSE = 1.7
# Spread of a cell's nodes above which it holds a jump, and how much longer than from its quickest
# node a state in it is guessed to take [1 / turn rate].
JUMP, LATER = 1.5, 0.3
# Longest step of a descent, and its longest duration in all [1 / turn rate].
AHEAD, LONGEST = 3.2, 60.0
# Most steps of a descent, nodes around its end whose words are tried, and sequences of controls
# that are remembered as tried.
STEPS, NODES, TOLD_APART = 60, 6, 128
# Of the search for durations: least saving of a step [1 / turn rate], number of steps, and how
# often more switches are tried.
GAIN, SEARCH, ROUNDS = 1e-5, 30, 4
# Beside jumps, and where the interpolated time is shorter by this share, descents may have missed
# a narrow way, which words of three arcs find.
SHORTER = 0.02
_ON_NODE = 1e-6


class KnownWords(NamedTuple):
    """Words of arcs into the goal box from W nodes of a table.

    Attributes:
        nodes: Number of each node in the table, ascending, shape (W,), int64.
        counts: Arcs of each word, shape (W,), int8.
        controls: Their numbers in `word_controls`, shape (W, MOST_ARCS), int8.
        durations: Shape (W, MOST_ARCS), float32 [1 / turn rate].
    """

    nodes: np.ndarray
    counts: np.ndarray
    controls: np.ndarray
    durations: np.ndarray


def aim_of(trailer: Trailer, goal: Goal, *, gain: float = GAIN, steps: int = SEARCH) -> Aim:
    """The box in turning radii, for the search for durations.

    Args:
        trailer: Which drives.
        goal: The box.
        gain: See `Aim`.
        steps: See `Aim`.
    """
    radius = trailer.radius
    widths = np.array(goal.tolerance) / [radius, radius, 1.0, 1.0]
    widths[2:][widths[2:] >= math.pi] = math.inf
    # An end that misses the narrower box by KEPT must still be inside the box.
    widths -= KEPT
    cart = Cart(trailer.length / radius, trailer.hitch_offset / radius)
    pairs = word_controls(trailer)
    # Whole numbers would have all that takes an aim compiled once more.
    beta, jackknife = float(goal.state[3]), float(trailer.jackknife)
    return Aim(cart, beta, widths, pairs, float(gain), steps, jackknife)


def word_controls(trailer: Trailer) -> np.ndarray:
    """Controls of words, v and omega, normalised, shape (C, 2).

    They are those of the table and, where such exist, those that hold beta at the jackknife limit:
    along the limit the quickest way is neither a turn nor straight.

    Args:
        trailer: Which drives.
    """
    pairs = control_set(trailer).astype(float)
    radius, limit = trailer.radius, trailer.jackknife
    lever = trailer.length / radius + trailer.hitch_offset / radius * math.cos(limit)
    if limit >= math.pi or abs(lever) <= math.sin(limit):
        return pairs
    held = math.sin(limit) / lever
    holding = [(v, side * held) for v in np.unique(pairs[:, 0]) for side in (-1.0, 1.0)]
    return np.vstack([pairs, holding])


class _Place(NamedTuple):
    """Where nodes are, in turning radii, and the time of one unit of the table."""

    x_min: float
    y_min: float
    step: float
    turn_rate: float


def times_by_words(
    table: np.ndarray,
    grid: StateGrid,
    trailer: Trailer,
    goal: Goal,
    words: KnownWords,
    states: np.ndarray,
) -> np.ndarray:
    """Durations of the quickest words that descents lead to; infinite where there are none.

    Args:
        table: Of an open field, shape (theta, beta, y, x) [s].
        grid: Where its nodes are.
        trailer: Whose time it is.
        goal: The box, in the table's frame.
        words: Of nodes close to it.
        states: In the table's frame, shape (n, 4).

    Returns:
        Shape (n,) [s].
    """
    times, *_ = _searched(table, grid, trailer, goal, words, states, False)
    return times


def word_by_descents(
    table: np.ndarray,
    grid: StateGrid,
    trailer: Trailer,
    goal: Goal,
    words: KnownWords,
    state: np.ndarray,
    *,
    thorough: bool = False,
) -> ArcWord | None:
    """The quickest word that descents from a state lead to; it ends in the box.

    Args:
        table, grid, trailer, goal, words: See `times_by_words`.
        state: In the table's frame, shape (4,).
        thorough: Whether to begin with every first step and not only with the best of each control:
            so ways into a channel narrower than a cell are found. That takes ten times as long.
    """
    some = _searched(table, grid, trailer, goal, words, state[None], thorough)
    times, counts, controls, durations = some
    if not math.isfinite(times[0]):
        return None
    arcs = controls[0, : counts[0]] * [trailer.speed, trailer.turn_rate]
    return ArcWord(arcs, durations[0, : counts[0]] / trailer.turn_rate)


def _searched(table, grid, trailer, goal, words, states, thorough):
    """Durations of words from states [s], numbers of their arcs, controls and durations."""
    radius = trailer.radius
    scale = np.array([radius, radius, 1.0, 1.0])
    place = _Place(grid.x_min / radius, grid.y_min / radius, grid.step / radius, trailer.turn_rate)
    found = (
        np.empty(len(states)),
        np.zeros(len(states), dtype=np.int64),
        np.empty((len(states), ROOM, 2), dtype=np.float32),
        np.empty((len(states), ROOM)),
    )
    _search(
        table,
        words,
        place,
        states / scale,
        np.ascontiguousarray(goal.to_frame(states)) / scale,
        np.array(grid.bounds) / radius,
        trailer.jackknife,
        aim_of(trailer, goal),
        math.ceil(AHEAD / grid.theta_step) if thorough else 0,
        *found,
    )
    times, *rest = found
    return times / trailer.turn_rate, *rest


def word_of_three_arcs(
    grid: StateGrid, trailer: Trailer, goal: Goal, state: np.ndarray
) -> ArcWord | None:
    """The quickest word of three arcs into the box, given more arcs where they save time.

    It costs some milliseconds.

    Args:
        grid: On which it has to keep.
        trailer: Which drives.
        goal: The box, in the frame of the grid.
        state: x, y, theta, beta, shape (4,).
    """
    word = quickest_word(trailer, state, goal)
    if word is None:
        return None
    radius, units = trailer.radius, [trailer.speed, trailer.turn_rate]
    scale = np.array([radius, radius, 1.0, 1.0])
    controls, times = np.empty((ROOM, 2)), np.empty(ROOM)
    count = len(word.durations)
    controls[:count] = word.controls / units
    times[:count] = word.durations * trailer.turn_rate
    start, aim = goal.to_frame(state) / scale, aim_of(trailer, goal)
    total = shorten(start, controls, times, count, aim)
    if not math.isfinite(total):
        return None
    count = merge(controls, times, count)
    _, count = refine(start, controls, times, count, total, aim, ROUNDS, ROOM)
    bounds = np.array(grid.bounds) / radius
    if not stays(state / scale, controls, times, count, aim.cart, bounds, trailer.jackknife):
        return None
    return ArcWord(controls[:count] * units, times[:count] / trailer.turn_rate)


@compiled
def _search(
    table, words, place, starts, local, bounds, jackknife, aim, feet, out, counts, controls, spent
):
    """Durations from all states [1 / turn rate].

    Args:
        table, words: See `times_by_words`.
        place: Of the nodes.
        starts, local: States in the table's frame and the box's, in turning radii, shape (n, 4).
        bounds: Of the grid, in turning radii.
        jackknife: Largest |beta|.
        aim: The box.
        feet: How many first steps of each control to begin with; 0: only the best of each.
        out, counts, controls, spent: To be filled with durations of words, numbers of their arcs,
            their controls and durations, shapes (n,), (n,), (n, ROOM, 2) and (n, ROOM).
    """
    way, way_times = np.empty((ROOM, 2)), np.empty(ROOM)
    word, times = np.empty((ROOM, 2)), np.empty(ROOM)
    best, best_times = np.empty((ROOM, 2)), np.empty(ROOM)
    ends, rows, weights = np.empty((3, 5)), np.empty(16, dtype=np.int64), np.empty(16)
    known = np.empty(TOLD_APART, dtype=np.int64)
    for s in range(len(starts)):
        least, best_count, tried = math.inf, 0, 0
        for over_jumps in range(2):
            for begin in range(-1, len(aim.pairs) * max(feet, 1)):
                first, foot = begin, -1
                if feet and begin >= 0:
                    first, foot = begin // feet, begin % feet
                arcs = _descend(
                    table, place, starts[s], first, foot, over_jumps, aim, way, way_times, ends
                )
                if arcs < 0:
                    continue
                found = _nodes_around(table, words.nodes, place, ends[0], rows, weights)
                for k in range(min(found, NODES)):
                    _heaviest_to(k, found, rows, weights)
                    row = rows[k]
                    count = arcs + words.counts[row]
                    word[:arcs], times[:arcs] = way[:arcs], way_times[:arcs]
                    for n in range(arcs, count):
                        word[n] = aim.pairs[words.controls[row, n - arcs]]
                        times[n] = words.durations[row, n - arcs]
                    count = merge(word, times, count)
                    if count == 0 or _is_told(word, count, known, tried):
                        continue
                    tried = min(tried + 1, TOLD_APART - 1)
                    total = shorten(local[s], word, times, count, aim)
                    if total < least and stays(
                        starts[s], word, times, count, aim.cart, bounds, jackknife
                    ):
                        best_count = merge(word, times, count)
                        least = total
                        best[:best_count] = word[:best_count]
                        best_times[:best_count] = times[:best_count]
        if best_count > 0:
            counts[s] = best_count
            controls[s, :best_count], spent[s, :best_count] = (
                best[:best_count],
                best_times[:best_count],
            )
            # Plain numbers: Numba would compile it for each constant.
            begun, rounds, most = np.int64(best_count), np.int64(ROUNDS), np.int64(ROOM)
            total, count = refine(local[s], best, best_times, begun, least, aim, rounds, most)
            if stays(starts[s], best, best_times, count, aim.cart, bounds, jackknife):
                least, counts[s] = total, count
                controls[s, :count], spent[s, :count] = best[:count], best_times[:count]
        out[s] = least


@kernel
def _is_told(word, count, known, tried):
    """Whether words with these controls were tried; if not, they are noted as number `tried`."""
    sign = 1
    for n in range(count):
        # Turn rates between 0 and 1 are those that hold beta at the jackknife limit.
        control = 3000 * int(word[n, 0]) + int(np.rint(1000 * word[n, 1])) + 5000
        sign = (sign * 10_007 + control) % 1_000_000_007
    for k in range(tried):
        if known[k] == sign:
            return True
    known[tried] = sign
    return False


@kernel
def _heaviest_to(k, count, rows, weights):
    """Exchange entry k with the heaviest of those from k on."""
    heaviest = k
    for n in range(k, count):
        heaviest = n if weights[n] > weights[heaviest] else heaviest
    rows[k], rows[heaviest] = rows[heaviest], rows[k]
    weights[k], weights[heaviest] = weights[heaviest], weights[k]


@kernel
def _cell(count, coordinate):
    """The node below a periodic coordinate [rad], and how far past it that is, in [0, 1)."""
    cell = (coordinate / TURN % 1.0) * count
    near = np.rint(cell)
    cell = near if abs(cell - near) < _ON_NODE else cell
    return int(cell) % count, cell - int(cell)


@kernel
def _nodes_around(table, nodes, place, state, rows, weights):
    """Find nodes of the cell around a state that know their words; returns how many there are.

    Args:
        table: For its shape.
        nodes: Numbers of all nodes that know their words.
        place: Of the nodes.
        state: x, y, theta and the sine and cosine of beta / 2.
        rows, weights: Place in `nodes` and linear weight of each; to be filled, shape (16,).
    """
    theta_count, beta_count, y_count, x_count = table.shape
    x, y = (state[0] - place.x_min) / place.step, (state[1] - place.y_min) / place.step
    i, j = min(int(x), x_count - 2), min(int(y), y_count - 2)
    t, p = _cell(theta_count, state[2])
    b, q = _cell(beta_count, 2 * math.atan2(state[3], state[4]))
    found = 0
    for corner in range(16):
        di, dj, dt, db = corner & 1, corner >> 1 & 1, corner >> 2 & 1, corner >> 3
        node = (((t + dt) % theta_count) * beta_count + (b + db) % beta_count) * y_count + j + dj
        node = node * x_count + i + di
        row = np.searchsorted(nodes, node)
        if row < len(nodes) and nodes[row] == node:
            weight = abs(1 - di - (x - i)) * abs(1 - dj - (y - j))
            rows[found], weights[found] = row, weight * abs(1 - dt - p) * abs(1 - db - q)
            found += 1
    return found


@kernel
def _guess(table, place, state, over_jumps):
    """Linear interpolation of the table; at a jump infinite, or the least node plus LATER.

    Args:
        table: Times to go [s].
        place: Of its nodes.
        state: x, y, theta and the sine and cosine of beta / 2.
        over_jumps: Whether to hope for the least node at a jump.
    """
    theta_count, beta_count, y_count, x_count = table.shape
    x, y = (state[0] - place.x_min) / place.step, (state[1] - place.y_min) / place.step
    if not (0.0 <= x <= x_count - 1.0 and 0.0 <= y <= y_count - 1.0):
        return math.inf
    i, j = min(int(x), x_count - 2), min(int(y), y_count - 2)
    u, v = x - i, y - j
    t, p = _cell(theta_count, state[2])
    b, q = _cell(beta_count, 2 * math.atan2(state[3], state[4]))
    low, high, total = math.inf, 0.0, 0.0
    for dt in range(2 if p > 0.0 else 1):
        for db in range(2):
            plane = table[(t + dt) % theta_count, (b + db) % beta_count]
            a00, a01, a10, a11 = (
                plane[j, i],
                plane[j, i + 1],
                plane[j + 1, i],
                plane[j + 1, i + 1],
            )
            low = min(low, a00, a01, a10, a11)
            high = max(high, a00, a01, a10, a11)
            weight = (p if dt else 1.0 - p) * (q if db else 1.0 - q)
            total += weight * (
                (1.0 - v) * ((1.0 - u) * a00 + u * a01) + v * ((1.0 - u) * a10 + u * a11)
            )
    rate = place.turn_rate
    if (high - low) * rate <= JUMP:
        return total * rate
    return low * rate + LATER if over_jumps else math.inf


@kernel
def _descend(table, place, start, first, only, over_jumps, aim, way, times, work):
    """Long steps down the table until it is close to the goal; returns the number of arcs.

    Args:
        table, place, over_jumps: See `_guess`.
        start: x, y, theta, beta.
        first: Number of the first control; -1: any.
        only: Number of the only step of that control to begin with; -1: any.
        aim: With the controls and the cart.
        way, times: To be filled with the arcs.
        work: To be filled, shape (3, 5); the first row is where it ends.

    Returns:
        The number of arcs; -1: the descent led nowhere.
    """
    state, ahead, foot = work[0], work[1], work[2]
    state[0], state[1], state[2] = start[0], start[1], start[2]
    state[3], state[4] = math.sin(start[3] / 2), math.cos(start[3] / 2)
    angle = TURN / table.shape[0]
    widest = max(aim.jackknife, abs(start[3])) + _ON_NODE
    count, spent = 0, 0.0
    if _guess(table, place, state, over_jumps) < CLOSE:
        # Whatever the first control, the nodes around are the same: they count once.
        if first < 0:
            return 0
        if only < 0:
            return -1
    for step in range(STEPS):
        past = state[2] / angle % 1.0
        past = 0.0 if abs(past - np.rint(past)) < _ON_NODE else past
        least, chosen, duration = math.inf, -1, 0.0
        for c in range(len(aim.pairs)):
            if step == 0 and first >= 0 and c != first:
                continue
            v, omega = aim.pairs[c, 0], aim.pairs[c, 1]
            # Turns end on nodes of theta.
            part = 0.5 if omega == 0.0 else 1.0 - past if omega > 0.0 or past == 0.0 else past
            for n in range(5):
                ahead[n] = state[n]
            before, foot_number = 0.0, 0
            while part * angle <= AHEAD:
                time = part * angle
                advance(ahead, v, omega, time - before, aim.cart)
                before, part, foot_number = time, part + 1.0, foot_number + 1
                # Nodes a little beyond the jackknife limit have times, for those within it.
                if aim.jackknife < math.pi and abs(2 * math.atan2(ahead[3], ahead[4])) > widest:
                    break
                if step == 0 and only >= 0 and foot_number - 1 != only:
                    continue
                guess = _guess(table, place, ahead, over_jumps)
                if guess + time < least:
                    least, chosen, duration = guess + time, c, time
                    for n in range(5):
                        foot[n] = ahead[n]
                if guess < CLOSE - angle:
                    break
        spent += duration
        if chosen < 0 or spent > LONGEST:
            return -1
        v, omega = aim.pairs[chosen, 0], aim.pairs[chosen, 1]
        if count and way[count - 1, 0] == v and way[count - 1, 1] == omega:
            times[count - 1] += duration
        elif count == ROOM - MOST_ARCS:
            return -1
        else:
            way[count, 0], way[count, 1], times[count] = v, omega, duration
            count += 1
        for n in range(5):
            state[n] = foot[n]
        if least - duration < CLOSE:
            return count
    return -1
