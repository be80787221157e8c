"""Routes: how a cart gets beside a combine that goes on working, or to its truck."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...planning.dubins import dubins_lengths, dubins_paths
from ...planning.extremals.planner import plan_by_extremals
from ...planning.goal import Goal
from ..machines.cart import Cart, hitch_of
from .clearance import gap_to_combines, outline, outline_at, way_is_clear
from .detours import COARSE, coarse_ground, distances_to
from .ground import Ground, Traffic
from .search import FOLDED, search_way, to_go_from
from .way import STEP, Way, way_of_poses

# Crop has to be gone so much before a cart comes, and combines keep away so much longer [s].
EARLY = 3.0
# Ways are planned with such a multiple of the least turning radius: the rest is for steering, and
# a trailer folds up if its tractor circles on the radius of the trailer's length.
ROOM = 1.1
# To keep from combines on the way [m].
GAP = 1.0
# By how much later than soonest a meeting is tried [s].
LATER = (0.0, 3.0, 7.0, 12.0, 20.0, 30.0, 45.0, 60.0, 90.0, 150.0)
# How much longer than the shortest car path one is still tried, in turning radii.
DETOUR = 14.0
# Of searches: nodes, and goals in a row with the time between them [s].
NODES, GOALS, BETWEEN = 10_000, 150, 2.0
# How near searches are to come to a meeting; from there on a car's path is tried, in radii.
NEAR = (12.0, 6.0, 2.5)
# How much longer than over coarse cells a way is taken to be, and for how long after the soonest
# meeting one is aimed at [s].
SLOWER, WINDOW = 1.15, 30.0
# With which trailer angle a path of the planning story ends [rad].
STRAIGHT = 0.1

# x, y, theta of the tractor where it is to be at a time [s]; None: nowhere.
Meeting = Callable[[float], np.ndarray | None]


@dataclass(frozen=True)
class Route:
    """A way, and when to set out.

    Attributes:
        way: To drive.
        depart: When [s].
        arrive: When it is driven [s].
    """

    way: Way
    depart: float
    arrive: float


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

    def plan(
        self, traffic: Traffic, state: np.ndarray, time: float, meeting: Meeting
    ) -> Route | None:
        """The soonest way found to a meeting.

        First the Dubins paths, which are time-optimal for the tractor in the open field (3.5), to
        where the meeting will be when they are driven; if all of them cross crop or combines, a
        search.

        Args:
            traffic: Combines.
            state: x, y, theta, beta of the cart.
            time: Now [s].
            meeting: Where the tractor is to be, over time.
        """
        gap = self._gap(traffic, state)
        soonest = self._soonest(state, time, meeting)
        if soonest is not None:
            for later in LATER:
                route = self._direct(traffic, state, time, soonest + later, meeting, gap)
                if route is not None:
                    return route
        return self._searched(traffic, state, time, meeting, gap)

    def _gap(self, traffic: Traffic, state: np.ndarray) -> float:
        """What to keep from combines; less if one is nearer already, so that a cart gets away."""
        cart = self.cart
        placed = outline_at(outline(cart), cart.length, cart.hitch_offset, state)
        times = (traffic.time, traffic.time + EARLY)
        return min(GAP, *(0.999 * gap_to_combines(traffic, placed, time) for time in times))

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
        at = time + BETWEEN * np.arange(GOALS)
        found = [(t, pose) for t in at.tolist() if (pose := meeting(t)) is not None]
        times = np.array([t for t, _ in found])
        return times, np.array([pose for _, pose in found]).reshape(-1, 3)

    def _direct(
        self,
        traffic: Traffic,
        state: np.ndarray,
        time: float,
        arrive: float,
        meeting: Meeting,
        gap: float,
    ) -> Route | None:
        goal = meeting(arrive)
        if goal is None:
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
            if not self._stands_clear(traffic, state, time, depart, gap):
                continue
            if self._is_clear(traffic, way, depart, gap):
                if self.exact:
                    way = self._optimal(traffic, state, goal, depart, way, gap) or way
                return Route(way, depart, depart + way.length / speed)
        return None

    def _optimal(
        self,
        traffic: Traffic,
        state: np.ndarray,
        goal: np.ndarray,
        depart: float,
        way: Way,
        gap: float,
    ) -> Way | None:
        """The time-optimal path with its trailer straight at the end, if it is clear."""
        trailer = self.cart.trailer
        plan = plan_by_extremals(
            trailer,
            state.tolist(),
            Goal(state=(*goal.tolist(), 0.0), tolerance=(0.0, 0.0, 0.0, STRAIGHT)),
        )
        if plan.path is None or not plan.converged:
            return None
        if plan.time > way.length / self.cart.speed + 4.0:
            return None
        count = max(2, math.ceil(plan.time * self.cart.speed / STEP) + 1)
        at = np.linspace(0.0, plan.path.times[-1], count)
        poses = np.stack([np.interp(at, plan.path.times, c) for c in plan.path.states[:, :3].T], 1)
        best = way_of_poses(poses, float(state[3]), self.cart, "optimal")
        return best if self._is_clear(traffic, best, depart, gap) else None

    def _is_clear(self, traffic: Traffic, way: Way, depart: float, gap: float) -> bool:
        times = depart + way.distances / self.cart.speed
        betas = np.abs(way.states[:, 3])
        if betas.max() > max(FOLDED, betas[0]):
            return False
        # Where it stands already it may stand.
        conflict = self._first_conflict(traffic, way.states[2:], times[2:], gap)
        return conflict == max(len(times) - 2, 0)

    def _stands_clear(
        self, traffic: Traffic, state: np.ndarray, time: float, until: float, gap: float
    ) -> bool:
        times = np.arange(time + 1.0, until, 2.0)
        states = np.tile(state, (len(times), 1))
        return self._first_conflict(traffic, states, times, gap) == len(times)

    def _first_conflict(
        self, traffic: Traffic, states: np.ndarray, times: np.ndarray, gap: float
    ) -> int:
        cart = self.cart
        return way_is_clear(
            self.ground,
            traffic,
            outline(cart),
            cart.length,
            cart.hitch_offset,
            np.ascontiguousarray(states),
            times,
            EARLY,
            gap,
        )

    def _searched(
        self, traffic: Traffic, state: np.ndarray, time: float, meeting: Meeting, gap: float
    ) -> Route | None:
        times, goals = self._goals(time, meeting)
        if not len(times):
            return None
        free = coarse_ground(self.ground, traffic)
        side, corner = COARSE * self.ground.cell, self.ground.corner
        from_here = distances_to(free, side, corner, np.ascontiguousarray(state[None, :2]))
        ways = np.array([to_go_from(from_here, self.ground, x, y) for x, y, _ in goals])
        in_time = np.flatnonzero(time + SLOWER * ways / self.cart.speed <= times)
        if not len(in_time):
            return None
        soonest = times[in_time[0]]
        meant = goals[(times >= soonest) & (times <= soonest + WINDOW)]
        away = distances_to(free, side, corner, np.ascontiguousarray(meant[:, :2]))
        for near in NEAR:
            found = self._search(traffic, state, time, away, near * self.cart.turning_radius, gap)
            if len(found) < 2:
                continue
            last = found[-1]
            soonest = self._soonest(last[:4], last[4], meeting)
            if soonest is None:
                continue
            for later in LATER:
                rest = self._direct(
                    traffic, last[:4], float(last[4]), soonest + later, meeting, gap
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
        gap: float,
    ) -> np.ndarray:
        cart = self.cart
        return search_way(
            self.ground,
            traffic,
            outline(cart),
            hitch_of(cart),
            cart.speed,
            ROOM * cart.turning_radius,
            np.ascontiguousarray(state),
            time,
            away,
            near,
            EARLY,
            gap,
            NODES,
        )

    def _joined(self, state: np.ndarray, time: float, found: np.ndarray, rest: Route) -> Route:
        """A way that was searched, and a car's path from its end."""
        # Waiting on the way is left to whoever drives: it looks ahead.
        moved = np.append(True, np.hypot(*np.diff(found[:, :2], axis=0).T) > 1e-6)
        depart = time
        if len(found) > 1 and not moved[1]:
            depart = float(found[int(np.argmax(moved[1:])), 4])
        poses = _arcs(found[moved, :3])
        poses = np.vstack([poses, rest.way.states[1:, :3]])
        way = way_of_poses(poses, float(state[3]), self.cart, "search")
        return Route(way, depart, rest.arrive)


def _arcs(poses: np.ndarray) -> np.ndarray:
    """Poses STEP apart or less along arcs through poses, shape (n, 3) -> (m, 3)."""
    pieces = [poses[:1]]
    for a, b in pairwise(poses):
        turn = b[2] - a[2]
        chord = math.hypot(b[0] - a[0], b[1] - a[1])
        length = chord / np.sinc(turn / math.tau)
        count = max(1, math.ceil(length / STEP))
        share = np.arange(1, count + 1) / count
        middle = a[2] + share * turn / 2
        along = share * length * np.sinc(share * turn / math.tau)
        pieces.append(
            np.stack(
                [a[0] + along * np.cos(middle), a[1] + along * np.sin(middle), a[2] + share * turn],
                axis=1,
            )
        )
    return np.concatenate(pieces)
