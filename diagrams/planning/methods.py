"""The planners by name, and what asking one of them returns."""

from collections.abc import Callable

from ...systems.numerics.errors import require_one_of
from ...systems.numerics.planning.extremals.primitives import plan_by_primitives
from ...systems.numerics.planning.minimum_time.planner import plan_by_casadi
from ...systems.numerics.planning.plan import Plan
from .question import PlanningQuestion


def _casadi(ask: PlanningQuestion) -> Plan:
    return plan_by_casadi(ask.trailer, ask.start, ask.goal, obstacles=ask.world)


def _primitive(ask: PlanningQuestion) -> Plan:
    if ask.world is not None:
        return _blind_to_walls("primitive", ask)
    return plan_by_primitives(ask.trailer, ask.start, ask.goal)


METHODS: dict[str, Callable[[PlanningQuestion], Plan]] = {
    "casadi": _casadi,
    "primitive": _primitive,
}


def chosen_methods(name: str) -> list[str]:
    """The names that one name stands for: itself, or with "all" every one.

    Raises:
        InvalidInput: There is no such method.
    """
    require_one_of("method", name, [*METHODS, "all"])
    return list(METHODS) if name == "all" else [name]


def _blind_to_walls(method: str, ask: PlanningQuestion) -> Plan:
    status = "not applicable among walls"
    return Plan(method=method, goal=ask.goal, status=status, converged=False)
