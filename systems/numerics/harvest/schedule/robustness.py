"""How much later than planned ways and emptyings may end without a tank running over."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root_scalar

from ...errors import require_non_negative
from .bisection import last_factor
from .fleet import Fleet
from .periodic_plan import Aim, PeriodicPlan, plan_round
from .rounds import Round

Matrix = NDArray[np.float64]

# Halvings of the range of a plan's fill; rounds until the worst case has settled; rounding.
_STEPS, _ROUNDS, _ROUNDING = 40, 10_000, 1e-9
# A plan that stands times so many times as long stands any.
_ALWAYS = 1e9


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

    The cart never leaves before the plan, and is 1 + j times as slow from where it was last on
    time. Exact where that is the place before, as in the thesis's plan, which stands no jitter at
    all: its tanks are full to the brim when the cart comes; and for the shortest period, whose
    plan stands `jitter_limit`. For trips, the cart must hold the grain as well. Nothing is certain
    of carts that share combines, or of tanks that are not emptied.
    """
    if _never_late(plan):
        return math.inf
    if plan.round.carts > 1 or any(plan.left_over):
        return 0.0
    low, _ = last_factor(lambda factor: stands_factor(plan, factor), 1.0, 2.0, 1e-10, _ALWAYS)
    # The rounding that capacities are given makes a little of nothing.
    return low - 1.0 if low - 1.0 > 10 * _ROUNDING else 0.0


def stands_factor(plan: PeriodicPlan, factor: float) -> bool:
    """Whether a plan's timetable is certain to hold if times are up to `factor` times as long."""
    if _never_late(plan):
        return True
    if plan.round.carts > 1 or any(plan.left_over):
        return factor <= 1.0
    fleet, round_ = plan.fleet, plan.round
    numbers = list(round_.combines)
    rates = np.array([fleet.fill_rates[n] for n in numbers])
    net = np.array([fleet.net_rate(n) for n in numbers])
    capacities = np.array([fleet.capacities[n] for n in numbers]) * (1.0 + _ROUNDING)
    visits, before, passed, ways = _lateness(plan)
    planned = np.array(plan.loads_at_start)
    loads = planned
    # Least loads that no lateness exceeds, from below: they rise to the worst case.
    for _ in range(_ROUNDS):
        late = passed + factor * (ways + before @ (loads / net))
        worst = planned.copy()
        np.maximum.at(worst, visits, rates[visits] * late)
        if (worst > capacities).any():
            return False
        if (worst - loads <= _ROUNDING * 1e-3 * capacities).all():
            return _has_room(plan, worst, factor)
        loads = worst
    return False


def plan_for_jitter(fleet: Fleet, round_: Round, jitter: float) -> PeriodicPlan | None:
    """The plan of the longest period that certainly stands a jitter; None: there is none.

    Raises:
        InvalidInput: The jitter is negative.
    """
    require_non_negative("jitter", jitter)

    def stands(plan: PeriodicPlan | None) -> bool:
        return plan is not None and stands_factor(plan, 1.0 + jitter)

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


def _never_late(plan: PeriodicPlan) -> bool:
    """Whether the cart stands by one combine and has nowhere else to go."""
    return plan.round.truck is None and len(set(plan.round.combines)) == 1


def _lateness(plan: PeriodicPlan) -> tuple[NDArray[np.int64], Matrix, Matrix, Matrix]:
    """Every place from which the cart may have been late when it comes to a combine.

    Returns:
        One row for each visit and each place since the last one to its combine: the visit, (m,);
        which emptyings lie between, (m, V); the planned time from leaving this combine to leaving
        that place, with stops at the truck from there on, (m,) [s]; and the ways from there on,
        (m,) [s].
    """
    round_, size = plan.round, plan.round.size
    truck = round_.truck
    visits, between, passed, ways = [], [], [], []
    for visit in range(size):
        slow, stops, emptied = 0.0, 0.0, np.zeros(size)
        origin = (visit - round_.previous(visit)) % size
        for back in range(1, round_.previous(visit) + 1):
            place = (visit - back) % size
            slow += round_.travel_times[place]
            if truck is not None and round_.trips[place]:
                stops += truck.stop_time + truck.cart_capacity / truck.unload_rate
            since = plan.leaves[place] - plan.leaves[origin]
            visits.append(visit)
            between.append(emptied.copy())
            passed.append(stops + (since if since >= 0 else since + plan.period))
            ways.append(slow)
            emptied[place] += 1.0
    return np.array(visits), np.array(between), np.array(passed), np.array(ways)


def _has_room(plan: PeriodicPlan, loads: Matrix, factor: float) -> bool:
    """Whether the cart holds until each trip what such loads, and stays beside them, bring."""
    round_, fleet = plan.round, plan.fleet
    if round_.truck is None:
        return True
    grain = [
        loads[i]
        + fleet.fill_rates[n]
        * max(factor * loads[i] / fleet.net_rate(n), plan.leaves[i] - plan.starts[i])
        for i, n in enumerate(round_.combines)
    ]
    room = round_.truck.cart_capacity * (1.0 + _ROUNDING)
    trips = [visit for visit in range(round_.size) if round_.trips[visit]]
    return all(math.fsum(grain[i] for i in round_.block(visit)) <= room for visit in trips)
