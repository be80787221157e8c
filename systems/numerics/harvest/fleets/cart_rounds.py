"""A model of carts among combines, from event to event, which takes milliseconds for a harvest.

The combines keep the paths and times of their plan. Carts ignore all other machines: their way is
4 / pi times the distance, which is the mean over all directions of a way along and across the
swaths. They unload driving combines on straight work only, the one whose tank is full first before
others. A combine whose tank is full before a cart is there stands until it is emptied; it is later
by that from then on, but holds up no others. Carts that have no room for another tank drive to
their place on the margin, where trucks take turns.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..carts.cut_times import cut_times
from ..carts.tanks import TICK, make_tanks
from ..field.yield_map import YieldMap
from ..machines import Cart, Combine
from ..plan.harvest_plan import CombinePlan
from ..trucks import TruckFleet, TruckPool

# Straight work that is shorter than this leaves no time to unload [m].
SHORTEST = 50.0

# Way over distance, averaged over all directions [-].
DETOUR = 4.0 / math.pi
# Time to draw up and to set out again, besides that of driving and of unloading [s].
AROUND = 25.0
# Less grain than this counts as none [kg].
NOTHING = 1.0


@dataclass(frozen=True, eq=False)
class WorkAhead:
    """A combine's work by its own clock, which stops while it waits for carts.

    Attributes:
        cut: All that it has cut at moments TICK apart, shape (T,) [kg].
        places: Where it is then, shape (T, 2) [m].
        opens: For each moment the first one, from it on, at which a cart may be beside the combine,
            or T if there is none; shape (T,).
        end: When it parks [s].
    """

    cut: np.ndarray
    places: np.ndarray
    opens: np.ndarray
    end: float


def work_ahead(team: CombinePlan, density: float | YieldMap) -> list[WorkAhead]:
    """The work of all combines of a plan.

    Args:
        team: The plan of the combines.
        density: Of the crop [kg/m^2].
    """
    cut = cut_times(team.field, team.size, team.paths)
    tanks = make_tanks(team.machines, cut, density, [timed.end for timed in team.paths])
    found = []
    for timed, tank in zip(team.paths, tanks, strict=True):
        stations = timed.station_at(tank.times)
        path = timed.path
        straight = path.cutting & (np.abs(path.curvatures) < 1e-6) & (path.lengths >= SHORTEST)
        if len(straight):
            beside = straight[path.piece_at(stations)] & (tank.times < timed.end)
        else:
            beside = np.zeros(len(stations), dtype=bool)
        following = np.where(beside, np.arange(len(beside)), len(beside))
        opens = np.minimum.accumulate(following[::-1])[::-1]
        found.append(WorkAhead(tank.cut, path.pose_at(stations)[:, :2], opens, timed.end))
    return found


def moment(time: float, work: WorkAhead) -> int:
    """Number of the moment at or before a time of a combine's own clock.

    Args:
        time: [s].
        work: Of the combine.
    """
    return int(min(max(time / TICK, 0.0), len(work.cut) - 1))


@dataclass(frozen=True, eq=False)
class CartRounds:
    """What carts do by the model.

    Attributes:
        ends: When each combine has parked, shape (N,) [s].
        grain: Grain that carts fetch from each, shape (N,) [kg].
        stops: How long each stands for carts, shape (N,) [s].
        misses: How many times a combine stands for a cart.
        visits, trips: Numbers of visits to combines and of trips to trucks.
        way: Of each cart, including that beside combines, shape (K,) [m].
        hauled: Grain times way, summed over all carts [kg m].
        cart_ends: When each cart is empty for good, shape (K,) [s].
        at_trucks: How long each cart waits for a truck, shape (K,) [s].
        emptying: How long grain flows from each cart, shape (K,) [s].
        beside: How long grain flows into each cart, shape (K,) [s].
    """

    ends: np.ndarray
    grain: np.ndarray
    stops: np.ndarray
    misses: int
    visits: int
    trips: int
    way: np.ndarray
    hauled: float
    cart_ends: np.ndarray
    at_trucks: np.ndarray
    emptying: np.ndarray
    beside: np.ndarray

    @property
    def makespan(self) -> float:
        """When the last machine has done its work [s]."""
        return float(max(self.ends.max(), self.cart_ends.max()))


def run_carts(
    work: Sequence[WorkAhead],
    combines: Sequence[Combine],
    cart: Cart,
    places: np.ndarray,
    trucks: TruckFleet,
    truck_rate: float,
    threshold: float = 0.5,
) -> CartRounds:
    """Serve the combines of a plan.

    Args:
        work: Of the combines.
        combines: The combines.
        cart: One of the equal carts.
        places: Where each cart begins and is emptied, shape (K, 2) [m].
        trucks: What takes the grain there.
        truck_rate: Rate at which carts are emptied [kg/s].
        threshold: Part of a tank that has to be filled before a cart comes.
    """
    model = _Model(work, combines, cart, places, TruckPool(trucks), truck_rate, threshold)
    while model.serve_next():
        pass
    for k in range(len(places)):
        model.to_truck(k)
    return CartRounds(
        ends=np.array([w.end for w in work]) + model.late,
        grain=model.taken,
        stops=model.late,
        misses=model.misses,
        visits=model.visits,
        trips=model.trips,
        way=model.way,
        hauled=model.hauled,
        cart_ends=model.free,
        at_trucks=model.waits,
        emptying=model.gives,
        beside=model.takes,
    )


class _Model:
    def __init__(
        self,
        work: Sequence[WorkAhead],
        combines: Sequence[Combine],
        cart: Cart,
        places: np.ndarray,
        pool: TruckPool,
        truck_rate: float,
        threshold: float,
    ):
        self.work, self.combines, self.cart = work, combines, cart
        self.largest = max(combine.capacity for combine in combines)
        self.pool, self.rate, self.threshold = pool, truck_rate, threshold
        # Of each cart: where its truck is and where it stands, when it is free, what is in it, how
        # far it drove, and how long it waited for trucks, gave grain and took it.
        self.homes, self.places = np.array(places), np.array(places)
        self.free, self.load, self.way = np.zeros((3, len(places)))
        self.waits, self.gives, self.takes = np.zeros((3, len(places)))
        self.taken, self.late = np.zeros(len(work)), np.zeros(len(work))
        # When the last visit to each combine ended, in real time: visits do not overlap.
        self.left = np.zeros(len(work))
        self.misses = self.visits = self.trips = 0
        self.hauled = 0.0

    def serve_next(self) -> bool:
        """Make the next visit or trip of the cart free first; return if grain was left to fetch."""
        waiting = [n for n, each in enumerate(self.work) if each.cut[-1] - self.taken[n] > NOTHING]
        if not waiting:
            return False
        k = int(np.argmin(self.free))
        # As in the planner, a cart goes on to combines as long as a whole tank fits in.
        if self.load[k] > NOTHING and self.cart.capacity - self.load[k] < self.largest:
            self.to_truck(k)
            return True
        self._visit(k, min(waiting, key=lambda n: (self._full(n), self._loaded(n))))
        return True

    def _reaches(self, n: int, amount: float) -> float:
        """When a combine's tank holds an amount; infinite if never [s]."""
        work = self.work[n]
        k = int(np.searchsorted(work.cut, self.taken[n] + amount))
        return math.inf if k >= len(work.cut) else k * TICK + float(self.late[n])

    def _full(self, n: int) -> float:
        return self._reaches(n, self.combines[n].capacity)

    def _loaded(self, n: int) -> float:
        """Earliest time at which a visit to a combine is worth while [s]."""
        time = self._reaches(n, self.threshold * self.combines[n].capacity)
        return min(time, self.work[n].end + float(self.late[n]))

    def _visit(self, k: int, n: int) -> None:
        work, combine = self.work[n], self.combines[n]
        begin = max(self._loaded(n), self.free[k], self.left[n])
        for _ in range(3):
            until = min(begin, self._full(n))
            there = work.places[moment(until - self.late[n], work)]
            way = DETOUR * float(np.hypot(*(there - self.places[k])))
            arrives = self.free[k] + way / self.cart.speed + AROUND
            begin = max(self._loaded(n), arrives, self.left[n])
        full, ends = self._full(n), work.end + float(self.late[n])
        clock = moment(begin - self.late[n], work)
        opens = int(work.opens[clock]) if begin < min(full, ends) else len(work.cut)
        open_at = opens * TICK + float(self.late[n]) if opens < len(work.cut) else math.inf
        if max(begin, open_at) < min(full, ends):
            begin, stands = max(begin, open_at), False
        else:
            # The combine fills up, or parks, before a cart is beside it.
            begin, stands = max(begin, min(full, ends)), True
        clock = moment(min(begin, full) - self.late[n], work)
        if begin >= ends and full >= ends:
            clock = len(work.cut) - 1
        self._drive(k, work.places[clock])
        room = self.cart.capacity - self.load[k]
        load = float(work.cut[clock]) - self.taken[n]
        if stands:
            taken = min(load, room)
            lasts = taken / combine.unload_rate
            if full < ends:
                self.misses += 1
                self.late[n] += begin + lasts - full
        else:
            lasts, taken = self._pour(n, begin, room)
            beside = combine.speed * lasts
            self.way[k] += beside
            self.hauled += beside * (self.load[k] + taken / 2)
        self.load[k] += taken
        self.takes[k] += lasts
        self.free[k] = begin + lasts
        self.places[k] = work.places[moment(self.free[k] - self.late[n], work)]
        self.taken[n] += taken
        self.left[n] = self.free[k]
        self.visits += 1

    def _pour(self, n: int, begin: float, room: float) -> tuple[float, float]:
        """Duration and amount of unloading beside a combine that cuts on [s], [kg]."""
        work, rate = self.work[n], self.combines[n].unload_rate
        first = moment(begin - self.late[n], work)
        closed = np.flatnonzero(work.opens[first:] > np.arange(first, len(work.opens)))
        last = first + (int(closed[0]) if len(closed) else len(work.opens) - first - 1)
        there = work.cut[first : max(last, first) + 1] - self.taken[n]
        flown = rate * TICK * np.arange(len(there))
        done = np.flatnonzero((flown >= there) | (flown >= room))
        k = int(done[0]) if len(done) else len(there) - 1
        taken = float(min(there[k], room, max(flown[k], rate * TICK)))
        return max(taken / rate, TICK), max(taken, 0.0)

    def _drive(self, k: int, there: np.ndarray) -> float:
        way = DETOUR * float(np.hypot(*(there - self.places[k])))
        self.way[k] += way
        self.hauled += way * float(self.load[k])
        return way

    def to_truck(self, k: int) -> None:
        """Drive to a truck, and be emptied."""
        if self.load[k] <= NOTHING:
            return
        way = self._drive(k, self.homes[k])
        arrives = float(self.free[k]) + way / self.cart.speed + AROUND
        fillings = self.pool.empty(arrives, self.load[k], self.rate)
        gives = sum(each.end - each.begin for each in fillings)
        self.free[k] = fillings[-1].end
        self.waits[k] += self.free[k] - arrives - gives
        self.gives[k] += gives
        self.places[k], self.load[k] = self.homes[k], 0.0
        self.trips += 1
