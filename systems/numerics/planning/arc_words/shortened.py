"""A word of arcs with the durations that take the least time into a goal box.

The controls stay, in their order; how long each is held is chosen anew, for a start that may be
another than the word was made for. More switches let a word come near to singular arcs, too: arcs
of no duration are put in between, and those that save time grow.
"""

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize
from threadpoolctl import ThreadpoolController

from ...compiled import compiled, kernel
from ..goal import Goal
from ..plan import TrailerPath
from ..trailer import Trailer
from .quickest import ArcWord
from .words import control_set

# Of a start, a word and whether to look finely: a function from durations [s] to what must not be
# negative at places along the word, shape (m,) [m], and its slopes, shape (m, n) [m/s].
Clearance = Callable[[Any, ArcWord, bool], Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]]

# Of the solver: most steps, and the change of the duration at which it stops [1 / turn rate].
MOST_STEPS = 60
PRECISION = 1e-7
# Steps by which a word that ends a little outside the box is brought into it.
CORRECTIONS = 5
# Largest miss of an end that counts as none, by which the box is made smaller for the search, in
# turning radii and radians.
KEPT = 1e-6
# Arcs that are held for less are left out [1 / turn rate].
SHORTEST = 1e-9
# Times that more switches are tried, for so many arcs at most, and how much they must save,
# relative to the duration.
ROUNDS = 4
MOST_ARCS = 14
WORTH = 2e-5
# Beyond this phase a trailer has settled up to rounding. Limiting the phase keeps its map of full
# rank, so that a trailer backed up exactly straight behind its tractor still has an angle. Where it
# settles ever more slowly, on the circle of its own length, time is limited so [1 / turn rate].
SETTLED, SETTLED_SLOWLY = 15.0, 1e7
# A start's beta is disturbed by so much [rad], and a steady word then misses by so much at most, in
# the units of the state.
DISTURBANCE, DISTURBED = 1e-10, 1e-5
# How often a word is shortened again, with finer checks, if it is in a wall by more than this
# [trailer lengths].
LOOKS_AGAIN, OVERLAP = 2, 5e-4
# Change of a duration for finite-difference slopes [1 / turn rate].
_NUDGE = 1e-6


class Cart(NamedTuple):
    """The trailer's lengths.

    Attributes:
        length: From the hitch to the trailer's axle, in turning radii.
        hitch: From the tractor's axle back to the hitch, in turning radii.
    """

    length: float
    hitch: float


def shortest(
    trailer: Trailer, start, word: ArcWord, goal: Goal, clearance: Clearance | None = None
) -> ArcWord | None:
    """A word near another that takes the least time into a box, with more switches if they help.

    Args:
        trailer, start, word, goal, clearance: As for `shortened`.
    """
    best = shortened(trailer, start, word, goal, clearance)
    for _ in range(ROUNDS):
        if best is None or not 0 < len(best.durations) <= MOST_ARCS:
            break
        more = with_more_switches(best, trailer)
        found = shortened(trailer, start, more, goal, clearance)
        if found is None or found.time > best.time * (1 - WORTH):
            break
        best = found
    return best


def shortened(
    trailer: Trailer, start, word: ArcWord, goal: Goal, clearance: Clearance | None = None
) -> ArcWord | None:
    """The same controls with the least time into a box; None if no durations near lead into it.

    A local optimum: whatever else is on the way, such as the jackknife limit, is not looked at.

    Args:
        trailer: Which drives.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        word: At least one arc.
        goal: The box.
        clearance: What must not be negative along the way; by default there is nothing.
    """
    found = _shortened(trailer, start, word, goal, clearance, fine=False)
    if clearance is None:
        return found
    for _ in range(LOOKS_AGAIN):
        # By now there are few arcs, which may be looked at in many places.
        if found is None or not len(found.durations):
            break
        if clearance(start, found, True)(found.durations)[0].min() >= -OVERLAP * trailer.length:
            break
        found = _shortened(trailer, start, found, goal, clearance, fine=True)
    return found


