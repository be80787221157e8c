"""A planning question as every method is asked it."""

import math
from dataclasses import dataclass, field

from ...systems.numerics.errors import require, require_finite, require_positive
from ...systems.numerics.geometry.world import World
from ...systems.numerics.planning.footprint import Discs, covering_discs
from ...systems.numerics.planning.goal import Goal, require_plannable
from ...systems.numerics.planning.trailer import Trailer
from ...systems.numerics.planning.value_function.grid import THESIS_STEP
from ...systems.numerics.planning.value_function.solve import Progress
from ...systems.numerics.planning.value_function.value_function import ValueFunction
from .memory import quarter_of_memory


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
