"""A plan among walls from a table: its policy, then made as short as it can be."""

import math
from collections.abc import Sequence
from time import perf_counter
from typing import Any

from ...geometry.world import World
from ..goal import Goal
from ..minimum_time.planner import plan_by_casadi
from ..plan import Plan
from ..trailer import Trailer
from ..value_function.grid import StateGrid
from ..value_function.lookup_in_reach import look_up_in_reach
from ..value_function.rollout import roll_out
from ..value_function.value_function import ValueFunction
from ..vehicle.footprint import Discs
from ..vehicle.overlap import deepest_overlap
from .passages import saved_by_narrow_passages

METHOD = "value-function"
# A shorter way through a passage that the grid may not see is worth a word if it saves so much, in
# turning radii.
WORTH = 1.0
# How much less time counts as less.
_LESS = 1e-6


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
    """Drive down the time to go by the policy of the table, and let the path seed the programme.

    The quicker of both is the plan. The notes hold the table's `time_to_go`, the time of the path
    as it was `driven`, and by how much it runs into a wall, its `overlap`.

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
    notes: dict[str, Any] = {
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
    driven = roll_out(value, start)
    if not driven.arrived:
        notes["warnings"] = [*value.warnings, hint]
        return _without_path("lost on the way", value, goal, notes, began)
    path, time = driven.path, float(driven.path.times[-1])
    notes["driven"] = time
    status, way = "arrived", "driven down the table"
    converged = value.converged and not value.warnings
    residual = value.residual
    seeds = [path] if len(path.controls) else None
    polished = plan_by_casadi(value.trailer, start, goal, seeds=seeds, obstacles=world, discs=discs)
    # The programme's path ends where it should, whatever the grid resolved.
    better = polished.time < time * (1 - _LESS) or bool(value.warnings)
    if better and polished.converged and polished.path is not None:
        path, way = polished.path, "driven down the table, then polished"
        converged, residual = value.converged, polished.residual
        notes["warnings"] = []
    elif value.warnings:
        status = "arrived in a wider box"
    radius = value.trailer.speed / value.trailer.turn_rate
    ends = start[:2], goal.state[:2]
    if saved_by_narrow_passages(world, discs, value.grid.step, *ends) > WORTH * radius:
        notes["warnings"] = [*notes["warnings"], f"on a shorter way {hint}"]
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
