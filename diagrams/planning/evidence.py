"""What is known of a plan besides its planner's word: driven, bounded, or found by others too.

A solver ends in a local optimum. That nothing is quicker needs a reason: the plan meets a bound
that no path can beat, or planners that work in different ways agree.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .verdict import PlanningVerdict, Row

# How far a converged plan's controls may lead from the goal, in the units of the state.
DRIVEN_TOLERANCE = 1e-4
# Plans that take as long agree to this, relative to it, and a plan this near to the bound meets it.
AGREEMENT = 2e-3
# Planners that solve one programme, if from different seeds, are one witness.
_WITNESSES = {"casadi": "programme", "polished": "programme"}


def reasons(verdict: "PlanningVerdict", row: "Row") -> list[str]:
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
        and _witness(each.method) != _witness(row.method)
        and each.holds
        and each.plan.time <= (1 + AGREEMENT) * verdict.best_time
    ]
    if alike:
        found.append(f"as quick as {', '.join(alike)}")
    return found


def status_of(verdict: "PlanningVerdict", row: "Row") -> str:
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


def _witness(method: str) -> str:
    return _WITNESSES.get(method, method)
