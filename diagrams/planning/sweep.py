"""Travel time over the direction of the goal, Figure 3.10."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...systems.numerics.errors import require
from ...systems.numerics.planning.goal import Goal
from ...systems.numerics.planning.lower_bound import lower_bound
from ...systems.numerics.planning.plan import Plan
from ...systems.numerics.planning.value_function.grid import THESIS_STEP
from ...systems.numerics.planning.value_function.solve import Progress
from .methods import METHODS
from .question import PlanningQuestion

# y_g - y_i of the figure, and the ends of its axis.
RISE = 4.0
RATIOS = (0.5, 3.0)


@dataclass(frozen=True, eq=False)
class Sweep:
    """Travel times over the ratio (x_g - x_i) / (y_g - y_i).

    Attributes:
        ratios: Shape (n,).
        times: For each method, shape (n,); not a number where it did not converge [s].
        lower_bounds: Shape (n,) [s].
        tolerance: Half-widths of the goal.
    """

    ratios: np.ndarray
    times: dict[str, np.ndarray]
    lower_bounds: np.ndarray
    tolerance: tuple[float, float, float, float]

    def as_object(self) -> dict[str, object]:
        """As JSON takes it; null where a method did not converge."""
        return {
            "ratios": self.ratios.tolist(),
            "goal_tolerance": [width if math.isfinite(width) else None for width in self.tolerance],
            "lower_bound": self.lower_bounds.tolist(),
            "methods": {
                name: [time if math.isfinite(time) else None for time in times.tolist()]
                for name, times in self.times.items()
            },
        }


def sweep_ratios(
    methods: Sequence[str],
    tolerance: tuple[float, float, float, float],
    count: int,
    grid_step: float = THESIS_STEP,
    progress: Progress | None = None,
) -> Sweep:
    """Ask planners for the way from below a goal, with headings and trailer straight.

    Args:
        methods: Names of the planners.
        tolerance: Half-widths of the goal.
        count: Number of ratios, at least two.
        grid_step: Of the value function, in turning radii.
        progress: See `solve_value_function`.

    Raises:
        InvalidInput: Too few ratios, a tolerance that is none, or a grid that is too coarse.
    """
    require(count >= 2, "count", "be at least 2", count)
    ratios = np.linspace(*RATIOS, count)
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=tolerance)
    questions = [
        PlanningQuestion(
            start=(-ratio * RISE, -RISE, 0.0, 0.0),
            goal=goal,
            grid_step=grid_step,
            progress=progress,
        )
        for ratio in ratios.tolist()
    ]
    found = {name: [_time(METHODS[name](each)) for each in questions] for name in methods}
    return Sweep(
        ratios=ratios,
        times={name: np.array(times) for name, times in found.items()},
        lower_bounds=np.array([lower_bound(q.trailer, q.start, q.goal) for q in questions]),
        tolerance=tolerance,
    )


def _time(plan: Plan) -> float:
    """Its time; not a number for a path that is none, or leads elsewhere."""
    return plan.time if plan.converged else math.nan
