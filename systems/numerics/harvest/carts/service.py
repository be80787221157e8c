"""What carts have planned so far, the world that they plan in, and their ways to trucks.

A visit has a route to the combine, a time beside it, and a route to the truck or to a place where
no combine ever comes and from which a way leads on. Every plan can be saved and restored. The world
is not saved with it, as it is large and follows from the stops.
"""

import copy
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ...errors import NoPlan
from ..field.field import Field
from ..field.yield_map import mean_density
from ..paths import TimedPath
from ..trucks import TruckPool
from .cart_motion import CartMotion, Moving, join_motions, standing_motion
from .cart_plan import CartPlan, CartVisit, Job, Stop, Trip
from .cut_times import GAP
from .routes import Standing
from .surroundings import CartSurroundings, changed_surroundings, first_difference
from .traffic import SAMPLE, Traffic, cart_traffic, least_gaps
from .visit_choice import LEAST
from .windows import BETWEEN

# When a cart tries to set out, relative to a stop: before it, and after it if it could not [s].
SET_OUT = (-200.0, -60.0, 0.0, 120.0, 360.0, 900.0, 2000.0, 5000.0)

# What a stop costs beside its time: braking, starting again, and a driver who has to mind it [s].
STOPPING = 30.0

# A cart goes to its truck once it has no room for a whole tank, but not before it is filled to this
# part of its capacity.
WORTH_A_TRIP = 0.5

# How many of the worlds used last are kept; others are made again when they are needed.
MOST_WORLDS = 6

# Computes the times of plans again for given stops; nothing follows a stop that lasts FOR_EVER.
Retime = Callable[[Sequence[Stop]], list[TimedPath]]


class PlanSoFar(NamedTuple):
    """A copy of what is planned so far, to be restored; attributes as of `Service`.

    Attributes:
        jobs: Of each cart, in order.
        stops: Of combines.
        turns: Number of the combine that each cart serves next.
        until: What combines do after this time is not known [s].
    """

    jobs: list[list[Job]]
    stops: list[Stop]
    turns: list[int]
    until: float


