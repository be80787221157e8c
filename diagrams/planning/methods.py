"""A planning question, and the planners by name that answer it."""

import math
import os
from collections.abc import Callable
from dataclasses import dataclass, field

from ...systems.numerics.errors import require, require_finite, require_one_of, require_positive
from ...systems.numerics.geometry.world import World
from ...systems.numerics.planning.extremals.planner import plan_by_extremals
from ...systems.numerics.planning.extremals.primitives import plan_by_primitives
from ...systems.numerics.planning.footprint import Discs, covering_discs
from ...systems.numerics.planning.goal import Goal, require_plannable
from ...systems.numerics.planning.minimum_time.planner import plan_by_casadi
from ...systems.numerics.planning.plan import Plan
from ...systems.numerics.planning.planners.from_table import grid_within, plan_by_value_function
from ...systems.numerics.planning.planners.polished import plan_polished
from ...systems.numerics.planning.planners.thesis_scheme import METHOD as AVERAGING
from ...systems.numerics.planning.planners.thesis_scheme import plan_by_averaging
from ...systems.numerics.planning.trailer import Trailer
from ...systems.numerics.planning.value_function.grid import THESIS_STEP, StateGrid, grid_around
from ...systems.numerics.planning.value_function.solve import Progress, open_field_table
from ...systems.numerics.planning.value_function.value_function import ValueFunction

# Of a solution of the value function, for each node: the table, bounds and what passes keep.
BYTES_PER_NODE = 24
# Among walls, for each node of x and y besides: free room by heading on a finer raster.
_BYTES_OF_WALLS = 2 * 8 * 4 * 4
# Where a system does not say how much it has [bytes].
_UNKNOWN = 8e9


def quarter_of_memory() -> float:
    """A quarter of the machine's memory [bytes]."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 4
    except (AttributeError, OSError, ValueError):
        return _UNKNOWN / 4


def memory_of(grid: StateGrid, walled: bool) -> float:
    """What solving on a grid takes [bytes].

    Args:
        grid: Whose nodes.
        walled: Whether there are obstacles.
    """
    theta, beta, y, x = grid.shape
    walls = theta * y * x * _BYTES_OF_WALLS if walled else 0.0
    return float(theta) * beta * y * x * BYTES_PER_NODE + walls


@dataclass(frozen=True, kw_only=True, eq=False)
class PlanningQuestion:
    """From where to where, with which cart, among which walls.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # x, y, theta, beta [m], [m], [rad], [rad].
    start: tuple[float, float, float, float]
    goal: Goal
    trailer: Trailer = field(default_factory=Trailer)
    # Without one, the open field.
    world: World | None = None
    # Distance of the value function's nodes, in turning radii.
    grid_step: float = THESIS_STEP
    # A value function that is known already, of this cart and goal; see `plan_by_value_function`.
    table: ValueFunction | None = None
    # Width of the cart [m]; by default half of the trailer's length.
    width: float | None = None
    # What the cart covers, in place of a width; see `discs`.
    footprint: Discs | None = None
    # That a table may take at most [bytes].
    memory: float = field(default_factory=quarter_of_memory)
    # Told of every pass over that grid; see `solve_value_function`.
    progress: Progress | None = None

    def __post_init__(self) -> None:
        require(len(self.start) == 4, "start", "be (x, y, theta, beta)", self.start)
        for value in self.start:
            require_finite("start", value)
        for name, state, slack in (
            ("start", self.start, 0.0),
            ("goal", self.goal.state, self.goal.tolerance[3]),
        ):
            bent = abs(math.remainder(state[3], math.tau))
            reach = self.trailer.jackknife + slack
            require(bent <= reach, name, "have |beta| within jackknife", state[3])
        require_plannable(self.trailer, self.start, self.goal)
        if self.width is not None:
            require_positive("width", self.width)
            # Discs of less would be too many.
            words = "be at least a fiftieth of the trailer's length"
            require(self.width >= self.trailer.length / 50, "width", words, self.width)
            without = self.footprint is None
            require(without, "width", "stand without discs, which have widths", self.width)
        require_positive("memory", self.memory)
        require_positive("grid", self.grid_step)
        require(self.grid_step <= 1, "grid", "have a step of at most 1", self.grid_step)

    @property
    def discs(self) -> Discs:
        """What the cart covers."""
        return self.footprint or covering_discs(self.trailer, self.width)


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
