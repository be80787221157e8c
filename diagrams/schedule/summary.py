"""A schedule as JSON takes it: what holds, by how much, and what to change."""

import math
from dataclasses import dataclass, replace

from ...systems.numerics.harvest.schedule.answer import (
    CartSchedule,
    ScheduleAnswer,
    drawn_timetable,
    first_loads,
    first_visits,
)
from ...systems.numerics.harvest.schedule.best_visits import (
    best_visits,
    can_keep_up,
    travel_time_limit,
)
from ...systems.numerics.harvest.schedule.carts import find_remedies
from ...systems.numerics.harvest.schedule.closed_forms import (
    EqualCombines,
    combines_max,
    travel_time_max,
)
from ...systems.numerics.harvest.schedule.fleet import MOST, Fleet, Round, line_of
from ...systems.numerics.harvest.schedule.limits import first_to_overflow
from ...systems.numerics.harvest.schedule.periodic_plan import Aim, plan_round
from ...systems.numerics.harvest.schedule.simulation import can_stand

# A constraint this near to the tightest one binds as well.
_TIE = 1e-9
# Of a tank or a period, what is a rounding of nothing.
_NOTHING = 1e-9


@dataclass(frozen=True)
class Constraint:
    """One condition of a schedule.

    Attributes:
        name: The input that it bounds.
        slack: How much is left, in the unit below [-]; negative: not met.
        unit: Of the slack.
        part: The slack as a part of the bound, by which constraints compare.
        says: The condition in words.
    """

    name: str
    slack: float
    unit: str
    part: float
    says: str


def summarise_schedule(
    answer: ScheduleAnswer,
    carts: int,
    travel_time: float | None = None,
    fill: float = 1.0,
    jitter: float | None = None,
) -> dict[str, object]:
    """Everything that `sightfield schedule --json` prints; numbers that are infinite are null.

    Args:
        answer: The schedule.
        carts: How many there are.
        travel_time: Between neighbours, if it is one and the same [s].
        fill: Part of each tank that was asked for.
        jitter: Part of each time, that was asked for.
    """
    fleet = answer.fleet
    travel_time_max = travel_limit(answer, travel_time) if travel_time is not None else None
    limits = constraints(answer, travel_time, travel_time_max)
    waits: list[float | None] = [None] * fleet.size
    served: list[float | None] = [None] * fleet.size
    for cart in answer.carts:
        if cart.plan is not None:
            for combine, visit in first_visits(cart.plan.round.combines).items():
                load, full = cart.plan.loads_at_start[visit], fleet.capacities[combine]
                waits[combine] = _unless_nothing(cart.plan.waits[visit], cart.plan.period)
                served[combine] = _unless_nothing(load, full)
    loads = None
    if answer.feasible:
        first = first_loads(fleet, drawn_timetable(answer, 1))
        loads = [*map(_unless_nothing, first, fleet.capacities)]
    rates = {*zip(fleet.fill_rates, fleet.unload_rates, strict=True)}
    return {
        "feasible": answer.feasible,
        "reasons": list(answer.reasons),
        "certificate": _certificate(answer),
        "combines": fleet.size,
        "combines_max": combines_max(*min(rates)) if len(rates) == 1 else None,
        "carts_used": len(answer.carts),
        "travel_time": travel_time,
        "travel_time_max": _finite(travel_time_max),
        "travel_scale_max": _finite(answer.travel_scale),
        "period": max(plan.period for plan in answer.plans) if answer.feasible else None,
        "period_min": _finite(max(cart.period_min for cart in answer.carts)),
        "waiting_times": waits if answer.feasible else None,
        "loads_at_start": loads,
        "loads_when_served": served if answer.feasible else None,
        "binding": binding(answer, limits, fill, jitter),
        "constraints": {
            limit.name: {
                "slack": _finite(limit.slack),
                "unit": limit.unit,
                "part": _finite(limit.part),
                "says": limit.says,
            }
            for limit in limits
        },
        "jitter": _finite(min(cart.jitter for cart in answer.carts)) if answer.feasible else None,
        "jitter_max": _finite(answer.jitter_max) if answer.jitter_max >= 0 else None,
        "remedies": None
        if answer.feasible
        else _remedies(answer, carts, travel_time, fill, jitter),
        "carts": [_cart_object(answer, cart) for cart in answer.carts],
    }


def travel_limit(answer: ScheduleAnswer, travel_time: float) -> float:
    """The largest equal time between neighbours [s], with the same split if that is not the worse.

    Ways by a truck stay as they are, and so does the split then. Negative: not even no time would
    do. Infinite where no cart drives from combine to combine.

    Args:
        answer: The schedule.
        travel_time: Between neighbours in it [s].
    """
    fleet = replace(answer.fleet, travel_times=line_of((1.0,) * (answer.fleet.size - 1)))
    kinds = {*zip(fleet.capacities, fleet.fill_rates, fleet.unload_rates, strict=True)}
    if len(kinds) == len(answer.carts) == 1 and answer.truck is None:
        # Beyond N_max this says how far, where a programme only says that there is nothing.
        return travel_time_max(EqualCombines(fleet.size, *kinds.pop(), 0.0))
    limits = [
        best_visits(fleet, cart.group.order, None, cart.group.carts).scale
        if answer.truck is None
        else travel_time_limit(fleet, cart.round)
        for cart in answer.carts
    ]
    if answer.truck is None and travel_time > 0:
        limits = [max(min(limits), travel_time * answer.travel_scale)]
    # Adding zero takes the sign off a zero.
    return min(limits) + 0.0