class Service:
    """The visits planned so far, and the world that they are planned in.

    Args:
        field: The field.
        world: What carts plan among.
        retime: Computes the times of the plans again when combines stop.
        strategy, threshold: In which order combines are served, and from when on; see
            `serve_combines`.

    Attributes:
        world: As it is with the stops so far.
        jobs: Of each cart, in order.
        stops: Of combines.
        turns: Number of the combine that each cart serves next, if they are served in turns.
        tanks: Of all combines, with all visits so far.
        settled: Nothing that begins before this is changed any more [s].
        failed: Number of a cart that has failed, or -1.
    """

    def __init__(
        self,
        field: Field,
        world: CartSurroundings,
        retime: Retime,
        strategy: str,
        threshold: float,
    ) -> None:
        self.field, self.supply, self.retime = field, world.supply, retime
        self.density = mean_density(self.supply.density, field.polygon)
        self.strategy, self.threshold = strategy, threshold
        self.world, self.cart = world, world.cart
        self._worlds: dict[tuple[tuple[Stop, ...], float], CartSurroundings] = {
            ((), world.until): world
        }
        capacities = [combine.capacity for combine in world.team]
        self.least_tank, self.largest_tank = min(capacities), max(capacities)
        self.jobs: list[list[Job]] = [[] for _ in self.supply.trucks]
        self.stops: list[Stop] = []
        self.begins = [standing_motion(self.cart, pose, 0.0) for pose in self.supply.trucks]
        self.turns = [0] * len(self.supply.trucks)
        self.settled, self.failed = -np.inf, -1
        self.fill_tanks()

    def fill_tanks(self) -> None:
        """Compute what tanks hold from what is cut and what all visits take."""
        self.tanks = [copy.copy(tank) for tank in self.world.tanks]
        for visit in self.visits:
            self.tanks[visit.combine].take(visit)

    @property
    def carts(self) -> range:
        """Numbers of the carts."""
        return range(len(self.jobs))

    @property
    def visits(self) -> list[CartVisit]:
        """All that are planned."""
        return [job.visit for jobs in self.jobs for job in jobs if job.visit]

    @property
    def trouble(self) -> float:
        """Cost of all stops for carts: their durations, and STOPPING more for each [s]."""
        return sum(stop.duration + STOPPING for stop in self.stops)

    def grain(self) -> float:
        """All that is cut [kg]."""
        return sum(float(tank.cut[-1]) for tank in self.tanks)

    def standing(self, cart: int) -> Standing:
        """Where a cart stands after all that it has to do so far."""
        if not self.jobs[cart]:
            return Standing(self.begins[cart].last_pose, 0.0, max(self.settled, 0.0))
        last = self.jobs[cart][-1]
        since = max(last.end, self.settled)
        return Standing(last.motion.last_pose, last.motion.last_angle, since)

    def load(self, cart: int) -> float:
        """What a cart holds after all that it has to do so far [kg]."""
        load = 0.0
        for job in self.jobs[cart]:
            load += job.visit.taken if job.visit else 0.0
            load = 0.0 if job.trip else load
        return load

    def room(self, cart: int) -> float:
        """What a cart has room for after all that it has to do so far [kg]."""
        return self.cart.capacity - self.load(cart)

    def other_carts(self, cart: int, begin: float) -> Traffic:
        """All other carts from a moment on.

        Args:
            cart: Number of the one that is left out.
            begin: The moment [s].
        """
        begin = max(math.floor(begin / SAMPLE) * SAMPLE, 0.0)
        motions = []
        for k, jobs in enumerate(self.jobs):
            if k != cart:
                before = [self.begins[k], *(job.motion for job in jobs)]
                done = sum(job.end < begin for job in jobs)
                motions.append(before[done:])
        return cart_traffic(self.cart, motions, len(self.tanks), begin)

    def make_room(self) -> None:
        """Send carts to their trucks that are too full for another visit."""
        if any(self.room(cart) < LEAST * self.largest_tank for cart in self.carts):
            self.empty_carts([cart for cart in self.carts if self._is_due(self.load(cart))])

    def _is_due(self, load: float) -> bool:
        """Whether a cart with this load [kg] should go to its truck."""
        full = self.cart.capacity - load < self.largest_tank
        return full and load >= WORTH_A_TRIP * self.cart.capacity

    def leave(
        self,
        motions: list[CartMotion],
        leaves: Moving,
        visit: CartVisit,
        others: Traffic,
        stop: Stop | None,
    ) -> bool:
        """Find a way off, to the truck if it is time, and commit all; return whether there is one.

        Args:
            motions: Of the cart, until it leaves.
            leaves: When and how fast it leaves.
            visit: The visit that it has made.
            others: The other carts.
            stop: Of the combine, for this visit; None if it does not stop.
        """
        cart = visit.cart
        load = self.load(cart) + visit.taken
        goals = [None]
        if self._is_due(load):
            goals = [self.supply.trucks[cart], None]
        stay = motions[-1]
        for goal in goals:
            off = self.world.planner.route_from(
                stay.last_pose, stay.last_angle, leaves, others, goal
            )
            if off is None:
                continue
            self.tanks[visit.combine].take(visit)
            trip = None if goal is None else self._trip(cart, off.timed.end, load)
            self.jobs[cart].append(Job(join_motions([*motions, off]), visit, trip, stop))
            return True
        return False

    def empty_carts(self, full: Sequence[int]) -> None:
        """Send carts to their trucks; the others make way if they have to.

        Args:
            full: Their numbers.

        Raises:
            NoPlan: One finds no way.
        """
        # Trucks take from carts in the order in which these come.
        waiting = sorted(full, key=lambda cart: self.standing(cart).since)
        idle = [cart for cart in self.carts if cart not in waiting]
        while waiting:
            gone = [cart for cart in waiting if self._to_truck(cart)]
            waiting = [cart for cart in waiting if cart not in gone]
            if waiting and not gone:
                gone = [cart for cart in idle if self._to_truck(cart)]
                idle = []
                if not gone:
                    stands = np.round(self.standing(waiting[0]).pose[:2], 1).tolist()
                    raise NoPlan(f"`carts` must find ways to their trucks; got none from {stands}")

    def _to_truck(self, cart: int) -> bool:
        """Send a cart to its truck, now or when the way is free; return whether there is a way."""
        stands, load = self.standing(cart), self.load(cart)
        others = self.other_carts(cart, stands.since)
        goal = self.supply.trucks[cart]
        for begin in self.departures(stands.since):
            start = Moving(begin, 0.0)
            off = self.world.planner.route_from(stands.pose, stands.beta, start, others, goal)
            if off is not None:
                trip = self._trip(cart, off.timed.end, load)
                self.jobs[cart].append(Job(off, None, trip, None))
                return True
        return False

    def _trip(self, cart: int, begin: float, load: float) -> Trip | None:
        """A cart's time at a truck, after all fillings planned so far; None for no load."""
        trips = [job.trip for jobs in self.jobs for job in jobs if job.trip]
        settled = [filling for trip in trips for filling in trip.fillings]
        pool = TruckPool(self.supply.truck_fleet, settled)
        fillings = pool.empty(begin, load, self.supply.truck_rate)
        return Trip(cart, begin, fillings[-1].end, load, tuple(fillings)) if fillings else None

    def departures(self, first: float) -> list[float]:
        """Moments at which to try to set out, until all machines have stopped [s].

        Args:
            first: The first of them [s].
        """
        ends = [job.end for jobs in self.jobs for job in jobs[-1:]]
        end = max(first, *ends, *(plan.end for plan in self.world.plans))
        later = [first + wait - SET_OUT[0] for wait in SET_OUT]
        return [*(moment for moment in later if moment <= end), end]

    def kept(self) -> PlanSoFar:
        """A copy of what is planned, for `restore`."""
        jobs = [[*jobs] for jobs in self.jobs]
        return PlanSoFar(jobs, [*self.stops], [*self.turns], self.world.until)

    def restore(self, kept: PlanSoFar) -> None:
        """Return to what was planned earlier."""
        self.stops, self.turns = [*kept.stops], [*kept.turns]
        self.jobs = [[*jobs] for jobs in kept.jobs]
        self.look_again(kept.until)
        self.fill_tanks()

    def look_again(self, until: float = np.inf) -> float:
        """Update the world to the current stops; return the time from which on it differs [s].

        Args:
            until: What combines do after this time is ignored [s].
        """
        key = tuple(self.stops), until
        known = self._worlds.pop(key, None)
        if known is None:
            plans = self.retime(self.stops)
            known, since = changed_surroundings(self.world, self.field, plans, until)
        else:
            since = first_difference(self.world.plans, known.plans)
        self._worlds[key] = self.world = known
        if len(self._worlds) > MOST_WORLDS:
            del self._worlds[next(iter(self._worlds))]
        return since

    def keeps_off(self, motion: CartMotion, others: Traffic, more: float = BETWEEN) -> bool:
        """Whether a cart keeps the gap to others, and some more, all the way.

        Args:
            motion: Of the cart.
            others: Machines that move.
            more: Added to the gap [m].
        """
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
            sum(tank.left for tank in self.tanks) + sum(map(self.load, self.carts)),
        )
