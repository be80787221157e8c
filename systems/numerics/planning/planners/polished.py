"""`plan_polished`: a table says where to look, and the minimum-time programme finds the optimum."""

import math
from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter

from ...errors import require
from ..arc_words.candidates import (
    car_words,
    drawn_words,
    keeps_limit,
    quickest_words,
)
from ..arc_words.quickest import LONGEST, ArcWord, quickest_word, word_path
from ..arc_words.shortened import word_of
from ..car_paths import dubins_paths, reeds_shepp_paths
from ..extremals.planner import plan_by_extremals
from ..goal import Goal, checked_start
from ..minimum_time.planner import plan_by_casadi
from ..minimum_time.problem import Attempt, Problem, near_best, resampled, with_placed_switches
from ..minimum_time.seeds import seed_along
from ..plan import Plan, TrailerPath
from ..trailer import Trailer
from ..value_function.descents import Descent, descents
from ..value_function.grid import THESIS_STEP
from ..value_function.solve import open_field_table
from ..value_function.value_function import ValueFunction, word_known
from .chance import paths_by_chance

METHOD = "polished"
# Most ways down the table, words, and paths of a car from which the programme is solved.
WAYS, WORDS, CAR_PATHS = 2, 4, 8
# Ways down the table that are made into words, with durations that take exactly the least time.
WORD_WAYS = 4
# Fewer where the extremal solver has found a path, or a table tells the quickest way.
_WAYS_BESIDE, _CAR_PATHS_BESIDE = 1, 3
# A trailer of more turning radii is long.
_LONG_TRAILER = 1.5
# Car paths end in the middle of the box, which is reached later than the box: those longer than the
# quickest way down the table by more than this many turning radii are not tried.
_LONGER = 2.0
# Of the programme that is solved from every seed: intervals of each of its three arcs, how long the
# first and the last are [1 / turn rate], and iterations. Few are enough to tell which is best.
_COARSE_INTERVALS, _ENDS, _QUICK_ITERATIONS = 8, 8.0, 100
# Its few intervals may rank paths wrongly, and take a path for several. So its best paths are
# refined until so many have come out unlike, but at most so many of them.
REFINED, _MOST_REFINED = 4, 12
# Intervals of each arc and iterations of the programme that solves a path again, if its switches
# cannot be placed.
_INTERVALS, _MAX_ITERATIONS = 24, 200
# Least saving of time that counts, relative to it.
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

    Seeds are the best ways down the table, the quickest words of held controls near these, exact
    for any cart and distance, and shortest words of a car. With reverse, a long trailer or one that
    starts beyond a right angle, and where no table tells the way, words are drawn at random as
    well, the same every time: some that lead into the box, and others that end anywhere, until
    several of these have led to the quickest path, far away in each gear. A small programme tells
    which lead to the quickest paths; the switches of these are then placed exactly.
    To a point, or a point with a tolerance in beta alone, the extremal solver is asked too. There
    may be more optima than seeds, and the best may be missed.

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
    state = checked_start(trailer, start, goal)
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
    quick = Problem(trailer, state, goal, _QUICK_ITERATIONS)
    fell_back: list[str] = []
    ways = [] if value is None else descents(value, state)[:WORD_WAYS]
    if not ways:
        fell_back.append(
            "no table of this cart, distance and goal: other seeds only"
            if value is None
            else "the table promises no way: other seeds only"
        )
    extremal = _extremal(problem)
    many = extremal is None and _has_many_optima(problem, ways)
    seeds, arcs = _seeds(problem, ways, value, extremal, many)
    coarse = [(name, _solved(quick, path, _COARSE_INTERVALS)) for name, path in seeds]
    if many:
        drawn = paths_by_chance(
            quick,
            lambda path: _solved(quick, path, _COARSE_INTERVALS),
            [each for _, each in coarse],
        )
        coarse += [("drawn word", each) for each in drawn]
    found = [each for each in coarse if each[1].is_path]
    notes: dict[str, object] = {
        "table": None if value is None else value.grid.shape,
        "seeds": len(coarse),
        "converged_seeds": len(found),
        "fell_back": fell_back,
    }
    iterations = sum(each.iterations for _, each in coarse)
    best = extremal
    if found and (best is None or min(each.time for _, each in found) < best.time):
        way, _ = min(found, key=lambda each: each[1].time)
        fine = _refined(problem, [each for _, each in found], fell_back)
        if many and fine.is_path:
            fine = _with_more_switches(problem, fine)
        iterations += fine.iterations
        if fine.is_path and (best is None or fine.time < best.time * (1 - _LESS)):
            best = _plan(goal, fine.path, fine.time, fine.status, fine.violation, way)
    if arcs and (best is None or arcs[0].time < best.time * (1 - _WORTH)):
        # The word itself, which is exact, where the programme finds nothing as quick near it.
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


def _solved(problem: Problem, path: TrailerPath, intervals: int) -> Attempt:
    """The programme of three arcs of so many intervals each, solved from a path."""
    ends = _ENDS / problem.trailer.turn_rate
    return problem.solve(resampled(path, intervals, ends))


def _extremal(problem: Problem) -> Plan | None:
    """The optimum of a cart that meets x, y and theta exactly, if the extremal solver finds it."""
    goal = problem.goal
    if any(goal.tolerance[:3]) or problem.trailer.reverse:
        return None
    plan = plan_by_extremals(problem.trailer, problem.start.tolist(), goal)
    if not plan.converged or plan.path is None:
        return None
    return _plan(goal, plan.path, plan.time, "optimal", plan.residual, "extremal")


