"""Routes: how a cart gets beside a combine that goes on working, or to its truck."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...planning.dubins import dubins_lengths, dubins_paths
from ..machines.cart import Cart, hitch_of
from .clearance import crop_under, gap_to_combines, outline, outline_at
from .detours import COARSE, arrivals, clear_times, distances_to, nearest_arrival
from .ground import Ground, Traffic
from .optimal import optimal_way
from .refuge import refuges
from .route import Meeting, Route, staying_at
from .search import search_way
from .surroundings import EARLY, GAPS, Surroundings, surroundings_of
from .way import STEP, along_arcs, way_of_poses

# Ways are planned with such a multiple of the least turning radius: the rest is for steering, and
# a trailer folds up if its tractor circles on the radius of the trailer's length.
ROOM = 1.1
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
        around = surroundings_of(self.cart, self.ground, traffic, self._outline, state)
        soonest = self._soonest(state, time, meeting)
        if soonest is not None and not self._crop_between(traffic, state, soonest, meeting):
            route = self._direct(around, state, time, soonest, meeting, LATER)
            if route is not None:
                return route
        return self._searched(around, state, time, meeting)

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
        around = surroundings_of(self.cart, self.ground, traffic, self._outline, state)
        for place in places:
            there = staying_at(place)
            soonest = self._soonest(state, time, there)
            if soonest is None:
                continue
            route = self._direct(around, state, time, soonest, there, LATER[:1])
            if route is not None:
                return route
        return None

    def has_room(self, traffic: Traffic, pose: np.ndarray) -> bool:
        """Whether a cart may stand at a pose of its tractor, shape (3,), now."""
        cart = self.cart
        state = np.append(pose, 0.0)
        placed = outline_at(self._outline, cart.length, cart.hitch_offset, state)
        if crop_under(self.ground, traffic, placed, traffic.time, 0.0) > 0:
            return False
        return bool(gap_to_combines(traffic, placed, traffic.time) > GAPS[0])

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
        around: Surroundings,
        state: np.ndarray,
        time: float,
        soonest: float,
        meeting: Meeting,
        later: Sequence[float],
    ) -> Route | None:
        """The first car's path that is clear, to a meeting some time after the soonest."""
        stays = around.stays_until(state, time, soonest + later[-1])
        for arrive in soonest + np.array(later):
            goal = meeting(np.array([arrive]))[0]
            if np.isfinite(goal[0]):
                route = self._car_path(around, state, time, float(arrive), goal, stays)
                if route is not None:
                    return route
        return None

    def _car_path(
        self,
        around: Surroundings,
        state: np.ndarray,
        time: float,
        arrive: float,
        goal: np.ndarray,
        stays: float,
    ) -> Route | None:
        radius, speed = ROOM * self.cart.turning_radius, self.cart.speed
        paths = dubins_paths(state[:3].tolist(), goal.tolist(), radius)
        for path in paths:
            if path.length > paths[0].length + DETOUR * radius:
                break
            depart = max(time, arrive - path.length / speed)
            if depart > stays:
                continue
            count = max(2, math.ceil(path.length / STEP) + 1)
            way = way_of_poses(
                path.poses(np.linspace(0.0, path.length, count)), float(state[3]), self.cart, "car"
            )
            if depart + way.length / speed > arrive + 1.0:
                continue
            if around.is_clear(way, depart):
                if self.exact:
                    best = optimal_way(self.cart, state, goal, way)
                    if best is not None and around.is_clear(best, depart):
                        way = best
                return Route(way, depart, depart + way.length / speed)
        return None

    def _searched(
        self, around: Surroundings, state: np.ndarray, time: float, meeting: Meeting
    ) -> Route | None:
        times, goals = self._goals(time, meeting)
        if not len(times):
            return None
        clear = clear_times(self.ground, around.traffic)
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
            found = self._search(around, state, time, away, near * self.cart.turning_radius)
            if len(found) == 0:
                return None
            if len(found) == 1:
                continue
            last = found[-1]
            soonest = self._soonest(last[:4], last[4], meeting)
            if soonest is None:
                continue
            rest = self._direct(around, last[:4], float(last[4]), soonest, meeting, LATER)
            if rest is not None:
                return self._joined(state, time, found, rest)
        return None

    def _search(
        self, around: Surroundings, state: np.ndarray, time: float, away: np.ndarray, near: float
    ) -> np.ndarray:
        return search_way(
            self.ground,
            around.traffic,
            around.points,
            hitch_of(self.cart),
            self.cart.speed,
            ROOM * self.cart.turning_radius,
            np.ascontiguousarray(state),
            time,
            away,
            near,
            EARLY,
            around.gaps,
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
