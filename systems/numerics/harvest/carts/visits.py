"""Which cart serves which combine, in which window, and when it drives to its truck.

Visits are chosen one after the other, each with a route to the combine, a time beside it and a
route to where nobody ever comes. Combines fill together: so that one cart can serve them one after
another, they are emptied long before they are full. Where no cart can come before a tank is full,
the combine stops where a cart gets to it: first it stands for ever, a cart's way to it is found
among all others, who go on or wait for it, and then it stands for as long as that took. What was
planned before and is not possible any more is planned again.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree

from ...errors import require
from ..field.field import Field
from ..machines.alongside import MIDDLE, STANDING
from ..machines.cart import Cart
from ..machines.combine import Combine
from ..no_plan import NoPlan
from ..paths.timed_path import TimedPath
from .cart_motion import CartMotion, join_motions, standing_motion, trailer_poses
from .cut_times import GAP, CutTimes, cut_times, open_ground, opens_along
from .profile import Moving
from .roadmap import Roadmap, field_lines, make_roadmap, node_opens, reopened
from .routes import LONGEST, RUN_IN, RoutePlanner, Standing
from .stops import FOR_EVER, Stop, retime_alone
from .tanks import Pour, make_tanks
from .traffic import SAMPLE, Traffic, cart_traffic, combine_traffic, least_gaps
from .windows import BETWEEN, Beside, Window, beside, drive_beside, find_windows

# How far apart two poses of opposite headings are, when those alike are looked for [m].
LIKE = 10.0
# In which order combines are served.
STRATEGIES = ("sequential", "on-demand")
# Time between beginnings of a visit that are looked at, and tried [s]; how many are tried.
LOOKED, TRIED, MOST_TRIED = 5.0, 15.0, 6
# Part of a tank for which a cart comes, at least.
LEAST = 0.1
# When a cart leaves: as soon as all is out, or later if it cannot, or sooner [s].
LEAVING = (0.0, 10.0, -10.0, 25.0, -25.0)
# What a visit takes of a cart's time beside ways and the flow of grain [s].
AROUND = 25.0
# Time between moments at which it is told where ground is open for ways [s].
OFTEN = 120.0
# Least speed at which a cart joins a combine and leaves it [m/s].
SLOWEST = 0.5
# How long before a stop a cart sets out, and how long after it does if it could not [s].
SET_OUT = (-200.0, -60.0, 0.0, 120.0, 360.0, 900.0, 2000.0, 5000.0)
# How many places for a stop, or beside a combine that stands, are tried.
PLACES_TRIED = 8
# Where the box may be beside a combine that stands, in usual distances to its left and ahead, and
# how it is turned [rad]: the auger swings.
PLACES = [
    (left, ahead, quarter * math.pi / 4)
    for left in (1.0, 1.5, 0.6, -1.0, -1.5, -0.6)
    for quarter in (0, 4, 2, 6, 1, 3, 5, 7)
    for ahead in (0.0, 0.8, -0.8, 1.4, -1.6)
    if 0.9 < math.hypot(left, ahead) < 0.98 * STANDING
]
# Of these, as many are looked at together.
TOGETHER = 12
# A tank of which less is left is empty [kg].
EMPTY = 1.0
# Between what a plan had and what is left of it when combines are later [m].
SAME = 1e-3


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
        jobs: Of each cart, one after the other.
    """

    plans: list[TimedPath]
    motions: list[CartMotion]
    visits: list[Visit]
    trips: list[Trip]
    stops: list[Stop]
    left: float
    jobs: "list[list[Job]]"


class Failure(NamedTuple):
    """A cart fails for good: it ends what it is at, is emptied, and serves nobody any more.

    Attributes:
        cart: Its number.
        time: When [s].
    """

    cart: int
    time: float


class _TooLate(Exception):
    """What has begun would have to be given up."""


# Times plans again when combines stop; a stop that lasts FOR_EVER ends what comes after it.
Retime = Callable[[Sequence[Stop]], list[TimedPath]]