def _seeds(
    problem: Problem,
    ways: list[Descent],
    value: ValueFunction | None,
    extremal: Plan | None,
    many: bool,
) -> tuple[list[tuple[str, TrailerPath]], list[ArcWord]]:
    """Named paths from which the programme is solved, and the quickest words among them."""
    trailer, start, goal = problem.trailer, problem.start, problem.goal
    named = [(f"way {k} down the table", way.path) for k, way in enumerate(ways[:WAYS], 1)]
    if extremal is not None:
        cars = _car_paths(problem, extremal.time, _CAR_PATHS_BESIDE)
        return named[:_WAYS_BESIDE] + [("car path", path) for path in cars], []
    drawn = drawn_words(trailer, start, goal) if many else []
    arcs = _quickest(problem, [way.path for way in ways], value, drawn)[: WORDS if many else 1]
    longest = math.inf
    if ways and any(goal.tolerance[:3]):
        longest = ways[0].time + _LONGER / trailer.turn_rate
    cars = _car_paths(problem, longest, CAR_PATHS if many else _CAR_PATHS_BESIDE)
    named += [("quickest word", word_path(trailer, start, word)) for word in arcs]
    named += [("car path", path) for path in cars]
    return named + [("drawn word", word_path(trailer, start, word)) for word in drawn], arcs


def _has_many_optima(problem: Problem, ways: list[Descent]) -> bool:
    """Whether no table tells the quickest way, or there are more ways than its nodes can resolve.

    That is so with cusps, with long trailers, whose paths resemble no car's, and with trailers that
    start beyond a right angle, where a tiny change decides to which side they unfold.
    """
    trailer = problem.trailer
    long = trailer.length * trailer.turn_rate > _LONG_TRAILER * trailer.speed
    bent = abs(math.remainder(problem.start[3], math.tau)) > math.pi / 2
    return not ways or trailer.reverse or long or bent


def _quickest(
    problem: Problem, ways: list[TrailerPath], value: ValueFunction | None, drawn: list[ArcWord]
) -> list[ArcWord]:
    """The quickest words near ways down the table, its word, those of a car and drawn ones."""
    trailer, start, goal = problem.trailer, problem.start, problem.goal
    words = [word_of(way) for way in ways]
    promised = math.inf
    if value is not None:
        known = word_known(value, value.to_table(start))
        words += [] if known is None else [known]
        # The table's word is what it promises; without one it interpolates.
        promised = float(value.interpolated(start)) if known is None else known.time
    longest = min((word.time for word in words), default=math.inf) * trailer.turn_rate
    # Where ways down the table miss a channel, the promised time still accounts for it.
    near = min(longest, promised * trailer.turn_rate) < LONGEST
    if near and all(0 < width < math.inf for width in goal.tolerance[:2]):
        entry = quickest_word(trailer, start, goal)
        words += [] if entry is None else [entry]
    words += car_words(trailer, start, goal, longest + _LONGER)
    found = quickest_words(
        trailer,
        start,
        words + drawn,
        goal,
        lambda word: len(word.durations) > 0 and keeps_limit(trailer, start, word),
    )
    return _unlike(found)


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
    radius = trailer.radius
    first, last = tuple(problem.start[:3].tolist()), problem.goal.state[:3]
    words = dubins_paths(first, last, radius)
    if trailer.reverse:
        words += reeds_shepp_paths(first, last, radius)
    near = [word for word in words if word.length <= longest * trailer.speed]
    betas = float(problem.start[3]), problem.goal.state[3]
    shortest = sorted(near, key=lambda word: word.length)[:most]
    return [seed_along([word], trailer, betas) for word in shortest]


def _refined(problem: Problem, found: list[Attempt], fell_back: list[str]) -> Attempt:
    """The best path near coarse attempts, with its switches in place if they can be placed."""
    refined, times = list[Attempt](), list[float]()
    unplaced = False
    for coarse in near_best(found)[:_MOST_REFINED]:
        placed = [each for each in with_placed_switches(problem, [coarse]) if each.is_path]
        # A coarse path is one of the cart too, so that the optimum beside it takes no longer.
        longest = coarse.time * (1 + _WORTH)
        if not any(each.status == "optimal" and each.time <= longest for each in placed):
            unplaced = True
            fine = _solved(problem, coarse.path, _INTERVALS)
            placed += [fine, *with_placed_switches(problem, [fine])]
        refined += [coarse, *placed]
        time = min(each.time for each in (coarse, *placed) if each.is_path)
        if all(abs(time - other) > _ALIKE * time for other in times):
            times.append(time)
        if len(times) == REFINED:
            break
    if unplaced:
        fell_back.append("switches not placed: solved in more intervals first")
    return min(refined, key=lambda each: (not each.is_path, *each.rank))


def _with_more_switches(problem: Problem, found: Attempt) -> Attempt:
    """A quicker path in more intervals, if there is one: few intervals leave out short cusps."""
    finer = _solved(problem, found.path, _INTERVALS)
    if not finer.is_path or finer.time >= found.time * (1 - _WORTH):
        return found
    placed = [each for each in with_placed_switches(problem, [finer]) if each.is_path]
    return min([found, finer, *placed], key=lambda each: each.rank)


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
