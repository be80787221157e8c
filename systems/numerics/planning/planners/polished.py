"""`plan_polished`: a table says where to look, and the minimum-time programme finds the optimum."""

import math
from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from ...errors import require
from ..arc_words.candidates import car_words, drawn_words, keeps_limit, quickest_words
from ..arc_words.quickest import LONGEST, ArcWord, quickest_word, word_path
from ..arc_words.shortened import merged
from ..car_paths import dubins_paths, reeds_shepp_paths
from ..extremals.planner import plan_by_extremals
from ..goal import Goal, checked_start
from ..minimum_time.planner import plan_by_casadi
from ..minimum_time.problem import Attempt, Problem, resampled, with_placed_switches
from ..minimum_time.seeds import seed_along
from ..plan import Plan, TrailerPath
from ..trailer import Trailer
from ..value_function.descents import descents
from ..value_function.grid import THESIS_STEP
from ..value_function.solve import open_field_table
from ..value_function.value_function import ValueFunction, word_known

METHOD = "polished"
# Ways down the table that are tried at most, and seeds in all: the rest are the shortest car paths.
WAYS, SEEDS = 2, 5
# Ways that are made into words, whose durations take the least time exactly.
WORD_WAYS = 4
# More for a cart that may reverse, which has more ways to choose from.
_SEEDS_WITH_REVERSE = 14
# Trailers of more turning radii swing in on ways like no car's: words are drawn for them, too, and
# for carts that may reverse. Of the quickest words, so many are tried then.
_LONG_TRAILER, _WORDS_IF_DRAWN = 1.5, 4
# Fewer where the extremal solver has found a path.
_WAYS_BESIDE, _SEEDS_BESIDE = 1, 4
# A box is reached sooner than its middle, where car paths end: those that are so many turning radii
# longer than the quickest way down the table are not tried.
_LONGER = 2.0
# Of the programme that is solved from every seed, where few are enough to tell which is best.
_COARSE_INTERVALS, _QUICK_ITERATIONS = 16, 25
# Of the one in which the best path is solved again, when its switches cannot be placed.
_INTERVALS, _MAX_ITERATIONS = 60, 200
# Where a long trip needs more of them: in 1 / turn rate, at most, and iterations for each seed.
_PER_TURN, _MOST_INTERVALS, _PATIENT_ITERATIONS = 1.5, 240, 40
# How much less time counts as less.
_LESS = 1e-9
# Words whose times differ by less, relative to them, are taken for one.
_ALIKE = 1e-5
# A word that is quicker by more than this is taken instead of what the programme found.
_WORTH = 1e-6


