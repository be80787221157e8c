"""Can these carts serve these combines, how certain is that, and what is the plan?"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

from ...errors import require, require_non_negative
from .best_visits import BestVisits
from .carts import CartGroup, assign_combines, largest_scale
from .fleet import MOST, Fleet, Round, Truck
from .limits import best_round, certain_limit, unloading_share
from .periodic_plan import Aim, PeriodicPlan, Timetable, plan_round
from .simulation import (
    CartRun,
    first_run,
    jitter_limit,
    plan_for_jitter,
    plan_jitter,
    simulate_schedule,
)


class Holds(Enum):
    """Which strategies a certificate holds for."""

    ANY = "whatever carts do"
    ORDERS = "for every order of visits that empty the tanks"
    SEARCHED = "for the visits that were searched"


@dataclass(frozen=True)
class InfeasibilityCertificate:
    """Why there is no schedule: what there is too little of.

    Attributes:
        resource: "unload_rate" (augers are too slow for the carts' time) or "travel_time".
        limit: The largest factor on all ways with which there could be a schedule; 0: none.
        holds: For which strategies.
    """

    resource: str
    limit: float
    holds: Holds

    @property
    def says(self) -> str:
        """The certificate as a sentence."""
        if self.resource == "unload_rate":
            return f"unloading takes more time than the carts have, {self.holds.value}"
        most = (
            "none of their time" if self.limit <= 0 else f"at most {self.limit:.4g} of their time"
        )
        return f"ways would have to take {most}, {self.holds.value}"


def certify_infeasible(
    fleet: Fleet, carts: int, truck: Truck | None, groups: list[BestVisits]
) -> InfeasibilityCertificate:
    """The strongest reason why there is no schedule.

    Args:
        fleet: The combines.
        carts: How many there are.
        truck: Where carts unload, if anywhere.
        groups: What each cart can do at best for its combines.
    """
    limit = certain_limit(fleet, carts, truck)
    if limit == 0.0:
        return InfeasibilityCertificate("unload_rate", 0.0, Holds.ANY)
    if limit < 1.0:
        return InfeasibilityCertificate("travel_time", limit, Holds.ANY)
    if carts == 1 and groups[0].bound <= 1.0:
        return InfeasibilityCertificate("travel_time", groups[0].bound, Holds.ORDERS)
    found = min(group.scale for group in groups)
    return InfeasibilityCertificate(
        "travel_time", max(found, 0.0) if math.isfinite(found) else 0.0, Holds.SEARCHED
    )


@dataclass(frozen=True)
class CartSchedule:
    """What one cart does.

    Attributes:
        group: Its combines, and what it could do for them at best.
        round: Its visits: one to each combine, if that is enough.
        plan: Its times, or None if there are none.
        phase: When its first round starts [s].
        period_min: The shortest period it could keep, that of a cart that never waits [s].
        jitter: Jitter that its plan certainly tolerates, as a part of each time.
        jitter_max: Largest jitter that a cart can tolerate at all, if it serves each combine once a
            round and needs no truck; otherwise what the plan of the shortest period certainly
            tolerates; a part of each time.
    """

    group: CartGroup
    round: Round
    plan: PeriodicPlan | None
    phase: float
    period_min: float
    jitter: float
    jitter_max: float

    def unloading_share(self, fleet: Fleet) -> float:
        """Part of its time that goes into unloading alone; more than 1: too much."""
        return unloading_share(fleet, self.group.order) / self.group.carts


@dataclass(frozen=True)
class ScheduleAnswer:
    """A fleet's schedule.

    Attributes:
        fleet: The combines.
        truck: Where carts unload; none: they hold any amount.
        carts: One entry for each cart that is used.
        travel_scale: Factor by which all driving could be slower, with the groups and visits that
            are best then; less than 1: there is no schedule.
        feasible: Whether every cart has a plan, and one that tolerates the jitter asked for.
        reasons: Why not, one sentence each.
        certificate: What there is too little of, if no schedule of full tanks is known either;
            none: one is known.
    """

    fleet: Fleet
    truck: Truck | None
    carts: tuple[CartSchedule, ...]
    travel_scale: float
    feasible: bool
    reasons: tuple[str, ...]
    certificate: InfeasibilityCertificate | None = None

    @property
    def jitter_max(self) -> float:
        """The largest jitter that every cart tolerates if it never waits."""
        return min(cart.jitter_max for cart in self.carts)

    @property
    def plans(self) -> tuple[PeriodicPlan, ...]:
        """The plan of each cart; only of a schedule that is feasible."""
        return tuple(cart.plan for cart in self.carts if cart.plan is not None)


def answer_schedule(
    fleet: Fleet,
    carts: int = 1,
    truck: Truck | None = None,
    fill: float = 1.0,
    jitter: float | None = None,
    neighbours: bool = False,
) -> ScheduleAnswer:
    """Split the combines among carts, and plan each cart's round.

    All carts keep the same period where they can, except in plans for a jitter. Each starts a part
    of its period after the one before, so that they come to the truck in turn.

    Args:
        fleet: The combines.
        carts: How many there are at most.
        truck: Where carts of finite capacity unload.
        fill: Part of each tank that is used.
        jitter: Choose that part so that this jitter is certainly tolerated, as in `plan_jitter`.
        neighbours: Give each cart combines that follow one another.

    Raises:
        InvalidInput: A value is out of its range.
    """
    require(0 < fill <= 1, "fill", "lie above 0 and up to 1", fill)
    require(jitter is None or fill == 1.0, "jitter", "come without fill", jitter)
    if jitter is not None:
        require_non_negative("jitter", jitter)
        require(jitter <= MOST, "jitter", f"be at most {MOST:g}", jitter)
    groups = assign_combines(fleet, carts, truck, neighbours=neighbours)
    alone = [_plan_cart(fleet, group, truck, fill, jitter) for group in groups]
    # Carts that share combines have one plan.
    plans = [cart for cart in alone for _ in range(cart.group.carts)]
    reasons = tuple(reason for cart in alone for reason in _reasons(fleet, cart, fill, jitter))
    feasible = all(cart.plan is not None for cart in plans)
    if feasible:
        plans = _in_turn(plans if jitter is not None else _in_step(fleet, plans, fill))
    certificate = None
    if min(group.travel_scale for group in groups) < 1.0 - 1e-12:
        bests = [group.best for group in groups]
        certificate = certify_infeasible(fleet, carts, truck, bests)
    return ScheduleAnswer(
        fleet=fleet,
        truck=truck,
        carts=tuple(plans),
        travel_scale=largest_scale(groups, fleet, carts, truck, neighbours=neighbours),
        feasible=feasible,
        reasons=reasons,
        certificate=certificate,
    )


def answer_timetable(answer: ScheduleAnswer, cycles: int) -> Timetable:
    """The timetable of all carts, as `plan_timetable` makes it for one.

    Each combine begins when its cart's plan says, shifted by the cart's phase.

    Args:
        answer: The schedule.
        cycles: Number of rounds.

    Raises:
        InvalidInput: A value is out of its range.
    """
    require(answer.feasible, "answer", "be feasible", "; ".join(answer.reasons))
    runs: list[CartRun] = []
    begins = [0.0] * answer.fleet.size
    first_of: dict[int, CartRun] = {}
    for cart in answer.carts:
        assert cart.plan is not None
        leader = first_of.get(id(cart.group))
        if leader is not None:
            runs.append(replace(leader, first_start=leader.first_start + cart.phase))
            continue
        run, of_cart = first_run(cart.plan)
        run = replace(run, first_start=run.first_start + cart.phase)
        for combine in cart.group.order:
            begins[combine] = of_cart[combine] + cart.phase
        first_of[id(cart.group)] = run
        runs.append(run)
    return simulate_schedule(answer.fleet, runs, cycles, start_times=begins)


def _plan_cart(
    fleet: Fleet, group: CartGroup, truck: Truck | None, fill: float, jitter: float | None
) -> CartSchedule:
    """The plan of one cart by itself: with one visit to each combine a round, if that works."""
    if group.carts > 1:
        return _plan_visits(fleet, group, group.best.round, fill, jitter)
    once, _ = best_round(fleet, group.order, truck)
    plan = _plan_visits(fleet, group, once, fill, jitter)
    if plan.plan is not None or group.best.round == once:
        return plan
    return _plan_visits(fleet, group, group.best.round, fill, jitter)


def _plan_visits(
    fleet: Fleet, group: CartGroup, round_: Round, fill: float, jitter: float | None
) -> CartSchedule:
    early = plan_round(fleet, round_, aim=Aim.EARLY)
    if early is None:
        limit = -1.0
    elif round_.truck is None and round_.carts == 1 and round_.size == len(group.order):
        limit = jitter_limit(fleet, round_)
    else:
        limit = plan_jitter(early)
    if jitter is None:
        plan = plan_round(fleet, round_, fill)
    else:
        plan = plan_for_jitter(fleet, round_, jitter)
    return CartSchedule(
        group=group,
        round=round_,
        plan=plan,
        phase=0.0,
        period_min=_period_min(early),
        jitter=-1.0 if plan is None else plan_jitter(plan),
        jitter_max=limit,
    )


def _period_min(early: PeriodicPlan | None) -> float:
    """The period of a cart that never waits; 0 if it need not drive, infinite without a plan."""
    if early is None:
        return math.inf
    return early.period if any(early.round.travel_times) else 0.0


def _in_step(fleet: Fleet, carts: list[CartSchedule], fill: float) -> list[CartSchedule]:
    """The same carts with one period, the shortest of theirs, if all can keep it."""
    if len(carts) == 1:
        return carts
    period = min(cart.plan.period for cart in carts if cart.plan is not None)
    again = [plan_round(fleet, cart.round, fill, period=period) for cart in carts]
    if any(plan is None for plan in again):
        return carts
    return [
        replace(cart, plan=plan, jitter=plan_jitter(plan))
        for cart, plan in zip(carts, again, strict=True)
        if plan is not None
    ]


def _in_turn(carts: list[CartSchedule]) -> list[CartSchedule]:
    """The same carts, each starting an equal part of its period after the one before."""
    turn = []
    for k, cart in enumerate(carts):
        assert cart.plan is not None
        sharing = [n for n, other in enumerate(carts) if other.group is cart.group]
        # Carts that share combines are evenly spaced in their round.
        part = k / len(carts) if len(sharing) == 1 else sharing.index(k) / len(sharing)
        turn.append(replace(cart, phase=part * cart.plan.period))
    return turn


def _reasons(fleet: Fleet, cart: CartSchedule, fill: float, jitter: float | None) -> list[str]:
    """Why a cart has no plan, in words."""
    if cart.plan is not None:
        return []
    order, round_ = cart.group.order, cart.round
    carts = "one cart" if cart.group.carts == 1 else f"{cart.group.carts} carts"
    who = f"{carts} with {len(order)} combines"
    share = cart.unloading_share(fleet)
    if share > 1.0 + 1e-12:
        return [f"{who}: unloading alone takes {share:.4g} of its time; none is left to drive"]
    if cart.period_min < math.inf and jitter is not None:
        most = f"{cart.jitter_max:.4g} is the limit"
        return [f"{who}: no plan is certain to stand a jitter of {jitter:.4g}; {most}"]
    if cart.period_min < math.inf:
        return [f"{who}: {fill:.4g} of each tank is too little, though full tanks would do"]
    scale = cart.group.travel_scale
    if scale > 0:
        return [f"{who}: driving takes too long; it would have to take {scale:.4g} of its time"]
    what = "the cart's room and its ways by the truck leave" if round_.truck else "unloading leaves"
    return [f"{who}: {what} no time to drive between combines"]


def drawn_timetable(answer: ScheduleAnswer, cycles: int) -> Timetable:
    """Timetable in which each cart, starting at its phase, finds its first combine as planned.

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
            # Of carts that share combines only the first one finds them so.
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
