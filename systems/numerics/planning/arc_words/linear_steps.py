"""Durations of words into a goal box by linear programmes: thousands of words in a blink.

The total time is linear in the durations, and the end of the word nearly so. So the best small
change of durations is a linear programme of four rows, the faces of the box: a dual simplex begins
at the shortest arcs and takes a few pivots. A step that leaves the box is brought back by least
changes. The share of the promised saving that is then left decides how long the next step may be.
That takes microseconds, where the general solver of `shortened` takes milliseconds.

Source: the steps are those of Griffith and Stewart 1961; the pivots, with bounds, of Lemke 1954.
"""

import math
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from .shortened import Cart, advance

TURN = 2.0 * math.pi
# Most arcs that arrays hold, and most arcs of a word that is given more switches: all of them fit.
ROOM, FEW_ARCS = 128, 8
# Pivots of a linear programme, and corrections of a word.
MOST_PIVOTS, CORRECTIONS, FIRST_CORRECTIONS = 40, 4, 8
# Largest miss of an end that counts as none, and what stops corrections, in turning radii and
# radians.
KEPT, ENOUGH = 1e-5, 2e-6
# First and longest change of a duration in a step, and the one below which steps end; the share of
# its promised saving that a step has to keep; least and most growth of the change from one step to
# the next; and the longest change in a correction [1 / turn rate].
FIRST_CHANGE, LONGEST_CHANGE, LEAST_CHANGE, KEEPS = 0.5, 1.0, 1e-3, 0.1
LEAST_GROWTH, MOST_GROWTH = 0.25, 2.0
LONGEST_CORRECTION = 0.5
# Time between checks along a word for the edge of the grid and the jackknife limit [1 / turn rate].
LOOK = 0.1
# Arcs held for less are none [1 / turn rate].
_SHORTEST = 1e-9
_TINY = 1e-9
# Costs that differ by less are the same, so that rounding does not decide.
_ALIKE = 1e-7


class Aim(NamedTuple):
    """A goal box in its own frame, in turning radii, and how far to search for durations.

    Attributes:
        cart: The trailer's lengths.
        beta: Of the goal [rad].
        widths: Half-widths of the box, shape (4,); infinite: free.
        pairs: All controls v, omega, shape (C, 2).
        gain: A step that promises less is not taken [1 / turn rate].
        steps: At most.
        jackknife: Largest |beta| at the end of an arc, or that of the start; pi: any. Along an arc
            beta goes one way. A step that leads beyond counts as one that misses the box.
    """

    cart: Cart
    beta: float
    widths: np.ndarray
    pairs: np.ndarray
    gain: float
    steps: int
    jackknife: float = math.pi


@kernel
def _ends(start, controls, times, count, aim, state, gaps, slopes):
    """Gaps of the end of a word to the middle of the box, and their slopes with the durations.

    Args:
        start: x, y, theta, beta in the box's frame.
        controls, times: Of the arcs, shapes (n, 2) and (n,), of which `count` are used.
        count: Number of arcs.
        aim: The box.
        state: To be written over, shape (5,).
        gaps: To be filled, shape (4,); angles in [-pi, pi].
        slopes: To be filled, shape (5, n); the last row is written over.

    Returns:
        The largest |beta| at the end of an arc; zero where there is no limit to it.
    """
    state[0], state[1], state[2] = start[0], start[1], start[2]
    state[3], state[4] = math.sin(start[3] / 2), math.cos(start[3] / 2)
    cart, widest = aim.cart, 0.0
    for k in range(count):
        v, omega = controls[k, 0], controls[k, 1]
        slopes[3, k] = advance(state, v, omega, times[k], cart) if times[k] > 0.0 else 1.0
        slopes[0, k], slopes[1, k], slopes[2, k] = state[0], state[1], state[2]
        if aim.jackknife < math.pi:
            widest = max(widest, abs(2 * math.atan2(state[3], state[4])))
        s, c = 2 * state[3] * state[4], state[4] * state[4] - state[3] * state[3]
        slopes[4, k] = omega - (v * s - cart.hitch * omega * c) / cart.length
    # A longer arc shifts all that follows along the cart there, and turns it about the cart.
    growth = 1.0
    for k in range(count - 1, -1, -1):
        v, omega = controls[k, 0], controls[k, 1]
        x, y, theta, own = slopes[0, k], slopes[1, k], slopes[2, k], slopes[3, k]
        slopes[0, k] = v * math.cos(theta) - omega * (state[1] - y)
        slopes[1, k] = v * math.sin(theta) + omega * (state[0] - x)
        slopes[2, k] = omega
        slopes[3, k] = slopes[4, k] * growth
        growth *= own
    gaps[0], gaps[1] = state[0], state[1]
    gaps[2] = state[2] - TURN * np.rint(state[2] / TURN)
    beta = 2 * math.atan2(state[3], state[4]) - aim.beta
    gaps[3] = beta - TURN * np.rint(beta / TURN)
    return widest


