"""How carts serve combines: one visit after the other is planned, with its routes.

`visit_choice` chooses the visits. If no cart can come before a tank is full, some of the last
visits are replaced by others that leave time for it, or combines stop where that costs least; see
`stops`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...errors import NoPlan, require, require_one_of
from ..field.field import Field
from ..machines import Cart, Combine
from ..paths import TimedPath
from .cart_motion import CartMotion, Moving
from .cart_plan import FOR_EVER, CartPlan, CartVisit, Failure, Stop, Supply
from .service import PlanSoFar, Retime, Service
from .stops import collect, hold, let_wait, visit_standing
from .surroundings import make_surroundings
from .tanks import EMPTY
from .visit_choice import LEAST, STRATEGIES, Attempt, FreeCart, Outlook, choose_visits
from .windows import drive_beside

# Part of a cart's accelerations that plans use: what is driven and logged differs a little.
PLANNED = 0.97
# Departures of a cart that are tried in turn, relative to the time when it has its grain [s].
LEAVING = (0.0, 10.0, -10.0, 25.0, -25.0)
# A combine that waits this long does so because carts have no way to it, not just other work [s].
LONG = 300.0
# Least speed at which a cart joins a combine and leaves it [m/s].
SLOWEST = 0.5
# The most of the last visits that are given up, one more each time, if no cart could come in time.
MOST_BACK = 9
# No combine may wait until this long after the tank was full; plans are compared up to then [s].
WELL_AFTER = 400.0
# The most combines that are then served first.
MOST_FIRST = 3
# If none of that is enough, waits are tried in this many of the plans that went furthest.
MOST_TRIED = 5
# Limits of the visits planned in place of others: for each visit so far, at least, and at most;
# and how many of them a wait counts for, as it takes that long to plan.
OTHERS_A_VISIT, FEWEST_OTHERS, MOST_OTHERS, WAITING = 40, 160, 1000, 8
# What is done if no cart can come in time.
VISITS = ("revised", "greedy")


@dataclass
class _Past:
    """Earlier plans, to which planning can return.

    Attributes:
        plans: The plan before each visit.
        most_others: How many visits may be planned in place of others.
        others: How many have been so far.
        unrevised: The plan when first no cart could come in time, and the plans before it.
    """

    plans: list[PlanSoFar]
    most_others: int
    others: int = 0
    unrevised: tuple[PlanSoFar, list[PlanSoFar]] | None = None

    def may_try(self, service: Service) -> bool:
        """Whether more may be planned; the limit grows so that late visits are revised too."""
        so_far = max(FEWEST_OTHERS, OTHERS_A_VISIT * len(service.visits))
        return self.others < min(so_far, self.most_others)


class _Tried(NamedTuple):
    """A plan up to where a combine would have to wait.

    Attributes:
        full: When its tank is full [s].
        plan: What is planned.
        before: Plans before each visit of it.
    """

    full: float
    plan: PlanSoFar
    before: list[PlanSoFar]


def serve_combines(
    ground: Field,
    combines: Sequence[Combine],
    cart: Cart,
    plans: Sequence[TimedPath],
    swaths: Sequence[np.ndarray],
    supply: Supply,
    retime: Retime,
    strategy: str = "sequential",
    threshold: float = 0.5,
    failure: Failure | None = None,
    progress: Callable[[float], None] = lambda share: None,
    visits: str = "revised",
) -> CartPlan:
    """Plan all visits, trips and routes.

    Args:
        ground: The field.
        combines: The N combines, of one size.
        cart: One of the equal carts.
        plans: Of all combines, without waits for carts.
        swaths: Lines that carts may follow in the field, points of each (n, 2) [m].
        supply: Crop and trucks.
        retime: Computes the times of the plans again when combines stop.
        strategy: "sequential": each cart serves its own combines in a fixed turn; "on-demand": a
            free cart goes where a tank is filled to the threshold first.
        threshold: Part of a tank from which on carts come, unless that is too late.
        failure: Of a cart; it is not anticipated before it happens.
        progress: Called now and then with the part of the grain accounted for, in [0, 1].
        visits: "revised": if no cart can come to a combine in time, some of the last visits are
            replaced by others, so that none waits, or all wait least; "greedy": it waits.

    Raises:
        InvalidInput: The only cart fails.
        NoPlan: A cart can never get to a combine or to its truck.
    """
    require_one_of("strategy", strategy, STRATEGIES)
    require_one_of("visits", visits, VISITS)
    require(0.0 < threshold <= 1.0, "threshold", "be in (0, 1]", threshold)
    if failure is not None:
        count = len(supply.trucks)
        require(0 <= failure.cart < count, "failing_cart", f"be below {count}", failure.cart)
        require(count > 1, "carts", "be at least 2 where one fails", count)
    careful = replace(
        cart,
        acceleration=PLANNED * cart.acceleration,
        lateral_acceleration=PLANNED * cart.lateral_acceleration,
    )
    world = make_surroundings(ground, combines, careful, swaths, supply, list(plans))
    best: tuple[Service, int] | None = None
    fault: NoPlan | None = None
    past = _Past([], 0)
    # If combines wait in spite of all, a plan with fewer revised visits, or none, may be better.
    for most_others in (MOST_OTHERS, FEWEST_OTHERS, 0) if visits == "revised" else (0,):
        if most_others == FEWEST_OTHERS > past.others:
            # It would be the same plan.
            continue
        service = Service(ground, world, retime, strategy, threshold)
        before: list[PlanSoFar] = []
        if past.unrevised is not None:
            plan, before = past.unrevised
            service.restore(plan)
        past = _Past(before, most_others)
        longest = np.inf if best is None else best[0].trouble
        try:
            _serve_all(service, past, progress, longest)
        except NoPlan as error:
            fault = error
            continue
        if service.trouble < longest:
            best = service, most_others
        if not service.stops:
            break
    if best is None:
        assert fault is not None
        raise fault
    service, most_others = best
    if failure is not None:
        _fail(service, failure)
        _serve_all(service, _Past([], most_others), progress)
    return service.result()


def _serve_all(
    service: Service, past: _Past, progress: Callable[[float], None], longest: float = np.inf
) -> None:
    """Serve until no grain is left, or stops cost at least `longest` [s].

    Raises:
        NoPlan: It would never end, or a cart finds no way.
    """
    seen: set[tuple[object, ...]] = set()
    for _ in range(_most_rounds(service)):
        service.make_room()
        if all(t.full_at() == np.inf and t.left <= EMPTY for t in service.tanks):
            break
        progress(sum(visit.taken for visit in service.visits) / service.grain())
        now = (*service.turns, *service.visits, *service.stops)
        if now in seen:
            # What followed from this state was given up again, and would be for ever.
            raise _endless(service)
        seen.add(now)
        past.plans.append(service.kept())
        missed = _serve_in_windows(service)
        if missed is None:
            continue
        full = service.tanks[missed].full_at()
        if full < np.inf:
            past.unrevised = past.unrevised or (service.kept(), past.plans[:-1])
            _revise(service, past, missed, full)
            if service.trouble >= longest:
                return
        else:
            collect(service)
    else:
        raise _endless(service)
    service.empty_carts([cart for cart in service.carts if service.load(cart) > 0.0])
    progress(1.0)


def _most_rounds(service: Service) -> int:
    """How many visits there may be, with those that are given up and planned again."""
    tanks = service.grain() / service.least_tank
    return 40 + 10 * len(service.tanks) + int(3 * tanks / LEAST / 2)


def _endless(service: Service) -> NoPlan:
    left = service.grain() - sum(visit.taken for visit in service.visits)
    return NoPlan(
        f"`carts` must take all grain; {left:.0f} kg would be left, for combines that stop "
        "undo what others have stopped for"
    )


def _serve_in_windows(
    service: Service, only: int | None = None, *, hurries: bool = False
) -> int | None:
    """Plan the next visit; return the combine that has to wait if there is none, else None.

    Args:
        only: The only combine that is served; None: any.
        hurries: Whether a cart comes as early as is useful.
    """
    free = []
    for cart in service.carts:
        if cart != service.failed:
            stands = service.standing(cart)
            node = int(service.world.nodes_near(stands.pose[None])[0])
            room, serves = service.room(cart), _served_by(service, cart)
            serves = [n for n in serves if only is None or n == only]
            free.append(FreeCart(cart, node, stands.since, room, serves, service.turns[cart]))
    outlook = Outlook(
        service.world.team,
        service.density,
        service.tanks,
        service.world.beginnings,
        free,
        service.world.arrivals,
        service.strategy,
        service.threshold,
        hurries,
    )
    for choice in choose_visits(outlook):
        if not isinstance(choice, Attempt):
            return choice
        if _visit(service, choice):
            service.turns[choice.cart] = choice.combine + 1
            return None
    raise AssertionError("the last choice is who has to wait")


def _served_by(service: Service, cart: int) -> list[int]:
    combines, carts = len(service.tanks), len(service.jobs)
    if service.strategy == "on-demand" or service.failed >= 0:
        return list(range(combines))
    return [n for n in range(combines) if n % carts == cart or n == cart % combines]


def _visit(service: Service, choice: Attempt) -> bool:
    """Plan the way there, beside the combine and off again; commit it if all three exist."""
    cart, number, window, begin = choice
    lane, closes = service.world.windows[window].lane, service.world.windows[window].end
    stands = service.standing(cart)
    others = service.other_carts(
        cart, max(stands.since, begin - service.world.planner.longest - 5.0)
    )
    tank, plan, room = service.tanks[number], service.world.plans[number], service.room(cart)
    pour = tank.pour(begin, closes, room)
    if pour.end - begin < 4.0:
        return False
    beside_it = drive_beside(plan, lane, begin, closes)
    start = Moving(begin, float(beside_it.speeds[0]))
    if start.speed < SLOWEST:
        return False
    to = service.world.planner.route_to(stands, beside_it.path.poses[0], start, others)
    if to is None:
        return False
    for later in LEAVING:
        end = min(pour.end + later, closes)
        if end <= begin + 4.0:
            continue
        taken = tank.pour(begin, end, room)
        if taken.taken < 0.5 * pour.taken:
            continue
        timed = drive_beside(plan, lane, begin, end)
        if timed.speeds[-1] < SLOWEST:
            continue
        stay = CartMotion(timed, service.cart, to.last_angle)
        if not service.keeps_off(stay, service.world.combines) or not service.keeps_off(
            stay, others
        ):
            continue
        visit = CartVisit(cart, number, begin, taken.end, taken.taken)
        leaves = Moving(end, float(timed.speeds[-1]))
        if service.leave([to, stay], leaves, visit, others, None):
            return True
    return False


def _let_wait(service: Service, number: int, full: float) -> None:
    """Let a combine wait for a cart; others are served meanwhile if that makes all wait less.

    Args:
        number: Of the combine.
        full: When its tank is full [s].

    Raises:
        NoPlan: No cart gets to it.
    """
    before = service.kept()
    let_wait(service, number, full)
    stop = _last_stop(service, number)
    if stop.duration < LONG:
        return
    # Total wait of the others that are full before it has been served, if they wait until then.
    served = _last_visit(service, number).end
    others = sum(max(served - tank.full_at(), 0.0) for tank in service.tanks)
    if others == 0.0:
        return
    after = service.kept()
    service.restore(before)
    try:
        held = _serve_meanwhile(service, stop._replace(duration=FOR_EVER))
    except NoPlan:
        held = False
    if not held or _last_stop(service, number).duration - stop.duration >= others:
        service.restore(after)


def _serve_meanwhile(service: Service, stop: Stop) -> bool:
    """Serve others while a combine stands, until a cart gets to it before another tank is full."""
    if not hold(service, stop):
        return False
    while True:
        kept = service.kept()
        if visit_standing(service, stop.combine, stop):
            begins = _last_visit(service, stop.combine).begin
            if min(tank.full_at() for tank in service.tanks) >= begins:
                return True
        service.restore(kept)
        visits = len(service.visits)
        service.make_room()
        missed = _serve_in_windows(service)
        if missed is not None:
            full = service.tanks[missed].full_at()
            if full == np.inf:
                return False
            let_wait(service, missed, full)
        if len(service.visits) <= visits:
            # One stop undoes the visit that another is for: this would never end.
            return False


def _last_visit(service: Service, number: int) -> CartVisit:
    visits = (visit for visit in service.visits if visit.combine == number)
    return max(visits, key=lambda visit: visit.begin)


def _last_stop(service: Service, number: int) -> Stop:
    return max(stop for stop in service.stops if stop.combine == number)


def _revise(service: Service, past: _Past, number: int, full: float) -> None:
    """Do what is best for a combine that no cart can reach before its tank is full.

    Some of the last visits are given up, so that no combine waits until WELL_AFTER after this tank
    is full. If one has to wait nevertheless, the plan with the least waits is taken: one in which
    this combine waits, or, with visits given up, one in which another that is full later waits.

    Args:
        number: Of the combine.
        full: When its tank is full [s].

    Raises:
        NoPlan: No cart gets to the combines that wait, whatever is given up.
    """
    now, until = _Tried(full, past.plans[-1], past.plans[:-1]), full + WELL_AFTER
    others = _serve_earlier(service, past, number, until)
    if others is not None:
        others.sort(key=lambda each: -each.full)
        _wait_least(service, past, [now, *others[:MOST_TRIED]], until)


def _serve_earlier(service: Service, past: _Past, number: int, until: float) -> list[_Tried] | None:
    """Give up some of the last visits, one more each time, and serve a combine first.

    Args:
        number: Of the combine.
        until: All tanks are to have room until then [s].

    Returns:
        None if they have, and no combine waits; else the plans tried, up to where one would wait.
    """
    history = past.plans
    tried: list[_Tried] = []
    for back in range(1, min(MOST_BACK, len(history) - 1) + 1):
        first = [number]
        while len(first) <= MOST_FIRST and past.may_try(service):
            service.restore(history[-1 - back])
            past.plans = history[: -1 - back]
            try:
                missed = _go_on(service, past, first, until)
            except NoPlan:
                break
            if missed is None:
                return None
            tried.append(_Tried(service.tanks[missed].full_at(), service.kept(), past.plans))
            if missed in first:
                break
            # Another combine would wait now: both are served before the rest.
            first = [*first, missed]
    return tried


def _wait_least(service: Service, past: _Past, tried: Sequence[_Tried], until: float) -> None:
    """Let combines wait, in that one of some plans in which waits cost least.

    Args:
        tried: The plans; the first one is always tried, and of equal ones the earlier is taken.
        until: Up to when they are compared [s].

    Raises:
        NoPlan: In none of them carts get to the combines that wait.
    """
    found: tuple[PlanSoFar, list[PlanSoFar]] | None = None
    least, fault = np.inf, None
    for k, each in enumerate(tried):
        if k > 0 and not past.may_try(service):
            break
        service.restore(each.plan)
        past.plans = list(each.before)
        try:
            _go_on(service, past, [], until, least)
        except NoPlan as error:
            fault = fault or error
            continue
        if service.trouble < least:
            least, found = service.trouble, (service.kept(), past.plans)
    if found is None:
        assert fault is not None
        raise fault
    plan, past.plans = found
    service.restore(plan)


def _go_on(
    service: Service, past: _Past, first: list[int], until: float, longest: float | None = None
) -> int | None:
    """Plan visits, first one to each of some combines, until all tanks have room at a time.

    Of these combines all but the last are served as early as is useful.

    Args:
        first: Numbers of the combines that come first.
        until: The time [s].
        longest: Combines that no cart can reach in time wait, until stops cost this much; None:
            planning ends as soon as one would have to wait [s].

    Returns:
        The combine that would have to wait; None if none has to.

    Raises:
        NoPlan: One that comes first cannot be served in time, or no cart gets to one that waits.
    """
    coming = list(first)
    while coming or min(tank.full_at() for tank in service.tanks) <= until:
        past.others += 1
        past.plans.append(service.kept())
        only, hurries = (coming[0] if coming else None), len(coming) > 1
        missed = _serve_in_windows(service, only, hurries=hurries)
        if missed is not None:
            if coming:
                raise NoPlan(f"`carts` must come to combine {missed} in time")
            if longest is None:
                return missed
            past.others += WAITING
            _let_wait(service, missed, service.tanks[missed].full_at())
            if service.trouble >= longest:
                break
        coming = coming[1:]
        service.make_room()
    return None


def _fail(service: Service, failure: Failure) -> None:
    """Give up all that has not begun when a cart fails; the cart serves no combine any more.

    What has begun, and the stops of combines, stay as they are: so what is driven until then
    is the same with and without the failure.
    """
    service.settled, service.failed = failure.time, failure.cart
    service.jobs = [[job for job in jobs if job.begin < service.settled] for jobs in service.jobs]
    service.fill_tanks()
