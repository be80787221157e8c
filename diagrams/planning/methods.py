"""The planners by name, and what asking one of them returns."""

import math
from collections.abc import Callable

from ...systems.numerics.errors import require_one_of
from ...systems.numerics.planning.extremals.planner import plan_by_extremals
from ...systems.numerics.planning.extremals.primitives import plan_by_primitives
from ...systems.numerics.planning.minimum_time.planner import plan_by_casadi
from ...systems.numerics.planning.plan import Plan
from ...systems.numerics.planning.planners.from_table import grid_within, plan_by_value_function
from ...systems.numerics.planning.planners.polished import plan_polished
from ...systems.numerics.planning.planners.thesis_scheme import METHOD as AVERAGING
from ...systems.numerics.planning.planners.thesis_scheme import plan_by_averaging
from ...systems.numerics.planning.value_function.grid import StateGrid, grid_around
from ...systems.numerics.planning.value_function.solve import open_field_table
from ...systems.numerics.planning.value_function.value_function import ValueFunction
from .memory import memory_of
from .question import PlanningQuestion


def too_large(ask: PlanningQuestion, grid: StateGrid) -> bool:
    """Whether a table on a grid would take more memory than is allowed.

    Args:
        ask: Which says how much is allowed.
        grid: Of the table.
    """
    return memory_of(grid, ask.world is not None) > ask.memory


def _casadi(ask: PlanningQuestion) -> Plan:
    return plan_by_casadi(ask.trailer, ask.start, ask.goal, obstacles=ask.world, discs=ask.discs)


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
    if any(map(math.isinf, ask.goal.tolerance[:2])):
        status = "not applicable: its grid is a square around the goal"
        return Plan(method="value-function", goal=ask.goal, status=status, converged=False)
    grid = _grid(ask)
    if ask.table is None and too_large(ask, grid):
        taken = memory_of(grid, ask.world is not None)
        status = (
            f"not applicable: its grid would have {math.prod(grid.shape):.1e} nodes, for which "
            f"{taken / 1e9:.3g} GB are needed and {ask.memory / 1e9:.3g} GB allowed"
        )
        return Plan(method="value-function", goal=ask.goal, status=status, converged=False)
    return plan_by_value_function(
        ask.trailer,
        ask.start,
        ask.goal,
        step=ask.grid_step,
        value=_table(ask),
        progress=ask.progress,
        obstacles=ask.world,
        discs=ask.discs,
    )


def _grid(ask: PlanningQuestion) -> StateGrid:
    if ask.world is None:
        return grid_around(ask.trailer, ask.start, ask.goal, ask.grid_step)
    return grid_within(ask.world, ask.trailer, ask.goal, ask.grid_step)


def _table(ask: PlanningQuestion) -> ValueFunction | None:
    """The table that was given, or the one of the open field that all questions share."""
    if ask.table is not None or ask.world is not None:
        return ask.table
    return open_field_table(ask.trailer, ask.start, ask.goal, ask.grid_step, ask.progress)


def _polished(ask: PlanningQuestion) -> Plan:
    if ask.world is not None:
        return _blind_to_walls("polished", ask)
    # It only needs a guide: where the grid asked for is too large, the thesis's will do.
    grid = grid_around(ask.trailer, ask.start, ask.goal, ask.grid_step)
    table = ask.table if too_large(ask, grid) else _table(ask)
    return plan_polished(ask.trailer, ask.start, ask.goal, value=table)


def _averaging(ask: PlanningQuestion) -> Plan:
    goal = ask.goal
    why = None
    if ask.world is not None:
        return _blind_to_walls(AVERAGING, ask)
    if ask.trailer.reverse:
        why = "it drives forwards only"
    elif any(map(math.isinf, goal.tolerance[:2])):
        why = "its grid is a square around the goal"
    elif too_large(ask, _grid(ask)):
        why = "its grid would be too large"
    if why is not None:
        status = f"not applicable: {why}"
        return Plan(method=AVERAGING, goal=goal, status=status, converged=False)
    return plan_by_averaging(
        ask.trailer, ask.start, goal, step=ask.grid_step, progress=ask.progress
    )


METHODS: dict[str, Callable[[PlanningQuestion], Plan]] = {
    "casadi": _casadi,
    "extremal": _in_the_open("extremal", plan_by_extremals),
    "value-function": _value_function,
    "polished": _polished,
    "primitive": _in_the_open("primitive", plan_by_primitives),
    AVERAGING: _averaging,
}
# The thesis's table is not the time to go: it is there to compare with, for who asks for it.
VARIANTS = {AVERAGING}


def promises_optimum(method: str, ask: PlanningQuestion) -> bool:
    """Whether a planner claims that no path of the cart takes less time to the goal.

    Extremals meet x, y and theta exactly, and only drive forwards. Polished paths were as quick as
    those from every seed, or quicker, in all of 400 random questions (compare bench_planners.py).

    Args:
        method: Name of the planner.
        ask: The question.
    """
    if method == "extremal":
        return not any(ask.goal.tolerance[:3]) and not ask.trailer.reverse
    if method == "polished":
        return ask.world is None and not ask.trailer.reverse
    return method == "casadi"


def chosen_methods(name: str) -> list[str]:
    """The names that one name stands for: itself, or with "all" every one but variants.

    Raises:
        InvalidInput: There is no such method.
    """
    require_one_of("method", name, [*METHODS, "all"])
    if name == "all":
        return [each for each in METHODS if each not in VARIANTS]
    return [name]
