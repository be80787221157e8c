"""Travel time over the direction of the goal, Figure 3.10."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...systems.numerics.errors import require
from ...systems.numerics.planning.goal import Goal
from ...systems.numerics.planning.lower_bound import lower_bound
from ...systems.numerics.planning.plan import Plan
from ...systems.numerics.planning.value_function.grid import THESIS_STEP, grid_around
from ...systems.numerics.planning.value_function.solve import (
    Progress,
    solve_value_function,
    widened,
)
from ...systems.numerics.planning.value_function.value_function import ValueFunction
from .methods import METHODS, PlanningQuestion, too_large

# y_g - y_i of the figure, and the ends of its axis.
RISE = 4.0
RATIOS = (0.5, 3.0)
# Methods that look at a value function.
_BY_TABLE = {"value-function", "polished"}


@dataclass(frozen=True, eq=False)
class DirectionSweep:
    """Travel times over the ratio (x_g - x_i) / (y_g - y_i).

    Attributes:
        ratios: Shape (n,).
        times: For each method, shape (n,); not a number where it did not converge [s].
        lower_bounds: Shape (n,) [s].
        tolerance: Half-widths of the goal.
        remarks: Why times are missing, sentences.
    """

    ratios: np.ndarray
    times: dict[str, np.ndarray]
    lower_bounds: np.ndarray
    tolerance: tuple[float, float, float, float]
    remarks: tuple[str, ...] = ()

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
            "remarks": list(self.remarks),
        }


def sweep_ratios(
    methods: Sequence[str],
    tolerance: tuple[float, float, float, float],
    count: int,
    grid_step: float = THESIS_STEP,
    progress: Progress | None = None,
) -> DirectionSweep:
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
    if _BY_TABLE & set(methods) and not any(map(math.isinf, tolerance[:2])):
        table = _shared_table(questions[-1])
        questions = [replace(question, table=table) for question in questions]
    found = {name: [METHODS[name](each) for each in questions] for name in methods}
    return DirectionSweep(
        ratios=ratios,
        times={name: np.array([_time(plan) for plan in plans]) for name, plans in found.items()},
        lower_bounds=np.array([lower_bound(q.trailer, q.start, q.goal) for q in questions]),
        tolerance=tolerance,
        remarks=tuple(remark for name, plans in found.items() for remark in _remarks(name, plans)),
    )


def _shared_table(farthest: PlanningQuestion) -> ValueFunction | None:
    """One value function for all starts; None if a planner has to say that it is too coarse."""
    trailer, goal, step = farthest.trailer, farthest.goal, farthest.grid_step
    grid = grid_around(trailer, farthest.start, goal, step)
    _, warnings = widened(goal, grid)
    if warnings or too_large(farthest, grid):
        return None
    return solve_value_function(trailer, goal, grid, progress=farthest.progress)


def _remarks(method: str, plans: Sequence[Plan]) -> list[str]:
    """What a planner says where it did not converge, and how often."""
    said = Counter(plan.status for plan in plans if not plan.converged)
    return [f"{method}: {status} ({count} of {len(plans)})" for status, count in said.items()]


def _time(plan: Plan) -> float:
    """Its time; not a number for a path that is none, or leads elsewhere."""
    return plan.time if plan.converged else math.nan
