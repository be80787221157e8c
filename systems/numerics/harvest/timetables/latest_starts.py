"""Visits as late as they may be: the sequential strategy on the work that combines really do.

With loads that grow at one rate these rounds are those of Zhang 2014, 3.4: the cart waits beside a
combine that it has emptied until it has to be with the next one. Only in the first round it waits
with each one for as long as it can, where the thesis moves on and waits with the next (t'_n).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..schedule.fleet import Truck
from ..schedule.timetable import LoadLine, Timetable, Visit
from .pouring import pour
from .work import Work

# Part of the level from which on a tank is worth a visit before its combine has finished.
WORTH = 0.1
# How often the way to the next combine is looked at, while a cart stays with one.
LOOKS = 8


@dataclass(frozen=True)
class Service:
    """What a cart can do.

    Attributes:
        level: Load up to which tanks are to fill [kg].
        capacity: Of a tank [kg].
        rate: Of the augers [kg/s].
        speed: Of a cart towards or away from a combine at work, at the least [m/s].
        roundabout: Way driven, as a factor on straight distances between combines.
        settling: Time that every way takes beyond that [s].
        truck: Where carts of finite capacity unload; none: they hold any amount.
    """

    level: float
    capacity: float
    rate: float
    speed: float
    roundabout: float
    settling: float
    truck: Truck | None = None


def plan_visits(
    works: Sequence[Work],
    orders: Sequence[Sequence[int]],
    starts: np.ndarray,
    service: Service,
) -> Timetable:
    """The timetable of carts that serve their combines in turn.

    Each visit begins as late as no tank of this round gets fuller than it should, or else as soon
    as the cart can be there. A combine that comes next but has hardly cut anything is passed by.

    Args:
        works: Of all combines, N, with one step of time.
        orders: Of each cart, the combines that it serves, in turn; no combine is in two of them.
        starts: Where each cart sets out at time 0, shape (K, 2) [m].
        service: What each cart can do.

    Returns:
        The visits. Nothing is lost; a tank that would hold more than it can is in `overflows`, and
        its combine will have to stop.
    """
    loads = [work.grain - work.grain[0] for work in works]
    visits: list[Visit] = []
    carts: list[LoadLine] = []
    for number, order in enumerate(orders):
        made, line = _Cart(number, works, order, starts[number], service, loads).drive()
        visits += made
        carts.append(line)
    step = works[0].step
    overflows = {}
    for n, load in enumerate(loads):
        over = np.flatnonzero(load > service.capacity * (1 + 1e-9))
        if len(over):
            overflows[n] = step * float(over[0])
    return Timetable(
        visits=tuple(sorted(visits, key=lambda visit: visit.start_unloading)),
        tanks=tuple(LoadLine(step * np.arange(len(load), dtype=float), load) for load in loads),
        carts=tuple(carts),
        lost=(0.0,) * len(works),
        overflows=overflows,
    )


class _Cart:
    """One cart's visits, as they are put together."""

    def __init__(
        self,
        number: int,
        works: Sequence[Work],
        order: Sequence[int],
        start: np.ndarray,
        service: Service,
        loads: list[np.ndarray],
    ) -> None:
        self.number, self.works, self.order, self.service = number, works, order, service
        self.step = works[0].step
        self.start = start
        self.loads = loads
        # Of each combine: step from which on it has been without a cart, and its load then.
        self.since = dict.fromkeys(order, 0)
        self.left = dict.fromkeys(order, 0.0)
        self.held = 0.0
        self.points = [(0.0, 0.0)]

    def drive(self) -> tuple[list[Visit], LoadLine]:
        """All visits until every tank stays empty, and the cart's load."""
        visits: list[Visit] = []
        place, leave, before = 0, 0, -1
        while queue := self._queue(place):
            starts = self._latest(queue)
            chosen = next((k for k, n in enumerate(queue) if self._worth(n, starts[k])), 0)
            n = queue[chosen]
            way = self._way(before, n, leave)
            truck = self.service.truck
            if (
                truck is not None
                and self.held + self.service.level > truck.cart_capacity
                and visits
            ):
                way = self._by_truck(truck, leave)
                visits[-1] = replace(visits[-1], by_truck=True)
            arrive = leave + way
            start = max(arrive, starts[chosen])
            load = self._load(n, start)
            emptied, _ = self._pour(n, start, -1)
            place = self.order.index(n) + 1
            # Beside the empty tank until the next one has to be served.
            self.since[n], self.left[n] = emptied, 0.0
            leave = emptied
            if following := self._queue(place):
                latest = self._latest(following)[0]
                ways = (self._way(n, following[0], k) for k in self._between(leave, latest))
                leave = max(leave, latest - max(ways))
            emptied, stay = self._pour(n, start, leave, load)
            grain = self._grain(n, start + np.arange(len(stay)))
            given = load + grain - grain[0] - stay
            # A cart that is full leaves at once.
            room = math.inf if truck is None else truck.cart_capacity - self.held
            stay = stay[: max(2, int(np.searchsorted(given, room, side="right")))]
            leave, taken = start + len(stay) - 1, float(given[len(stay) - 1])
            emptied = emptied if 0 <= emptied <= leave else leave
            self._note(n, start, stay)
            self.held += taken
            self.points += [(start * self.step, self.held - taken), (leave * self.step, self.held)]
            visits.append(
                Visit(
                    combine=n,
                    arrive=arrive * self.step,
                    start_unloading=start * self.step,
                    emptied=emptied * self.step,
                    leave=leave * self.step,
                    load_at_start=load,
                    taken=taken,
                    cart=self.number,
                )
            )
            before = n
        times, held = np.array(self.points, dtype=np.float64).T
        return visits, LoadLine(times=times, loads=held)

    def _queue(self, place: int) -> list[int]:
        """The combines that will have grain to give, in turn from a place of the order on."""
        turn = [self.order[(place + k) % len(self.order)] for k in range(len(self.order))]
        return [n for n in turn if self._load(n, len(self.works[n].reachable)) > 1e-6]

    def _latest(self, queue: Sequence[int]) -> list[int]:
        """The latest step with which each visit of a queue may begin; none is skipped."""
        starts = [self._deadline(n) for n in queue]
        for k in range(len(queue) - 2, -1, -1):
            n, following = queue[k], starts[k + 1]
            until = following - self._way(n, queue[k + 1], following)
            low, high = self.since[n], starts[k]
            if self._emptied(n, high) > until:
                # The later it begins, the later the tank is empty.
                while high - low > 1:
                    middle = (low + high) // 2
                    if self._emptied(n, middle) <= until:
                        low = middle
                    else:
                        high = middle
                starts[k] = low
        return starts

    def _deadline(self, n: int) -> int:
        """The last step before which a tank holds no more than its level, or its last grain."""
        work = self.works[n]
        cut = self._grain(n, np.array(self.since[n]))
        most = cut + self.service.level - self.left[n]
        full = int(np.searchsorted(work.grain, most, side="right")) - 1
        return max(min(full, work.done), self.since[n])

    def _worth(self, n: int, start: int) -> bool:
        done = start >= self.works[n].done
        return done or self._load(n, start) >= WORTH * self.service.level

    def _grain(self, n: int, k: np.ndarray) -> np.ndarray:
        grain = self.works[n].grain
        return grain[np.minimum(k, len(grain) - 1)]

    def _load(self, n: int, k: int) -> float:
        before, now = self._grain(n, np.array([self.since[n], k]))
        return float(self.left[n] + now - before)

    def _emptied(self, n: int, start: int) -> int:
        return self._pour(n, start, -1)[0]

    def _pour(
        self, n: int, first: int, last: int, load: float | None = None
    ) -> tuple[int, np.ndarray]:
        work = self.works[n]
        held = self._load(n, first) if load is None else load
        return pour(work.grain, work.reachable, first, last, held, self.service.rate, self.step)

    def _way(self, here: int, there: int, k: int) -> int:
        """Steps from one combine to another at about a time."""
        if here == there:
            return 0
        a = self._place(here, k) if here >= 0 else self.start
        way = self.service.roundabout * math.dist(a, self._place(there, k)) / self.service.speed
        return math.ceil((way + self.service.settling) / self.step)

    def _between(self, first: int, last: int) -> range:
        """Steps from one to another at which ways are looked at."""
        return range(first, max(first, last) + 1, max(1, (last - first) // LOOKS))

    def _place(self, n: int, k: int) -> np.ndarray:
        places = self.works[n].places
        return places[min(k, len(places) - 1)]

    def _by_truck(self, truck: Truck, leave: int) -> int:
        """Drive by the truck; the steps that it takes."""
        there = leave * self.step + truck.travel_time
        gone = there + truck.stop_time + self.held / truck.unload_rate
        self.points += [(there, self.held), (gone, 0.0)]
        self.held = 0.0
        return math.ceil((gone + truck.travel_time) / self.step) - leave

    def _note(self, n: int, start: int, stay: np.ndarray) -> None:
        """Write down what the tank holds during a visit, and after it if none came again."""
        load, work = self.loads[n], self.works[n]
        end = start + len(stay)
        if end > len(load):
            load = np.concatenate([load, np.full(end - len(load), load[-1])])
        load[start:end] = stay
        grain = work.grain[np.minimum(np.arange(end - 1, len(load)), len(work.grain) - 1)]
        load[end - 1 :] = stay[-1] + grain - grain[0]
        self.loads[n] = load
        self.since[n], self.left[n] = end - 1, float(stay[-1])
