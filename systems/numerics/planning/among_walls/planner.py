"""A plan among walls from a table: searched, then made as short as it can be."""

import math
from collections.abc import Sequence
from time import perf_counter

from ...geometry.world import World
from ..goal import Goal
from ..minimum_time.planner import plan_by_casadi
from ..plan import Plan
from ..trailer import Trailer
from ..value_function.grid import StateGrid
from ..value_function.obstacles import make_walls
from ..value_function.value_function import ValueFunction
from ..vehicle.footprint import Discs
from ..vehicle.overlap import deepest_overlap
from .lookup import look_up_in_reach
from .search import search_path

METHOD = "value-function"
# Nodes of the raster of free distances that a path is searched on, in one step of the grid.
FINENESS = 4


def grid_within(world: World, trailer: Trailer, goal: Goal, step: float) -> StateGrid:
    """A grid over a world, with a node at the goal.

    Args:
        world: All of it is covered, because a way round a wall may lead anywhere.
        trailer: For its turning radius.
        goal: Where the node is.
        step: Distance of nodes in turning radii.
    """
    radius = trailer.speed / trailer.turn_rate
    h = step * radius
    lows = [
        at - h * math.ceil((at - low) / h - 1e-9)
        for at, low in zip(goal.state[:2], world.bounds[:2].tolist(), strict=True)
    ]
    return StateGrid.covering((lows[0], lows[1], *world.bounds[2:].tolist()), step, radius=radius)


def plan_from_table(
    value: ValueFunction, start: Sequence[float], goal: Goal, world: World, discs: Discs
) -> Plan:
    """Search a path down the time to go, and let it seed the minimum-time programme.

    The notes hold the table's `time_to_go`, the time of the path as it was `searched`, and by how
    much it runs into a wall, its `overlap`.

    Args:
        value: Time to go among the walls.
        start: x, y, theta, beta, clear of walls [m], [m], [rad], [rad].
        goal: The box; smaller than the table's, if the grid could not resolve it.
        world: With the walls.
        discs: What the cart covers.
    """
    began = perf_counter()
    promised = float(value.time_to_go(start))
    if math.isinf(promised):
        promised = float(look_up_in_reach(value, start))
    notes: dict[str, object] = {
        "value_function": value,
        "time_to_go": promised,
        "sweeps": value.sweeps,
        "scheme": value.scheme,
        "grid": value.grid.shape,
        "tolerance": value.goal.tolerance,
        "warnings": list(value.warnings),
    }
    hint = _hint(value)
    if math.isinf(promised):
        notes["warnings"] = [*value.warnings, hint]
        return _without_path("unreachable on this grid", value, goal, notes, began)
    search = search_path(value, make_walls(world, discs, value.grid, FINENESS), start)
    notes["steps"] = search.steps
    if search.path is None:
        notes["warnings"] = [*value.warnings, hint]
        return _without_path("lost on the way", value, goal, notes, began)
    notes["searched"] = float(search.path.times[-1])
    path, status, way = search.path, "arrived", "searched among the walls"
    converged = value.converged and not value.warnings
    residual = value.residual
    seeds = [path] if len(path.controls) else None
    polished = plan_by_casadi(value.trailer, start, goal, seeds=seeds, obstacles=world, discs=discs)
    if polished.converged and polished.path is not None:
        path, way = polished.path, "searched among the walls, then polished"
        converged, residual = value.converged, polished.residual
        # The path ends where it should, whatever the grid resolved.
        notes["warnings"] = []
    elif value.warnings:
        status = "arrived in a wider box"
    notes["way"] = way
    notes["overlap"] = max(deepest_overlap(world, discs, path.states), 0.0)
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


def _hint(value: ValueFunction) -> str:
    """What to try where the table knows no way."""
    radius = value.trailer.speed / value.trailer.turn_rate
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
