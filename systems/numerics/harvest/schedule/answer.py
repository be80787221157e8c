"""Can these carts serve these combines, and what is the plan? All parts put together."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ...errors import require, require_non_negative
from .carts import CartGroup, assign_combines
from .certificate import InfeasibilityCertificate, certify_infeasible
from .fleet import Fleet, Truck
from .limits import best_round, unloading_share
from .periodic_plan import Aim, PeriodicPlan, plan_round
from .robustness import jitter_limit, plan_for_jitter, plan_jitter
from .rounds import Round
from .simulation import CartRun, first_run, simulate_schedule
from .timetable import Timetable


@dataclass(frozen=True)
class CartSchedule:
    """What one cart does.

    Attributes:
        group: Its combines, and what it could do for them at best.
        round: Its visits: one to each combine, if that will do.
        plan: Its times, or None if there are none.
        phase: When its first round starts [s].
        period_min: The shortest period it could keep, that of a cart that never waits [s].
        jitter: What its plan certainly stands, as a part of each time.
        jitter_max: The largest that any cart stands that serves each combine once a round and
            needs no truck; of others what the plan of the shortest period certainly stands; a
            part of each time.
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
        feasible: Whether every cart has a plan, and one that stands the jitter asked for.
        reasons: Why not, one sentence each.
        certificate: What there is too little of if no schedule of full tanks is known either;
            none: there is one.
    """

    fleet: Fleet
    truck: Truck | None
    carts: tuple[CartSchedule, ...]
    feasible: bool
    reasons: tuple[str, ...]
    certificate: InfeasibilityCertificate | None = None

    @property
    def travel_scale(self) -> float:
        """By which factor all driving could be slower; less than 1: there is no schedule."""
        return min(cart.group.travel_scale for cart in self.carts)

    @property
    def jitter_max(self) -> float:
        """The largest jitter that every cart stands if it never waits."""
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

    Carts keep one period where they can (but for plans that stand a jitter), each starts a part
    of it after the one before, so that they come to the truck in turn.

    Args:
        fleet: The combines.
        carts: How many there are at most.
        truck: Where carts of finite capacity unload.
        fill: Part of each tank that is used.
        jitter: Choose that part so that this jitter is certainly stood, as in `plan_jitter`.
        neighbours: Give each cart combines that follow one another.

    Raises:
        InvalidInput: A value is out of its range.
    """
    require(0 < fill <= 1, "fill", "lie above 0 and up to 1", fill)
    require(jitter is None or fill == 1.0, "jitter", "come without fill", jitter)
    if jitter is not None:
        require_non_negative("jitter", jitter)
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
        feasible=feasible,
        reasons=reasons,
        certificate=certificate,
    )


def answer_timetable(
    answer: ScheduleAnswer,
    cycles: int,
    initial_loads: Sequence[float] | None = None,
    start_times: Sequence[float] | None = None,
    ready: float = -math.inf,
) -> Timetable:
    """The timetable of all carts, as `plan_timetable` makes that of one.

    Without start times each combine begins by its cart's plan, and that at the cart's phase.

    Args:
        answer: The schedule.
        cycles: Number of rounds.
        initial_loads: Of the tanks, (N,) [kg].
        start_times: When combines begin to cut, (N,) [s].
        ready: When the carts are, at the earliest [s].

    Raises:
        InvalidInput: A value is out of its range.
    """
    require(answer.feasible, "answer", "be feasible", "; ".join(answer.reasons))
    runs: list[CartRun] = []
    begins = [0.0] * answer.fleet.size if start_times is None else list(start_times)
    first_of: dict[int, CartRun] = {}
    for cart in answer.carts:
        assert cart.plan is not None
        leader = first_of.get(id(cart.group))
        if leader is not None:
            runs.append(replace(leader, first_start=leader.first_start + cart.phase))
            continue
        run, of_cart = first_run(cart.plan, initial_loads, start_times, ready)
        if start_times is None:
            run = replace(run, first_start=run.first_start + cart.phase)
            for combine in cart.group.order:
                begins[combine] = of_cart[combine] + cart.phase
        first_of[id(cart.group)] = run
        runs.append(run)
    return simulate_schedule(answer.fleet, runs, cycles, initial_loads, begins)


def _plan_cart(
    fleet: Fleet, group: CartGroup, truck: Truck | None, fill: float, jitter: float | None
) -> CartSchedule:
    """The plan of one cart by itself: with one visit to each combine a round, if that will do."""
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
    """The period of a cart that never waits; none at all where it need not drive."""
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
    """The same carts, each by an equal part of its period after the one before."""
    turn = []
    for k, cart in enumerate(carts):
        assert cart.plan is not None
        sharing = [n for n, other in enumerate(carts) if other.group is cart.group]
        # Those that share combines are as far apart as their round has it.
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
