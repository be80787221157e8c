"""Which cart serves which combine, in which window, and when it drives to its truck.

Combines fill together: so that one cart can serve them one after another, the first ones are
emptied before they are full. Where no cart can come before a tank is full, the combine stops for a
bounded time, its plan is timed again, and all visits are planned anew.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..field.field import Field
from ..machines.alongside import MIDDLE, STANDING
from ..machines.cart import Cart
from ..machines.combine import Combine
from ..paths.timed_path import TimedPath
from .cart_motion import CartMotion, join_motions, standing_motion, trailer_poses
from .cut_times import GAP, cut_times, open_ground
from .profile import Moving
from .roadmap import field_lines, make_roadmap, node_opens
from .routes import RoutePlanner, Standing
from .stops import Stop, with_stop
from .tanks import Pour, Tank, make_tanks
from .traffic import Traffic, cart_traffic, combine_traffic, least_gaps
from .windows import BETWEEN, Beside, Window, beside, drive_beside, find_windows

# What one visit takes of a cart's time, about, when combines are told apart [s].
VISIT = 180.0
# How long before a visit a cart is free, at least [s].
AHEAD = 20.0
# Time between beginnings of a visit that are tried [s], and how many at most.
TRIED, CANDIDATES = 15.0, 12
# Part of a tank for which a cart comes, at least.
LEAST = 0.2
# When a cart leaves: as soon as all is out, or later if it cannot, or sooner [s].
LEAVING = (0.0, 10.0, -10.0, 25.0, -25.0)
# How long a cart takes to a combine that waits for it, about, and how much longer that waits when
# it was too short [s]; and how often plans are timed anew.
COMING, LONGER, MOST_STOPS = 100.0, 90.0, 12
# Where the box may be beside a combine that stands, in usual distances to its left and ahead, and
# how it is turned [rad]: the auger swings.
PLACES = [
    (left, ahead, turn)
    for left in (1.0, 1.5)
    for turn in (0.0, math.pi, math.pi / 2, -math.pi / 2)
    for ahead in (0.0, 0.8, -0.8)
    if math.hypot(left, ahead) < STANDING
]
# A tank of which less is left is empty [kg].
EMPTY = 1.0


@dataclass(frozen=True, kw_only=True)
class Supply:
    """What carts have to do with.

    Attributes:
        density: Of the crop [kg/m^2].
        trucks: Pose of the tractor where each cart begins and is emptied, shape (K, 3).
        truck_rate: At which a cart is emptied [kg/s].
    """

    density: float
    trucks: np.ndarray
    truck_rate: float = 300.0


class Visit(NamedTuple):
    """A cart's time beside a combine.

    Attributes:
        cart, combine: Their numbers.
        begin, end: When grain flows [s].
        taken: [kg].
    """

    cart: int
    combine: int
    begin: float
    end: float
    taken: float


class Trip(NamedTuple):
    """A cart's time at its truck.

    Attributes:
        cart: Its number.
        begin, end: When it is emptied [s].
        delivered: [kg].
    """

    cart: int
    begin: float
    end: float
    delivered: float


@dataclass(frozen=True, eq=False)
class CartPlan:
    """What all carts do, and what that asks of combines.

    Attributes:
        plans: Of the combines, with their stops.
        motions: Of the carts.
        visits, trips: In order of their beginnings.
        stops: Waits of combines for carts; each is a miss.
        left: Grain that no cart gets, in tanks and in carts at the end [kg].
    """

    plans: list[TimedPath]
    motions: list[CartMotion]
    visits: list[Visit]
    trips: list[Trip]
    stops: list[Stop]
    left: float


class Candidate(NamedTuple):
    """A visit that may be possible.

    Attributes:
        combine: Its number.
        pour: When, and how much.
        latest: Until when the cart may stay beside it [s].
        stands: Whether the combine stands all the time.
    """

    combine: int
    pour: Pour
    latest: float
    stands: bool


@dataclass(eq=False)
class _Crew:
    """Carts while visits are planned."""

    motions: list[list[CartMotion]]
    loads: list[float]
    free: list[float]
    visits: list[Visit] = field(default_factory=list)
    trips: list[Trip] = field(default_factory=list)

    def stands(self, cart: int) -> Standing:
        last = self.motions[cart][-1]
        return Standing(last.last_pose, last.last_angle, self.free[cart])


Retime = Callable[[Sequence[TimedPath], Sequence[Stop]], list[TimedPath]]


def retime_alone(combine: Combine) -> Retime:
    """Stops that delay the combine that stops, and no other."""

    def retime(plans: Sequence[TimedPath], stops: Sequence[Stop]) -> list[TimedPath]:
        after = list(plans)
        for stop in stops:
            after[stop.combine] = with_stop(after[stop.combine], stop, combine.acceleration)
        return after

    return retime


def serve_combines(
    ground: Field,
    combine: Combine,
    cart: Cart,
    plans: Sequence[TimedPath],
    swaths: Sequence[np.ndarray],
    supply: Supply,
    retime: Retime | None = None,
) -> CartPlan:
    """Plan all visits, trips and routes.

    Args:
        ground: The field.
        combine, cart: One of the equal combines and carts.
        plans: Of all combines, without waits for carts.
        swaths: Lines that carts may follow in the field, points of each (n, 2) [m].
        supply: Crop and trucks.
        retime: Times plans again when combines stop; without it a stop delays nobody else.
    """
    again = retime_alone(combine) if retime is None else retime
    stops: list[Stop] = []
    tried = 0
    while True:
        timed = again(plans, stops)
        service = _Service(ground, combine, cart, timed, swaths, supply)
        missed = service.run()
        tried += 1
        if missed is None or tried >= MOST_STOPS:
            return service.result(stops)
        near = [
            k
            for k, stop in enumerate(stops)
            if stop.combine == missed.combine and abs(stop.station - missed.station) < 5.0
        ]
        if near:
            old = stops[near[0]]
            stops[near[0]] = old._replace(duration=old.duration + LONGER)
        else:
            stops.append(missed)


class _Service:
    """One attempt to plan all visits for given times of the combines."""

    def __init__(
        self,
        ground: Field,
        combine: Combine,
        cart: Cart,
        plans: Sequence[TimedPath],
        swaths: Sequence[np.ndarray],
        supply: Supply,
    ) -> None:
        cut = cut_times(ground, combine, plans)
        self.combine, self.cart, self.plans, self.supply = combine, cart, list(plans), supply
        self.ground = open_ground(ground, cut)
        self.combines = combine_traffic(combine, plans)
        roadmap = make_roadmap(self.ground, cart, field_lines(ground, combine, swaths))
        self.planner = RoutePlanner(self.ground, cart, roadmap, self.combines)
        self.windows = find_windows(combine, cart, plans, self.ground, self.combines)
        self.tanks = make_tanks(combine, cut, supply.density, [plan.end for plan in plans])
        self.place: Beside = beside(combine, cart)
        self.lost = 0.0
        count = len(supply.trucks)
        self.crew = _Crew(
            [[standing_motion(cart, pose, 0.0)] for pose in supply.trucks],
            [0.0] * count,
            [0.0] * count,
        )

    def run(self) -> Stop | None:
        """Serve until nothing is left; else what stop of a combine it takes."""
        while True:
            urgent = most_urgent(self.tanks, self.plans, len(self.crew.loads))
            if urgent is None:
                break
            number, due = urgent
            if self._serve(number, due):
                continue
            full = self.tanks[number].full_at()
            if full == np.inf:
                # What is left after the end: nobody can come there.
                self.lost += self.tanks[number].give_up()
                continue
            return self._stop_for(number, full)
        for number in range(len(self.crew.loads)):
            if self.crew.loads[number] > 0:
                self._to_truck(number)
        return None

    def _stop_for(self, number: int, full: float) -> Stop:
        """Where a combine waits: the last place before its tank is full that a cart gets to."""
        served = max((v.end for v in self.crew.visits if v.combine == number), default=0.0)
        times = np.arange(full - 3.0, served + 10.0, -4.0)
        plan = self.plans[number]
        others = self._others(-1)
        chosen = full - 3.0
        for time in times:
            if len(self._standing_poses(plan.pose_at(time), float(time), others)):
                chosen = float(time)
                break
        wait = min(self.crew.free) + COMING - chosen
        pouring = self.combine.capacity / self.combine.unload_rate
        duration = max(wait, COMING) + pouring
        return Stop(number, float(plan.station_at(chosen)), duration)

    def _serve(self, number: int, due: float) -> bool:
        free = min(self.crew.free)
        tank = self.tanks[number]
        room = max(self._room(k) for k in range(len(self.crew.loads)))
        for candidate in candidates(
            tank, self.plans[number], self.windows, number, free + AHEAD, due, room
        ):
            begin = candidate.pour.begin
            pose = self.plans[number].pose_at(begin)
            carts = [k for k in range(len(self.crew.free)) if self.crew.free[k] + AHEAD <= begin]
            carts.sort(key=lambda k: float(np.hypot(*(self.crew.stands(k).pose - pose)[:2])))
            for k in carts:
                if self._visit(k, candidate):
                    return True
        return False

    def _room(self, cart: int) -> float:
        return self.cart.capacity - self.crew.loads[cart]

    def _others(self, cart: int) -> Traffic:
        return cart_traffic(
            self.cart,
            [join_motions(m) for k, m in enumerate(self.crew.motions) if k != cart],
            len(self.plans),
        )

    def _visit(self, cart: int, candidate: Candidate) -> bool:
        """Plan the way there, beside the combine and off again; commit it if all three exist."""
        others = self._others(cart)
        plan, begin = self.plans[candidate.combine], candidate.pour.begin
        pour = self.tanks[candidate.combine].pour(begin, candidate.latest, self._room(cart))
        speed = 0.0 if candidate.stands else float(plan.speed_at(begin))
        for pose in self._poses_beside(candidate, others):
            to = self.planner.route_to(self.crew.stands(cart), pose, Moving(begin, speed), others)
            if to is None:
                continue
            for later in LEAVING:
                end = min(pour.end + later, candidate.latest)
                if end <= begin + 5.0:
                    continue
                taken = self.tanks[candidate.combine].pour(begin, end, self._room(cart))
                if taken.taken < 0.5 * pour.taken:
                    continue
                if candidate.stands:
                    stay = standing_motion(self.cart, to.last_pose, begin, to.last_angle)
                    leaves = 0.0
                else:
                    stay = drive_beside(plan, self.place, self.cart, begin, end, to.last_angle)
                    leaves = float(plan.speed_at(end))
                if not self._keeps_off(stay, end, others):
                    continue
                load = self.crew.loads[cart] + taken.taken
                empties = self.cart.capacity - load < self.combine.capacity
                truck = self.supply.trucks[cart] if empties else None
                off = self.planner.route_from(
                    stay.last_pose, stay.last_angle, Moving(end, leaves), others, truck
                )
                if off is None and truck is not None:
                    off = self.planner.route_from(
                        stay.last_pose, stay.last_angle, Moving(end, leaves), others, None
                    )
                    empties = False
                if off is None:
                    continue
                self._commit(cart, candidate.combine, [to, stay, off], taken, empties)
                return True
        return False

    def _commit(
        self, cart: int, number: int, motions: list[CartMotion], pour: Pour, empties: bool
    ) -> None:
        crew = self.crew
        self.tanks[number].take(pour)
        crew.motions[cart] += motions
        crew.loads[cart] += pour.taken
        crew.visits.append(Visit(cart, number, pour.begin, pour.end, pour.taken))
        crew.free[cart] = motions[-1].timed.end
        if empties:
            self._empty(cart)

    def _empty(self, cart: int) -> None:
        crew = self.crew
        begin = crew.free[cart]
        end = begin + crew.loads[cart] / self.supply.truck_rate
        crew.trips.append(Trip(cart, begin, end, crew.loads[cart]))
        crew.loads[cart], crew.free[cart] = 0.0, end

    def _to_truck(self, cart: int) -> None:
        """Drive to the truck, now or when the way is free."""
        stands = self.crew.stands(cart)
        others = self._others(cart)
        for wait in (0.0, 30.0, 120.0, 600.0, 3600.0):
            off = self.planner.route_from(
                stands.pose,
                stands.beta,
                Moving(stands.since + wait, 0.0),
                others,
                self.supply.trucks[cart],
            )
            if off is not None:
                self.crew.motions[cart].append(off)
                self.crew.free[cart] = off.timed.end
                self._empty(cart)
                return

    def _keeps_off(self, stay: CartMotion, end: float, others: Traffic) -> bool:
        times = np.arange(stay.timed.times[0], end, 0.5)
        tractor, trailer = stay.poses_at(times)
        return all(
            (
                least_gaps(traffic, self.planner.boxes, tractor, trailer, times) >= GAP + BETWEEN
            ).all()
            for traffic in (self.combines, others)
        )

    def _poses_beside(self, candidate: Candidate, others: Traffic) -> list[np.ndarray]:
        """Poses of the tractor at the beginning of a visit, the best first.

        A combine that stands swings its auger: then all that it reaches will do.
        """
        begin = candidate.pour.begin
        pose = self.plans[candidate.combine].pose_at(begin)
        if candidate.stands:
            return list(self._standing_poses(pose, begin, others)[:5])
        return [self.place.of(pose)]

    def _standing_poses(self, pose: np.ndarray, time: float, others: Traffic) -> np.ndarray:
        """Poses of the tractor in which the auger of a standing combine reaches, shape (n, 3)."""
        poses = [self.place.of(pose)]
        reach = self.place.left
        forth = self.cart.hitch_offset + self.cart.length * (1.0 - MIDDLE)
        c, s = math.cos(pose[2]), math.sin(pose[2])
        for left, ahead, turn in PLACES:
            x = pose[0] + reach * (c * ahead - s * left)
            y = pose[1] + reach * (s * ahead + c * left)
            course = pose[2] + turn
            poses.append(np.array([x + forth * np.cos(course), y + forth * np.sin(course), course]))
        every = np.array(poses)
        every = every[node_opens(self.ground, self.cart, every) <= time]
        behind = trailer_poses(every, np.zeros(len(every)), self.cart)
        times = np.full(len(every), time)
        fits = np.ones(len(every), dtype=bool)
        for traffic in (self.combines, others):
            gaps = least_gaps(traffic, self.planner.boxes, every, behind, times)
            fits &= gaps >= GAP + BETWEEN
        return every[fits]

    def result(self, stops: list[Stop]) -> CartPlan:
        """What was planned."""
        left = sum(tank.left for tank in self.tanks) + sum(self.crew.loads) + self.lost
        return CartPlan(
            self.plans,
            [join_motions(motions) for motions in self.crew.motions],
            sorted(self.crew.visits, key=lambda visit: visit.begin),
            sorted(self.crew.trips, key=lambda trip: trip.begin),
            list(stops),
            left,
        )


def most_urgent(
    tanks: Sequence[Tank], plans: Sequence[TimedPath], carts: int
) -> tuple[int, float] | None:
    """The combine to be served next, and by when a visit has to begin; None where all is out.

    Carts serve in turn: whoever is due comes one visit before the one who is served after it.
    """
    due = {n: tank.full_at() for n, tank in enumerate(tanks)}
    waiting = [n for n in due if due[n] < np.inf or tanks[n].left > EMPTY]
    if not waiting:
        return None
    waiting.sort(key=lambda n: (due[n], plans[n].end))
    latest = [due[n] for n in waiting]
    for k in range(len(waiting) - carts - 1, -1, -1):
        latest[k] = min(latest[k], latest[k + carts] - VISIT)
    first = int(np.argmin(latest))
    return waiting[first], latest[first]


def candidates(
    tank: Tank,
    plan: TimedPath,
    windows: Sequence[Window],
    number: int,
    earliest: float,
    due: float,
    room: float,
) -> list[Candidate]:
    """Visits of one combine that begin before its tank is full, the best first.

    Best is what takes most before the visit is due; then what comes soonest after.

    Args:
        tank: Of the combine.
        plan: Of it.
        windows: Of all combines.
        number: Of the combine.
        earliest: When a cart can be there [s].
        due: By when the visit should begin [s].
        room: In the emptiest cart [kg].
    """
    full = tank.full_at()
    capacity = tank.capacity
    found = []
    spans = [(w.begin, w.end, False) for w in windows if w.combine == number]
    spans += [(begin, end, True) for begin, end in _standings(plan)]
    for begin, end, stands in spans:
        low, high = max(begin, earliest), min(end, full)
        if stands and high == np.inf:
            high = low + 8 * 60.0
        for time in np.arange(low, high, TRIED if not stands else 2 * TRIED):
            pour = tank.pour(float(time), end, room)
            least = min(LEAST * capacity, max(tank.left, EMPTY))
            if pour.taken >= least:
                found.append(Candidate(number, pour, end, stands))
    soon = [c for c in found if c.pour.begin <= due]
    late = [c for c in found if c.pour.begin > due]
    # At the end all has to come out, whatever the moment.
    grain = 0.05 * capacity if full < np.inf else EMPTY
    soon.sort(key=lambda c: (-round(c.pour.taken / grain), c.stands, c.pour.begin))
    late.sort(key=lambda c: c.pour.begin)
    return _spread(soon)[:CANDIDATES] + _spread(late)[:CANDIDATES]


def _spread(ranked: list[Candidate]) -> list[Candidate]:
    """The best, and then others that are not close to those before them."""
    kept: list[Candidate] = []
    for each in ranked:
        if all(abs(each.pour.begin - other.pour.begin) >= 2 * TRIED - 1.0 for other in kept):
            kept.append(each)
    return kept


def _standings(plan: TimedPath) -> list[tuple[float, float]]:
    """Times at which a machine stands for a while after it has set out, the last for ever."""
    held = np.diff(plan.stations) < 1e-9
    found = [
        (float(plan.times[k]) + 1.0, float(plan.times[k + 1]) - 1.0)
        for k in np.flatnonzero(held)
        if plan.times[k + 1] - plan.times[k] > 30.0 and plan.stations[k] > 0
    ]
    return [*found, (plan.end + 1.0, np.inf)]
