"""The time-optimal path, as the best extremal: it reaches beta exactly.

Pontryagin's conditions hold along its arcs. With

    H = lambda_x cos(theta) + lambda_y sin(theta) - lambda_beta sin(beta) + omega phi      (3.22)

and the switching function phi = lambda_theta + lambda_beta (3.24), lambda_x and lambda_y are
constant, lambda_theta changes by lambda_x dy - lambda_y dx and lambda_beta by the factor
g = exp(integral of cos(beta)). So phi is linear in the costate at the start:

    phi = (y - y0) lambda_x - (x - x0) lambda_y + lambda_theta + g lambda_beta.

The singular arc gives that costate (see `word_solver`); without one, phi vanishes at the switches.

A bang, at most one singular arc, and bangs that bring beta to the goal: as L - singular - R - L,
and mirrored. Durations and the turn rate of the singular arc are solved for from many seeds, and
the quickest answer that keeps the bounds is the plan.

With a tolerance on beta the end is at one of its edges, unless a car path (Dubins) already ends
inside; with beta free the shortest car path is the optimum. x, y and theta are met exactly.

Source: Zhang 2014, (3.22)-(3.24); Chitsaz 2013.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..car_paths import dubins_paths
from ..goal import Goal
from ..plan import Plan
from ..trailer import Trailer
from .arcs import (
    NOT_SCALABLE,
    SHORTEST,
    Arc,
    arc_path,
    arc_samples,
    arc_word,
    goal_frame,
    turned_beta,
)
from .word_solver import solve_words, word_seeds

# Of phi, relative to its largest value.
_ROUNDING = 1e-6


@dataclass(frozen=True, eq=False)
class Extremal:
    """Costate and switching function along a path in the normalised model.

    Attributes:
        times: Both ends of every arc included, shape (n,).
        costates: lambda_x, lambda_y, lambda_theta, lambda_beta, shape (n, 4).
        switching: phi, shape (n,).
        hamiltonian: H, shape (n,).
        holds: Whether phi has the sign of the turn rate on bangs and vanishes on the singular arc,
            and H is constant and not negative; up to rounding.
    """

    times: np.ndarray
    costates: np.ndarray
    switching: np.ndarray
    hamiltonian: np.ndarray
    holds: bool


def extremal_of(start: np.ndarray, arcs: list[Arc], beta_is_free: bool) -> Extremal:
    """Reconstruct the costate of a path and check the conditions.

    Args:
        start: x, y, theta, beta in the normalised model, shape (4,).
        arcs: Bangs and at most one singular arc.
        beta_is_free: Whether the goal leaves beta free, so that lambda_beta vanishes.
    """
    pieces, clocks, growths = [], [], []
    singular = None
    state, clock, growth = np.asarray(start, dtype=float), 0.0, 1.0
    arcs = [arc for arc in arcs if arc.duration >= SHORTEST]
    for arc in arcs:
        times, states, omegas = arc_samples(state, arc)
        if arc.is_singular and abs(arc.omega) > SHORTEST:
            along = omegas / arc.omega
        else:
            along = np.array([turned_beta(state[3], 1.0, arc.omega, float(t))[1] for t in times])
        if arc.is_singular:
            singular = (state, arc.omega, growth)
        pieces.append(np.column_stack([states, omegas]))
        clocks.append(clock + times)
        growths.append(growth * along)
        state, clock, growth = states[-1], clocks[-1][-1], growths[-1][-1]
    x, y, theta, beta, omega = np.concatenate(pieces).T
    rows = np.column_stack([y - y[0], x[0] - x, np.ones(x.shape), np.concatenate(growths)])
    ends = np.cumsum([len(piece) for piece in pieces])[:-1]
    if singular is not None:
        initial = _costate_of_singular_arc(*singular, start)
    else:
        initial = _costate_of_switches(rows[ends], beta_is_free)
        initial = initial if np.sum(omega * (rows @ initial)) >= 0 else -initial
    phi = rows @ initial
    lambda_beta = initial[3] * rows[:, 3]
    hamiltonian = initial[0] * np.cos(theta) + initial[1] * np.sin(theta)
    hamiltonian = hamiltonian - lambda_beta * np.sin(beta) + omega * phi
    scale = max(float(np.max(np.abs(phi))), 1e-3 * float(np.max(np.abs(initial))))
    on_bang = np.concatenate(
        [np.full(len(piece), not arc.is_singular) for piece, arc in zip(pieces, arcs, strict=True)]
    )
    signs_hold = np.all(np.where(on_bang, omega * phi, -np.abs(phi)) >= -_ROUNDING * scale)
    constant = np.ptp(hamiltonian) <= _ROUNDING * max(1.0, float(np.max(np.abs(hamiltonian))))
    costates = np.column_stack([np.tile(initial[:2], (len(x), 1)), phi - lambda_beta, lambda_beta])
    return Extremal(
        times=np.concatenate(clocks),
        costates=costates,
        switching=phi,
        hamiltonian=hamiltonian,
        holds=bool(signs_hold and constant and np.min(hamiltonian) >= -_ROUNDING),
    )


def _costate_of_singular_arc(state, omega, growth, start) -> np.ndarray:
    # Carried back to the start; H = 1.
    x, y, theta, beta = state
    forward, sideways = 1 - omega * math.sin(beta), omega * math.cos(beta)
    east = forward * math.cos(theta) + sideways * math.sin(theta)
    north = forward * math.sin(theta) - sideways * math.cos(theta)
    turn = omega - east * (y - start[1]) + north * (x - start[0])
    return np.array([east, north, turn, -omega / growth])


def _costate_of_switches(rows: np.ndarray, beta_is_free: bool) -> np.ndarray:
    # A costate for which the switching function vanishes at the switches; one of them, if several.
    if beta_is_free:
        rows = np.vstack([rows, [0.0, 0.0, 0.0, 1.0]])
    if rows.shape[0] == 0:
        return np.array([0.0, 0.0, 1.0, 0.0])
    return np.linalg.svd(rows)[2][-1]


_METHOD = "extremal"
# Largest miss of an answer, of the goal or of a switch.
PRECISION = 1e-9
_ITERATIONS = 20
# Answers closer in time than this count as equally quick: one that meets the conditions is taken.
_SAME_TIME = 1e-6


class _Found(NamedTuple):
    duration: float
    arcs: list[Arc]
    miss: float
    extremal: Extremal


def plan_by_extremals(trailer: Trailer, start: Sequence[float], goal: Goal) -> Plan:
    """The quickest extremal found.

    Args:
        trailer: With the hitch on the axle and speed = turn rate * length; others are refused in
            the plan's status. Drives forwards even where it may reverse.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: Its tolerance on beta is used; x, y and theta are met exactly.

    Returns:
        A plan; `residual` is in the normalised model. Its notes: the arcs, whether Pontryagin's
        conditions hold along them, and the switching function over time [s].
    """
    began = time.perf_counter()

    def failure(status: str) -> Plan:
        wall_time = time.perf_counter() - began
        return Plan(method=_METHOD, goal=goal, status=status, converged=False, wall_time=wall_time)

    frame = goal_frame(trailer, start, goal)
    if frame is None:
        return failure(NOT_SCALABLE)
    local = np.array(frame.start)
    beta, width = goal.state[3], goal.tolerance[3]
    if _miss_within_bounds(local, [], goal, trailer.jackknife) <= PRECISION:
        return Plan(
            method=_METHOD,
            goal=goal,
            status="at the goal",
            converged=True,
            time=0.0,
            path=arc_path(frame, []),
            wall_time=time.perf_counter() - began,
        )
    # Duration, arcs, and whether beta has no part in the conditions.
    candidates: list[tuple[float, list[Arc], bool]] = []
    if width > 0:
        for path in dubins_paths(frame.start[:3], (0.0, 0.0, 0.0), 1.0):
            arcs = _arcs(path.turns, path.lengths, 0.0)
            candidates.append((path.length, arcs, True))
    if width < math.pi:
        for end in {beta - width, beta + width}:
            words, lengths, seeds = word_seeds(frame.start, (0.0, 0.0, 0.0, end))
            target = np.array([0.0, 0.0, 0.0, end])
            answers, errors = solve_words(words, lengths, seeds, local, target, _ITERATIONS)
            for word, n, answer in zip(
                words[errors < PRECISION],
                lengths[errors < PRECISION],
                answers[errors < PRECISION],
                strict=True,
            ):
                arcs = _arcs(word[:n], answer[:n], float(answer[n]))
                candidates.append((float(np.sum(answer[:n])), arcs, False))
    best: _Found | None = None
    for duration, arcs, beta_is_free in sorted(candidates, key=lambda each: each[0]):
        if best is not None and (best.extremal.holds or duration > best.duration + _SAME_TIME):
            break
        miss = _miss_within_bounds(local, arcs, goal, trailer.jackknife)
        if miss <= PRECISION:
            found = _Found(duration, arcs, miss, extremal_of(local, arcs, beta_is_free))
            best = found if best is None or found.extremal.holds else best
    if best is None:
        return failure("no extremal found")
    status = "optimal among extremals" if best.extremal.holds else "feasible, not an extremal"
    if any(goal.tolerance[:3]):
        # A box is entered sooner than its middle is reached.
        status += " to the middle of the box"
    return Plan(
        method=_METHOD,
        goal=goal,
        status=f"{status}, forwards only" if trailer.reverse else status,
        converged=True,
        time=best.duration / trailer.turn_rate,
        path=arc_path(frame, best.arcs),
        iterations=_ITERATIONS,
        residual=best.miss,
        wall_time=time.perf_counter() - began,
        notes={
            "arcs": arc_word([arc for arc in best.arcs if arc.duration >= SHORTEST]),
            "pontryagin_holds": best.extremal.holds,
            "switching_times": frame.world_times(best.extremal.times),
            "switching_function": best.extremal.switching,
            "candidates": len(candidates),
        },
    )


def _arcs(word, durations, omega: float) -> list[Arc]:
    return [
        Arc(float(turn) if turn else omega, float(duration), not turn)
        for turn, duration in zip(word, durations, strict=True)
    ]


def _miss_within_bounds(start: np.ndarray, arcs: list[Arc], goal: Goal, jackknife: float) -> float:
    # Largest miss of the goal's box, in its frame; infinite outside the bounds.
    state = start
    largest = abs(float(start[3]))
    for arc in arcs:
        if arc.duration < SHORTEST:
            continue
        _, states, omegas = arc_samples(state, arc)
        if np.max(np.abs(omegas)) > 1 + PRECISION:
            return math.inf
        largest = max(largest, float(np.max(np.abs(states[:, 3]))))
        state = states[-1]
    if jackknife < math.pi and largest > jackknife:
        return math.inf
    beta = abs(math.remainder(state[3] - goal.state[3], math.tau))
    heading = abs(math.remainder(state[2], math.tau))
    return float(max(abs(state[0]), abs(state[1]), heading, beta - goal.tolerance[3]))