def plan_polished(
    trailer: Trailer,
    start: Sequence[float],
    goal: Goal,
    *,
    value: ValueFunction | None = None,
    step: float = THESIS_STEP,
) -> Plan:
    """The quickest of the local optima near ways down a table and near car paths.

    Seeds are the best way down the table and those on other sides of barriers, the quickest word
    of held controls near these, exact for any cart and distance, and Dubins words. For a cart that
    may reverse, or with a long trailer, words are drawn at random as well, the same every time.
    A small programme tells which leads to the quickest path; the switches of that one are then
    placed exactly. To a point, or a point with a tolerance in beta alone, the extremal solver is
    asked too. With reverse there are more optima than seeds, and the best may be missed.

    In the notes: `way`, which seed won; `table`, the shape of the one that was there; `fell_back`,
    from what and to what, where that was needed.

    Args:
        trailer: The cart.
        start: (x, y, theta, beta) [m], [m], [rad], [rad].
        goal: The box or point, in the open field.
        value: A table to look at, of the same cart, for a goal of the same beta elsewhere; by
            default one that is solved when it is first needed, and kept.
        step: Distance of the table's nodes in turning radii.

    Raises:
        InvalidInput: Start, goal or option out of range, or the table is for something else.
    """
    began = perf_counter()
    state = checked_start(trailer, start)
    if goal.reached(state):
        return replace(plan_by_casadi(trailer, start, goal), method=METHOD)
    if value is None:
        value = open_field_table(trailer, start, goal, step)
    else:
        require(value.trailer == trailer, "value", "be for the same trailer", value.trailer)
        same = math.isclose(value.goal.state[3], goal.state[3], abs_tol=1e-12)
        require(same, "value", "be for the same beta", value.goal.state[3])
        value = value.moved(*goal.state[:3])
    problem = Problem(trailer, state, goal, _MAX_ITERATIONS)
    quick, patient = (
        Problem(trailer, state, goal, most) for most in (_QUICK_ITERATIONS, _PATIENT_ITERATIONS)
    )
    fell_back: list[str] = []
    ways = [] if value is None else descents(value, state)[:WORD_WAYS]
    if not ways:
        fell_back.append(
            "no table of this cart, distance and goal: car paths only"
            if value is None
            else "the table promises no way: car paths only"
        )
    # Where the cart meets x, y and theta exactly, the optimum is an extremal.
    exact = not any(goal.tolerance[:3])
    word = plan_by_extremals(trailer, start, goal) if exact and not trailer.reverse else None
    exactly = word is not None and word.converged
    arcs = [] if exactly else _quickest(problem, [way.path for way in ways], value)
    ways = ways[:WAYS]
    longest, most = math.inf, _SEEDS_WITH_REVERSE if trailer.reverse else SEEDS
    most += max(len(arcs) - 1, 0)
    if word is not None and word.converged:
        longest, most = word.time, _SEEDS_BESIDE
        ways = ways[:_WAYS_BESIDE]
    elif ways and not exact:
        longest = ways[0].time + _LONGER / trailer.turn_rate
    seeds = [(f"way {k} down the table", way.path) for k, way in enumerate(ways, 1)]
    seeds += [("quickest word", word_path(trailer, state, each)) for each in arcs]
    seeds += [("car path", path) for path in _car_paths(problem, longest, most - len(seeds))]
    coarse = [(name, quick.solve(resampled(path, _COARSE_INTERVALS))) for name, path in seeds]
    found = [each for each in coarse if each[1].is_path]
    notes: dict[str, object] = {
        "table": None if value is None else value.grid.shape,
        "seeds": len(coarse),
        "converged_seeds": len(found),
        "fell_back": fell_back,
    }
    iterations = sum(each.iterations for _, each in coarse)
    best: Plan | None = None
    if word is not None and word.converged and word.path is not None:
        best = _plan(goal, word.path, word.time, "optimal", word.residual, "extremal")
    if found and (best is None or min(each.time for _, each in found) < best.time):
        way, _ = min(found, key=lambda each: each[1].time)
        fine = _refined(problem, [each for _, each in found], fell_back)
        iterations += fine.iterations
        best = _quicker(goal, fine, way, best)
    for name, path in [] if found else seeds:
        # On so long a trip few intervals are too long for any seed to lead to a path.
        turns = float(path.times[-1]) * trailer.turn_rate
        many = min(max(math.ceil(_PER_TURN * turns), _INTERVALS), _MOST_INTERVALS)
        fine = patient.solve(resampled(path, many))
        iterations += fine.iterations
        best = _quicker(goal, fine, name, best)
    if arcs and (best is None or arcs[0].time < best.time * (1 - _WORTH)):
        # Exact as it is, where the programme finds nothing as quick beside it.
        path = word_path(trailer, state, arcs[0])
        best = _plan(goal, path, arcs[0].time, "optimal", 0.0, "quickest word")
    if best is None:
        fell_back.append("no seed led to a path: all seeds of the minimum-time programme")
        last = plan_by_casadi(trailer, start, goal)
        best = replace(last, notes={**last.notes, "way": "default seeds"})
    return replace(
        best,
        method=METHOD,
        iterations=best.iterations + iterations,
        wall_time=perf_counter() - began,
        notes={**best.notes, **notes},
    )


