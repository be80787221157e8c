"""How carts serve combines: every visit with its ways, and the stops that combines make for it.

Visits are planned one after the other, as `visit_choice` chooses them, each with a route to the
combine, a time beside it and a route to where nobody ever comes and a way leads on. Where no cart
can come before a tank is full, the combine stops where a cart gets to it: first it stands for ever,
a cart's way to it is found among all others, who go on or wait for it, and then it stands for as
long as that took. What was planned before and is not possible any more is planned again.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np

from ...errors import require
from ..field.field import Field
from ..field.yield_map import mean_density
from ..machines.cart import Cart
from ..machines.combine import Combine
from ..machines.trucks import TruckPool
from ..no_plan import NoPlan
from ..paths.timed_path import TimedPath
from .cart_motion import CartMotion, join_motions, standing_motion
from .cart_plan import CartPlan, CartVisit, Failure, Job, Supply, Trip
from .cut_times import GAP, opens_along
from .profile import Moving
from .routes import Standing
from .standing_places import is_in_reach, standing_poses
from .stops import FOR_EVER, Stop, retime_alone
from .surroundings import SAME, CartSurroundings, changed_surroundings, make_surroundings
from .tanks import Pour, make_tanks
from .traffic import SAMPLE, Traffic, cart_traffic, least_gaps
from .visit_choice import EMPTY, LEAST, STRATEGIES, Attempt, FreeCart, Outlook, choose_visits
from .windows import BETWEEN, drive_beside

# Part of a cart's accelerations that is planned with: what is driven and logged differs a little.
PLANNED = 0.97
# When a cart leaves: as soon as all is out, or later if it cannot, or sooner [s].
LEAVING = (0.0, 10.0, -10.0, 25.0, -25.0)
# Least speed at which a cart joins a combine and leaves it [m/s].
SLOWEST = 0.5
# How long before a stop a cart sets out, and how long after it does if it could not [s].
SET_OUT = (-200.0, -60.0, 0.0, 120.0, 360.0, 900.0, 2000.0, 5000.0)
# How many places for a stop, or beside a combine that stands, are tried.
PLACES_TRIED = 8
# Of places beside a combine that stands, so many are looked at together.
TOGETHER = 12
# What comes so long after a stop is of no account while a way to it is looked for [s].
AHEAD = 1500.0
# So many of the last visits are given up, one more each time, where nobody could come in time.
MOST_BACK = 6
# What takes their place has to let nobody wait for so long after that; or at least for so long [s].
WELL_AFTER, SOON_AFTER = 400.0, 60.0
# How many visits are planned in all in place of such ones.
MOST_OTHER = 60
# What is done where nobody can come in time.
VISITS = ("revised", "greedy")

# Times plans again when combines stop; a stop that lasts FOR_EVER ends what comes after it.
Retime = Callable[[Sequence[Stop]], list[TimedPath]]


class _TooLate(Exception):
    """What has begun would have to be given up."""


class _Plan(NamedTuple):
    """What is planned so far, and the world that it is planned in."""

    world: CartSurroundings
    jobs: list[list[Job]]
    stops: list[Stop]
    turns: list[int]


def serve_combines(
    ground: Field,
    combines: Sequence[Combine],
    cart: Cart,
    plans: Sequence[TimedPath],
    swaths: Sequence[np.ndarray],
    supply: Supply,
    retime: Retime | None = None,
    strategy: str = "sequential",
    threshold: float = 0.5,
    failure: Failure | None = None,
    progress: Callable[[float], None] = lambda share: None,
    visits: str = "revised",
) -> CartPlan:
    """Plan all visits, trips and routes.

    Args:
        ground: The field.
        combines: They, N of one size.
        cart: One of the equal carts.
        plans: Of all combines, without waits for carts.
        swaths: Lines that carts may follow in the field, points of each (n, 2) [m].
        supply: Crop and trucks.
        retime: Times plans again when combines stop; without it a stop delays nobody else.
        strategy: "sequential": each cart serves its own combines in a fixed turn; "on-demand": a
            free cart goes where a tank is filled to the threshold first.
        threshold: Part of a tank from which on carts come, unless that is too late.
        failure: Of a cart, which nobody knows of before it happens.
        progress: Told now and then which part of the grain is accounted for, in [0, 1].
        visits: "revised": where nobody can come to a combine in time, some of the last visits are
            given up for others that leave time for it; "greedy": it waits.

    Raises:
        InvalidInput: The only cart fails.
        NoPlan: A cart can never get to a combine or to its truck.
    """
    require(strategy in STRATEGIES, "strategy", f"be one of {', '.join(STRATEGIES)}", strategy)
    require(visits in VISITS, "visits", f"be one of {', '.join(VISITS)}", visits)
    require(0.0 < threshold <= 1.0, "threshold", "be in (0, 1]", threshold)
    if failure is not None:
        count = len(supply.trucks)
        require(0 <= failure.cart < count, "failing_cart", f"be below {count}", failure.cart)
        require(count > 1, "carts", "be at least 2 where one fails", count)
    again = retime or retime_alone(plans, [combine.acceleration for combine in combines])
    careful = replace(
        cart,
        acceleration=PLANNED * cart.acceleration,
        lateral_acceleration=PLANNED * cart.lateral_acceleration,
    )
    world = make_surroundings(ground, combines, careful, swaths, supply.trucks, list(plans))
    services: list[_Service] = []
    faults: list[NoPlan] = []
    # Greedy visits, too, where revised ones are not enough: the better plan is taken.
    for most_other in (MOST_OTHER, 0) if visits == "revised" else (0,):
        service = _Service(ground, world, supply, again, strategy, threshold, progress)
        service.most_other = most_other
        try:
            service.run()
        except NoPlan as fault:
            faults.append(fault)
        else:
            services.append(service)
            if not service.stops:
                break
    if not services:
        raise faults[-1]
    service = min(services, key=lambda each: sum(stop.duration for stop in each.stops))
    if failure is not None:
        service.fail(failure)
        service.run()
    return service.result()


class _Service:
    """The visits planned so far, and the world that they are planned in."""

    def __init__(
        self,
        field: Field,
        world: CartSurroundings,
        supply: Supply,
        retime: Retime,
        strategy: str,
        threshold: float,
        progress: Callable[[float], None],
    ) -> None:
        self.field, self.supply, self.retime = field, supply, retime
        self.density = mean_density(supply.density, field.polygon)
        self.strategy, self.threshold, self.progress = strategy, threshold, progress
        self.world, self.cart = world, world.cart
        capacities = [combine.capacity for combine in world.team]
        self.least_tank, self.largest_tank = min(capacities), max(capacities)
        self.jobs: list[list[Job]] = [[] for _ in supply.trucks]
        self.stops: list[Stop] = []
        self.begins = [standing_motion(self.cart, pose, 0.0) for pose in supply.trucks]
        self.turns = [0] * len(supply.trucks)
        # Before each of the visits since the last stop; how many were planned in place of others.
        self.history: list[_Plan] = []
        self.others, self.most_other = 0, MOST_OTHER
        # Nothing that begins before this is changed any more; a cart that has failed.
        self.settled, self.failed = -np.inf, -1
        self._fill_tanks()

    def _fill_tanks(self) -> None:
        """Account for what is cut and what the visits take."""
        ends = [plan.end for plan in self.world.plans]
        self.tanks = make_tanks(self.world.team, self.world.cut, self.supply.density, ends)
        for visit in self.visits:
            self.tanks[visit.combine].take(Pour(visit.begin, visit.end, visit.taken))

    @property
    def carts(self) -> range:
        """Their numbers."""
        return range(len(self.jobs))

    @property
    def visits(self) -> list[CartVisit]:
        """All that are planned."""
        return [job.visit for jobs in self.jobs for job in jobs if job.visit]

    def run(self) -> None:
        """Serve until nothing is left.

        Raises:
            NoPlan: There is no end of it, or a cart finds no way.
        """
        seen: set[tuple[object, ...]] = set()
        self.history, self.others = [], 0
        for _ in range(self._most_rounds()):
            self._make_room()
            if all(t.full_at() == np.inf and t.left <= EMPTY for t in self.tanks):
                break
            self.progress(sum(visit.taken for visit in self.visits) / self._grain())
            now = (*self.turns, *self.visits, *self.stops)
            if now in seen:
                # What follows from it was given up again, and would be for ever.
                raise self._endless()
            seen.add(now)
            self.history.append(self._kept())
            missed = self._serve_in_windows()
            if missed is None:
                continue
            full = self.tanks[missed].full_at()
            if full < np.inf:
                if not self._come_earlier(missed, full):
                    self._stop(missed, full)
                    self.history = []
            else:
                self._collect()
        else:
            raise self._endless()
        self._empty_carts(0.0)
        self.progress(1.0)

    def _endless(self) -> NoPlan:
        left = self._grain() - sum(visit.taken for visit in self.visits)
        return NoPlan(
            f"`carts` must take all grain; {left:.0f} kg would be left, for combines that stop "
            "undo what others have stopped for"
        )

    def fail(self, failure: Failure) -> None:
        """Give up all that has not begun when a cart fails; it serves nobody any more.

        What has begun, and the stops of combines, stay as they are: so what is driven until then
        is the same with and without the failure.
        """
        self.settled, self.failed = failure.time, failure.cart
        self.jobs = [[job for job in jobs if job.begin < self.settled] for jobs in self.jobs]
        self._fill_tanks()

    def _grain(self) -> float:
        return sum(float(tank.cut[-1]) for tank in self.tanks)

    def _most_rounds(self) -> int:
        """How many visits there may be, with those that are given up and planned again."""
        tanks = self._grain() / self.least_tank
        return 40 + 10 * len(self.tanks) + int(3 * tanks / LEAST / 2)

    # What carts are at.

    def _standing(self, cart: int) -> Standing:
        if not self.jobs[cart]:
            return Standing(self.begins[cart].last_pose, 0.0, max(self.settled, 0.0))
        last = self.jobs[cart][-1]
        since = max(last.end, self.settled)
        return Standing(last.motion.last_pose, last.motion.last_angle, since)

    def _load(self, cart: int) -> float:
        load = 0.0
        for job in self.jobs[cart]:
            load += job.visit.taken if job.visit else 0.0
            load = 0.0 if job.trip else load
        return load

    def _room(self, cart: int) -> float:
        return self.cart.capacity - self._load(cart)

    def _others(self, cart: int, begin: float) -> Traffic:
        """All other carts from a moment on."""
        begin = max(math.floor(begin / SAMPLE) * SAMPLE, 0.0)
        motions = []
        for k, jobs in enumerate(self.jobs):
            if k != cart:
                before = [self.begins[k], *(job.motion for job in jobs)]
                done = sum(job.end < begin for job in jobs)
                motions.append(before[done:])
        return cart_traffic(self.cart, motions, len(self.tanks), begin)

    # Visits in windows.

    def _make_room(self) -> None:
        """Send carts to their trucks that are too full for another visit."""
        if any(self._room(cart) < LEAST * self.largest_tank for cart in self.carts):
            self._empty_carts(self.cart.capacity - self.largest_tank)

    def _come_earlier(self, number: int, full: float) -> bool:
        """Serve a combine, which nobody can come to in time any more, instead of others before.

        The last visits are given up, one more each time; the combine is served first, then the
        others as usual, until so long after its tank was full that the plan is a better one.

        Args:
            number: Of the combine.
            full: When its tank is full [s].

        Returns:
            Whether there is such a plan now.
        """
        kept, history = self._kept(), self.history
        furthest, found = full + SOON_AFTER, None
        for back in range(2, min(MOST_BACK + 1, len(history)) + 1):
            first = [number]
            while self.others < self.most_other and furthest < np.inf:
                self._restore(history[-back])
                self.history = history[: 1 - back]
                reached, missed = self._reach(first, full + WELL_AFTER)
                if reached > furthest:
                    furthest, found = reached, (self._kept(), self.history)
                if missed in first or reached > full + SOON_AFTER:
                    break
                # Now another one waits: both come before the rest.
                first = [*first, missed]
        plan, self.history = found or (kept, history)
        self._restore(plan)
        return found is not None

    def _reach(self, first: list[int], until: float) -> tuple[float, int]:
        """Plan visits, one to some combines each first, until all tanks have room at a time.

        Args:
            first: Numbers of the combines.
            until: The time [s].

        Returns:
            When a combine has to wait before that, and which; infinite if none has to [s].
        """
        coming = list(first)
        while coming or min(tank.full_at() for tank in self.tanks) <= until:
            self.others += 1
            missed = self._serve_in_windows(coming[0] if coming else None)
            if missed is not None:
                return (-np.inf if coming else self.tanks[missed].full_at()), missed
            coming = coming[1:]
            try:
                self._make_room()
            except NoPlan:
                return -np.inf, first[0]
            self.history.append(self._kept())
        return np.inf, first[0]

    def _serve_in_windows(self, only: int | None = None) -> int | None:
        """Plan the visit that comes next; the number of a combine that has to wait if none can.

        Args:
            only: The only combine that is served; None: any.
        """
        free = []
        for cart in self.carts:
            if cart != self.failed:
                stands = self._standing(cart)
                node = int(self.world.nodes_near(stands.pose[None])[0])
                room, serves = self._room(cart), self._served_by(cart)
                serves = [n for n in serves if only is None or n == only]
                free.append(FreeCart(cart, node, stands.since, room, serves, self.turns[cart]))
        outlook = Outlook(
            self.world.team,
            self.density,
            self.tanks,
            self.world.beginnings,
            free,
            self.world.arrivals,
            self.strategy,
            self.threshold,
        )
        for choice in choose_visits(outlook):
            if not isinstance(choice, Attempt):
                return choice
            if self._visit(choice):
                self.turns[choice.cart] = choice.combine + 1
                return None
        raise AssertionError("the last choice is who has to wait")

    def _served_by(self, cart: int) -> list[int]:
        combines, carts = len(self.tanks), len(self.jobs)
        if self.strategy == "on-demand" or self.failed >= 0:
            return list(range(combines))
        return [n for n in range(combines) if n % carts == cart or n == cart % combines]

    def _visit(self, choice: Attempt) -> bool:
        """Plan the way there, beside the combine and off again; commit it if all three exist."""
        cart, number, window, begin = choice
        lane, closes = self.world.windows[window].lane, self.world.windows[window].end
        stands = self._standing(cart)
        others = self._others(cart, max(stands.since, begin - self.world.planner.longest - 5.0))
        tank, plan, room = self.tanks[number], self.world.plans[number], self._room(cart)
        pour = tank.pour(begin, closes, room)
        if pour.end - begin < 4.0:
            return False
        beside_it = drive_beside(plan, lane, begin, closes)
        start = Moving(begin, float(beside_it.speeds[0]))
        if start.speed < SLOWEST:
            return False
        to = self.world.planner.route_to(stands, beside_it.path.poses[0], start, others)
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
            stay = CartMotion(timed, self.cart, to.last_angle)
            if not self._keeps_off(stay, self.world.combines) or not self._keeps_off(stay, others):
                continue
            visit = CartVisit(cart, number, begin, taken.end, taken.taken)
            leaves = Moving(end, float(timed.speeds[-1]))
            if self._leave([to, stay], leaves, visit, others, None):
                return True
        return False

    def _leave(
        self,
        motions: list[CartMotion],
        leaves: Moving,
        visit: CartVisit,
        others: Traffic,
        stop: Stop | None,
    ) -> bool:
        """Find the way off, to the truck if it is time, and commit all."""
        cart = visit.cart
        load = self._load(cart) + visit.taken
        goals = [None]
        if self.cart.capacity - load < self.largest_tank:
            goals = [self.supply.trucks[cart], None]
        stay = motions[-1]
        for goal in goals:
            off = self.world.planner.route_from(
                stay.last_pose, stay.last_angle, leaves, others, goal
            )
            if off is None:
                continue
            self.tanks[visit.combine].take(Pour(visit.begin, visit.end, visit.taken))
            end = off.timed.end
            trip = None
            if goal is not None:
                trip = self._trip(cart, end, load)
            self.jobs[cart].append(Job(join_motions([*motions, off]), visit, trip, stop))
            return True
        return False

    # Trucks.

    def _empty_carts(self, most: float) -> None:
        """Send carts to their trucks that hold more than they should; idle ones make way."""
        waiting = [cart for cart in self.carts if self._load(cart) > most]
        # Trucks take from carts in the order in which these come.
        waiting.sort(key=lambda cart: self._standing(cart).since)
        idle = [cart for cart in self.carts if cart not in waiting]
        while waiting:
            gone = [cart for cart in waiting if self._to_truck(cart)]
            waiting = [cart for cart in waiting if cart not in gone]
            if waiting and not gone:
                gone = [cart for cart in idle if self._to_truck(cart)]
                idle = []
                if not gone:
                    stands = np.round(self._standing(waiting[0]).pose[:2], 1).tolist()
                    raise NoPlan(f"`carts` must find ways to their trucks; got none from {stands}")

    def _to_truck(self, cart: int) -> bool:
        """Drive to the truck, now or when the way is free; whether there is a way."""
        stands, load = self._standing(cart), self._load(cart)
        others = self._others(cart, stands.since)
        goal = self.supply.trucks[cart]
        for begin in self._begins(stands.since):
            start = Moving(begin, 0.0)
            off = self.world.planner.route_from(stands.pose, stands.beta, start, others, goal)
            if off is not None:
                end = off.timed.end
                trip = self._trip(cart, end, load) if load > 0 else None
                self.jobs[cart].append(Job(off, None, trip, None))
                return True
        return False

    def _trip(self, cart: int, begin: float, load: float) -> Trip:
        """A cart's time at a truck, after all that is settled with trucks."""
        trips = [job.trip for jobs in self.jobs for job in jobs if job.trip]
        settled = [filling for trip in trips for filling in trip.fillings]
        pool = TruckPool(self.supply.truck_fleet, settled)
        fillings = pool.empty(begin, load, self.supply.truck_rate)
        end = fillings[-1].end if fillings else begin
        return Trip(cart, begin, end, load, tuple(fillings))

    def _begins(self, first: float) -> list[float]:
        """Moments at which to set out, until all machines have come to stand."""
        ends = [job.end for jobs in self.jobs for job in jobs[-1:]]
        end = max(first, *ends, *(plan.end for plan in self.world.plans))
        later = [first + wait - SET_OUT[0] for wait in SET_OUT]
        return [*(moment for moment in later if moment <= end), end]

    # Combines that stand.

    def _collect(self) -> None:
        """Fetch what is left in a tank when its combine has done its work."""
        plans = self.world.plans
        numbers = [n for n, tank in enumerate(self.tanks) if tank.left > EMPTY]
        numbers.sort(key=lambda n: plans[n].end)
        for number in numbers:
            if self._visit_standing(number, None):
                return
        poses = [np.round(plans[n].path.poses[-1, :2], 1).tolist() for n in numbers]
        raise NoPlan(f"`carts` must find ways to where combines park; got none to {poses[0]}")

    def _stop(self, number: int, full: float) -> None:
        """Let a combine wait: at the last place before its tank is full that a cart gets to."""
        plan = self.world.plans[number]
        served = max((v.end for v in self.visits if v.combine == number), default=0.0)
        soonest = max(served, self.settled) + 4.0
        found: list[float] = []
        for ready, apart in ((True, 14.0), (False, 60.0)):
            for time in np.arange(full - 4.0, soonest, -5.0).tolist():
                if len(found) < PLACES_TRIED and all(abs(time - t) >= apart for t in found):
                    by_then = time if ready else np.inf
                    if len(standing_poses(self.world, plan.pose_at(time), by_then)):
                        found.append(time)
        # Rather not where that undoes what another combine stops for.
        kept = self._kept()
        latest = max([0.0, *(self._standing(cart).since for cart in self.carts)])
        for ahead, gentle in product((AHEAD, np.inf), (True, False) if self.stops else (False,)):
            for time in found or [max(full - 4.0, self.settled + 4.0, 0.0)]:
                stop = Stop(number, float(plan.station_at(time)), FOR_EVER)
                self.stops.append(stop)
                if (
                    self._see(max(time, latest) + ahead)
                    and self._visit_standing(number, stop)
                    and (not gentle or len(self.stops) > len(kept.stops))
                ):
                    return
                self._restore(kept)
        raise NoPlan(
            f"`carts` must find ways to combines that wait; got none to combine {number} near "
            f"{np.round(plan.pose_at(full)[:2], 1).tolist()}"
        )

    def _kept(self) -> _Plan:
        """What is planned, to come back to."""
        jobs = [[*jobs] for jobs in self.jobs]
        return _Plan(self.world, jobs, [*self.stops], [*self.turns])

    def _restore(self, kept: _Plan) -> None:
        """Come back to what was planned."""
        self.world, self.stops, self.turns = kept.world, [*kept.stops], [*kept.turns]
        self.jobs = [[*jobs] for jobs in kept.jobs]
        self._fill_tanks()

    def _visit_standing(self, number: int, stop: Stop | None) -> bool:
        """Serve a combine that stands at the end of its plan, where it waits, or has parked."""
        spent: list[np.ndarray] = []
        for _ in range(PLACES_TRIED):
            found = self._come_to(number, spent)
            if found is None:
                return False
            cart, to = found
            stands = self.world.plans[number]
            bent = np.append(to.last_pose, to.last_angle)
            if not is_in_reach(self.world.size, self.cart, stands.pose_at(stands.end), bent):
                spent.append(to.last_pose)
                continue
            begin = max(to.timed.end, stands.end) + 1.0
            pour = self.tanks[number].pour(begin, np.inf, self._room(cart))
            visit = CartVisit(cart, number, begin, pour.end, pour.taken)
            motions = [to, standing_motion(self.cart, to.last_pose, begin, to.last_angle)]
            leaves = Moving(pour.end + 1.0, 0.0)
            if stop is None:
                others = self._others(cart, self._standing(cart).since)
                if self._leave(motions, leaves, visit, others, None):
                    return True
            elif self._leave_stop(motions, leaves, visit, stop):
                return True
            spent.append(to.last_pose)
        return False

    def _leave_stop(
        self, motions: list[CartMotion], leaves: Moving, visit: CartVisit, stop: Stop
    ) -> bool:
        """Let a combine go on when it is empty, or later, so that the cart finds a way off."""
        cart, kept = visit.cart, self._kept()
        stands_from = self.world.plans[visit.combine].end
        others = self._others(cart, self._standing(cart).since)
        stay = motions[-1]
        for turn in range(3):
            time = leaves.time + (1.0, 30.0)[min(turn, 1)]
            if turn == 2:
                # At worst it goes on when the cart has gone.
                first = self.world.planner.route_from(
                    stay.last_pose, stay.last_angle, leaves, others, None
                )
                if first is None:
                    return False
                time = first.timed.end + 2.0
            final = stop._replace(duration=time - stands_from)
            self.stops = [final if each is stop else each for each in self.stops]
            others = self._others(cart, self._standing(cart).since)
            same = self._see() and len(self.jobs[cart]) == len(kept.jobs[cart])
            if same and final in self.stops:
                others = self._others(cart, self._standing(cart).since)
                if self._leave(motions, leaves, visit, others, final):
                    return True
            self._restore(kept)
        return False

    def _come_to(self, number: int, spent: list[np.ndarray]) -> tuple[int, CartMotion] | None:
        """Who comes first to a combine that stands, and how.

        Args:
            number: Of the combine.
            spent: Poses that were tried in vain.
        """
        stands_from = self.world.plans[number].end
        pose = self.world.plans[number].pose_at(stands_from)
        planner = self.world.planner
        best: tuple[int, CartMotion] | None = None
        for cart in self._by_distance(pose):
            stands = self._standing(cart)
            others = self._others(cart, stands.since)
            places = standing_poses(self.world, pose, np.inf, others)
            for each in spent:
                places = places[np.hypot(*(places - each)[:, :2].T) > 0.1]
            by_then = max(stands.since, stands_from)
            for first in range(0, len(places), TOGETHER):
                likely = planner.with_ways_out(places[first : first + TOGETHER], by_then)
                if len(likely):
                    break
            else:
                continue
            for begin in self._begins(max(stands.since, stands_from + SET_OUT[0])):
                if best is not None and begin >= best[1].timed.end:
                    break
                start = Moving(begin, 0.0)
                to = planner.route_from(stands.pose, stands.beta, start, others, likely)
                if to is not None and to.timed.end < self.world.until - 1.0:
                    if best is None or to.timed.end < best[1].timed.end:
                        best = cart, to
                    break
        return best

    def _by_distance(self, pose: np.ndarray) -> list[int]:
        """Carts, the one that can be at a pose first foremost."""

        def there(cart: int) -> float:
            stands = self._standing(cart)
            return stands.since + float(np.hypot(*(stands.pose - pose)[:2])) / self.cart.speed

        carts = [k for k in range(len(self.jobs)) if self._room(k) > 0 and k != self.failed]
        return sorted(carts, key=there)

    # The world with its stops.

    def _see(self, until: float = np.inf) -> bool:
        """Look at the world with its stops, and give up what has become impossible.

        Args:
            until: Nothing that combines do later is looked at [s].

        Returns:
            Whether nothing that has begun would be undone.
        """
        try:
            while True:
                stops, before = len(self.stops), self.world.plans
                plans = self.retime(self.stops)
                self.world, since = changed_surroundings(
                    self.world, self.field, self.supply.trucks, plans, until
                )
                self._give_up_impossible(before, since)
                if len(self.stops) == stops:
                    break
                # Stops for what was given up are not needed any more.
        except _TooLate:
            return False
        self._fill_tanks()
        return True

    def _give_up_impossible(self, before: list[TimedPath], since: float) -> None:
        """Give up jobs that combines are in the way of, or that are beside where none is now."""
        given_up = False
        for cart, jobs in enumerate(self.jobs):
            for number, job in enumerate(jobs):
                if job.end > since and not self._is_possible(job, before):
                    self._give_up(cart, number)
                    given_up = True
                    break
        # Carts that stand where they were longer may be in the way of others.
        while given_up:
            given_up = False
            for cart, jobs in enumerate(self.jobs):
                for number, job in enumerate(jobs):
                    if job.end > since and not self._keeps_off(
                        job.motion, self._others(cart, job.begin), 0.0
                    ):
                        self._give_up(cart, number)
                        given_up = True
                        break

    def _give_up(self, cart: int, number: int) -> None:
        if self.jobs[cart][number].begin < self.settled:
            raise _TooLate
        lost = {job.stop for job in self.jobs[cart][number:] if job.stop}
        self.jobs[cart] = self.jobs[cart][:number]
        self.stops = [stop for stop in self.stops if stop not in lost]

    def _is_possible(self, job: Job, before: list[TimedPath]) -> bool:
        if job.visit:
            times = np.linspace(job.visit.begin, job.visit.end, 9)
            old, new = (
                plans[job.visit.combine].station_at(times) for plans in (before, self.world.plans)
            )
            if np.abs(old - new).max() > SAME:
                return False
        timed = job.motion.timed
        times = np.arange(timed.times[0], timed.end + 1.0, 1.0)
        tractor, trailer = job.motion.poses_at(times)
        planner = self.world.planner
        opens = np.maximum(
            opens_along(self.world.ground, planner.boxes[0], tractor),
            opens_along(self.world.ground, planner.boxes[1], trailer),
        )
        ends = np.array([job.motion.last_pose])
        return bool((opens <= times).all()) and (
            self._keeps_off(job.motion, self.world.combines, 0.0)
            and bool(planner.is_free_for_ever(ends, job.end)[0])
        )

    def _keeps_off(self, motion: CartMotion, others: Traffic, more: float = BETWEEN) -> bool:
        times = np.arange(motion.timed.times[0], motion.timed.end + 0.5, 0.5)
        tractor, trailer = motion.poses_at(times)
        gaps = least_gaps(others, self.world.planner.boxes, tractor, trailer, times)
        return bool((gaps >= GAP + more).all())

    def result(self) -> CartPlan:
        """What was planned."""
        jobs = [job for each in self.jobs for job in each]
        return CartPlan(
            self.world.plans,
            [
                join_motions([start, *(job.motion for job in each)])
                for start, each in zip(self.begins, self.jobs, strict=True)
            ],
            sorted(self.visits, key=lambda visit: visit.begin),
            sorted((job.trip for job in jobs if job.trip), key=lambda trip: trip.begin),
            list(self.stops),
            sum(tank.left for tank in self.tanks) + sum(map(self._load, self.carts)),
        )
