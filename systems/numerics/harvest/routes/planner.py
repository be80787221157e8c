"""Routes: how a cart gets beside a combine that goes on working, or to its truck."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...planning.dubins import dubins_lengths, dubins_paths
from ..machines.cart import Cart, hitch_of
from .clearance import crop_under, gap_to_combines, outline, outline_at, way_is_clear
from .detours import COARSE, arrivals, clear_times, distances_to, nearest_arrival
from .ground import Ground, Traffic
from .optimal import optimal_way
from .others import gap_to_carts
from .refuge import refuges
from .route import Meeting, Route, staying_at
from .search import FOLDED, search_way
from .way import STEP, Way, along_arcs, way_of_poses

# Crop has to be gone so much before a cart comes, and combines keep away so much longer [s].
EARLY = 3.0
# Ways are planned with such a multiple of the least turning radius: the rest is for steering, and
# a trailer folds up if its tractor circles on the radius of the trailer's length.
ROOM = 1.1
# To keep from combines on the way, and from other carts [m].
GAPS = (1.0, 3.0)
# By how much later than soonest a meeting is tried [s].
LATER = (0.0, 3.0, 7.0, 12.0, 20.0, 30.0, 45.0, 60.0, 90.0, 150.0)
# How much longer than the shortest car path one is still tried, in turning radii.
DETOUR = 14.0
# With so much crop straight ahead car's paths are not tried [m].
WIDE = 15.0
# Of searches: nodes.
NODES = 5_000
# How long from now meetings are looked at [s].
AHEAD = np.concatenate([np.arange(0.0, 300.0, 2.0), np.arange(300.0, 1801.0, 10.0)])
# How near searches are to come to a meeting; from there on a car's path is tried, in radii.
NEAR = (12.0, 6.0, 2.5)
# How much longer than over coarse cells a way is taken to be, and for how long after the soonest
# meeting one is aimed at [s].
SLOWER, WINDOW = 1.15, 30.0


@dataclass(frozen=True, eq=False)
class RoutePlanner:
    """What routes are planned with.

    Attributes:
        cart: The cart.
        ground: Raster.
        exact: Replace a car's path by the time-optimal one of the cart, trailer and all, where
            that is as clear.
    """

    cart: Cart
    ground: Ground
    exact: bool = False

    @cached_property
    def _outline(self) -> np.ndarray:
        return outline(self.cart)

    def plan(
        self, traffic: Traffic, state: np.ndarray, time: float, meeting: Meeting
    ) -> Route | None:
        """The soonest way found to a meeting.

        First the Dubins paths, which are time-optimal for the tractor in the open field (3.5), to
        where the meeting will be when they are driven; if all of them cross crop or combines, a
        search.

        Args:
            traffic: Combines.
            state: x, y, theta, beta of the cart, shape (4,).
            time: Now [s].
            meeting: Where the tractor is to be, over time.
        """
        gaps = self._gaps(traffic, state)
        soonest = self._soonest(state, time, meeting)
        if soonest is not None and not self._crop_between(traffic, state, soonest, meeting):
            for later in LATER:
                route = self._direct(traffic, state, time, soonest + later, meeting, gaps)
                if route is not None:
                    return route
        return self._searched(traffic, state, time, meeting, gaps)

    def _crop_between(
        self, traffic: Traffic, state: np.ndarray, time: float, meeting: Meeting
    ) -> bool:
        """Whether so much crop is between a cart and a meeting that no car's path helps."""
        goal = meeting(np.array([time]))[0]
        count = 2 + int(math.dist(state[:2], goal[:2]) / STEP)
        line = np.linspace(state[:2], goal[:2], count)
        return bool(crop_under(self.ground, traffic, line, time, 0.0) * STEP > WIDE)

    def aside(self, traffic: Traffic, state: np.ndarray, time: float) -> Route | None:
        """A short way to a place where a cart is not in the way of others; see `plan`."""
        places = refuges(self.ground, traffic, self.cart, state)
        route = self.to_any(traffic, state, time, places)
        return route and replace(route, way=replace(route.way, kind="aside"))

    def to_any(
        self, traffic: Traffic, state: np.ndarray, time: float, places: Sequence[np.ndarray]
    ) -> Route | None:
        """A car's path to the first of some poses, shape (3,) each, that has one; see `plan`."""
        gaps = self._gaps(traffic, state)
        for place in places:
            there = staying_at(place)
            soonest = self._soonest(state, time, there)
            if soonest is None:
                continue
            route = self._direct(traffic, state, time, soonest, there, gaps)
            if route is not None:
                return route
        return None

    def has_room(self, traffic: Traffic, pose: np.ndarray) -> bool:
        """Whether a cart may stand at a pose of its tractor, shape (3,), now."""
        cart = self.cart
        placed = outline_at(self._outline, cart.length, cart.hitch_offset, np.append(pose, 0.0))
        if crop_under(self.ground, traffic, placed, traffic.time, 0.0) > 0:
            return False
        return bool(gap_to_combines(traffic, placed, traffic.time) > GAPS[0])

    def _gaps(self, traffic: Traffic, state: np.ndarray) -> np.ndarray:
        """What to keep from combines and from other carts, shape (2,) [m].

        Less if one is nearer already, so that a cart gets away.
        """
        cart = self.cart
        placed = outline_at(self._outline, cart.length, cart.hitch_offset, state)
        now = traffic.time
        near = [gap_to_combines(traffic, placed, time) for time in (now, now + EARLY)]
        beside = [gap_to_carts(traffic.others, placed, late) for late in (0.0, EARLY)]
        return np.minimum(GAPS, 0.999 * np.array([min(near), min(beside)]))

    def _soonest(self, state: np.ndarray, time: float, meeting: Meeting) -> float | None:
        """When a tractor alone could be there [s]."""
        times, goals = self._goals(time, meeting)
        if not len(times):
            return None
        ways = dubins_lengths(state[:3].tolist(), goals, ROOM * self.cart.turning_radius)
        early = np.flatnonzero(time + ways / self.cart.speed <= times)
        return float(times[early[0]]) if len(early) else None

    def _goals(self, time: float, meeting: Meeting) -> tuple[np.ndarray, np.ndarray]:
        """When there is a meeting, shape (m,) [s], and where, shape (m, 3)."""
        times = time + AHEAD
        poses = meeting(times)
        there = np.isfinite(poses[:, 0])
        return times[there], poses[there]

    def _direct(
        self,
        traffic: Traffic,
        state: np.ndarray,
        time: float,
        arrive: float,
        meeting: Meeting,
        gaps: np.ndarray,
    ) -> Route | None:
        goal = meeting(np.array([arrive]))[0]
        if not np.isfinite(goal[0]):
            return None
        radius, speed = ROOM * self.cart.turning_radius, self.cart.speed
        paths = dubins_paths(state[:3].tolist(), goal.tolist(), radius)
        for path in paths:
            if path.length > paths[0].length + DETOUR * radius:
                break
            count = max(2, math.ceil(path.length / STEP) + 1)
            way = way_of_poses(
                path.poses(np.linspace(0.0, path.length, count)), float(state[3]), self.cart, "car"
            )
            depart = max(time, arrive - path.length / speed)
            if depart + way.length / speed > arrive + 1.0:
                continue
            if not self._stands_clear(traffic, state, time, depart, gaps):
                continue
            if self._is_clear(traffic, way, depart, gaps):
                if self.exact:
                    best = optimal_way(self.cart, state, goal, way)
                    if best is not None and self._is_clear(traffic, best, depart, gaps):
                        way = best
                return Route(way, depart, depart + way.length / speed)
        return None

    def _is_clear(self, traffic: Traffic, way: Way, depart: float, gaps: np.ndarray) -> bool:
        times = depart + way.distances / self.cart.speed
        betas = np.abs(way.states[:, 3])
        if betas.max() > max(FOLDED, betas[0]):
            return False
        # Where it stands already it may stand.
        conflict = self._first_conflict(traffic, way.states[0], way.states[2:], times[2:], gaps)
        return conflict == max(len(times) - 2, 0)

    def _stands_clear(
        self, traffic: Traffic, state: np.ndarray, time: float, until: float, gaps: np.ndarray
    ) -> bool:
        times = np.arange(time + 1.0, until, 2.0)
        states = np.tile(state, (len(times), 1))
        return self._first_conflict(traffic, state, states, times, gaps) == len(times)

    def _first_conflict(
        self,
        traffic: Traffic,
        start: np.ndarray,
        states: np.ndarray,
        times: np.ndarray,
        gaps: np.ndarray,
    ) -> int:
        cart, points = self.cart, self._outline
        if not len(times):
            return 0
        placed = outline_at(points, cart.length, cart.hitch_offset, start)
        return way_is_clear(
            self.ground,
            traffic,
            points,
            cart.length,
            cart.hitch_offset,
            np.ascontiguousarray(states),
            times,
            EARLY,
            gaps,
            crop_under(self.ground, traffic, placed, float(times[0]), EARLY),
        )

    def _searched(
        self, traffic: Traffic, state: np.ndarray, time: float, meeting: Meeting, gaps: np.ndarray
    ) -> Route | None:
        times, goals = self._goals(time, meeting)
        if not len(times):
            return None
        clear = clear_times(self.ground, traffic)
        side, corner = COARSE * self.ground.cell, self.ground.corner
        at = arrivals(clear, side, corner, state[:2], time, self.cart.speed / SLOWER)
        soonest = np.array([nearest_arrival(at, side, corner, x, y) for x, y, _ in goals])
        in_time = np.flatnonzero(soonest <= times)
        if not len(in_time):
            return None
        first = float(times[in_time[0]])
        meant = goals[(times >= first) & (times <= first + WINDOW)]
        away = distances_to(clear <= first, side, corner, np.ascontiguousarray(meant[:, :2]))
        for near in NEAR:
            found = self._search(traffic, state, time, away, near * self.cart.turning_radius, gaps)
            if len(found) == 0:
                return None
            if len(found) == 1:
                continue
            last = found[-1]
            soonest = self._soonest(last[:4], last[4], meeting)
            if soonest is None:
                continue
            for later in LATER:
                rest = self._direct(
                    traffic, last[:4], float(last[4]), soonest + later, meeting, gaps
                )
                if rest is not None:
                    return self._joined(state, time, found, rest)
        return None

    def _search(
        self,
        traffic: Traffic,
        state: np.ndarray,
        time: float,
        away: np.ndarray,
        near: float,
        gaps: np.ndarray,
    ) -> np.ndarray:
        cart = self.cart
        return search_way(
            self.ground,
            traffic,
            self._outline,
            hitch_of(cart),
            cart.speed,
            ROOM * cart.turning_radius,
            np.ascontiguousarray(state),
            time,
            away,
            near,
            EARLY,
            gaps,
            NODES,
        )

    def _joined(self, state: np.ndarray, time: float, found: np.ndarray, rest: Route) -> Route:
        """A way that was searched, and a car's path from its end."""
        # Waiting on the way is left to whoever drives: it looks ahead.
        moved = np.append(True, np.hypot(*np.diff(found[:, :2], axis=0).T) > 1e-6)
        depart = time
        if len(found) > 1 and not moved[1]:
            depart = float(found[int(np.argmax(moved[1:])), 4])
        poses = along_arcs(found[moved, :3])
        poses = np.vstack([poses, rest.way.states[1:, :3]])
        way = way_of_poses(poses, float(state[3]), self.cart, "search")
        return Route(way, depart, rest.arrive)
