"""Words drawn at random and bent until they lead into a box.

A cart that may reverse, or whose trailer is long, has many ways of cusps and loops that resemble no
path of a car, and a coarse table may prefer another. Thousands of random words, each with its
durations corrected until it ends in the box, show which orders of controls lead there soon.
"""

import math

import numpy as np

from ...compiled import compiled, kernel
from ..goal import Goal
from ..trailer import Trailer
from .held_controls import control_set
from .quickest import ArcWord
from .shortened import end_and_slopes, merged, normalised_in_radii

# How many are drawn, of how many arcs, and how many orders of controls are kept.
DRAWN, FEWEST_ARCS, MOST_ARCS, KEPT = 4000, 3, 6, 40
# Of a cart that may reverse, the part that drives forwards only: all else are ways with cusps.
FORWARDS = 0.3
# Straights are as long as the way to the goal times up to this.
FARTHER = 1.2
# Corrections of a word at most, the longest change of a duration in one [1 / turn rate], and what
# keeps corrections small that would move the end by little.
CORRECTIONS, LONGEST_CHANGE, DAMPING = 12, 1.0, 1e-4
# How far outside the box the end may stay for the search for durations that follows, in turning
# radii and radians, and when there is nothing more to correct.
NEAR, ENOUGH = 1e-3, 1e-4
_TURN = 2.0 * math.pi


def drawn_words(
    trailer: Trailer, start, goal: Goal, count: int = DRAWN, most: int = KEPT
) -> list[ArcWord]:
    """Words into a box, the quickest first, one for each order of controls; the same every time.

    Their ends may be outside the box by a hair, and the jackknife limit is not looked at: they
    are to be shortened.

    Args:
        trailer: Which drives, in the open field.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: The box, or point.
        count: Words that are drawn.
        most: Words that are returned.
    """
    radius = trailer.speed / trailer.turn_rate
    cart, local = normalised_in_radii(trailer, goal.to_frame(start))
    controls, durations, arcs = _draw(trailer, count, math.hypot(local[0], local[1]))
    widths = np.array(goal.tolerance) / [radius, radius, 1.0, 1.0]
    bound = np.isfinite(widths) & (widths < [math.inf, math.inf, math.pi, math.pi])
    widths[~bound] = 0.0
    misses = np.empty(count)
    _bring_in(local, controls, durations, arcs, cart, goal.state[3], widths, bound, misses)
    times = durations.sum(axis=1)
    times[~((misses <= NEAR) & np.isfinite(times))] = math.inf
    found: dict[bytes, ArcWord] = {}
    units = np.array([trailer.speed, trailer.turn_rate])
    for k in np.argsort(times, kind="stable").tolist():
        if len(found) == most or math.isinf(times[k]):
            break
        word = merged(ArcWord(controls[k] * units, durations[k] / trailer.turn_rate))
        if len(word.durations):
            found.setdefault(np.sign(word.controls).astype(np.int8).tobytes(), word)
    return list(found.values())


def _draw(trailer: Trailer, count: int, far: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normalised controls, shape (count, MOST_ARCS, 2), durations, and how many arcs are used."""
    rng = np.random.default_rng(0)
    pairs = control_set(trailer).astype(float)
    choices = np.full(count, len(pairs))
    # The forward controls come first.
    choices[: round(FORWARDS * count)] = 3
    numbers = rng.integers(0, choices[:, None], (count, MOST_ARCS))
    for k in range(1, MOST_ARCS):
        again = numbers[:, k] == numbers[:, k - 1]
        shift = rng.integers(1, choices)
        numbers[:, k] = np.where(again, (numbers[:, k] + shift) % choices, numbers[:, k])
    controls = pairs[numbers]
    arcs = rng.integers(FEWEST_ARCS, MOST_ARCS + 1, count)
    used = np.arange(MOST_ARCS) < arcs[:, None]
    durations = rng.exponential(1.0, (count, MOST_ARCS)) * used
    # One of the straights goes all the way.
    straight = used & (controls[..., 1] == 0)
    which = np.where(straight, rng.random((count, MOST_ARCS)), -1.0).argmax(axis=1)
    words = np.flatnonzero(straight.any(axis=1))
    durations[words, which[words]] += far * rng.uniform(0.0, FARTHER, len(words))
    return controls, durations, arcs


@compiled
def _bring_in(start, controls, durations, arcs, cart, beta, widths, bound, misses):
    """Correct the durations of words, by the least changes, until they end in the box.

    Args:
        start: In the box's frame, in turning radii.
        controls, durations: Of the words, normalised; durations are changed.
        arcs: How many of each word are used.
        cart: Its lengths.
        beta: Of the goal.
        widths: Half-widths of the box, those of free entries zero.
        bound: Which entries are not free.
        misses: How far outside each word ends at last, to be filled.
    """
    gaps, excess, square = np.empty(4), np.empty(4), np.empty((4, 4))
    for word in range(len(durations)):
        count, turns = arcs[word], 0.0
        pairs, held = controls[word, :count], durations[word, :count]
        slopes, change = np.empty((4, count)), np.empty(count)
        for step in range(CORRECTIONS + 1):
            end_and_slopes(start, pairs, held, cart, gaps, slopes)
            if step == 0:
                turns = _TURN * np.rint(gaps[2] / _TURN)
            gaps[2] -= turns
            gaps[3] -= beta
            gaps[3] -= _TURN * np.rint(gaps[3] / _TURN)
            misses[word] = _outside(gaps, widths, bound, excess)
            if misses[word] <= ENOUGH or step == CORRECTIONS:
                break
            _normal_matrix(slopes, excess, square)
            weights = np.linalg.solve(square, -excess)
            longest = _change(slopes, excess, weights, change)
            part = min(1.0, LONGEST_CHANGE / max(longest, 1e-12))
            for k in range(count):
                held[k] = max(held[k] + part * change[k], 0.0)


@kernel
def _outside(gaps, widths, bound, excess):
    """What of gaps is outside a box, into `excess`; returns the most."""
    most = 0.0
    for n in range(4):
        excess[n] = 0.0
        if bound[n]:
            excess[n] = gaps[n] - min(max(gaps[n], -widths[n]), widths[n])
        most = max(most, abs(excess[n]))
    return most


@kernel
def _normal_matrix(slopes, excess, square):
    """Products of the slopes of what is outside, and the damping, into `square`."""
    for n in range(4):
        for m in range(4):
            square[n, m] = DAMPING if n == m else 0.0
            if excess[n] != 0.0 and excess[m] != 0.0:
                for k in range(slopes.shape[1]):
                    square[n, m] += slopes[n, k] * slopes[m, k]


@kernel
def _change(slopes, excess, weights, change):
    """The least change of durations that corrects what is outside; returns its largest entry."""
    longest = 0.0
    for k in range(len(change)):
        change[k] = 0.0
        for n in range(4):
            if excess[n] != 0.0:
                change[k] += slopes[n, k] * weights[n]
        longest = max(longest, abs(change[k]))
    return longest
