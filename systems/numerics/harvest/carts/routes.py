"""Routes of carts in time: to a place beside a combine, and back to where nobody comes.

A search over the roadmap finds the way and who is let by; then the trailer is followed exactly
along that way, and times are planned for it that keep accelerations, gaps and off what is not cut.
Where no times are found, the place at which that failed is left out and the search goes on.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..machines.cart import Cart
from ..paths.machine_path import TRANSIT, MachinePath
from ..paths.timed_path import TimedPath
from .cart_motion import CartMotion, trailer_angles, trailer_poses
from .cut_times import GAP, OpenGround, opens_along
from .profile import MOMENT, WAY, Moving, Profile, plan_profile, plan_profile_back
from .roadmap import AFTER_CUT, FAR, Edges, Roadmap, connect, joined_edges, node_opens
from .search import intervals_of, search
from .traffic import Traffic, blocked_along, cart_boxes, joined

# Half of the way between two stations moves no corner of a cart farther than this [m].
HALF_WAY = 0.6 * WAY
# Added to the gap where it is looked at only here and there along an edge [m].
ROUGH = 0.5
# Time between moments at which nodes are known to be free [s].
STEP = 1.0
# How long a route may take [s], and how often another is looked for.
LONGEST, ATTEMPTS = 400.0, 5
# Straight way before a cart is beside a combine [m].
RUN_IN = 10.0
# Largest angle of the trailer [rad].
JACKKNIFE = 1.3


class Standing(NamedTuple):
    """A cart that stands.

    Attributes:
        pose: Of the tractor, shape (3,).
        beta: The trailer's angle [rad].
        since: From when on [s].
    """

    pose: np.ndarray
    beta: float
    since: float


@dataclass(frozen=True, eq=False)
class RoutePlanner:
    """What routes are planned among.

    Attributes:
        ground: From when on carts may be where.
        cart: One of the equal carts.
        roadmap: On this ground.
        combines: All of them, by time.
    """

    ground: OpenGround
    cart: Cart
    roadmap: Roadmap
    combines: Traffic

    @cached_property
    def boxes(self) -> np.ndarray:
        """Of tractor and trailer, shape (2, 3) [m]."""
        return cart_boxes(self.cart)

    @cached_property
    def _node_blocked(self) -> np.ndarray:
        """Whether combines come too near to each node, at moments STEP apart from 0 on."""
        end = self.combines.poses.shape[1] * MOMENT
        return self._standing(self.roadmap.nodes, self.combines, 0.0, int(end / STEP) + 2)

    def _standing(self, nodes: np.ndarray, traffic: Traffic, begin: float, count: int):
        behind = trailer_poses(nodes, np.zeros(len(nodes)), self.cart)
        gap = GAP + ROUGH
        return blocked_along(traffic, self.boxes, nodes, behind, gap, begin, STEP, count)

    def route_to(
        self, standing: Standing, beside: np.ndarray, end: Moving, others: Traffic
    ) -> CartMotion | None:
        """The latest route from where a cart stands to a pose that it passes at a given moment.

        It ends with a straight of RUN_IN.

        Args:
            standing: Where the cart is.
            beside: The pose, x, y, theta, shape (3,).
            end: When and how fast it passes it.
            others: Committed routes of other carts.

        Returns:
            The cart from where it stands on until it passes the pose; None where no route is found.
        """
        goal = np.array(beside, dtype=float)
        goal[:2] -= RUN_IN * np.array([math.cos(goal[2]), math.sin(goal[2])])
        speed = max(end.speed, 1.0)
        moment = end.time - RUN_IN / speed
        begin = max(standing.since, moment - LONGEST)
        if moment <= begin:
            return None
        run_in = np.stack([goal, np.asarray(beside, dtype=float)])

        def plan(path: MachinePath) -> Profile:
            at, limits, opens, blocked = self._closed(
                path, standing.beta, others, begin, end.time + 1.0
            )
            return plan_profile_back(
                at, limits, opens, blocked, begin, end, self.cart.acceleration, begin
            )

        return self._route(
            standing.pose, standing.beta, begin, goal, moment, others, run_in, plan, back=True
        )

    def route_from(
        self, pose: np.ndarray, beta: float, start: Moving, others: Traffic, goal: np.ndarray | None
    ) -> CartMotion | None:
        """The earliest route from a pose to where the cart may stand for ever.

        Args:
            pose: x, y, theta, shape (3,).
            beta: The trailer's angle there [rad].
            start: When and how fast the cart is there.
            others: Committed routes of other carts.
            goal: Pose to stand at, shape (3,); None: wherever nobody comes.
        """

        def plan(path: MachinePath) -> Profile:
            at, limits, opens, blocked = self._closed(
                path, beta, others, start.time, start.time + LONGEST
            )
            return plan_profile(
                at, limits, opens, blocked, start.time, start, self.cart.acceleration
            )

        return self._route(
            pose, beta, start.time, goal, start.time + LONGEST, others, None, plan, back=False
        )

    def _route(
        self,
        pose: np.ndarray,
        beta: float,
        begin: float,
        goal: np.ndarray | None,
        end: float,
        others: Traffic,
        run_in: np.ndarray | None,
        plan: Callable[[MachinePath], Profile],
        *,
        back: bool,
    ) -> CartMotion | None:
        nodes, edges = self._with_ends(pose, beta, goal)
        count = len(self.roadmap.nodes)
        traffic = joined(self.combines, others)
        known = self._node_blocked
        first = int(begin / STEP)
        moments = math.ceil((end - first * STEP) / STEP) + 2
        last = max(moments, known.shape[1] - first, others.poses.shape[1] * MOMENT / STEP - first)
        last = int(last) + 1
        blocked = self._standing(nodes, others, first * STEP, last)
        columns = np.minimum(np.arange(first, first + last), known.shape[1] - 1)
        blocked[:count] |= known[:, columns]
        blocked[count:] |= self._standing(nodes[count:], self.combines, first * STEP, last)
        # What may be stood on, where the cart stands already, is settled.
        opens = np.concatenate(
            [self.roadmap.opens, node_opens(self.ground, self.cart, nodes[count:])]
        )
        opens[count] = -np.inf
        intervals = intervals_of(blocked, opens, first * STEP, STEP)
        if not back:
            # It is on its way there: it cannot wait.
            intervals = _with_moment(intervals, count, begin)
        owner = np.repeat(np.arange(len(nodes)), np.diff(intervals.first))
        if back:
            goals = (owner == count) & (intervals.begins <= begin + STEP)
            start, estimates = count + 1, np.hypot(*(nodes - nodes[count])[:, :2].T)
            intervals = _with_moment(intervals, count + 1, end)
            owner = np.repeat(np.arange(len(nodes)), np.diff(intervals.first))
            goals = (owner == count) & (intervals.begins <= begin + STEP)
        elif goal is None:
            goals = (owner < count) & (intervals.ends == np.inf)
            start, estimates = count, np.zeros(len(nodes))
        else:
            goals = (owner == count + 1) & (intervals.ends == np.inf)
            start, estimates = count, np.hypot(*(nodes - nodes[count + 1])[:, :2].T)
        banned = np.zeros(len(edges.source), dtype=bool)
        for _ in range(ATTEMPTS):
            found = search(
                edges,
                banned,
                intervals,
                traffic,
                self.boxes,
                GAP + ROUGH,
                start,
                end if back else begin,
                goals,
                estimates / self.cart.speed,
                back=back,
                until=begin if back else end,
            )
            if found is None or len(found.edges) == 0:
                return None
            path = _path_of(edges, found.edges, run_in)
            profile = plan(path)
            if len(profile.times):
                timed = TimedPath(path, profile.times, profile.stations, profile.speeds)
                return CartMotion(timed, self.cart, beta)
            place = path.length - profile.reached if back else profile.reached
            lengths = np.cumsum(edges.lengths[found.edges].sum(axis=1))
            at = min(int(np.searchsorted(lengths, place)), len(found.edges) - 1)
            banned[found.edges[at]] = True
        return None

    def _with_ends(
        self, pose: np.ndarray, beta: float, goal: np.ndarray | None
    ) -> tuple[np.ndarray, Edges]:
        """Nodes and edges with those of a start and of an end, which get the last two numbers."""
        nodes, edges = self.roadmap.nodes, self.roadmap.edges
        count = len(nodes)
        start = np.array(pose, dtype=float)
        parts = [edges]
        near = np.flatnonzero(np.hypot(*(nodes[:, :2] - start[:2]).T) < 1.5 * FAR)
        ends = nodes[near]
        numbers = near
        if goal is not None:
            if np.hypot(*(goal - start)[:2]) < 3 * FAR:
                ends, numbers = np.vstack([ends, goal]), np.append(near, count + 1)
            close = np.flatnonzero(np.hypot(*(nodes[:, :2] - goal[:2]).T) < 1.5 * FAR)
            onto = connect(
                self.ground,
                self.cart,
                nodes[close],
                np.zeros(len(close)),
                np.tile(goal, (len(close), 1)),
            )
            parts.append(
                onto._replace(
                    source=close[onto.source], target=np.full(len(onto.source), count + 1)
                )
            )
        off = connect(
            self.ground, self.cart, np.tile(start, (len(ends), 1)), np.full(len(ends), beta), ends
        )
        parts.append(
            off._replace(source=np.full(len(off.source), count), target=numbers[off.target])
        )
        last = start if goal is None else goal
        return np.vstack([nodes, start, last]), joined_edges(parts)

    def _closed(
        self, path: MachinePath, beta: float, others: Traffic, begin: float, end: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Stations of a path, their highest speeds, when they open, and when they are closed."""
        at = path.stations_every(WAY)
        tractor = path.pose_at(at)
        betas = trailer_angles(path, self.cart, beta, at)
        trailer = trailer_poses(tractor, betas, self.cart)
        bends = np.abs(path.curvatures)
        bend = np.maximum(
            np.maximum(bends[path.piece_at(at)], bends[path.piece_at(np.maximum(at - WAY, 0.0))]),
            bends[path.piece_at(np.minimum(at + WAY, path.length))],
        )
        lateral = self.cart.lateral_acceleration
        limits = np.minimum(self.cart.speed, np.sqrt(lateral / np.maximum(bend, 1e-6)))
        opens = AFTER_CUT + np.maximum(
            opens_along(self.ground, self.boxes[0], tractor),
            opens_along(self.ground, self.boxes[1], trailer),
        )
        opens[np.abs(betas) > JACKKNIFE] = np.inf
        traffic = joined(self.combines, others)
        count = math.ceil((end - begin) / MOMENT) + 1
        gap = GAP + HALF_WAY
        blocked = blocked_along(traffic, self.boxes, tractor, trailer, gap, begin, MOMENT, count)
        return at, limits, opens, blocked


