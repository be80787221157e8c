"""Several planners on one question, side by side: driven, bounded, and held against one another.

A solver ends in a local optimum. That nothing is quicker needs a reason: the plan meets a bound
that no path can beat, or planners that work in different ways agree.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from ...systems.numerics.planning.footprint import require_clear_ends
from ...systems.numerics.planning.goal import Goal
from ...systems.numerics.planning.lower_bound import lower_bound
from ...systems.numerics.planning.plan import Plan, TrailerPath, refined_path, require_path
from ...systems.numerics.planning.trailer import Trailer, control_excess
from ...systems.numerics.planning.value_function.value_function import ValueFunction
from ...systems.planning import TractorTrailer
from .methods import METHODS, PlanningQuestion, promises_optimum

ACCURACY = 1e-11
# The integrator's own longest step, in times that a turn by one radian takes.
LONGEST_STEP = 0.1
# Time between samples of a path that is shown, in such times.
_SHOWN_STEP = 0.05
# How far a converged plan's controls may lead from the goal, in the units of the state.
DRIVEN_TOLERANCE = 1e-4
# Plans that take as long agree to this, relative to it, and a plan this near to the bound meets it.
AGREEMENT = 2e-3
# Planners whose paths are of one programme, if from different seeds, are one witness.
_PROGRAMME = ("casadi", "polished")
# A converged plan may be faster than the bound by a rounding, relative to it.
BOUND_TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Resimulation:
    """Where a path's controls lead.

    Attributes:
        path: The path that was driven, at the times of the planned one.
        final_state: x, y, theta, beta [m], [m], [rad], [rad].
        goal_miss: How far it is outside the goal's box, entry by entry.
        control_excess: By how much the planned controls leave the bounds, which the plant keeps
            [m/s or rad/s].
        jackknife_excess: By how much |beta| exceeds the limit at a sample [rad].
        drift: Largest distance between a planned state and the driven one, in any entry
            [m or rad].
    """

    path: TrailerPath
    final_state: tuple[float, float, float, float]
    goal_miss: tuple[float, float, float, float]
    control_excess: float
    jackknife_excess: float
    drift: float

    @property
    def violation(self) -> float:
        """The largest of what is outside the goal and beyond the bounds."""
        return max(*self.goal_miss, self.control_excess, self.jackknife_excess)


def resimulate(trailer: Trailer, path: TrailerPath, goal: Goal) -> Resimulation:
    """Drive the plant from the path's first state with its controls, each held to the next time.

    Args:
        trailer: Parameters.
        path: At least two samples; states other than the first only serve to find the drift.
        goal: What was to be reached.

    Raises:
        InvalidInput: The path has not two samples at increasing times.
    """
    require_path(path)
    plant = TractorTrailer(trailer, path.states[0])
    simulator = Simulator(plant)
    ResetIntegratorFromFlags(simulator, "runge_kutta5", LONGEST_STEP / trailer.turn_rate)
    simulator.get_mutable_integrator().set_target_accuracy(ACCURACY)
    context = simulator.get_mutable_context()
    driven = np.empty((len(path.times), 4))
    driven[0] = path.states[0]
    for k, held in enumerate(path.controls):
        # A change of the input between steps, not within one, costs the integrator nothing.
        plant.get_control_input_port().FixValue(context, held)
        simulator.AdvanceTo(path.times[k + 1] - path.times[0])
        driven[k + 1] = context.get_continuous_state_vector().CopyToVector()
    x, y, theta, beta = map(float, driven[-1])
    actual = TrailerPath(path.times, driven, path.controls)
    # Without a limit the trailer may turn right round.
    limit = trailer.jackknife if trailer.jackknife < math.pi else math.inf
    return Resimulation(
        path=actual,
        final_state=(x, y, theta, beta),
        goal_miss=goal.miss(driven[-1]),
        control_excess=control_excess(path.controls, trailer),
        jackknife_excess=max(actual.widest_angle - limit, 0.0),
        drift=float(np.abs(driven - path.states).max()),
    )


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

    @cached_property
    def shown(self) -> dict[str, TrailerPath]:
        """Paths by method, with samples so near that straight lines between them look like arcs.

        Planners sample a long arc at its ends alone.
        """
        trailer = self.question.trailer
        step = _SHOWN_STEP / trailer.turn_rate
        return {
            row.method: path if row.driven is None else refined_path(path, trailer, step)
            for row in self.rows
            if (path := row.plan.path) is not None
        }

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


def reasons(verdict: PlanningVerdict, row: Row) -> list[str]:
    """Why a plan is taken for the optimum; none: it is not, or nothing speaks for it.

    Args:
        verdict: The answers of all planners.
        row: One of them.
    """
    if not row.holds or row.plan.time > (1 + AGREEMENT) * verdict.best_time:
        return []
    found = []
    if row.plan.time <= (1 + AGREEMENT) * verdict.lower_bound:
        found.append("meets the bound")
    alike = [
        each.method
        for each in verdict.rows
        if each is not row
        and _witness(each) != _witness(row)
        and each.holds
        and each.plan.time <= (1 + AGREEMENT) * verdict.best_time
    ]
    if alike:
        found.append(f"as quick as {', '.join(alike)}")
    return found


def status_of(verdict: PlanningVerdict, row: Row) -> str:
    """What is said of a plan, in words: its planner's status, and what it is worth.

    Args:
        verdict: The answers of all planners.
        row: One of them.
    """
    status = row.plan.status
    if row.plan.converged and not row.holds:
        return f"{status}, but misses by {row.violation:.2g} when it is driven"
    if status != "optimal":
        return status
    why = reasons(verdict, row)
    return f"optimal: {', '.join(why)}" if why else "locally optimal"


def _witness(row: Row) -> str:
    """Whose path it is: a table's may have become one of the programme."""
    of_programme = row.method in _PROGRAMME or row.plan.notes.get("programme")
    return "programme" if of_programme else row.method


def contradictions(
    verdict: PlanningVerdict,
    exact: Callable[[str, PlanningQuestion], bool] = promises_optimum,
) -> list[str]:
    """What cannot be: sentences, none if all is well.

    Args:
        verdict: The planners' answers.
        exact: Whether a planner promises the optimum of a question; those that do have to agree,
            and no other may be quicker.
    """
    found = []
    for row in verdict.rows:
        plan = row.plan
        if plan.converged and plan.time < (1 - BOUND_TOLERANCE) * verdict.lower_bound:
            found.append(
                f"{row.method} takes {plan.time:.6g} s, below the bound {verdict.lower_bound:.6g} s"
            )
        if plan.converged and row.violation is not None and row.violation > DRIVEN_TOLERANCE:
            found.append(f"{row.method} misses by {row.violation:.2g} when it is driven")
    times = {
        row.method: row.plan.time
        for row in verdict.rows
        if exact(row.method, verdict.question) and row.plan.converged
    }
    if times and max(times.values()) > (1 + AGREEMENT) * min(times.values()):
        said = ", ".join(f"{method} {time:.6g} s" for method, time in times.items())
        found.append(f"planners that promise the optimum differ: {said}")
    promised = min(times, key=lambda method: times[method], default=None)
    for row in verdict.rows:
        believed = row.holds and row.plan.time >= (1 - BOUND_TOLERANCE) * verdict.lower_bound
        if promised is None or row.method in times or not believed:
            continue
        if times[promised] > (1 + AGREEMENT) * row.plan.time:
            found.append(
                f"{promised} promises the optimum, {times[promised]:.6g} s, and {row.method} "
                f"takes {row.plan.time:.6g} s"
            )
    return found
