"""Plans from a table of times to go: driven down it, and among walls made short.

A passage among walls may be too narrow for a table's grid. A line of nodes lies in a passage
wherever it is, and however it runs, if the cart has half a step of room on either side. A cart
that is slimmer by that much has it in every passage that the cart itself fits through. Where its
way leads, that of the cart is near.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Any

import shapely

from ...errors import require
from ...geometry.world import World, make_world
from ..footprint import Discs, covering_discs, path_overlap, require_clear_ends, walls_part
from ..goal import Goal, checked_start
from ..minimum_time.planner import plan_by_casadi
from ..minimum_time.problem import Problem, near_best, resampled
from ..minimum_time.seeds import default_seeds, detours
from ..plan import Plan, TrailerPath
from ..trailer import Trailer
from ..value_function.grid import THESIS_STEP, StateGrid, grid_around
from ..value_function.policy import is_late, other_ways, roll_out
from ..value_function.solve import Progress, solve_value_function, widened
from ..value_function.value_function import ValueFunction, look_up_in_reach

METHOD = "value-function"
# A shorter way through a passage that the grid may not see is mentioned if it saves more than this,
# in turning radii.
WORTH = 1.0
# Least saving of time that counts, relative to it.
_LESS = 1e-6
# Intervals and iterations of the small programme among walls, and the share of the time that a way
# must save to be solved again.
_INTERVALS, _ITERATIONS, _SAVED = 30, 100, 1e-3


def grid_within(world: World, trailer: Trailer, goal: Goal, step: float) -> StateGrid:
    """A grid over a world, with a node at the goal.

    Args:
        world: All of it is covered, because a way round a wall may lead anywhere.
        trailer: For its turning radius.
        goal: Where the node is.
        step: Distance of nodes in turning radii.
    """
    radius = trailer.radius
    h = step * radius
    lows = [
        at - h * math.ceil((at - low) / h - 1e-9)
        for at, low in zip(goal.state[:2], world.bounds[:2].tolist(), strict=True)
    ]
    return StateGrid.covering((lows[0], lows[1], *world.bounds[2:].tolist()), step, radius=radius)


def plan_from_table(
    value: ValueFunction, start: Sequence[float], goal: Goal, world: World, discs: Discs
) -> Plan:
    """Drive down the time to go by the policy of the table, and let the path seed the programme.

    The quicker of both is the plan. The notes hold the table's `time_to_go`, interpolated, the time
    of the path as it was `driven`, by how much it runs into a wall, its `overlap`, whether it is
    the `programme`'s, and whether passages too `narrow` for the grid may lead on or be shorter.

    Args:
        value: Time to go among the walls.
        start: x, y, theta, beta, clear of walls [m], [m], [rad], [rad].
        goal: The box; smaller than the table's, if the grid could not resolve it.
        world: With the walls.
        discs: What the cart covers.
    """
    began = perf_counter()
    trailer = value.trailer
    promised = float(value.looked_up(start))
    if math.isinf(promised):
        promised = float(look_up_in_reach(value, start))
    notes: dict[str, Any] = {
        "value_function": value,
        "time_to_go": promised,
        "sweeps": value.sweeps,
        "scheme": value.scheme,
        "grid": value.grid.shape,
        "tolerance": value.goal.tolerance,
        "warnings": list(value.warnings),
        "narrow": True,
    }
    hint = _hint(value)
    if math.isinf(promised):
        notes["warnings"] = [*value.warnings, hint]
        return _without_path("unreachable on this grid", value, goal, notes, began)
    driven = roll_out(value, start)
    if not driven.arrived:
        notes["warnings"] = [*value.warnings, hint]
        return _without_path("lost on the way", value, goal, notes, began)
    path, time = driven.path, float(driven.path.times[-1])
    notes["driven"] = time
    status, way = "arrived", "driven down the table"
    converged = value.converged and not value.warnings
    residual = value.residual
    seeds: dict[str, list[TrailerPath]] = {}
    if len(path.controls):
        seeds["driven down the table, then polished"] = [path]
        if quicker := _quicker_ways(value, start, goal, world, discs, path):
            seeds["found by a small programme, then polished"] = quicker
    polished = {
        name: plan_by_casadi(trailer, start, goal, seeds=each, obstacles=world, discs=discs)
        for name, each in seeds.items()
    }
    reached = [
        (name, each.path)
        for name, each in polished.items()
        if each.converged and each.path is not None
    ]
    quickest = min(reached, key=lambda each: each[1].times[-1], default=None)
    # The programme's path ends where it should, whatever the grid resolved.
    if quickest and (quickest[1].times[-1] < time * (1 - _LESS) or value.warnings):
        way, path = quickest
        converged, residual = value.converged, polished[way].residual
        notes["warnings"] = []
    elif value.warnings:
        status = "arrived in a wider box"
    radius = trailer.radius
    ends = start[:2], goal.state[:2]
    saved = saved_by_narrow_passages(world, discs, value.grid.step, *ends)
    notes["narrow"] = saved > WORTH * radius
    if notes["narrow"]:
        notes["warnings"] = [*notes["warnings"], f"on a shorter way {hint}"]
    notes["way"], notes["programme"] = way, way in polished
    notes["overlap"] = max(path_overlap(world, discs, path, value.trailer), 0.0)
    return Plan(
        method=METHOD,
        goal=goal,
        status=status,
        converged=converged,
        time=float(path.times[-1]),
        path=path,
        iterations=value.sweeps,
        residual=residual,
        wall_time=perf_counter() - began,
        notes=notes,
    )


def _quicker_ways(
    value: ValueFunction,
    start: Sequence[float],
    goal: Goal,
    world: World,
    discs: Discs,
    driven: TrailerPath,
) -> list[TrailerPath]:
    """Ways among walls that a small programme finds, quicker than the one that was driven.

    It starts from that way, from ways down the table that begin otherwise, and from ways round
    corners.
    """
    trailer = value.trailer
    problem = Problem(trailer, checked_start(trailer, start, goal), goal, _ITERATIONS, world, discs)
    seeds = [driven, *other_ways(value, start), *default_seeds(problem)[0]]
    tried = [problem.solve(resampled(seed, _INTERVALS)) for seed in seeds]
    quick = float(driven.times[-1]) * (1 - _SAVED)
    found = [each for each in tried if each.is_path and each.time < quick]
    return [each.path for each in near_best(found)] if found else []


def _through_narrow_passages(
    plan: Plan,
    slim: ValueFunction,
    start: Sequence[float],
    goal: Goal,
    world: World,
    discs: Discs,
) -> Plan:
    """The quicker of a plan and of what the programme finds through narrow passages.

    It starts from the way of a slimmer cart, whose table is given, and from routes round corners.
    """
    trailer, way = slim.trailer, roll_out(slim, start)
    seeds: dict[str, list[TrailerPath] | None] = {}
    if way.arrived and len(way.path.controls):
        seeds["driven by a slimmer cart, then polished"] = [way.path]
    seeds["round corners, then polished"] = None
    for name, each in seeds.items():
        known = plan.time if plan.converged else math.inf
        other = plan_by_casadi(
            trailer, start, goal, seeds=each, obstacles=world, discs=discs, known=known
        )
        if other.converged and other.time < known * (1 - _LESS):
            notes = {
                **plan.notes,
                "warnings": [],
                "way": name,
                "programme": True,
                "overlap": other.notes["overlap"],
            }
            plan = replace(other, method=METHOD, status="arrived", notes=notes)
    return plan


def _hint(value: ValueFunction) -> str:
    """What to try where the table knows no way."""
    radius = value.trailer.radius
    step = value.grid.step
    return (
        f"a passage may be narrower than the grid sees, whose nodes are {step:.3g} m apart: "
        f"half the step, {step / radius / 2:.3g} turning radii, looks closer"
    )


def _without_path(
    status: str, value: ValueFunction, goal: Goal, notes: dict[str, object], began: float
) -> Plan:
    return Plan(
        method=METHOD,
        goal=goal,
        status=status,
        converged=False,
        iterations=value.sweeps,
        residual=value.residual,
        wall_time=perf_counter() - began,
        notes=notes,
    )


def plan_by_value_function(
    trailer: Trailer,
    start: Sequence[float],
    goal: Goal,
    *,
    step: float = THESIS_STEP,
    polish: int | None = None,
    value: ValueFunction | None = None,
    progress: Progress | None = None,
    obstacles: World | None = None,
    discs: Discs | None = None,
) -> Plan:
    """Solve for the time to go, and drive down it by the policy of the table.

    The path is what was driven, and `time` is how long that took; the notes hold the
    `value_function`, its `time_to_go`, and `warnings`, for example of a tolerance that the grid
    cannot resolve. Then the plan is not converged: it is for a wider box.

    Args:
        trailer: The cart.
        start: (x, y, theta, beta) [m], [m], [rad], [rad].
        goal: The box. With a table that was solved for a goal elsewhere, the box turns with the
            goal's heading.
        step: Distance of nodes in turning radii: 0.2 is the thesis's grid.
        polish: See `solve_value_function`.
        value: A table to reuse, of the same cart and for a goal of the same beta and tolerance.
        progress: See `solve_value_function`.
        obstacles: Walls to keep clear of, on a grid over all of that world; see `plan_from_table`
            for the path and the notes. A table to reuse takes no walls.
        discs: What the cart covers; by default `covering_discs(trailer)`.

    Raises:
        InvalidInput: Start, goal or option out of range, an end in a wall, or the table is for
            something else.
    """
    began = perf_counter()
    start = checked_start(trailer, start, goal).tolist()
    if obstacles is not None:
        body = discs or covering_discs(trailer)
        require(value is None, "value", "be left out among obstacles", "a table")
        require_clear_ends(obstacles, body, start, goal)
        if walls_part(obstacles, body, start, goal):
            return Plan(method=METHOD, goal=goal, status="unreachable", converged=False)
        grid = grid_within(obstacles, trailer, goal, step)
        table = partial(
            solve_value_function,
            trailer,
            goal,
            grid,
            polish=polish,
            progress=progress,
            obstacles=obstacles,
        )
        plan = plan_from_table(table(discs=body), start, goal, obstacles, body)
        if plan.notes["narrow"]:
            slim = table(discs=slimmed(body, grid.step))
            plan = _through_narrow_passages(plan, slim, start, goal, obstacles, body)
        return replace(plan, wall_time=perf_counter() - began)
    if value is None:
        grid = grid_around(trailer, start, goal, step)
        value = solve_value_function(trailer, goal, grid, polish=polish, progress=progress)
    else:
        require(value.trailer == trailer, "value", "be for the same trailer", value.trailer)
        # A table for a box that its grid cannot resolve is for a wider one.
        wide, _ = widened(replace(value.goal, tolerance=goal.tolerance), value.grid)
        same = value.goal.tolerance == wide.tolerance and value.goal.state[3] == goal.state[3]
        require(same, "value", "be for the same beta and tolerance", value.goal)
        value = value.moved(*goal.state[:3])
    driven = roll_out(value, start)
    path = driven.path if driven.arrived else None
    time = float(path.times[-1]) if path is not None else math.inf
    late = is_late(value, driven.promised, time)
    notes: dict[str, object] = {
        "value_function": value,
        "time_to_go": driven.promised,
        "sweeps": value.sweeps,
        "scheme": value.scheme,
        "grid": value.grid.shape,
        "tolerance": value.goal.tolerance,
        "warnings": list(value.warnings),
    }
    if math.isinf(driven.promised):
        status = "unreachable on this grid"
    elif path is None:
        status = "lost on the way"
    elif late:
        status = "arrived later than promised"
    else:
        status = "arrived in a wider box" if value.warnings else "arrived"
    return Plan(
        method=METHOD,
        goal=goal,
        status=status,
        # The table only chooses the word: what is promised is a path into the goal.
        converged=path is not None and not late and not value.warnings,
        time=time,
        path=path,
        iterations=value.sweeps,
        residual=value.residual,
        wall_time=perf_counter() - began,
        notes=notes,
    )


# Share of the room by which routes keep off the edge of the region that has enough room.
_LITTLE = 1e-3


def saved_by_narrow_passages(
    world: World, discs: Discs, step: float, start: Sequence[float], end: Sequence[float]
) -> float:
    """How much passages that are too narrow for the grid would shorten the shortest route.

    Routes are those of a point that keeps the largest disc's radius off walls, with and without
    half a step of the grid more: that is the room a passage needs for a line of nodes to lie in it.
    The cart itself may be too long for a passage that its discs fit through one by one.

    Args:
        world: The walls.
        discs: What the cart covers.
        step: Distance of nodes [m].
        start, end: x, y [m].

    Returns:
        Length; zero: there is no such passage, or it saves nothing; infinite: there is no other way
        [m].
    """
    radius = max(discs.radii)
    narrow, wide = (_length(world, room, start, end) for room in (radius, radius + step / 2))
    return 0.0 if math.isinf(narrow) else max(wide - narrow, 0.0)


def slimmed(discs: Discs, step: float) -> Discs:
    """The discs of a cart that is slimmer by half a step on either side, but not by half.

    Args:
        discs: What the cart covers.
        step: Distance of nodes [m].
    """
    return replace(discs, radii=tuple(max(r - step / 2, r / 2) for r in discs.radii))


def _length(world: World, room: float, start: Sequence[float], end: Sequence[float]) -> float:
    """Length of the shortest route that keeps so much room, except at its ends; or infinite."""
    parts = shapely.get_parts(world.polygon.buffer(-room, join_style="mitre"))
    # What is nothing has one part, which is empty.
    parts = parts[~shapely.is_empty(parts)]
    if not len(parts):
        return math.inf
    places = shapely.points([start, end])
    # An end that has less room is moved to the nearest place that has enough.
    first, last = (int(shapely.distance(parts, place).argmin()) for place in places)
    if first != last:
        return math.inf
    free = parts[first]
    inside = make_world(
        shapely.get_coordinates(free.exterior)[:-1],
        [shapely.get_coordinates(ring)[:-1] for ring in free.interiors],
    )
    ends = [shapely.shortest_line(free, place).coords[0] for place in places]
    routes = detours(inside, _LITTLE * room, *ends)
    return float(shapely.length(shapely.LineString(routes[0]))) if routes else math.inf