@kernel
def _best_change(slopes, gaps, times, longest, count, widths, rows, numbers, columns, change):
    """The change of durations that saves the most, by slopes, and ends in the box.

    A dual simplex with bounds: entries of the change and gaps are variables alike, each basic or
    at one of its bounds, and it begins with all changes at their lower bounds.

    Args:
        slopes, gaps: Of the word, see `_ends`.
        times: Its durations.
        longest: Largest change of one of them.
        count: Number of arcs.
        widths: Half-widths of the box.
        rows: Work, shape (4, n).
        numbers: Work: which variable is in each row and column, shape (4 + n,).
        columns: Work: cost, bounds and place of columns, and bounds and value of rows, (4, 4 + n).
        change: To be filled, shape (n,).

    Returns:
        Whether there is one.
    """
    cost, low, high, at = columns[0], columns[1], columns[2], columns[3]
    for k in range(count):
        n = 4 + k
        cost[n], numbers[n] = 1.0, k
        low[n], high[n] = max(-times[k], -longest), longest
        at[n] = low[n]
        for i in range(4):
            rows[i, k] = slopes[i, k]
    for i in range(4):
        numbers[i] = count + i
        low[i], high[i] = min(-widths[i] - gaps[i], 0.0), max(widths[i] - gaps[i], 0.0)
    for _ in range(MOST_PIVOTS):
        out, worst, below = -1, _TINY, False
        for i in range(4):
            at[i] = 0.0
            for k in range(count):
                at[i] += rows[i, k] * at[4 + k]
            if low[i] - at[i] > worst * (1 + _ALIKE):
                out, worst, below = i, low[i] - at[i], True
            if at[i] - high[i] > worst * (1 + _ALIKE):
                out, worst, below = i, at[i] - high[i], False
        if out < 0:
            for n in range(4 + count):
                if numbers[n] < count:
                    change[numbers[n]] = at[n]
            return True
        # What brings this row back at the least cost.
        into, least = -1, math.inf
        for k in range(count):
            n = 4 + k
            pivot = rows[out, k] if below else -rows[out, k]
            pivot = -pivot if at[n] == high[n] else pivot
            if high[n] > low[n] and pivot > _TINY and abs(cost[n]) / pivot < least - _ALIKE:
                into, least = k, abs(cost[n]) / pivot
        if into < 0:
            return False
        n, pivot = 4 + into, 1.0 / rows[out, into]
        for k in range(count):
            rows[out, k] *= -pivot
        rows[out, into] = pivot
        for i in range(4):
            part = rows[i, into]
            if i != out and part != 0.0:
                rows[i, into] = 0.0
                for k in range(count):
                    rows[i, k] += part * rows[out, k]
        part, cost[n] = cost[n], 0.0
        for k in range(count):
            cost[4 + k] += part * rows[out, k]
        low[n], low[out] = low[out], low[n]
        high[n], high[out] = high[out], high[n]
        at[n] = low[n] if below else high[n]
        numbers[n], numbers[out] = numbers[out], numbers[n]
    return False


@kernel
def _bring_in(start, controls, times, count, aim, most, state, gaps, slopes, square):
    """Correct durations by the least changes until the word ends in the box.

    Args:
        start, controls, times, count, aim, state, gaps, slopes: See `_ends`.
        most: Corrections at most.
        square: Work, shape (7, 4).

    Returns:
        How far outside it ends; infinite where beta passes the jackknife limit on the way.
    """
    widths, excess, weights, active = aim.widths, square[4], square[5], square[6]
    worst, widest = 0.0, 0.0
    for step in range(most + 1):
        widest = _ends(start, controls, times, count, aim, state, gaps, slopes)
        worst = 0.0
        for i in range(4):
            excess[i] = gaps[i] - min(max(gaps[i], -widths[i]), widths[i])
            # Faces that it is on are kept to; rounding must not decide which.
            active[i] = 1.0 if abs(gaps[i]) >= widths[i] - _TINY else 0.0
            weights[i] = -excess[i]
            worst = max(worst, abs(excess[i]))
        if worst <= ENOUGH or step == most:
            break
        for i in range(4):
            for j in range(4):
                square[i, j] = 0.0
                if active[i] * active[j] > 0.0:
                    for k in range(count):
                        if times[k] > 0.0:
                            square[i, j] += slopes[i, k] * slopes[j, k]
            square[i, i] += _TINY if active[i] > 0.0 else 1.0
        for i in range(4):
            for j in range(i + 1, 4):
                part = square[j, i] / square[i, i]
                for k in range(i, 4):
                    square[j, k] -= part * square[i, k]
                weights[j] -= part * weights[i]
        for i in range(3, -1, -1):
            for k in range(i + 1, 4):
                weights[i] -= square[i, k] * weights[k]
            weights[i] /= square[i, i]
        longest = 0.0
        for k in range(count):
            slopes[4, k] = 0.0
            if times[k] > 0.0:
                for i in range(4):
                    if active[i] > 0.0:
                        slopes[4, k] += slopes[i, k] * weights[i]
            longest = max(longest, abs(slopes[4, k]))
        part = min(1.0, LONGEST_CORRECTION / max(longest, _TINY))
        for k in range(count):
            times[k] = max(times[k] + part * slopes[4, k], 0.0)
    return worst if widest <= max(aim.jackknife, abs(start[3])) + _TINY else math.inf