def _with_moment(intervals, node: int, time: float):
    """Intervals of which those of one node are replaced by a single moment."""
    a, b = intervals.first[node], intervals.first[node + 1]
    begins = np.concatenate([intervals.begins[:a], [time], intervals.begins[b:]])
    ends = np.concatenate([intervals.ends[:a], [time], intervals.ends[b:]])
    first = intervals.first.copy()
    first[node + 1 :] += 1 - (b - a)
    return type(intervals)(first, begins, ends)


def _path_of(edges: Edges, chosen: np.ndarray, run_in: np.ndarray | None) -> MachinePath:
    """The path along edges, and a straight behind it, without pieces of no length."""
    poses = [edges.poses[chosen[0], 0]]
    for e in chosen:
        for k in range(4):
            if edges.lengths[e, k] > 1e-6:
                pose = edges.poses[e, k + 1].copy()
                # Edges tell headings up to whole turns.
                start = edges.poses[e, k, 2]
                pose[2] = poses[-1][2] + (pose[2] - start)
                poses.append(pose)
    if run_in is not None:
        poses.append(np.array([*run_in[1][:2], poses[-1][2]]))
    count = len(poses) - 1
    return MachinePath(
        np.array(poses),
        np.ones(count, dtype=int),
        np.zeros(count, dtype=bool),
        np.full(count, TRANSIT),
    )
