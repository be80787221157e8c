"""Several planners on one question, side by side, with a bound that none of them can beat."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...systems.numerics.planning.footprint import require_clear_ends
from ...systems.numerics.planning.lower_bound import lower_bound
from ...systems.numerics.planning.plan import Plan
from ...systems.numerics.planning.value_function.value_function import ValueFunction
from .evidence import DRIVEN_TOLERANCE
from .methods import METHODS
from .question import PlanningQuestion
from .resimulation import Resimulation, resimulate


@dataclass(frozen=True, eq=False)
class Row:
    """One planner's answer, driven through the Drake plant.

    Attributes:
        method: Name of the planner.
        plan: Its answer.
        driven: Where its controls lead, or None without a path, and for one that ends as it begins.
    """

    method: str
    plan: Plan
    driven: Resimulation | None

    @property
    def violation(self) -> float | None:
        """The largest of what is outside the goal and beyond the bounds when it is driven [-]."""
        if self.driven is not None:
            return self.driven.violation
        # A cart that is at its goal is not driven.
        path = self.plan.path
        return None if path is None else max(self.plan.goal.miss(path.states[-1]))

    @property
    def holds(self) -> bool:
        """Whether the plan converged, and its controls lead into the goal when they are driven."""
        violation = self.violation
        return self.plan.converged and (violation is None or violation <= DRIVEN_TOLERANCE)

    @property
    def beta_final(self) -> float | None:
        """The trailer's angle at the end of the plan, in (-pi, pi] [rad]."""
        if self.plan.path is None:
            return None
        angle = math.remainder(float(self.plan.path.states[-1, 3]), math.tau)
        return math.pi if angle == -math.pi else angle


@dataclass(frozen=True, eq=False)
class PlanningVerdict:
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
        """Least time of a plan that holds; infinite without one [s]."""
        return min((row.plan.time for row in self.rows if row.holds), default=math.inf)

    @property
    def value_function(self) -> ValueFunction | None:
        """The table that a planner solved or used, or None without one."""
        for row in self.rows:
            value = row.plan.notes.get("value_function")
            if isinstance(value, ValueFunction):
                return value
        return None

    def gap_to_best(self, row: Row) -> float | None:
        """How much longer than the best plan, relative to it; None where there is no other."""
        others = [each for each in self.rows if each.holds and each.method != row.method]
        return _gap(row, self.best_time) if others else None

    def gap_to_bound(self, row: Row) -> float | None:
        """How much longer than the lower bound, relative to it."""
        return _gap(row, self.lower_bound)


def ask_methods(question: PlanningQuestion, methods: Sequence[str]) -> PlanningVerdict:
    """Ask planners, by name, and drive what they return through the plant.

    Args:
        question: What is asked.
        methods: Their names.

    Raises:
        InvalidInput: The question cannot be meant, for instance starts in a wall.
    """
    if question.world is not None:
        # Those that do not look at walls would not say so.
        require_clear_ends(question.world, question.discs, question.start, question.goal)
    rows = []
    for name in methods:
        plan = METHODS[name](question)
        driven = None
        if plan.path is not None and len(plan.path.times) > 1:
            driven = resimulate(question.trailer, plan.path, question.goal)
        rows.append(Row(name, plan, driven))
    bound = lower_bound(question.trailer, question.start, question.goal)
    return PlanningVerdict(question, bound, tuple(rows))


def _gap(row: Row, reference: float) -> float | None:
    # A plan that does not hold may end elsewhere: then its time compares with nothing.
    if not (row.holds and math.isfinite(reference) and reference > 0):
        return None
    return row.plan.time / reference - 1
