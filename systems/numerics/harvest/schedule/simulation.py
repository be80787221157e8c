"""What a cart's round does to the tanks, event by event, and how late it may be.

Between events each load is linear: a combine that works fills its tank, a cart beside it empties
the tank and then takes over what is cut. A full tank runs over, and what runs over is counted.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from heapq import heapify, heappop, heappush

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import root_scalar

from ...errors import require, require_non_negative
from .fleet import Fleet, Round, require_count, way_by_truck
from .limits import last_factor
from .periodic_plan import Aim, LoadLine, PeriodicPlan, Timetable, Visit, plan_round

# Part of a tank that rounding may put above its capacity.
_ROUNDING = 1e-9

Matrix = NDArray[np.float64]

# Bisection steps for a plan's fill; most rounds until the worst case has settled.
_STEPS, _ROUNDS = 40, 10_000
# A plan that tolerates times longer by this factor tolerates any.
_ALWAYS = 1e9


@dataclass(frozen=True)
class CartRun:
    """What one cart is told to do.

    Attributes:
        round: The visits that it repeats.
        first_start: When it is beside the first combine [s].
        plan: The cart neither starts to unload nor leaves before this plan does; none: it starts
            when it comes and leaves when the tank is empty. It never leaves more in a tank than the
            plan does, with two exceptions: it is full, and then drives by the truck at once; or it
            needs the room for what the plan takes before the next trip, as otherwise a little more
            here would mean a little less there, more and more so from round to round.
        travel_factors: Factor by which each way takes longer than planned; one number or one for
            each visit of the whole run, repeated as needed.
        unload_factors: The same for emptying a tank, whose load falls more slowly by it.
    """

    round: Round
    first_start: float = 0.0
    plan: PeriodicPlan | None = None
    travel_factors: ArrayLike = 1.0
    unload_factors: ArrayLike = 1.0


def simulate_schedule(
    fleet: Fleet,
    runs: CartRun | Sequence[CartRun],
    cycles: int,
    initial_loads: Sequence[float] | None = None,
    start_times: Sequence[float] | None = None,
) -> Timetable:
    """Follow the carts through a number of rounds.

    Args:
        fleet: The combines. One that no cart serves fills and runs over.
        runs: One for each cart; one that comes to a combine beside which another cart stands
            waits until that one has gone.
        cycles: Number of rounds.
        initial_loads: Of the tanks, (N,) [kg]; none: empty.
        start_times: When each combine begins to cut, (N,) [s]; none: at time 0.

    Raises:
        InvalidInput: A value is out of its range.
    """
    require_count("cycles", cycles)
    runs = [runs] if isinstance(runs, CartRun) else list(runs)
    begins = (0.0,) * fleet.size if start_times is None else tuple(start_times)
    loads = (0.0,) * fleet.size if initial_loads is None else tuple(initial_loads)
    for name, values in (("start_times", begins), ("initial_loads", loads)):
        require(len(values) == fleet.size, name, f"have {fleet.size} entries", values)
    for load, capacity in zip(loads, fleet.capacities, strict=True):
        require(0 <= load <= capacity, "initial_loads", "fit into the tanks", load)
    tanks = [_Tank(fleet, n, begins[n], loads[n]) for n in range(fleet.size)]
    carts = [_Cart(run, number, cycles) for number, run in enumerate(runs)]
    # Each visit in its turn, so that carts that share a combine find what the others left.
    waiting = [(cart.next_start(tanks), cart.number) for cart in carts]
    heapify(waiting)
    while waiting:
        start, number = heappop(waiting)
        cart = carts[number]
        if start < cart.next_start(tanks):
            # Another cart is there.
            heappush(waiting, (cart.next_start(tanks), number))
            continue
        cart.visit(tanks)
        if not cart.is_done:
            heappush(waiting, (cart.next_start(tanks), number))
    visits = [visit for cart in carts for visit in cart.visits]
    end = max([*begins, *(visit.leave for visit in visits)])
    for n, tank in enumerate(tanks):
        # Until the first of its carts has made all its rounds, and does not come any more.
        last = [cart.visits[-1].leave for cart in carts if n in cart.run.round.combines]
        tank.fill_until(max(min(last, default=end), tank.time))
    return Timetable(
        visits=tuple(sorted(visits, key=lambda visit: visit.start_unloading)),
        tanks=tuple(tank.line() for tank in tanks),
        carts=tuple(cart.line() for cart in carts),
        lost=tuple(tank.lost for tank in tanks),
        overflows={n: tank.overflow for n, tank in enumerate(tanks) if tank.overflow < math.inf},
    )


class _Tank:
    """Load of one combine's tank, from event to event."""

    def __init__(self, fleet: Fleet, combine: int, begin: float, load: float) -> None:
        self.fleet = fleet
        self.capacity = fleet.capacities[combine]
        self.rate = fleet.fill_rates[combine]
        self.net_rate = fleet.net_rate(combine)
        self.begin, self.time, self.load = begin, begin, load
        self.lost, self.overflow = 0.0, math.inf
        self._points = [(begin, load)]

    def put(self, time: float, load: float) -> None:
        """State the load at a time."""
        self.time, self.load = time, load
        self._points.append((time, load))

    def fill_until(self, time: float) -> None:
        """Let the combine cut until a time, with no cart beside it."""
        load = self.load + self.rate * (time - self.time)
        if load > self.capacity * (1.0 + _ROUNDING):
            self.overflow = min(self.overflow, self.time + (self.capacity - self.load) / self.rate)
            self.lost += load - self.capacity
            self.put(max(self.time, time - (load - self.capacity) / self.rate), self.capacity)
        self.put(time, min(load, self.capacity))

    def line(self) -> LoadLine:
        """The load over time."""
        times, loads = np.array(self._points).T
        return LoadLine(times=times, loads=loads)