def constraints(
    answer: ScheduleAnswer, travel_time: float | None, travel_time_max: float | None
) -> list[Constraint]:
    """The conditions of all carts, each for the cart that has least left.

    Args:
        answer: The schedule.
        travel_time: Between neighbours, if it is one and the same [s].
        travel_time_max: Its limit, then [s].
    """
    fleet = answer.fleet
    share = max(cart.unloading_share(fleet) for cart in answer.carts)
    scale = answer.travel_scale
    # What part of its limit the driving takes; no driving at all takes none.
    part = 1.0 - 1.0 / scale if scale > 0 else -math.inf
    found = [
        Constraint("unload_rate", 1.0 - share, "", 1.0 - share, "unloading leaves time to drive")
    ]
    if travel_time is None or travel_time_max is None:
        says = "driving takes so long that no tank overflows"
        found.append(Constraint("travel_time", scale - 1.0, "of all ways", part, says))
    else:
        says = "travel time is at most its limit"
        slack = travel_time_max - travel_time
        found.append(Constraint("travel_time", slack, "s", part, says))
    if answer.truck is not None:
        room = answer.truck.cart_capacity
        needed = max(_least_trip(answer, cart) for cart in answer.carts)
        left = room - needed
        says = "the cart holds the grain of one trip"
        found.append(Constraint("cart_capacity", left, "kg", left / room, says))
    return found


def binding(
    answer: ScheduleAnswer, limits: list[Constraint], fill: float, jitter: float | None
) -> list[str]:
    """The constraints that are not met or, if all are, those that leave least.

    Args:
        answer: The schedule.
        limits: Its constraints.
        fill: Part of each tank that was asked for.
        jitter: Part of each time, that was asked for.
    """
    if answer.feasible:
        least = min(limit.part for limit in limits)
        return [limit.name for limit in limits if limit.part <= least + _TIE]
    missed = [limit.name for limit in limits if limit.part < 0]
    if missed:
        return missed
    return ["jitter" if jitter is not None else "fill"] if fill < 1 or jitter is not None else []


def _least_trip(answer: ScheduleAnswer, cart: CartSchedule) -> float:
    """Grain of the largest trip of a cart that never waits [kg]; without a plan none fits."""
    round_ = cart.round
    early = plan_round(answer.fleet, round_, aim=Aim.EARLY)
    if early is None:
        room = min(1e3 * _all_tanks(answer), MOST)
        unbounded = answer.truck and replace(answer.truck, cart_capacity=room)
        early = plan_round(answer.fleet, replace(round_, truck=unbounded), aim=Aim.EARLY)
    if early is None:
        return math.inf
    return max(
        math.fsum(early.taken[i] for i in round_.block(visit))
        for visit in range(round_.size)
        if round_.trips[visit]
    )


def _all_tanks(answer: ScheduleAnswer) -> float:
    return math.fsum(answer.fleet.capacities)


def _remedies(
    answer: ScheduleAnswer,
    carts: int,
    travel_time: float | None,
    fill: float,
    jitter: float | None,
) -> dict[str, object]:
    """What to change, each by itself; null: no change of that input will do."""
    fleet = answer.fleet

    def serves(fleet: Fleet, round_: Round) -> bool:
        if jitter is not None:
            return can_stand(fleet, round_, jitter)
        return (
            plan_round(fleet, round_, fill) is not None if fill < 1 else can_keep_up(fleet, round_)
        )

    remedies = find_remedies(fleet, carts, answer.truck, serves)
    values = {
        "travel_time": None if travel_time is None else {travel_time},
        "capacity": set(fleet.capacities),
        "fill_rate": set(fleet.fill_rates),
        "unload_rate": set(fleet.unload_rates),
    }
    if answer.truck is not None:
        values["cart_capacity"] = {answer.truck.cart_capacity}
        values["truck_travel_time"] = {answer.truck.travel_time}
    changes: dict[str, object] = {
        "combines": remedies.combines,
        "carts": remedies.carts or None,
    }
    if not remedies.carts:
        # Up to one for each combine were tried.
        changes["carts_more_than"] = max(fleet.size, carts, remedies.carts_bound - 1)
    for name, factor in remedies.factors.items():
        if not 0 < factor < math.inf:
            changes[name] = None
            continue
        present = values[name]
        # One number for all of them; for unlike combines the factor says it.
        value = factor * min(present) if present is not None and len(present) == 1 else None
        changes[name] = {"factor": factor, "value": value}
    return changes


def _cart_object(answer: ScheduleAnswer, cart: CartSchedule) -> dict[str, object]:
    plan = cart.plan
    visits: list[dict[str, object]] = []
    for i in range(plan.round.size if plan is not None else 0):
        assert plan is not None
        visits.append(
            {
                "combine": plan.round.combines[i],
                "start_unloading": plan.starts[i],
                "emptied": plan.emptied[i],
                "leave": plan.leaves[i],
                "load_at_start": _unless_nothing(
                    plan.loads_at_start[i], answer.fleet.capacities[plan.round.combines[i]]
                ),
                "taken": plan.taken[i],
                "by_truck": plan.round.trips[i],
            }
        )
    return {
        "combines": list(cart.group.order),
        "travel_scale_max": _finite(cart.group.travel_scale),
        "first_to_overflow": list(first_to_overflow(answer.fleet, cart.round)),
        "period": None if plan is None else plan.period,
        "phase": cart.phase,
        "jitter": _finite(cart.jitter) if plan is not None else None,
        "visits": visits,
    }


def _certificate(answer: ScheduleAnswer) -> dict[str, object] | None:
    said = answer.certificate
    if said is None:
        return None
    return {
        "resource": said.resource,
        "travel_scale_max": said.limit,
        "holds": said.holds.value,
        "says": said.says,
    }


def _unless_nothing(value: float, whole: float) -> float:
    """A number, or zero where it is but a rounding of what there is."""
    return 0.0 if abs(value) <= _NOTHING * whole else value


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
