"""The time-optimal path, as the best extremal: it reaches beta exactly.

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
from typing import NamedTuple

import numpy as np

from ..dubins import dubins_paths
from ..goal import Goal
from ..plan import Plan
from ..trailer import Trailer
from .arc_path import SHORTEST, Arc, arc_path, arc_samples, arc_word
from .costates import Extremal, extremal_of
from .frame import NOT_SCALABLE, goal_frame
from .seeding import word_seeds
from .word_solver import solve_words

_METHOD = "extremal"
# Largest miss of an answer, of the goal or of a switch.
PRECISION = 1e-9
_ITERATIONS = 20
# Answers as quick as each other, of which one that meets the conditions is preferred.
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