class _Cart:
    """One cart on its rounds, from visit to visit."""

    def __init__(self, run: CartRun, number: int, cycles: int) -> None:
        self.run, self.number = run, number
        self._most = cycles * run.round.size
        self._travel_factors = np.atleast_1d(np.asarray(run.travel_factors, dtype=float)).tolist()
        self._unload_factors = np.atleast_1d(np.asarray(run.unload_factors, dtype=float)).tolist()
        truck = run.round.truck
        self._room = math.inf if truck is None else truck.cart_capacity
        self._kept_free = _taken_later(run.round, run.plan)
        self._held, self._time = 0.0, run.first_start
        self._points = [(self._time, self._held)]
        self.visits: list[Visit] = []

    @property
    def is_done(self) -> bool:
        """Whether it has made all its rounds."""
        return len(self.visits) == self._most

    def line(self) -> LoadLine:
        """What it holds over time."""
        times, loads = np.array(self._points).T
        return LoadLine(times=times, loads=loads)

    def next_start(self, tanks: list[_Tank]) -> float:
        """When it can begin to unload next: it is there, nobody else is, and the plan says so."""
        lap, place = divmod(len(self.visits), self.run.round.size)
        tank = tanks[self.run.round.combines[place]]
        start = max(self._time, tank.begin, tank.time)
        if self.run.plan is not None:
            planned = self.run.first_start + lap * self.run.plan.period
            start = max(start, planned + self.run.plan.starts[place])
        return start

    def visit(self, tanks: list[_Tank]) -> None:
        """Unload, wait as the plan says, and drive to the next combine."""
        round_, truck, plan = self.run.round, self.run.round.truck, self.run.plan
        count = len(self.visits)
        lap, place = divmod(count, round_.size)
        tank = tanks[round_.combines[place]]
        start, arrive = self.next_start(tanks), self._time
        planned, left_planned = -math.inf, 0.0
        if plan is not None:
            planned = self.run.first_start + lap * plan.period + plan.leaves[place]
            left_planned = plan.left_over[place]
        tank.fill_until(start)
        load = tank.load
        net = tank.net_rate / self._unload_factors[count % len(self._unload_factors)]
        until_empty = max(load - left_planned, 0.0) / net
        free = max(self._room - self._held - self._kept_free[place], 0.0)
        until_full = free / (net + tank.rate)
        if plan is not None and 0.0 < start + until_empty - planned <= _ROUNDING * plan.period:
            # Where augers deliver little more than combines cut, what rounding adds to a load would
            # make the cart late, which adds more.
            until_empty = max(planned - start, 0.0)
            left_planned = load - net * until_empty
        emptied = start + min(until_empty, until_full)
        left_over = load - net * until_full if until_full < until_empty else min(load, left_planned)
        taken = load - left_over + tank.rate * (emptied - start)
        leave = max(emptied, planned)
        if leave > emptied:
            leave = min(leave, emptied + max(free - taken, 0.0) / tank.rate)
        self._points += [(start, self._held), (emptied, self._held + taken)]
        taken += tank.rate * (leave - emptied)
        self._held += taken
        self._points.append((leave, self._held))
        tank.put(emptied, left_over)
        tank.put(leave, left_over)
        # Full sooner than planned, it drives by the truck, unless nothing more was to be taken.
        full = self._held >= self._room * (1.0 - _ROUNDING)
        full &= plan is None or self._kept_free[place] > _ROUNDING * self._room
        by_truck = truck is not None and (round_.trips[place] or full)
        self.visits.append(
            Visit(
                combine=round_.combines[place],
                arrive=arrive,
                start_unloading=start,
                emptied=emptied,
                leave=leave,
                load_at_start=load,
                taken=taken,
                by_truck=by_truck,
                cart=self.number,
            )
        )
        way = round_.travel_times[place]
        factor = self._travel_factors[count % len(self._travel_factors)]
        if truck is None or not by_truck:
            self._time = leave + factor * way
            return
        if not round_.trips[place]:
            # Sooner than planned.
            there = round_.combines[(place + 1) % round_.size]
            way = way_by_truck(tank.fleet, truck, round_.combines[place], there)
        there = leave + factor * way / 2
        gone = there + truck.stop_time + self._held / truck.unload_rate
        self._points += [(there, self._held), (gone, 0.0)]
        self._held, self._time = 0.0, gone + factor * way / 2