def _shortened(
    trailer: Trailer, start, word: ArcWord, goal: Goal, clearance: Clearance | None, fine: bool
) -> ArcWord | None:
    radius = trailer.radius
    scale = np.array([radius, radius, 1.0, 1.0])
    cart, local = normalised_in_radii(trailer, goal.to_frame(start))
    controls = word.controls / [trailer.speed, trailer.turn_rate]
    durations = word.durations * trailer.turn_rate
    widths = np.array(goal.tolerance) / scale
    bound = np.isfinite(widths) & (widths < [math.inf, math.inf, math.pi, math.pi])
    # An end on a face of the box must not be outside by rounding.
    widths = np.where(widths > 2 * KEPT, widths - KEPT, 0.0)
    exact, loose = bound & (widths == 0), bound & (widths > 0)
    # Whole turns of the heading at the end of this word: held fixed, so that gaps do not jump.
    end = np.empty(4)
    _end(local, controls, durations, cart, end)
    turns = math.tau * round(end[2] / math.tau)
    known: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def looked_up(held: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        key = held.tobytes()
        if key not in known:
            known.clear()
            gaps, slopes = np.empty(4), np.empty((4, len(held)))
            end_and_slopes(local, controls, np.maximum(held, 0.0), cart, gaps, slopes)
            gaps[2] -= turns
            gaps[3] = math.remainder(gaps[3] - goal.state[3], math.tau)
            known[key] = gaps, slopes
        return known[key]

    def room(held):
        gaps = looked_up(held)[0][loose]
        return np.concatenate([widths[loose] - gaps, widths[loose] + gaps])

    def room_slopes(held):
        slopes = looked_up(held)[1][loose]
        return np.concatenate([-slopes, slopes])

    constraints = []
    if loose.any():
        constraints.append({"type": "ineq", "fun": room, "jac": room_slopes})
    if exact.any():
        constraints.append(
            {
                "type": "eq",
                "fun": lambda held: looked_up(held)[0][exact],
                "jac": lambda held: looked_up(held)[1][exact],
            }
        )
    if clearance is not None:
        free = clearance(start, word, fine)
        # In turning radii, as are places.
        constraints.append(
            {
                "type": "ineq",
                "fun": lambda held: free(held / trailer.turn_rate)[0] / radius,
                "jac": lambda held: (
                    free(held / trailer.turn_rate)[1] / (radius * trailer.turn_rate)
                ),
            }
        )
    ones = np.ones(len(durations))
    # With several threads BLAS is ten times slower on such small problems, and rounds differently.
    with _blas().limit(limits=1, user_api="blas"):
        answer = minimize(
            lambda held: float(held.sum()),
            durations,
            jac=lambda _: ones,
            bounds=[(0.0, None)] * len(durations),
            constraints=constraints,
            method="SLSQP",
            options={"maxiter": MOST_STEPS, "ftol": PRECISION},
        )
    held = np.where(answer.x < SHORTEST, 0.0, answer.x)
    if not np.isfinite(held).all():
        return None
    # The solver may stop a little outside, where many words take as long as each other.
    for _ in range(CORRECTIONS):
        gaps, slopes = looked_up(held)
        excess = np.where(bound, gaps - np.clip(gaps, -widths, widths), 0.0)
        if np.abs(excess).max() <= KEPT:
            return merged(ArcWord(word.controls, held / trailer.turn_rate))
        off, on = np.flatnonzero(excess), np.flatnonzero(held)
        change, *_ = np.linalg.lstsq(slopes[np.ix_(off, on)], -excess[off], rcond=None)
        held[on] = np.maximum(held[on] + change, 0.0)
    return None


@cache
def _blas() -> ThreadpoolController:
    return ThreadpoolController()


def is_steady(trailer: Trailer, start, word: ArcWord, goal: Goal) -> bool:
    """Whether a word still leads into a box when the start's beta is slightly disturbed.

    A short trailer that is backed up for long stays in line only without any rounding: no real
    cart can drive that.

    Args:
        trailer: Which drives.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        word: Its arcs, or none.
        goal: The box, or point.
    """
    beside = np.array(start, dtype=float)
    beside[3] += DISTURBANCE
    return max(goal.miss(end_of(trailer, beside, word))) <= DISTURBED


def end_of(trailer: Trailer, start, word: ArcWord) -> np.ndarray:
    """Where a word leads, shape (4,); beta in (-pi, pi].

    Args:
        trailer: Which drives.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        word: Its arcs, or none.
    """
    cart, local = normalised_in_radii(trailer, start)
    end = np.empty(4)
    controls = word.controls / [trailer.speed, trailer.turn_rate]
    _end(local, controls, word.durations * trailer.turn_rate, cart, end)
    end[:2] *= trailer.radius
    return end


def merged(word: ArcWord) -> ArcWord:
    """The same word without arcs that take no time, and with neighbours that are alike as one."""
    controls: list[np.ndarray] = []
    durations: list[float] = []
    for control, duration in zip(word.controls, word.durations.tolist(), strict=True):
        if duration <= 0.0:
            continue
        if controls and (controls[-1] == control).all():
            durations[-1] += duration
        else:
            controls.append(control)
            durations.append(duration)
    return ArcWord(np.array(controls).reshape(-1, 2), np.array(durations))


def word_of(path: TrailerPath) -> ArcWord:
    """The word of which a path is driven."""
    return merged(ArcWord(path.controls, np.diff(path.times)))


def after(word: ArcWord, time: float) -> ArcWord:
    """What is left of a word when it has been followed for a time [s]."""
    ends = np.cumsum(word.durations)
    left = np.minimum(word.durations, np.maximum(ends - time, 0.0))
    return merged(word._replace(durations=left))


def with_more_switches(word: ArcWord, trailer: Trailer) -> ArcWord:
    """Each arc in two, with arcs of all other controls and no duration in between."""
    pairs = control_set(trailer) * [trailer.speed, trailer.turn_rate]
    controls, durations = [*pairs], [0.0] * len(pairs)
    for control, duration in zip(word.controls, word.durations.tolist(), strict=True):
        others = [pair for pair in pairs if (pair != control).any()]
        controls += [control, *others, control]
        durations += [duration / 2, *[0.0] * len(others), duration / 2]
    controls += [*pairs]
    durations += [0.0] * len(pairs)
    return ArcWord(np.array(controls), np.array(durations))


def normalised_in_radii(trailer: Trailer, state) -> tuple[Cart, np.ndarray]:
    """Trailer and state with lengths in turning radii.

    Args:
        trailer: The cart.
        state: x, y, theta, beta [m], [m], [rad], [rad].
    """
    radius = trailer.radius
    cart = Cart(trailer.length / radius, trailer.hitch_offset / radius)
    return cart, np.array(state, dtype=float) / [radius, radius, 1.0, 1.0]


@compiled
def end_and_slopes(start, controls, durations, cart, end, slopes):
    """Where a word leads, in turning radii, and how its end changes with the durations.

    Args:
        start: x, y, theta, beta.
        controls: v, omega, normalised, shape (k, 2).
        durations: Shape (k,) [1 / turn rate].
        cart: Its lengths.
        end: To be filled, shape (4,); beta in (-pi, pi].
        slopes: To be filled, shape (4, k).
    """
    _end(start, controls, durations, cart, end)
    nudged = durations.copy()
    moved = np.empty(4)
    for k in range(len(durations)):
        nudged[k] = durations[k] + _NUDGE
        _end(start, controls, nudged, cart, moved)
        nudged[k] = durations[k]
        for n in range(4):
            gap = moved[n] - end[n]
            if n == 3:
                gap -= 2 * math.pi * np.rint(gap / (2 * math.pi))
            slopes[n, k] = gap / _NUDGE


@compiled
def _end(start, controls, durations, cart, end):
    """Where a word leads, in turning radii; beta in (-pi, pi]."""
    state = np.empty(5)
    state[0], state[1], state[2] = start[0], start[1], start[2]
    state[3], state[4] = math.sin(start[3] / 2), math.cos(start[3] / 2)
    for k in range(len(durations)):
        advance(state, controls[k, 0], controls[k, 1], durations[k], cart)
    end[:3] = state[:3]
    end[3] = 2 * math.atan2(state[3], state[4])


@kernel
def advance(state, v, omega, time, cart):
    """Drive on, by the maps of `half_angle_map`; returns how a small change of beta grows.

    Args:
        state: x, y, theta and the sine and cosine of beta / 2, shape (5,), in turning radii.
        v, omega: The control, normalised.
        time: For how long it is held [1 / turn rate].
        cart: Its lengths.
    """
    half = omega * time / 2
    chord = v * time * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
    state[0] += chord * math.cos(state[2] + half)
    state[1] += chord * math.sin(state[2] + half)
    state[2] += 2 * half
    pull = -v / (2 * cart.length)
    rise = omega * (1 + cart.hitch / cart.length) / 2
    fall = omega * (cart.hitch / cart.length - 1) / 2
    square = pull * pull + rise * fall
    root = math.sqrt(abs(square))
    phase = root * time
    if phase < 1e-9:
        even, odd = 1.0, min(time, SETTLED_SLOWLY)
    elif square > 0:
        even, odd = 1.0, math.tanh(min(phase, SETTLED)) / root
    else:
        even, odd = math.cos(phase), math.sin(phase) / root
    s = (even + pull * odd) * state[3] + rise * odd * state[4]
    c = fall * odd * state[3] + (even - pull * odd) * state[4]
    size = math.sqrt(s * s + c * c)
    state[3], state[4] = s / size, c / size
    return (even * even - square * odd * odd) / (size * size)