@compiled
def shorten(start, controls, times, count, aim):
    """Give arcs the durations that take the least time into a box, near those that they have.

    Args:
        start: x, y, theta, beta in the box's frame, in turning radii.
        controls: v, omega of the arcs, normalised, shape (n, 2), n at most ROOM.
        times: Their durations, to be changed, shape (n,) [1 / turn rate].
        count: How many arcs are used.
        aim: The box.

    Returns:
        The duration of the word; infinite where no durations near lead into the box.
    """
    state, square = np.empty(5), np.empty((7, 4))
    gaps, others = np.empty(4), np.empty(4)
    slopes, other_slopes = np.empty((5, count)), np.empty((5, count))
    rows, numbers = np.empty((4, count)), np.empty(4 + count, dtype=np.int64)
    columns, change, tried = np.empty((4, 4 + count)), np.empty(count), np.empty(count)
    first = FIRST_CORRECTIONS
    miss = _bring_in(start, controls, times, count, aim, first, state, gaps, slopes, square)
    if miss > KEPT:
        return math.inf
    total, longest = times[:count].sum(), FIRST_CHANGE
    for _ in range(aim.steps):
        if not _best_change(
            slopes, gaps, times, longest, count, aim.widths, rows, numbers, columns, change
        ):
            break
        promised, largest = -change.sum(), np.abs(change).max()
        if promised < aim.gain:
            break
        for k in range(count):
            tried[k] = max(times[k] + change[k], 0.0)
        most = CORRECTIONS
        miss = _bring_in(
            start, controls, tried, count, aim, most, state, others, other_slopes, square
        )
        kept = (total - tried.sum()) / promised if miss <= KEPT else -math.inf
        # The change that saves the most, if the saving that is lost grows with its square.
        growth = 0.5 / max(1.0 - kept, _TINY)
        longest = min(largest * min(max(growth, LEAST_GROWTH), MOST_GROWTH), LONGEST_CHANGE)
        if kept > KEEPS:
            total = tried.sum()
            times[:count] = tried
            gaps, others = others, gaps
            slopes, other_slopes = other_slopes, slopes
        if longest < LEAST_CHANGE:
            break
    return total


@kernel
def merge(controls, times, count):
    """Leave out arcs that take no time and join neighbours that are alike; returns the number.

    Args:
        controls, times, count: See `shorten`; to be changed.
    """
    kept = 0
    for k in range(count):
        if times[k] <= _SHORTEST:
            continue
        same = kept > 0
        for n in range(2):
            same = same and controls[kept - 1, n] == controls[k, n]
        if same:
            times[kept - 1] += times[k]
            continue
        controls[kept, 0], controls[kept, 1] = controls[k, 0], controls[k, 1]
        times[kept] = times[k]
        kept += 1
    return kept


@kernel
def _with_more_switches(controls, times, count, pairs, more, more_times):
    """Each arc in two, with arcs of all other controls and no duration between; their number."""
    n = 0
    for k in range(-1, count + 1):
        within = 0 <= k < count
        for half in range(-1, len(pairs) + 1):
            split = half in (-1, len(pairs))
            if split and not within:
                continue
            if split:
                v, omega, time = controls[k, 0], controls[k, 1], times[k] / 2
            else:
                v, omega, time = pairs[half, 0], pairs[half, 1], 0.0
                if within and v == controls[k, 0] and omega == controls[k, 1]:
                    continue
            more[n, 0], more[n, 1], more_times[n] = v, omega, time
            n += 1
    return n