def _taken_later(round_: Round, plan: PeriodicPlan | None) -> list[float]:
    """What a plan takes after each visit before the cart drives by the truck, (V,) [kg]."""
    later = [0.0] * round_.size
    if plan is None or round_.truck is None:
        return later
    for trip in (visit for visit in range(round_.size) if round_.trips[visit]):
        taken = 0.0
        for visit in round_.block(trip):
            later[visit] = taken
            taken += plan.taken[visit]
    return later


def plan_timetable(
    plan: PeriodicPlan,
    cycles: int,
    initial_loads: Sequence[float] | None = None,
    start_times: Sequence[float] | None = None,
    ready: float = -math.inf,
) -> Timetable:
    """The timetable of a plan's visits that starts from the loads that tanks have now.

    The first round starts as late as it can without any tank holding more than the plan says; tanks
    with less are emptied sooner, and the cart waits there for longer (t'_n of the thesis). A cart
    that cannot be there in time starts when it is ready, and catches up while the plan has waits.

    Args:
        plan: Which visits, and how far apart.
        cycles: Number of rounds.
        initial_loads: Of the tanks, (N,) [kg]; none: empty.
        start_times: When each combine begins to cut, (N,) [s]; none: one after another by the
            plan's stagger, of which time 0 is the first start of unloading.
        ready: When the cart can be beside the first combine [s].
    """
    run, begins = first_run(plan, initial_loads, start_times, ready)
    return simulate_schedule(plan.fleet, run, cycles, initial_loads, begins)


