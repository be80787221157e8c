"""Several planners on one question, side by side, with a bound that none of them can beat."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...systems.numerics.planning.among_walls.clear import require_clear_ends
from ...systems.numerics.planning.lower_bound import lower_bound
from ...systems.numerics.planning.minimum_time.footprint import covering_discs
from ...systems.numerics.planning.plan import Plan
from ...systems.numerics.planning.value_function.value_function import ValueFunction
from .methods import METHODS
from .question import PlanningQuestion
from .resimulation import Resimulation, resimulate


@dataclass(frozen=True, eq=False)
class Row:
    """One planner's answer, driven through the Drake plant.

    Attributes:
        method: Name of the planner.
        plan: Its answer.
        driven: Where its controls lead, or None without a path.
    """

    method: str
    plan: Plan
    driven: Resimulation | None

    @property
    def violation(self) -> float | None:
        """The largest of what is outside the goal and beyond the bounds when it is driven [-]."""
        return None if self.driven is None else self.driven.violation

    @property
    def beta_final(self) -> float | None:
        """The trailer's angle at the end of the plan, in (-pi, pi] [rad]."""
        if self.plan.path is None:
            return None
        angle = math.remainder(float(self.plan.path.states[-1, 3]), math.tau)
        return math.pi if angle == -math.pi else angle


@dataclass(frozen=True, eq=False)
class Verdict:
    """What all planners say.

    Attributes:
        question: What was asked.
        lower_bound: Dubins or Reeds-Shepp time, into the goal's box if it has one [s].
        rows: One for each planner.
    """

    question: PlanningQuestion
    lower_bound: float
    rows: tuple[Row, ...]

    @property
    def best_time(self) -> float:
        """Least time of a plan that converged; infinite without one [s]."""
        return min((row.plan.time for row in self.rows if row.plan.converged), default=math.inf)

    @property
    def value_function(self) -> ValueFunction | None:
        """The table that a planner solved or used, or None without one."""
        for row in self.rows:
            value = row.plan.notes.get("value_function")
            if isinstance(value, ValueFunction):
                return value
        return None

    def gap_to_best(self, row: Row) -> float | None:
        """How much longer than the best plan, relative to it."""
        return _gap(row.plan, self.best_time)

    def gap_to_bound(self, row: Row) -> float | None:
        """How much longer than the lower bound, relative to it."""
        return _gap(row.plan, self.lower_bound)


def ask_methods(question: PlanningQuestion, methods: Sequence[str]) -> Verdict:
    """Ask planners, by name, and drive what they return through the plant.

    Args:
        question: What is asked.
        methods: Their names.

    Raises:
        InvalidInput: The question cannot be meant, for instance starts in a wall.
    """
    if question.world is not None:
        # Those that do not look at walls would not say so.
        body = covering_discs(question.trailer)
        require_clear_ends(question.world, body, question.start, question.goal)
    rows = []
    for name in methods:
        plan = METHODS[name](question)
        driven = None
        if plan.path is not None and len(plan.path.times) > 1:
            driven = resimulate(question.trailer, plan.path, question.goal)
        rows.append(Row(name, plan, driven))
    bound = lower_bound(question.trailer, question.start, question.goal)
    return Verdict(question, bound, tuple(rows))


def _gap(plan: Plan, reference: float) -> float | None:
    # A plan that did not converge may end elsewhere: then its time compares with nothing.
    if not (plan.converged and math.isfinite(reference) and reference > 0):
        return None
    return plan.time / reference - 1
