"""How much later than planned ways and emptyings may end without a tank running over."""

import math

from scipy.optimize import root_scalar

from ...errors import require_non_negative
from .fleet import Fleet
from .periodic_plan import Aim, PeriodicPlan, plan_round
from .rounds import Round

_STEPS = 40


def jitter_limit(fleet: Fleet, round_: Round) -> float:
    """The largest j with which a cart that never waits lets no tank run over.

    Each way and each emptying may take up to 1 + j times as long as planned, each by itself. The
    loads grow with each of these times, so that the worst is that all take as long as they can:
    combine n then needs the part s_n = x / (1 + x) of the period, x = (1 + j) r_f / (r_u - r_f).
    No sequential strategy stands more. Negative: there is no schedule even without jitter;
    infinite for one combine. For rounds without a truck.
    """
    driving = math.fsum(round_.travel_times)
    numbers = round_.combines

    def margin(factor: float) -> float:
        """Least room in a tank, as a part of it, times 1 - sum s_n, which may be negative."""
        shares = [factor * fleet.fill_rates[n] / fleet.net_rate(n) for n in numbers]
        shares = [share / (1.0 + share) for share in shares]
        spare = 1.0 - math.fsum(shares)
        return min(
            spare - factor * driving * (1.0 - share) / fleet.filling_time(n)
            for n, share in zip(numbers, shares, strict=True)
        )

    if len(numbers) == 1 and driving == 0:
        return math.inf
    # At factor 0 every tank has all its room; at the factor that no tank's others allow, none.
    high = 1.0
    while margin(high) > 0:
        high *= 2.0
    answer = root_scalar(margin, bracket=(0.0, high), xtol=1e-14, rtol=1e-14)
    return float(answer.root) - 1.0


def plan_jitter(plan: PeriodicPlan) -> float:
    """A j with which a plan's timetable certainly lets no tank run over.

    The cart never leaves before the plan; from where it was last on time it may be 1 + j times
    as slow. For each combine and each such place in between, what remains of its filling time
    C / r_f must allow that, with every emptying as long as that of a full tank. Exact where the
    place before is the one that counts, as in the thesis's plan, which stands no jitter at all:
    its tanks are full to the brim when the cart comes. For trips, the cart must hold the grain
    of full tanks.
    """
    fleet, round_ = plan.fleet, plan.round
    size, truck = round_.size, round_.truck
    if set(round_.combines) == {round_.combines[0]} and truck is None:
        return math.inf
    emptying = [fleet.capacities[n] / fleet.net_rate(n) for n in round_.combines]
    factor = _factor_of_room(plan, emptying)
    for visit in range(size):
        combine = round_.combines[visit]
        slowed, fixed = 0.0, 0.0
        for back in range(1, round_.previous(visit) + 1):
            place = (visit - back) % size
            slowed += round_.travel_times[place]
            if truck is not None and round_.trips[place]:
                fixed += truck.stop_time + truck.cart_capacity / truck.unload_rate
            # From the previous leaving of this combine to the planned leaving of `place`.
            passed = _since(plan, place, (visit - round_.previous(visit)) % size)
            room = fleet.filling_time(combine) - passed - fixed
            if slowed > 0:
                factor = min(factor, room / slowed)
            slowed += emptying[place]
    return max(factor - 1.0, 0.0)


def plan_for_jitter(fleet: Fleet, round_: Round, jitter: float) -> PeriodicPlan | None:
    """The plan of the longest period that certainly stands a jitter; None: there is none."""
    require_non_negative("jitter", jitter)
    wanted = jitter * (1.0 - 1e-9) - 1e-12

    def stands(plan: PeriodicPlan | None) -> bool:
        return plan is not None and plan_jitter(plan) >= wanted

    full = plan_round(fleet, round_)
    if full is None or stands(full):
        return full
    best = plan_round(fleet, round_, aim=Aim.EARLY)
    if best is None or not stands(best):
        return None
    low = max(
        load / fleet.capacities[n]
        for n, load in zip(round_.combines, best.loads_at_start, strict=True)
    )
    high = 1.0
    for _ in range(_STEPS):
        middle = (low + high) / 2
        plan = plan_round(fleet, round_, fill=middle)
        if plan is not None and stands(plan):
            low, best = middle, plan
        else:
            high = middle
    return best


def _since(plan: PeriodicPlan, place: int, origin: int) -> float:
    """Time from leaving at visit `origin` to leaving at visit `place`, within one round [s]."""
    passed = plan.leaves[place] - plan.leaves[origin]
    return passed if passed >= 0 else passed + plan.period


def _factor_of_room(plan: PeriodicPlan, emptying: list[float]) -> float:
    """The largest factor on emptyings with which the cart holds full tanks until each trip."""
    round_, fleet = plan.round, plan.fleet
    if round_.truck is None:
        return math.inf
    factor = math.inf
    for visit in range(round_.size):
        if not round_.trips[visit]:
            continue
        block = round_.block(visit)
        tanks = math.fsum(fleet.capacities[round_.combines[i]] for i in block)
        during = math.fsum(fleet.fill_rates[round_.combines[i]] * emptying[i] for i in block)
        waits = math.fsum(
            fleet.fill_rates[round_.combines[i]] * (plan.leaves[i] - plan.starts[i]) for i in block
        )
        # Each stay is the planned one or an emptying, whichever is longer; here both.
        factor = min(factor, (round_.truck.cart_capacity - tanks - waits) / during)
    return factor