def first_run(
    plan: PeriodicPlan,
    initial_loads: Sequence[float] | None = None,
    start_times: Sequence[float] | None = None,
    ready: float = -math.inf,
) -> tuple[CartRun, tuple[float, ...]]:
    """The cart's run of `plan_timetable`, and when the combines begin.

    Args:
        plan: The plan.
        initial_loads: Of the tanks, (N,) [kg].
        start_times: When combines begin to cut, (N,) [s].
        ready: When the cart can be beside the first combine [s].

    Raises:
        InvalidInput: A value is out of its range.
    """
    fleet, round_ = plan.fleet, plan.round
    loads = (0.0,) * fleet.size if initial_loads is None else tuple(initial_loads)
    require(len(loads) == fleet.size, "initial_loads", f"have {fleet.size} entries", loads)
    if start_times is None:
        begins = tuple(
            begin + load / rate if math.isfinite(begin) else 0.0
            for begin, load, rate in zip(plan.stagger, loads, fleet.fill_rates, strict=True)
        )
    else:
        begins = tuple(start_times)
    require(len(begins) == fleet.size, "start_times", f"have {fleet.size} entries", begins)
    latest = math.inf
    for visit in range(round_.size):
        combine = round_.combines[visit]
        if combine not in round_.combines[:visit]:
            filling = (plan.loads_at_start[visit] - loads[combine]) / fleet.fill_rates[combine]
            latest = min(latest, begins[combine] + filling - plan.starts[visit])
    return CartRun(round=round_, first_start=max(latest, ready), plan=plan), begins


def jitter_limit(fleet: Fleet, round_: Round) -> float:
    """The largest j with which a cart that never waits lets no tank run over.

    Each way and each emptying may take up to 1 + j times as long as planned, each by itself. The
    loads grow with each of these times, so that the worst is that all take as long as they can:
    combine n then needs the part s_n = x / (1 + x) of the period, x = (1 + j) r_f / (r_u - r_f).
    No sequential strategy tolerates more. Negative: there is no schedule even without jitter;
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
    # At factor 0 every tank has all its room; at a factor that is large enough there is none.
    high = 1.0
    while margin(high) > 0:
        high *= 2.0
    answer = root_scalar(margin, bracket=(0.0, high), xtol=1e-14, rtol=1e-14)
    return float(answer.root) - 1.0


def plan_jitter(plan: PeriodicPlan) -> float:
    """A j with which a plan's timetable certainly lets no tank run over.

    The cart never leaves before the plan does, and takes 1 + j times as long from the place where
    it was last on time. The result is exact if that is the place before, as in the thesis's plan,
    which tolerates no jitter at all: its tanks are full to the brim when the cart comes. It is also
    exact for the shortest period, whose plan tolerates `jitter_limit`. With trips, the cart must
    hold the grain as well. Nothing is certain of carts that share combines, or of tanks that are
    not emptied.
    """
    if _never_late(plan):
        return math.inf
    if plan.round.carts > 1 or any(plan.left_over):
        return 0.0
    low, _ = last_factor(lambda factor: stands_factor(plan, factor), 1.0, 2.0, 1e-10, _ALWAYS)
    # The rounding that is allowed on capacities turns a jitter of zero into a tiny one.
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
    # The loads of the worst case are found by iteration: they rise to it from the planned ones.
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


def can_stand(fleet: Fleet, round_: Round, jitter: float) -> bool:
    """Whether the plan of full tanks of a round, or the earliest, certainly tolerates a jitter.

    Args:
        fleet: The combines.
        round_: The visits.
        jitter: Part of each time [-].
    """
    plans = (plan_round(fleet, round_, aim=aim) for aim in Aim)
    return any(plan is not None and stands_factor(plan, 1.0 + jitter) for plan in plans)


def plan_for_jitter(fleet: Fleet, round_: Round, jitter: float) -> PeriodicPlan | None:
    """The plan of the longest period that certainly tolerates a jitter; None: there is none.

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
    """Whether the cart can hold, until each trip, such loads and what is cut during its stays."""
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
