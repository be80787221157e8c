"""The first round as the thesis draws it (Zhang 2014, Figures 3.4 to 3.6)."""

import math
from collections.abc import Sequence

from .answer import ScheduleAnswer
from .fleet import Fleet
from .periodic_plan import PeriodicPlan
from .rounds import Round
from .simulation import CartRun, simulate_schedule
from .timetable import Timetable


def drawn_timetable(answer: ScheduleAnswer, cycles: int) -> Timetable:
    """Rounds in which each cart finds its first combine as the plan says at its phase.

    Its other combines began, with empty tanks, when it set out for the first one. Carts without
    a plan never wait, and start beside a full tank; some tank will run over.

    Args:
        answer: The schedule.
        cycles: Number of rounds.
    """
    begins = [0.0] * answer.fleet.size
    runs: list[CartRun] = []
    for cart in answer.carts:
        if cart.phase == 0.0 or cart.round.carts == 1:
            # Of carts that share combines the first one finds them so.
            for combine, begin in _begins(answer.fleet, cart.round, cart.plan).items():
                begins[combine] = cart.phase + begin
        runs.append(CartRun(round=cart.round, first_start=cart.phase, plan=cart.plan))
    return simulate_schedule(answer.fleet, runs, cycles, start_times=begins)


def first_loads(fleet: Fleet, timetable: Timetable) -> tuple[float, ...]:
    """The load of each combine in the first visit to it: C, C'_1, ..., C'_(N-2), C, (N,) [kg]."""
    loads = [math.nan] * fleet.size
    for visit in reversed(timetable.visits):
        loads[visit.combine] = visit.load_at_start
    return tuple(loads)


def first_visits(combines: Sequence[int]) -> dict[int, int]:
    """The first visit of a round to each combine: combine to number of the visit."""
    return {combine: visit for visit, combine in reversed(list(enumerate(combines)))}


def _begins(fleet: Fleet, round_: Round, plan: PeriodicPlan | None) -> dict[int, float]:
    """When each combine of a round begins to cut, relative to the first start of unloading [s]."""
    first = round_.combines[0]
    load = fleet.capacities[first] if plan is None else plan.loads_at_start[0]
    way = round_.travel_times[-1] if plan is None else plan.period - plan.leaves[-1]
    return {n: -load / fleet.fill_rates[n] if n == first else -way for n in round_.combines}
