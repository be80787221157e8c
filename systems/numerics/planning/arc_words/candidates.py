"""Words into a goal box without a table: those of a car, and words drawn at random.

Each is made as short as it can be. A cart that may reverse, or whose trailer is long, has many ways
of cusps and loops that resemble no path of a car, and a coarse table may prefer another. Thousands
of random words, each with its durations corrected until it ends in the box, show which orders of
controls lead there soon.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterable

import numpy as np

from ...compiled import compiled, kernel
from ..car_paths import dubins_paths, reeds_shepp_paths
from ..goal import Goal
from ..trailer import Trailer
from .quickest import ArcWord, word_path
from .shortened import (
    Clearance,
    end_and_slopes,
    is_steady,
    merged,
    normalised_in_radii,
    shortened,
    shortest,
    with_more_switches,
)
from .words import control_set

# Words of Reeds and Shepp that are tried, and words that are given more switches.
REEDS_SHEPP_WORDS, REFINED = 8, 2
# A switch must save more time than this [1 / turn rate].
SWITCH = 1e-6


def quickest_words(
    trailer: Trailer,
    start,
    words: Iterable[ArcWord],
    goal: Goal,
    allowed: Callable[[ArcWord], bool],
    clearance: Clearance | None = None,
) -> list[ArcWord]:
    """Optimise the durations of words so that they take the least time into a box; quickest first.

    Args:
        trailer: Which drives.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        words: From which to start; they need not lead into the box.
        goal: The box, or point.
        allowed: Says of a word whether it may be driven.
        clearance: See `shortened`.
    """

    def kept(found: Iterable[ArcWord | None]) -> list[ArcWord]:
        steady = (
            word for word in found if word is not None and is_steady(trailer, start, word, goal)
        )
        return [word for word in steady if allowed(word)]

    near = kept(shortened(trailer, start, word, goal, clearance) for word in words)
    near.sort(key=lambda word: rank(word, trailer))
    near += kept([shortest(trailer, start, word, goal, clearance) for word in near[:REFINED]])
    return sorted(near, key=lambda word: rank(word, trailer))


def rank(word: ArcWord, trailer: Trailer) -> float:
    """Sorts words by time, then by their switches [1 / turn rate]."""
    return word.time * trailer.turn_rate + SWITCH * len(word.durations)


def car_words(trailer: Trailer, start, goal: Goal, longest: float = math.inf) -> list[ArcWord]:
    """Words of a car to the middle of a box, with more switches for the trailer.

    Args:
        trailer: Which drives.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: The box, or point.
        longest: Longer words are left out [1 / turn rate].
    """
    radius = trailer.radius
    first, last = tuple(float(entry) for entry in start[:3]), goal.state[:3]
    paths = dubins_paths(first, last, radius)
    if trailer.reverse:
        paths += reeds_shepp_paths(first, last, radius)[:REEDS_SHEPP_WORDS]
    words = []
    for path in paths:
        ways = np.array(path.lengths)
        if np.abs(ways).sum() <= longest * radius:
            turns = np.sign(ways) * np.array(path.turns) * trailer.turn_rate
            controls = np.column_stack([np.sign(ways) * trailer.speed, turns])
            word = merged(ArcWord(controls, np.abs(ways) / trailer.speed))
            words.append(with_more_switches(word, trailer))
    return words


def keeps_limit(trailer: Trailer, start, word: ArcWord) -> bool:
    """Whether a word keeps within the jackknife limit, or within what beta was at the start.

    Args:
        trailer: With the limit.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        word: Its arcs, or none.
    """
    limit = max(trailer.jackknife, abs(math.remainder(float(start[3]), math.tau)))
    if limit >= math.pi or not len(word.durations):
        return True
    return word_path(trailer, start, word).widest_angle <= limit + 1e-9


# Number of words drawn, their fewest and most arcs, and how many orders of controls are kept: with
# the same winding of the angles, and in all.
DRAWN, FEWEST_ARCS, MOST_ARCS, KEPT_ALIKE, KEPT = 4000, 3, 6, 10, 40
# For a cart that may reverse, the share of words that only drive forwards: the others have cusps.
FORWARDS = 0.3
# One straight of a word is made longer by up to this many times the distance to the goal.
FARTHER = 1.2
# Most turns before and after a long straight, and how long that is, as shares of the distance.
TURNS, STRAIGHT = (2, 3), (0.5, 1.1)
# Most corrections of a word, the longest change of a turn in one [1 / turn rate], and the damping
# that limits corrections which would hardly move the end.
CORRECTIONS, LONGEST_CHANGE, DAMPING = 12, 1.0, 1e-4
# How far outside the box the end of a word that is kept may be, for the search for durations that
# follows, and the miss at which corrections stop, in turning radii and radians.
NEAR, ENOUGH = 1e-3, 1e-4
_TURN = 2.0 * math.pi


def drawn_words(trailer: Trailer, start, goal: Goal, count: int = DRAWN) -> list[ArcWord]:
    """Words into a box, the quickest first, one for each order of controls; the same every time.

    Words whose theta or beta winds differently are kept beside quicker ones: near each there may be
    an optimum, such as that of a trailer which swings over to its other side. Ends may be slightly
    outside the box, and the jackknife limit is ignored: the words are to be optimised afterwards.

    Args:
        trailer: Which drives, in the open field.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: The box, or point.
        count: Words that are drawn.
    """
    radius = trailer.radius
    cart, local = normalised_in_radii(trailer, goal.to_frame(start))
    controls, durations, arcs = _draw(trailer, count, math.hypot(local[0], local[1]))
    widths = np.array(goal.tolerance) / [radius, radius, 1.0, 1.0]
    bound = np.isfinite(widths) & (widths < [math.inf, math.inf, math.pi, math.pi])
    widths[~bound] = 0.0
    misses, windings = np.empty(count), np.empty((count, 2), int)
    _bring_in(
        local, controls, durations, arcs, cart, goal.state[3], widths, bound, misses, windings
    )
    times = durations.sum(axis=1)
    times[~((misses <= NEAR) & np.isfinite(times))] = math.inf
    found: dict[bytes, ArcWord] = {}
    alike: Counter[bytes] = Counter()
    units = np.array([trailer.speed, trailer.turn_rate])
    for k in np.argsort(times, kind="stable").tolist():
        if len(found) == KEPT or math.isinf(times[k]):
            break
        word = merged(ArcWord(controls[k] * units, durations[k] / trailer.turn_rate))
        wound = windings[k].tobytes()
        order = wound + np.sign(word.controls).astype(np.int8).tobytes()
        if len(word.durations) and order not in found and alike[wound] < KEPT_ALIKE:
            found[order] = word
            alike[wound] += 1
    return list(found.values())


def scattered_words(trailer: Trailer, start, goal: Goal, count: int) -> list[ArcWord]:
    """Words as they are drawn, wherever they end; the same every time.

    Args:
        trailer: Which drives, in the open field.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: The box, or point, as far away as some of the straights are long.
        count: How many.
    """
    radius = trailer.radius
    far = math.dist(start[:2], goal.state[:2]) / radius
    controls, durations, arcs = _draw(trailer, count, far)
    units = np.array([trailer.speed, trailer.turn_rate])
    return [
        ArcWord(pairs[:used] * units, held[:used] / trailer.turn_rate)
        for pairs, held, used in zip(controls, durations, arcs, strict=True)
    ]


def manoeuvre_words(trailer: Trailer, start, goal: Goal, gear: int, count: int) -> list[ArcWord]:
    """Words of some turns, a long straight and some turns, wherever they end; the same every time.

    Args:
        trailer: Which drives, in the open field.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: The box, or point, about as far away as the straights are long.
        gear: Of the straights, 1 or -1.
        count: How many.
    """
    rng = np.random.default_rng(0)
    turns = control_set(trailer)
    turns = turns[turns[:, 1] != 0]
    units = np.array([trailer.speed, trailer.turn_rate])
    far = math.dist(start[:2], goal.state[:2]) / trailer.speed
    words = []
    for _ in range(count):
        first, last = (rng.integers(1, most + 1) for most in TURNS)
        controls = turns[rng.integers(len(turns), size=first + 1 + last)]
        controls[first] = gear, 0
        durations = rng.exponential(1.0, len(controls)) / trailer.turn_rate
        durations[first] += far * rng.uniform(*STRAIGHT)
        words.append(ArcWord(controls * units, durations))
    return words


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
def _bring_in(start, controls, durations, arcs, cart, beta, widths, bound, misses, windings):
    """Correct the durations of words, by the least changes, until they end in the box.

    Args:
        start: In the box's frame, in turning radii.
        controls, durations: Of the words, normalised; durations are changed.
        arcs: How many of each word are used.
        cart: Its lengths.
        beta: Of the goal.
        widths: Half-widths of the box, those of free entries zero.
        bound: Which entries are not free.
        misses, windings: How far outside the box each word ends, and the whole turns of theta and
            beta there, zero if they are free; to be filled.
    """
    gaps, excess, square = np.empty(4), np.empty(4), np.empty((4, 4))
    far = max(1.0, math.hypot(start[0], start[1]))
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
            bent = np.rint(gaps[3] / _TURN)
            gaps[3] -= _TURN * bent
            windings[word, 0] = round(turns / _TURN) if bound[2] else 0
            windings[word, 1] = bent if bound[3] else 0
            misses[word] = _outside(gaps, widths, bound, excess)
            if misses[word] <= ENOUGH or step == CORRECTIONS:
                break
            _normal_matrix(slopes, excess, square)
            weights = np.linalg.solve(square, -excess)
            longest = _change(slopes, excess, weights, pairs, far, change)
            part = min(1.0, LONGEST_CHANGE / max(longest, 1e-12))
            for k in range(count):
                held[k] = max(held[k] + part * change[k], 0.0)


@kernel
def _outside(gaps, widths, bound, excess):
    """Write the part of each gap that is outside a box into `excess`; returns the largest."""
    most = 0.0
    for n in range(4):
        excess[n] = 0.0
        if bound[n]:
            excess[n] = gaps[n] - min(max(gaps[n], -widths[n]), widths[n])
        most = max(most, abs(excess[n]))
    return most


@kernel
def _normal_matrix(slopes, excess, square):
    """Fill `square` with the products of the slopes of entries outside the box, plus damping."""
    for n in range(4):
        for m in range(4):
            square[n, m] = DAMPING if n == m else 0.0
            if excess[n] != 0.0 and excess[m] != 0.0:
                for k in range(slopes.shape[1]):
                    square[n, m] += slopes[n, k] * slopes[m, k]


@kernel
def _change(slopes, excess, weights, pairs, far, change):
    """The least change of durations that corrects what is outside; returns its largest entry."""
    longest = 0.0
    for k in range(len(change)):
        change[k] = 0.0
        for n in range(4):
            if excess[n] != 0.0:
                change[k] += slopes[n, k] * weights[n]
        # The end moves with a straight in proportion, so that on a far way it may change by more.
        longest = max(longest, abs(change[k]) / (far if pairs[k, 1] == 0.0 else 1.0))
    return longest