class Job(NamedTuple):
    """What a cart does at a stretch, from standing to standing where nobody comes.

    Attributes:
        motion: All of it.
        visit, trip: What it is for.
        stop: Of the combine that waits for it.
    """

    motion: CartMotion
    visit: Visit | None
    trip: Trip | None
    stop: Stop | None

    @property
    def end(self) -> float:
        """When the cart is free again [s]."""
        return self.trip.end if self.trip else self.motion.timed.end


class _Target(NamedTuple):
    """Visits to a combine that a cart might begin.

    Attributes:
        combine, cart: Their numbers.
        moments: Of any use to begin, in order, shape (n,) [s].
        windows: In which they are, shape (n,).
        first: Number of the moment that is liked best.
        deadline: The last of them, infinite where nothing hurries [s].
        lasts: The visit and setting out from it, about [s].
        nodes: Near the poses beside the combine at the moments, shape (n,).
    """

    combine: int
    cart: int
    moments: np.ndarray
    windows: np.ndarray
    first: int
    deadline: float
    lasts: float
    nodes: np.ndarray

    def tried(self, due: float) -> list[int]:
        """Numbers of the moments that are tried, if it should have begun by then."""
        first = self.first
        if self.moments[first] > due:
            first = max(int(np.searchsorted(self.moments, due, side="right")) - 1, 0)
        ranked = [*range(first, len(self.moments)), *range(first - 1, -1, -1)]
        ranked.sort(key=lambda k: self.moments[k] > max(due, self.moments[first]))
        kept: list[int] = []
        for k in ranked:
            if all(abs(self.moments[k] - self.moments[each]) >= TRIED - 0.1 for each in kept):
                kept.append(k)
        return kept[:MOST_TRIED]


def serve_combines(
    ground: Field,
    combine: Combine,
    cart: Cart,
    plans: Sequence[TimedPath],
    swaths: Sequence[np.ndarray],
    supply: Supply,
    retime: Retime | None = None,
    strategy: str = "sequential",
    threshold: float = 0.5,
    failure: "Failure | None" = None,
) -> CartPlan:
    """Plan all visits, trips and routes.

    Args:
        ground: The field.
        combine, cart: One of the equal combines and carts.
        plans: Of all combines, without waits for carts.
        swaths: Lines that carts may follow in the field, points of each (n, 2) [m].
        supply: Crop and trucks.
        retime: Times plans again when combines stop; without it a stop delays nobody else.
        strategy: "sequential": each cart serves its own combines in a fixed turn; "on-demand": a
            free cart goes where a tank is filled to the threshold first.
        threshold: Part of a tank from which on carts come, unless that is too late.
        failure: Of a cart, which nobody knows of before it happens.

    Raises:
        InvalidInput: The only cart fails.
        NoPlan: A cart can never get to a combine or to its truck.
    """
    require(strategy in STRATEGIES, "strategy", f"be one of {', '.join(STRATEGIES)}", strategy)
    require(0.0 < threshold <= 1.0, "threshold", "be in (0, 1]", threshold)
    if failure is not None:
        count = len(supply.trucks)
        require(0 <= failure.cart < count, "failing_cart", f"be below {count}", failure.cart)
        require(count > 1, "carts", "be at least 2 where one fails", count)
    again = retime or retime_alone(plans, combine.acceleration)
    service = _Service(ground, combine, cart, swaths, supply, again, strategy, threshold)
    service.see(list(plans))
    service.run()
    if failure is not None:
        service.fail(failure)
        service.run()
    return service.result()


