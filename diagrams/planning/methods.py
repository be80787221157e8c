"""The planners by name, and what asking one of them returns."""

import math
from collections.abc import Callable

from ...systems.numerics.errors import require_one_of
from ...systems.numerics.planning.extremals.planner import plan_by_extremals
from ...systems.numerics.planning.extremals.primitives import plan_by_primitives
from ...systems.numerics.planning.minimum_time.planner import plan_by_casadi
from ...systems.numerics.planning.plan import Plan
from ...systems.numerics.planning.value_function.planner import (
    grid_around,
    plan_by_value_function,
)
from .question import PlanningQuestion

# Three times as many as the fine grid has, which takes 0.8 GB.
NODES_LIMIT = 120_000_000


def _casadi(ask: PlanningQuestion) -> Plan:
    return plan_by_casadi(ask.trailer, ask.start, ask.goal, obstacles=ask.world)


def _in_the_open(method: str, planner: Callable[..., Plan]) -> Callable[[PlanningQuestion], Plan]:
    """A planner that knows no walls, and says so among them."""

    def ask_planner(ask: PlanningQuestion) -> Plan:
        if ask.world is None:
            return planner(ask.trailer, ask.start, ask.goal)
        return _blind_to_walls(method, ask)

    return ask_planner


def _blind_to_walls(method: str, ask: PlanningQuestion) -> Plan:
    status = "not applicable among walls"
    return Plan(method=method, goal=ask.goal, status=status, converged=False)


def _value_function(ask: PlanningQuestion) -> Plan:
    if ask.world is not None:
        return _blind_to_walls("value-function", ask)
    if any(map(math.isinf, ask.goal.tolerance[:2])):
        status = "not applicable: its grid is a square around the goal"
        return Plan(method="value-function", goal=ask.goal, status=status, converged=False)
    nodes = math.prod(grid_around(ask.trailer, ask.start, ask.goal, ask.grid_step).shape)
    if ask.table is None and nodes > NODES_LIMIT:
        status = f"not applicable: its grid would have {nodes:.1e} nodes"
        return Plan(method="value-function", goal=ask.goal, status=status, converged=False)
    return plan_by_value_function(
        ask.trailer,
        ask.start,
        ask.goal,
        step=ask.grid_step,
        value=ask.table,
        progress=ask.progress,
    )


METHODS: dict[str, Callable[[PlanningQuestion], Plan]] = {
    "casadi": _casadi,
    "extremal": _in_the_open("extremal", plan_by_extremals),
    "value-function": _value_function,
    "primitive": _in_the_open("primitive", plan_by_primitives),
}


def promises_optimum(method: str, ask: PlanningQuestion) -> bool:
    """Whether a planner claims that no path of the cart takes less time to the goal.

    Extremals meet x, y and theta exactly, and only drive forwards.
    """
    if method == "extremal":
        return not any(ask.goal.tolerance[:3]) and not ask.trailer.reverse
    return method == "casadi"


def chosen_methods(name: str) -> list[str]:
    """The names that one name stands for: itself, or with "all" every one.

    Raises:
        InvalidInput: There is no such method.
    """
    require_one_of("method", name, [*METHODS, "all"])
    return list(METHODS) if name == "all" else [name]
