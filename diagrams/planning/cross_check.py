"""Whether the answers of several planners can all be true."""

from collections.abc import Callable

from .evidence import AGREEMENT, DRIVEN_TOLERANCE
from .methods import promises_optimum
from .question import PlanningQuestion
from .verdict import PlanningVerdict

# A converged plan may be faster than the bound by a rounding, relative to it.
BOUND_TOLERANCE = 1e-6


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