def _quickest(
    problem: Problem, ways: list[TrailerPath], value: ValueFunction | None
) -> list[ArcWord]:
    """The quickest words near ways down the table, its word, those of a car, perhaps drawn ones."""
    trailer, start, goal = problem.trailer, problem.start, problem.goal
    words = [merged(ArcWord(way.controls, np.diff(way.times))) for way in ways]
    promised = math.inf
    if value is not None:
        known = word_known(value, value.to_table(start))
        words += [] if known is None else [known]
        # The table's word is what it promises; without one it interpolates.
        promised = float(value.interpolated(start)) if known is None else known.time
    longest = min((word.time for word in words), default=math.inf) * trailer.turn_rate
    # Where ways down the table miss a channel, its promise knows of it.
    near = min(longest, promised * trailer.turn_rate) < LONGEST
    if near and all(0 < width < math.inf for width in goal.tolerance[:2]):
        entry = quickest_word(trailer, start, goal)
        words += [] if entry is None else [entry]
    words += car_words(trailer, start, goal, longest + _LONGER)
    drawn = trailer.reverse or trailer.length * trailer.turn_rate > _LONG_TRAILER * trailer.speed
    words += drawn_words(trailer, start, goal) if drawn else []
    found = quickest_words(
        trailer,
        start,
        words,
        goal,
        lambda word: len(word.durations) > 0 and keeps_limit(trailer, start, word),
    )
    return _unlike(found)[: _WORDS_IF_DRAWN if drawn else 1]


def _unlike(words: list[ArcWord]) -> list[ArcWord]:
    """Words, the quickest first, without those that take as long as one before."""
    found: list[ArcWord] = []
    for word in words:
        if not found or word.time > found[-1].time * (1 + _ALIKE):
            found.append(word)
    return found


def _car_paths(problem: Problem, longest: float, most: int) -> list[TrailerPath]:
    """The shortest words of a car, if they take at most so long."""
    trailer = problem.trailer
    radius = trailer.speed / trailer.turn_rate
    first, last = tuple(problem.start[:3].tolist()), problem.goal.state[:3]
    words = dubins_paths(first, last, radius)
    if trailer.reverse:
        words += reeds_shepp_paths(first, last, radius)
    near = [word for word in words if word.length <= longest * trailer.speed]
    betas = float(problem.start[3]), problem.goal.state[3]
    shortest = sorted(near, key=lambda word: word.length)[:most]
    return [seed_along([word], trailer, betas) for word in shortest]


def _refined(problem: Problem, found: list[Attempt], fell_back: list[str]) -> Attempt:
    """The best of coarse attempts with its switches in place."""
    least = min(found, key=lambda each: each.time)
    placed = [each for each in with_placed_switches(problem, found) if each.is_path]
    best = min(placed, key=lambda each: each.rank, default=None)
    # A coarse path is one of the cart too, so that the optimum beside it takes no longer.
    if best is not None and best.status == "optimal" and best.time <= least.time * (1 + 1e-6):
        return best
    fell_back.append("switches not placed: solved in equal intervals first")
    fine = problem.solve(resampled(least.path, _INTERVALS))
    placed += [each for each in with_placed_switches(problem, [fine]) if each.is_path]
    return min([fine, *placed], key=lambda each: (not each.is_path, *each.rank))


def _quicker(goal: Goal, attempt: Attempt, way: str, best: Plan | None) -> Plan | None:
    """The plan of an attempt, if that is a path and takes less time than the best plan, or it."""
    if attempt.is_path and (best is None or attempt.time < best.time * (1 - _LESS)):
        return _plan(goal, attempt.path, attempt.time, attempt.status, attempt.violation, way)
    return best


def _plan(
    goal: Goal, path: TrailerPath, time: float, status: str, residual: float, way: str
) -> Plan:
    return Plan(
        method=METHOD,
        goal=goal,
        status=status,
        converged=status == "optimal",
        time=time,
        path=path,
        residual=residual,
        notes={"way": way},
    )