@compiled
def _keep_cheap(start, controls, times, count, few, aim):
    """Leave out arcs of no duration that cost more than they are worth.

    The dual prices of the word's own programme, of a few columns, say what it is worth to shift
    the end of the word within the box. By weak duality they also bound what a programme with all
    columns could save: for most words there is nothing to be had.

    Args:
        start, aim: See `shorten`.
        controls, times, count: A word with more switches; to be changed.
        few: How many arcs it had before; two halves of each come one after the other.

    Returns:
        The number of arcs, and a bound on what a first step of `shorten` can promise; infinite
        where the word's own programme has no solution.
    """
    state, gaps, slopes = np.empty(5), np.empty(4), np.empty((5, count))
    _ends(start, controls, times, count, aim, state, gaps, slopes)
    own, own_times = np.empty((4, few)), np.zeros(few)
    halves = 0
    for k in range(count):
        if times[k] > 0.0:
            own_times[halves // 2] += times[k]
            for i in range(4):
                own[i, halves // 2] = slopes[i, k]
            halves += 1
    rows, numbers = np.empty((4, few)), np.empty(4 + few, dtype=np.int64)
    columns, change, prices = np.empty((4, 4 + few)), np.empty(few), np.zeros(4)
    longest = FIRST_CHANGE
    if not _best_change(
        own, gaps, own_times, longest, few, aim.widths, rows, numbers, columns, change
    ):
        return count, math.inf
    saved = 0.0
    for n in range(4, 4 + few):
        i = numbers[n] - few
        if i >= 0 and columns[0, n] != 0.0:
            prices[i] = columns[0, n]
            room = aim.widths[i] + (gaps[i] if prices[i] > 0.0 else -gaps[i])
            saved += abs(prices[i]) * max(room, 0.0)
    kept = 0
    for k in range(count):
        cost = 1.0
        for i in range(4):
            cost -= prices[i] * slopes[i, k]
        saved += cost * min(times[k], longest) if cost > 0.0 else -cost * longest
        if times[k] > 0.0 or cost < -_ALIKE:
            controls[kept, 0], controls[kept, 1] = controls[k, 0], controls[k, 1]
            times[kept] = times[k]
            kept += 1
    return kept, saved


@compiled
def refine(start, controls, times, count, total, aim, rounds, most):
    """Put more switches into a word of few arcs, as long as they save time.

    Args:
        start, controls, times, count, aim: See `shorten`; the word is shortened and merged already.
        total: Its duration.
        rounds: How often, at most.
        most: Most arcs that the word may have afterwards.

    Returns:
        The duration and the number of arcs.
    """
    more, more_times = np.empty((ROOM, 2)), np.empty(ROOM)
    for _ in range(rounds):
        if not 0 < count <= FEW_ARCS:
            break
        many = _with_more_switches(controls, times, count, aim.pairs, more, more_times)
        many, promised = _keep_cheap(start, more, more_times, many, count, aim)
        if promised < aim.gain:
            break
        found = shorten(start, more, more_times, many, aim)
        many = merge(more, more_times, many)
        if not found < total - aim.gain or many > most:
            break
        total, count = found, many
        controls[:count], times[:count] = more[:count], more_times[:count]
    return total, count


@compiled
def stays(start, controls, times, count, cart, bounds, jackknife):
    """Whether a word keeps on a rectangle and within the jackknife limit, or its start's beta.

    Args:
        start: x, y, theta, beta, in turning radii.
        controls, times, count: See `shorten`.
        cart: Its lengths.
        bounds: x_min, y_min, x_max, y_max in the frame of the start.
        jackknife: Largest |beta| [rad]; pi: none.
    """
    edge = min(
        start[0] - bounds[0], start[1] - bounds[1], bounds[2] - start[0], bounds[3] - start[1]
    )
    if jackknife >= math.pi and times[:count].sum() <= edge:
        return True  # So little time does not lead beyond the edge.
    state = np.empty(5)
    state[:3] = start[:3]
    state[3], state[4] = math.sin(start[3] / 2), math.cos(start[3] / 2)
    limit = max(jackknife, abs(2 * math.atan2(state[3], state[4]))) + _TINY
    for k in range(count):
        looks = max(1, math.ceil(times[k] / LOOK))
        for _ in range(looks):
            advance(state, controls[k, 0], controls[k, 1], times[k] / looks, cart)
            if not (
                bounds[0] - _TINY <= state[0] <= bounds[2] + _TINY
                and bounds[1] - _TINY <= state[1] <= bounds[3] + _TINY
            ):
                return False
            # Folded beyond pi, it would come back on the other side.
            if jackknife < math.pi and abs(2 * math.atan2(state[3], state[4])) > limit:
                return False
    return True