class _Service:
    """The visits planned so far, and the world that they are planned in."""

    def __init__(
        self,
        field: Field,
        combine: Combine,
        cart: Cart,
        swaths: Sequence[np.ndarray],
        supply: Supply,
        retime: Retime,
        strategy: str,
        threshold: float,
    ) -> None:
        # As many arguments as a harvest has parts.
        self.field, self.combine, self.cart, self.supply = field, combine, cart, supply
        self.retime, self.strategy, self.threshold = retime, strategy, threshold
        self.lines = field_lines(field, combine, swaths)
        self.place: Beside = beside(combine, cart)
        self.roadmap: Roadmap | None = None
        self.plans: list[TimedPath] = []
        self.cut: CutTimes | None = None
        self.stops: list[Stop] = []
        self.jobs: list[list[Job]] = [[] for _ in supply.trucks]
        self.begins = [standing_motion(cart, pose, 0.0) for pose in supply.trucks]
        self.turns = [0] * len(supply.trucks)
        # Nothing that begins before this is changed any more; a cart that has failed.
        self.settled, self.failed = -np.inf, -1

    def see(self, plans: list[TimedPath]) -> None:
        """Look at the world anew, for plans of the combines; give up what has become impossible."""
        before, stops = self.plans, len(self.stops)
        since = _first_difference(before, plans)
        cut = cut_times(self.field, self.combine, plans, self.cut, since)
        ground = open_ground(self.field, cut)
        if self.roadmap is None:
            self.roadmap = make_roadmap(ground, self.cart, self.lines)
        else:
            self.roadmap = reopened(self.roadmap, ground, self.cart, since)
        self.plans, self.ground, self.cut = plans, ground, cut
        self.combines = combine_traffic(self.combine, plans)
        self.planner = RoutePlanner(
            ground, self.cart, self.roadmap, self.combines, getattr(self, "planner", None), since
        )
        self.windows: list[Window] | None = None
        self._known_ways: dict[tuple[int, int], np.ndarray] = {}
        self._give_up_impossible(before, since)
        if len(self.stops) < stops:
            # Stops for what was given up are not needed any more.
            self.see(self.retime(self.stops))
            return
        self._fill_tanks()

    def _fill_tanks(self) -> None:
        """Account for what is cut and what the visits take."""
        assert self.cut is not None, "the world has been seen"
        ends = [plan.end for plan in self.plans]
        self.tanks = make_tanks(self.combine, self.cut, self.supply.density, ends)
        for visit in self.visits:
            self.tanks[visit.combine].take(Pour(visit.begin, visit.end, visit.taken))

    @property
    def carts(self) -> range:
        """Their numbers."""
        return range(len(self.jobs))

    @property
    def visits(self) -> list[Visit]:
        """All that are planned."""
        return [job.visit for jobs in self.jobs for job in jobs if job.visit]

    def run(self) -> None:
        """Serve until nothing is left; `left` tells if there was no end of it."""
        for _ in range(self._most_rounds()):
            if any(self._room(cart) < LEAST * self.combine.capacity for cart in self.carts):
                self._empty_carts(self.cart.capacity - self.combine.capacity)
            full = np.array([tank.full_at() for tank in self.tanks])
            left = np.array([tank.left for tank in self.tanks])
            if (full == np.inf).all() and (left <= EMPTY).all():
                break
            missed = self._serve_in_windows(full)
            if missed is None:
                continue
            if full[missed] < np.inf:
                self._stop(missed, float(full[missed]))
            else:
                self._collect()
        self._empty_carts(0.0)

    def fail(self, failure: Failure) -> None:
        """Give up all that has not begun when a cart fails; it serves nobody any more.

        What has begun, and the stops of combines, stay as they are: so what is driven until then
        is the same with and without the failure.
        """
        self.settled, self.failed = failure.time, failure.cart
        self.jobs = [[job for job in jobs if not self._is_open(job)] for jobs in self.jobs]
        self._fill_tanks()

    def _is_open(self, job: Job) -> bool:
        """Whether a job has not begun yet."""
        return float(job.motion.timed.times[0]) >= self.settled

    def _most_rounds(self) -> int:
        """How many visits there may be, with those that are given up and planned again."""
        tanks = sum(tank.left for tank in self.tanks) / self.combine.capacity
        return 40 + 10 * len(self.plans) + int(3 * tanks / LEAST / 2)

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
                recent = [job.motion for job in jobs if job.end >= begin] or [
                    job.motion for job in jobs[-1:]
                ]
                first = len(jobs) - len(recent)
                start = jobs[first - 1].motion if first else self.begins[k]
                rest = standing_motion(
                    self.cart, start.last_pose, start.timed.end, start.last_angle
                )
                motions.append(join_motions([rest, *recent]))
        return cart_traffic(self.cart, motions, len(self.plans), begin)

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
                    others = self._others(cart, float(job.motion.timed.times[0]))
                    if job.end > since and not self._keeps_off(job.motion, others, 0.0):
                        self._give_up(cart, number)
                        given_up = True
                        break

    def _give_up(self, cart: int, number: int) -> None:
        if not self._is_open(self.jobs[cart][number]):
            raise _TooLate
        lost = {job.stop for job in self.jobs[cart][number:] if job.stop}
        self.jobs[cart] = self.jobs[cart][:number]
        self.stops = [stop for stop in self.stops if stop not in lost]

    def _is_possible(self, job: Job, before: list[TimedPath]) -> bool:
        if job.visit:
            times = np.linspace(job.visit.begin, job.visit.end, 9)
            old, new = (each[job.visit.combine].station_at(times) for each in (before, self.plans))
            if np.abs(old - new).max() > SAME:
                return False
        timed = job.motion.timed
        times = np.arange(timed.times[0], timed.end + 1.0, 1.0)
        tractor, trailer = job.motion.poses_at(times)
        boxes = self.planner.boxes
        opens = np.maximum(
            opens_along(self.ground, boxes[0], tractor), opens_along(self.ground, boxes[1], trailer)
        )
        ends = np.array([job.motion.last_pose])
        return bool((opens <= times).all()) and (
            self._keeps_off(job.motion, self.combines, 0.0)
            and bool(self.planner.is_free_for_ever(ends, job.end)[0])
        )

    def _keeps_off(self, motion: CartMotion, others: Traffic, more: float = BETWEEN) -> bool:
        times = np.arange(motion.timed.times[0], motion.timed.end + 0.5, 0.5)
        tractor, trailer = motion.poses_at(times)
        gaps = least_gaps(others, self.planner.boxes, tractor, trailer, times)
        return bool((gaps >= GAP + more).all())

    # Visits in windows.

    def _serve_in_windows(self, full: np.ndarray) -> int | None:
        """Plan the visit that comes next; the number of a combine that has to wait if none can."""
        targets = []
        for cart in self.carts:
            if cart == self.failed:
                continue
            stands = self._standing(cart)
            for number in range(len(self.plans)):
                target = self._target(number, cart, stands, float(full[number]))
                if target is not None:
                    targets.append(target)
        while targets:
            reached = {target.combine for target in targets}
            missed = [n for n in range(len(full)) if n not in reached and full[n] < np.inf]
            target, due = self._next(targets)
            tried = target.tried(due)
            first = min(missed, key=lambda n: full[n], default=-1)
            if first >= 0 and full[first] < target.moments[tried[0]]:
                return first
            for k in tried:
                window = self.windows_of()[target.windows[k]]
                if self._visit(target.cart, window, float(target.moments[k])):
                    self.turns[target.cart] = target.combine + 1
                    return None
            targets.remove(target)
        return int(np.argmin(full))

    def windows_of(self) -> list[Window]:
        """All windows in this world."""
        if self.windows is None:
            self.windows = find_windows(
                self.combine, self.cart, self.plans, self.ground, self.combines
            )
            spans = [np.arange(w.begin, w.end, LOOKED) for w in self.windows]
            self._moments = np.concatenate([np.zeros(0), *spans])
            self._of_window = np.repeat(np.arange(len(spans)), [len(s) for s in spans])
            poses = [
                w.lane.path.pose_at(w.lane.stations(self.plans[w.combine].station_at(span)))
                for w, span in zip(self.windows, spans, strict=True)
            ]
            self._node_of_moment = self._nodes_near(np.concatenate([np.zeros((0, 3)), *poses]))
        return self.windows

    def _nodes_near(self, poses: np.ndarray) -> np.ndarray:
        """The node of the roadmap that is most like each pose, shape (n,)."""

        def places(each: np.ndarray) -> np.ndarray:
            turned = LIKE * np.stack([np.cos(each[:, 2]), np.sin(each[:, 2])], axis=1)
            return np.hstack([each[:, :2], turned])

        return np.asarray(KDTree(places(self.planner.roadmap.nodes)).query(places(poses))[1])

    def _ways(self, node: int, to: np.ndarray, times: np.ndarray) -> np.ndarray:
        """How long ways take, at least, over ground that is open when they end, shape (n,) [s].

        Args:
            node: From it.
            to: Nodes, shape (n,).
            times: When they end, shape (n,) [s].
        """
        found = np.full(len(to), np.inf)
        turns = np.ceil(times / OFTEN).astype(int)
        for turn in np.unique(turns):
            if (node, turn) not in self._known_ways:
                edges = self.planner.roadmap.edges
                count = len(self.planner.roadmap.nodes)
                open_by_then = np.flatnonzero(edges.opens <= turn * OFTEN)
                ends = edges.source[open_by_then], edges.target[open_by_then]
                links = csr_array((edges.duration[open_by_then], ends), shape=(count, count))
                self._known_ways[node, turn] = dijkstra(links, indices=node)
            found[turns == turn] = self._known_ways[node, turn][to[turns == turn]]
        return found

    def _target(self, number: int, cart: int, stands: Standing, full: float) -> _Target | None:
        """When a cart would come to a combine."""
        windows = self.windows_of()
        if self.strategy == "sequential" and not self._is_mine(number, cart):
            return None
        tank, plan = self.tanks[number], self.plans[number]
        if full == np.inf and tank.left <= EMPTY:
            return None
        room, rate = self._room(cart), self.combine.unload_rate
        of = self._of_window
        combine_of = np.array([w.combine for w in windows], dtype=int)
        ends = np.array([w.end for w in windows])
        own = (self._moments < min(full, plan.end)) & (self._moments > stands.since)
        own[own] &= combine_of[of[own]] == number
        at = np.flatnonzero(own)
        if len(at) == 0:
            return None
        moments, until = self._moments[at], ends[of[at]]
        near = int(self._nodes_near(stands.pose[None])[0])
        away = self._ways(near, self._node_of_moment[at], moments)
        there = stands.since + away + RUN_IN / 2 <= moments
        if not there.any():
            return None
        at, moments, until = at[there], moments[there], until[there]
        away = away[there]
        loads = np.interp(moments, tank.times, tank.load)
        filling = np.minimum(self.combine.fill_rate(self.supply.density), 0.9 * rate)
        drained = loads / (rate - filling)
        taken = np.minimum(np.minimum(drained, until - moments) * rate, room)
        useful = taken >= LEAST * tank.capacity
        if full == np.inf:
            useful = taken >= min(LEAST * tank.capacity, max(0.8 * tank.left, EMPTY))
        if not useful.any():
            return None
        good = useful & (loads >= self.threshold * tank.capacity)
        good &= taken >= 0.8 * np.minimum(loads, room)
        if not good.any():
            good = useful & (taken >= 0.97 * taken[useful].max())
        chosen = np.flatnonzero(useful)
        first = int(np.argmax(good[chosen]))
        return _Target(
            number,
            cart,
            moments[chosen],
            of[at[chosen]],
            first,
            float(moments[chosen[-1]]) if full < np.inf else np.inf,
            float(taken[chosen[first]]) / rate + AROUND,
            self._node_of_moment[at[chosen]],
        )

    def _is_mine(self, number: int, cart: int) -> bool:
        if self.failed >= 0:
            return cart != self.failed
        if len(self.plans) >= len(self.jobs):
            return number % len(self.jobs) == cart
        return cart % len(self.plans) == number

    def _next(self, targets: list[_Target]) -> tuple[_Target, float]:
        """Whom to serve next, and by when: as the strategy says, if others can wait so long."""
        carts = len(self.jobs)
        if self.strategy == "sequential":
            # The cart that is free first serves its own.
            cart = min(targets, key=lambda t: self._standing(t.cart).since).cart
            targets, carts = [target for target in targets if target.cart == cart], 1
        # Carts come to one combine after the other: whoever is due comes before those due later.
        by_combine = {t.combine: t for t in sorted(targets, key=lambda t: -t.deadline)}
        order = sorted(by_combine.values(), key=lambda t: t.deadline)
        due = [t.deadline for t in order]
        for k in range(len(order) - carts - 1, -1, -1):
            due[k] = min(due[k], due[k + carts] - self._lasts(order[k], order[k + carts]))
        dues = {t.combine: d for t, d in zip(order, due, strict=True)}

        def rank(target: _Target) -> tuple[float, float]:
            begin = min(float(target.moments[target.first]), dues[target.combine])
            if self.strategy == "sequential":
                turn = (target.combine - self.turns[target.cart]) % len(self.plans)
                return float(turn), begin
            return begin, float(target.cart)

        first = min(targets, key=rank)
        begin = rank(first)[-1 if self.strategy == "sequential" else 0]
        pressed = [
            t
            for t in targets
            if carts == 1
            and dues[t.combine] < dues[first.combine]
            and dues[t.combine] < begin + self._lasts(first, t)
        ]
        if pressed:
            first = min(pressed, key=lambda t: dues[t.combine])
        return first, dues[first.combine]

    def _lasts(self, target: _Target, following: _Target) -> float:
        """Time from the beginning of one visit to that of the next one at its deadline, about."""
        node, last = int(target.nodes[target.first]), slice(-1, None)
        way = self._ways(node, following.nodes[last], following.moments[last])
        return target.lasts + min(float(way[0]), LONGEST)

    def _visit(self, cart: int, window: Window, begin: float) -> bool:
        """Plan the way there, beside the combine and off again; commit it if all three exist."""
        stands = self._standing(cart)
        others = self._others(cart, max(stands.since, begin - LONGEST - 5.0))
        number = window.combine
        tank, plan, room = self.tanks[number], self.plans[number], self._room(cart)
        pour = tank.pour(begin, window.end, room)
        if pour.end - begin < 4.0:
            return False
        beside_it = drive_beside(plan, window.lane, begin, window.end)
        start = Moving(begin, float(beside_it.speeds[0]))
        if start.speed < SLOWEST:
            return False
        pose = beside_it.path.poses[0]
        to = self.planner.route_to(stands, pose, start, others)
        if to is None:
            return False
        for later in LEAVING:
            end = min(pour.end + later, window.end)
            if end <= begin + 4.0:
                continue
            taken = tank.pour(begin, end, room)
            if taken.taken < 0.5 * pour.taken:
                continue
            timed = drive_beside(plan, window.lane, begin, end)
            if timed.speeds[-1] < SLOWEST:
                continue
            stay = CartMotion(timed, self.cart, to.last_angle)
            if not self._keeps_off(stay, self.combines) or not self._keeps_off(stay, others):
                continue
            visit = Visit(cart, number, begin, taken.end, taken.taken)
            leaves = Moving(end, float(timed.speeds[-1]))
            if self._leave(cart, [to, stay], leaves, visit, others, None):
                return True
        return False

    def _leave(
        self,
        cart: int,
        motions: list[CartMotion],
        leaves: Moving,
        visit: Visit,
        others: Traffic,
        stop: Stop | None,
    ) -> bool:
        """Find the way off, to the truck if it is time, and commit all."""
        load = self._load(cart) + visit.taken
        goals = [None]
        if self.cart.capacity - load < self.combine.capacity:
            goals = [self.supply.trucks[cart], None]
        stay = motions[-1]
        for goal in goals:
            off = self.planner.route_from(stay.last_pose, stay.last_angle, leaves, others, goal)
            if off is None:
                continue
            self.tanks[visit.combine].take(Pour(visit.begin, visit.end, visit.taken))
            end = off.timed.end
            trip = None
            if goal is not None:
                trip = Trip(cart, end, end + load / self.supply.truck_rate, load)
            self.jobs[cart].append(Job(join_motions([*motions, off]), visit, trip, stop))
            return True
        return False

    # Trucks.

    def _empty_carts(self, most: float) -> None:
        """Send carts to their trucks that hold more than they should; idle ones make way."""
        waiting = [cart for cart in self.carts if self._load(cart) > most]
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
            off = self.planner.route_from(stands.pose, stands.beta, start, others, goal)
            if off is not None:
                end = off.timed.end
                lasts = load / self.supply.truck_rate
                trip = Trip(cart, end, end + lasts, load) if load > 0 else None
                self.jobs[cart].append(Job(off, None, trip, None))
                return True
        return False

    def _begins(self, first: float) -> list[float]:
        """Moments at which to set out, until all machines have come to stand."""
        ends = [job.end for jobs in self.jobs for job in jobs[-1:]]
        end = max(first, *ends, *(plan.end for plan in self.plans))
        later = [first + wait - SET_OUT[0] for wait in SET_OUT]
        return [*(moment for moment in later if moment <= end), end]

    # Combines that stand.

    def _collect(self) -> None:
        """Fetch what is left in a tank when its combine has done its work."""
        numbers = [n for n, tank in enumerate(self.tanks) if tank.left > EMPTY]
        numbers.sort(key=lambda n: self.plans[n].end)
        for number in numbers:
            if self._visit_standing(number, None):
                return
        poses = [np.round(self.plans[n].path.poses[-1, :2], 1).tolist() for n in numbers]
        raise NoPlan(f"`carts` must find ways to where combines park; got none to {poses[0]}")

    def _stop(self, number: int, full: float) -> None:
        """Let a combine wait: at the last place before its tank is full that a cart gets to."""
        plan = self.plans[number]
        served = max((v.end for v in self.visits if v.combine == number), default=0.0)
        soonest = max(served, self.settled) + 4.0
        times = np.arange(full - 4.0, soonest, -5.0)
        found: list[float] = []
        for ready, apart in ((True, 14.0), (False, 60.0)):
            for time in times:
                if len(found) < PLACES_TRIED and all(abs(time - t) >= apart for t in found):
                    poses = self._standing_poses(
                        plan.pose_at(time), float(time) if ready else np.inf, None
                    )
                    if len(poses):
                        found.append(float(time))
        kept = self._state()
        # Rather not where that undoes what another combine stops for.
        for gentle in (True, False) if self.stops else (False,):
            for time in found or [max(full - 4.0, self.settled + 4.0, 0.0)]:
                stop = Stop(number, float(plan.station_at(time)), FOR_EVER)
                self.stops.append(stop)
                if (
                    self._see_again()
                    and self._visit_standing(number, stop)
                    and (not gentle or len(self.stops) > len(kept["stops"]))
                ):
                    return
                self.__dict__.update(kept)
                kept = self._state()
        raise NoPlan(
            f"`carts` must find ways to combines that wait; got none to combine {number} near "
            f"{np.round(plan.pose_at(full)[:2], 1).tolist()}"
        )

    def _see_again(self) -> bool:
        """Look at the world with its stops; False if that undoes what has begun."""
        try:
            self.see(self.retime(self.stops))
        except _TooLate:
            return False
        return True

    def _state(self) -> dict[str, Any]:
        """What is planned, and the world that it is planned in, to come back to."""
        return {**self.__dict__, "jobs": [[*jobs] for jobs in self.jobs], "stops": [*self.stops]}

    def _visit_standing(self, number: int, stop: Stop | None) -> bool:
        """Serve a combine that stands at the end of its plan, where it waits, or has parked."""
        spent: list[np.ndarray] = []
        for _ in range(PLACES_TRIED):
            found = self._come_to(number, spent)
            if found is None:
                return False
            cart, to = found
            stands_from = self.plans[number].end
            begin = max(to.timed.end, stands_from) + 1.0
            pour = self.tanks[number].pour(begin, np.inf, self._room(cart))
            visit = Visit(cart, number, begin, pour.end, pour.taken)
            motions = [to, standing_motion(self.cart, to.last_pose, begin, to.last_angle)]
            leaves = Moving(pour.end + 1.0, 0.0)
            if stop is None:
                others = self._others(cart, self._standing(cart).since)
                if self._leave(cart, motions, leaves, visit, others, None):
                    return True
            elif self._leave_stop(cart, motions, leaves, visit, stop):
                return True
            spent.append(to.last_pose)
        return False

    def _leave_stop(
        self, cart: int, motions: list[CartMotion], leaves: Moving, visit: Visit, stop: Stop
    ) -> bool:
        """Let a combine go on when it is empty, or later, so that the cart finds a way off."""
        kept, stands_from = self._state(), self.plans[visit.combine].end
        others = self._others(cart, self._standing(cart).since)
        stay = motions[-1]
        # At worst it goes on when the cart has gone.
        first = self.planner.route_from(stay.last_pose, stay.last_angle, leaves, others, None)
        goes_on = [leaves.time + 1.0, leaves.time + 30.0]
        if first is not None:
            goes_on.append(first.timed.end + 2.0)
        for time in goes_on:
            final = stop._replace(duration=time - stands_from)
            self.stops = [each for each in self.stops if each is not stop] + [final]
            seen = self._see_again()
            others = self._others(cart, self._standing(cart).since)
            same = seen and len(self.jobs[cart]) == len(kept["jobs"][cart])
            if same and self._leave(cart, motions, leaves, visit, others, final):
                return True
            self.__dict__.update(kept)
            kept = self._state()
        return False

    def _come_to(self, number: int, spent: list[np.ndarray]) -> tuple[int, CartMotion] | None:
        """Who comes first to a combine that stands, and how.

        Args:
            number: Of the combine.
            spent: Poses that were tried in vain.
        """
        stands_from = self.plans[number].end
        pose = self.plans[number].pose_at(stands_from)
        best: tuple[int, CartMotion] | None = None
        for cart in self._by_distance(pose):
            stands = self._standing(cart)
            others = self._others(cart, stands.since)
            places = self._standing_poses(pose, np.inf, others)
            for each in spent:
                places = places[np.hypot(*(places - each)[:, :2].T) > 0.1]
            places = self.planner.with_ways_off(places)[:TOGETHER]
            if len(places) == 0:
                continue
            for begin in self._begins(max(stands.since, stands_from + SET_OUT[0])):
                if best is not None and begin >= best[1].timed.end:
                    break
                start = Moving(begin, 0.0)
                to = self.planner.route_from(stands.pose, stands.beta, start, others, places)
                if to is not None:
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

    def _standing_poses(self, pose: np.ndarray, time: float, others: Traffic | None) -> np.ndarray:
        """Poses of the tractor in which the auger of a standing combine reaches, shape (n, 3)."""
        reach = self.place.left
        forth = self.cart.hitch_offset + self.cart.length * (1.0 - MIDDLE)
        c, s = math.cos(pose[2]), math.sin(pose[2])
        left, ahead, turn = np.array([(1.0, 0.0, 0.0), *PLACES]).T
        course = pose[2] + turn
        x = pose[0] + reach * (c * ahead - s * left) + forth * np.cos(course)
        y = pose[1] + reach * (s * ahead + c * left) + forth * np.sin(course)
        every = np.column_stack([x, y, course])
        opens = node_opens(self.ground, self.cart, every)
        every = every[(opens <= time) & (opens < np.inf)]
        behind = trailer_poses(every, np.zeros(len(every)), self.cart)
        times = np.full(len(every), min(time, 1e7))
        fits = np.ones(len(every), dtype=bool)
        for traffic in (self.combines, *([others] if others else [])):
            gaps = least_gaps(traffic, self.planner.boxes, every, behind, times)
            fits &= gaps >= GAP + BETWEEN
        return every[fits]

    def result(self) -> CartPlan:
        """What was planned."""
        jobs = [job for each in self.jobs for job in each]
        return CartPlan(
            self.plans,
            [
                join_motions([start, *(job.motion for job in each)])
                for start, each in zip(self.begins, self.jobs, strict=True)
            ],
            sorted(self.visits, key=lambda visit: visit.begin),
            sorted((job.trip for job in jobs if job.trip), key=lambda trip: trip.begin),
            list(self.stops),
            sum(tank.left for tank in self.tanks) + sum(map(self._load, range(len(self.jobs)))),
            self.jobs,
        )


def _first_difference(before: list[TimedPath], after: list[TimedPath]) -> float:
    """When machines begin to be elsewhere than they were to be [s]."""
    if not before:
        return -1.0
    times = np.arange(0.0, max(plan.end for plan in [*before, *after]) + 2.0, 1.0)
    differs = np.zeros(len(times), dtype=bool)
    for old, new in zip(before, after, strict=True):
        differs |= np.abs(old.station_at(times) - new.station_at(times)) > SAME
    return float(times[np.argmax(differs)]) - 1.0 if differs.any() else np.inf
