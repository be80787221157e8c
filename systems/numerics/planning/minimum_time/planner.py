"""`plan_by_casadi`: the best of the local optima that a set of seeds leads to."""

import math
from collections.abc import Sequence
from time import perf_counter

import numpy as np

from ...errors import require
from ...geometry.world import World
from ..arc_words.candidates import car_words, keeps_limit, quickest_words
from ..arc_words.quickest import word_path
from ..footprint import Discs, covering_discs, require_clear_ends, walls_part
from ..goal import Goal, checked_start
from ..plan import Plan, TrailerPath
from ..trailer import Trailer
from .kept_clear import best_kept_clear
from .problem import (
    INTERVALS_PER_ARC,
    Attempt,
    Problem,
    resampled,
    split_into_arcs,
    with_placed_switches,
)
from .seeds import default_seeds

METHOD = "casadi"
# Most iterations for each seed among walls, where a seed that has no way on may take very long.
WALLED_ITERATIONS = 200
# Quickest words that are tried where no other seed leads to a path.
_WORDS = 3


def plan_by_casadi(
    trailer: Trailer,
    start: Sequence[float],
    goal: Goal,
    *,
    intervals: int = 60,
    seeds: Sequence[TrailerPath] | None = None,
    obstacles: World | None = None,
    discs: Discs | None = None,
    max_iterations: int = 500,
    known: float = math.inf,
) -> Plan:
    """Solve the minimum-time programme from several seeds, and keep the fastest path.

    Each seed leads to a local optimum at best; the wall time is that of all of them.

    Args:
        trailer: The vehicle and its bounds.
        start: (x, y, theta, beta) [m], [m], [rad], [rad].
        goal: What is to be reached, and how closely.
        intervals: Number of intervals in which the controls are constant.
        seeds: Paths to start from; by default every word of Dubins, or of Reeds and Shepp with
            reverse, and where these fail words of the cart; with obstacles ways round their
            corners.
        obstacles: The world whose walls the vehicle keeps clear of.
        discs: What the vehicle covers; by default `covering_discs(trailer)`.
        max_iterations: Of the solver, for each seed; among walls at most `WALLED_ITERATIONS`.
        known: Time of a path that is known; among walls none is made clear that seems slower [s].

    Returns:
        The plan. `residual` is its largest violation of a constraint; its notes say how many seeds
        converged.

    Raises:
        InvalidInput: An argument is out of range, or an end overlaps a wall.
    """
    began = perf_counter()
    require(intervals >= 2, "intervals", "be at least 2", intervals)
    require(max_iterations >= 1, "max_iterations", "be at least 1", max_iterations)
    state = checked_start(trailer, start, goal)
    if obstacles is not None:
        discs = discs or covering_discs(trailer)
        max_iterations = min(max_iterations, WALLED_ITERATIONS)
        require_clear_ends(obstacles, discs, state.tolist(), goal)
        if walls_part(obstacles, discs, state.tolist(), goal):
            return Plan(method=METHOD, goal=goal, status="unreachable", converged=False)
    problem = Problem(trailer, state, goal, max_iterations, obstacles, discs)
    if goal.reached(problem.start):
        return _no_way_to_go(problem, perf_counter() - began)
    groups = [seeds] if seeds is not None else default_seeds(problem)
    attempts: list[Attempt] = []
    for group in groups:
        if not any(each.is_path for each in attempts):
            attempts += [problem.solve(resampled(seed, intervals)) for seed in group]
    if seeds is None and obstacles is None and not any(each.is_path for each in attempts):
        attempts += _from_words(problem)
    found = [each for each in attempts if each.is_path]
    notes: dict[str, object] = {"seeds": len(attempts), "converged_seeds": len(found)}
    iterations = sum(each.iterations for each in attempts)
    clear = True
    if obstacles is not None:
        # Paths that are given may be nearly clear, and elsewhere than where the spline leads them.
        given = [Attempt(each, math.inf, "as given", 0) for each in seeds or []]
        kept, more = best_kept_clear(problem, [*attempts, *given], known)
        best = None if kept is None else kept.attempt
        iterations += more
        if kept is not None:
            notes["overlap"] = max(kept.overlap, 0.0)
            clear = kept.is_clear(problem)
    else:
        better = with_placed_switches(problem, found) if found else []
        iterations += sum(each.iterations for each in better)
        paths = [*found, *(each for each in better if each.is_path)]
        best = min(paths, key=lambda a: a.rank, default=None)
    if best is None:
        return Plan(
            method=METHOD,
            goal=goal,
            status=_commonest([each.status for each in attempts]),
            converged=False,
            iterations=iterations,
            residual=min((each.violation for each in attempts), default=math.inf),
            wall_time=perf_counter() - began,
            notes=notes,
        )
    return Plan(
        method=METHOD,
        goal=goal,
        status=best.status if clear else "touches a wall",
        converged=best.status == "optimal" and clear,
        time=best.time,
        path=best.path,
        iterations=iterations,
        residual=best.violation,
        wall_time=perf_counter() - began,
        notes=notes,
    )


def _from_words(problem: Problem) -> list[Attempt]:
    """Attempts from words of a car, fitted to the trailer: exact arc by arc on far, stiff ways."""
    trailer, start, goal = problem.trailer, problem.start, problem.goal
    words = quickest_words(
        trailer,
        start,
        car_words(trailer, start, goal),
        goal,
        lambda word: len(word.durations) > 0 and keeps_limit(trailer, start, word),
    )
    paths = [word_path(trailer, start, word) for word in words[:_WORDS]]
    return [problem.solve(split_into_arcs(path, trailer, INTERVALS_PER_ARC)) for path in paths]


def _no_way_to_go(problem: Problem, wall_time: float) -> Plan:
    """The plan of a cart that is at its goal."""
    path = TrailerPath(np.zeros(1), problem.start[None], np.zeros((0, 2)))
    return Plan(
        method=METHOD,
        goal=problem.goal,
        status="optimal",
        converged=True,
        time=0.0,
        path=path,
        wall_time=wall_time,
    )


def _commonest(statuses: list[str]) -> str:
    """The most frequent status among the failures."""
    failures = [each for each in statuses if each != "optimal"]
    return max(failures, key=failures.count) if failures else "no path found"
