"""Timed routes of carts: to a place beside a combine, and back to where no combine comes.

A search over the roadmap finds the way and which machines are let pass. Then the trailer's motion
along that way is computed exactly, and times are planned that respect accelerations, gaps and uncut
ground. If no times are found, the edge at which that failed is banned and the search is repeated.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...compiled import compiled
from ..machines import Cart
from ..paths import MachinePath, TimedPath, cornering_limits
from .cart_motion import (
    MOMENT,
    WAY,
    CartMotion,
    Moving,
    Passage,
    Profile,
    free_intervals,
    plan_profile,
    plan_profile_back,
    trailer_angles,
    trailer_poses,
)
from .cut_times import GAP, OpenGround, opens_along
from .roadmap import (
    AFTER_CUT,
    FAR,
    SAMPLED,
    Edges,
    Roadmap,
    connect,
    joined_edges,
    near_nodes,
    node_opens,
    opens_to,
    take_edges,
)
from .search import Intervals, Task, search
from .traffic import Traffic, blocked_along, cart_boxes, during, joined, least_gaps

# While a cart drives half of the way between two stations, no corner moves farther than this [m].
HALF_WAY = 0.6 * WAY
# Added to the gap where it is checked only at samples along an edge [m].
ROUGH = 0.5
# Time between the moments at which nodes are checked [s].
STEP = 1.0
# Time limit of a route: this long [s], or so many times the drive along two sides of the field at
# top speed if that is longer; how many ways are tried.
LONGEST, SIDES, ATTEMPTS = 400.0, 2.5, 5
# Spare rows for the additional edges of one search, and for their samples.
EXTRA, SAMPLES = 4000, 120000
# Straight way before a cart is beside a combine [m].
RUN_IN = 10.0
# Largest angle of the trailer [rad].
JACKKNIFE = 1.3


class Standing(NamedTuple):
    """A cart that stands.

    Attributes:
        pose: Of the tractor, shape (3,).
        beta: The trailer's angle [rad].
        since: From when on it stands there [s].
    """

    pose: np.ndarray
    beta: float
    since: float


@dataclass(frozen=True, eq=False)
class RoutePlanner:
    """A planner of routes, with the roadmap and the combines that it plans among.

    Attributes:
        ground: When each cell of the ground opens to carts.
        cart: One of the equal carts.
        roadmap: On this ground.
        combines: Traffic of all combines.
        blocked: Whether combines come too near to each node, at moments STEP apart from 0 on;
            shape (n, m).
        last_blocked: Number of the last moment at which each is blocked, -1 for none, shape (n,).
        exits: Nodes from which carts drive to their trucks, shape (e,).
        ways_out: When each node first has a way to one of the exits that keeps clear of all
            combines where they stand in the end, shape (n,) [s].
        room: Edges of the roadmap, with spare rows behind them for the edges of a search and for
            their samples.
    """

    ground: OpenGround
    cart: Cart
    roadmap: Roadmap
    combines: Traffic
    blocked: np.ndarray
    last_blocked: np.ndarray
    exits: np.ndarray
    ways_out: np.ndarray
    room: Edges

    @cached_property
    def boxes(self) -> np.ndarray:
        """Of tractor and trailer, shape (2, 3) [m]."""
        return cart_boxes(self.cart)

    @cached_property
    def longest(self) -> float:
        """How long a route may take [s]."""
        sides = float(np.ptp(self.roadmap.nodes[:, :2], axis=0).sum())
        return max(LONGEST, SIDES * sides / self.cart.speed)

    def is_free_for_ever(self, poses: np.ndarray, begin: float) -> np.ndarray:
        """Whether no combine ever comes near to carts that stand at poses, shape (n,).

        Args:
            poses: Of the tractor, shape (n, 3).
            begin: From then on [s].
        """
        first = math.ceil(begin / STEP)
        count = int(self.combines.poses.shape[1] * MOMENT / STEP) + 2
        near = _blocked_at(poses, self.cart, self.combines, first * STEP, max(count - first, 1))
        return np.logical_not(near.any(axis=1))

    def with_ways_out(self, poses: np.ndarray, time: float) -> np.ndarray:
        """Select the poses from which a cart in line has a way to the trucks, shape (m, 3).

        Args:
            poses: Of the tractor, shape (n, 3).
            time: When the way has to be open at the latest [s].
        """
        nodes = self.roadmap.nodes
        start, end = near_nodes(self.roadmap, poses, onto=True)
        known = self.ways_out[end] <= time
        start, end = start[known], end[known]
        off = connect(self.ground, self.cart, poses[start], np.zeros(len(start)), nodes[end])
        return poses[np.unique(start[off.source[off.opens <= time]])]

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
        begin = max(standing.since, moment - self.longest)
        if moment <= begin:
            return None
        run_in = np.stack([goal, np.asarray(beside, dtype=float)])

        def plan(path: MachinePath) -> Profile:
            passage = self._passage(path, standing.beta, others, begin, end.time + 1.0)
            return plan_profile_back(passage, end, self.cart.acceleration, begin)

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
            goal: Poses to stand at, shape (3,) or (n, 3); None: any node to which nobody comes and
                from which there is a way to the trucks at the start.
        """

        def plan(path: MachinePath) -> Profile:
            passage = self._passage(path, beta, others, start.time, start.time + self.longest)
            return plan_profile(passage, start, self.cart.acceleration)

        return self._route(
            pose,
            beta,
            start.time,
            goal,
            start.time + self.longest,
            others,
            None,
            plan,
            back=False,
            moving=start.speed > 0,
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
        moving: bool = False,
    ) -> CartMotion | None:
        goals = np.zeros((0, 3)) if goal is None else np.atleast_2d(np.asarray(goal, dtype=float))
        nodes, edges = self._with_ends(pose, beta, goals)
        count = len(self.roadmap.nodes)
        first = int(begin / STEP)
        known, last_known = self.blocked, self.last_blocked
        # Whatever moves after the end of the search counts in its last moment.
        others_end = others.begin + others.poses.shape[1] * MOMENT
        last = max(math.ceil((max(end, others_end) - first * STEP) / STEP), 1) + 2
        span = first * STEP, (first + last) * STEP
        others = during(others, *span)
        traffic = joined(during(self.combines, *span), others)
        blocked = np.empty((len(nodes), last), dtype=bool)
        # The last known moment counts for all later ones.
        within = known[:, min(first, known.shape[1] - 1) : first + last]
        blocked[:count, : within.shape[1]] = within
        blocked[:count, within.shape[1] :] = known[:, -1:]
        blocked[:count, -1] |= last_known >= first + last - 1
        moments = max(known.shape[1] - first, last)
        ends = _blocked_at(nodes[count:], self.cart, self.combines, first * STEP, moments)
        blocked[count:] = ends[:, :last]
        blocked[count:, -1] |= ends[:, last - 1 :].any(axis=1)
        blocked |= _blocked_at(nodes, self.cart, others, first * STEP, last)
        opens = np.concatenate(
            [self.roadmap.opens, node_opens(self.ground, self.cart, nodes[count:])]
        )
        # The cart is there already, so the ground at its start needs no check.
        opens[count] = -np.inf
        intervals = Intervals(*free_intervals(blocked, opens, first * STEP, STEP))
        own = slice(intervals.first[count], intervals.first[count + 1])
        waits = (intervals.begins[own] <= begin) & (begin <= intervals.ends[own])
        if not back and (moving or not waits.any()):
            # The cart cannot wait there: it is moving, or others pass.
            intervals = _with_moment(intervals, count, begin)
        start = count
        if back:
            start = count + 1
            intervals = _with_moment(intervals, start, end)
        owner = np.repeat(np.arange(len(nodes)), np.diff(intervals.first))
        if back:
            aims = (owner == count) & (intervals.begins <= begin + STEP)
            estimates = np.hypot(*(nodes - nodes[count])[:, :2].T)
        elif goal is None:
            aims = (owner < count) & (intervals.ends == np.inf)
            aims[aims] = self.ways_out[owner[aims]] <= begin
            estimates = np.zeros(len(nodes))
        else:
            aims = (owner > count) & (intervals.ends == np.inf)
            estimates = np.min([np.hypot(*(nodes - each)[:, :2].T) for each in goals], axis=0)
        banned = np.zeros(len(edges.source), dtype=bool)
        estimates = estimates / self.cart.speed
        task = Task(edges, banned, intervals, traffic, self.boxes, GAP + ROUGH, aims, estimates)
        origin, until = (end, begin) if back else (begin, end)
        for _ in range(ATTEMPTS):
            found = search(task, start, origin, back=back, until=until)
            if len(found) == 0:
                return None
            path = _path_of(edges, found, run_in)
            profile = plan(path)
            if len(profile.times):
                timed = TimedPath(path, profile.times, profile.stations, profile.speeds)
                return CartMotion(timed, self.cart, beta)
            place = path.length - profile.reached if back else profile.reached
            lengths = np.cumsum(edges.lengths[found].sum(axis=1))
            at = min(int(np.searchsorted(lengths, place)), len(found) - 1)
            banned[found[at]] = True
        return None

    def _with_ends(
        self, pose: np.ndarray, beta: float, goals: np.ndarray
    ) -> tuple[np.ndarray, Edges]:
        """Nodes and edges with those of a start and goals added; these get the last numbers."""
        nodes, room = self.roadmap.nodes, self.room
        count = len(nodes)
        start = np.array(pose, dtype=float)
        near = near_nodes(self.roadmap, start[None], onto=True)[1]
        close = np.hypot(*(goals - start)[:, :2].T) < 3 * FAR
        numbers = np.concatenate([near, count + 1 + np.flatnonzero(close)])
        ends = np.vstack([nodes[near], goals[close]])
        off = connect(
            self.ground, self.cart, np.tile(start, (len(ends), 1)), np.full(len(ends), beta), ends
        )
        goal, node = near_nodes(self.roadmap, goals, onto=False)
        onto = connect(self.ground, self.cart, nodes[node], np.zeros(len(node)), goals[goal])
        parts = [
            off._replace(source=np.full(len(off.source), count), target=numbers[off.target]),
            onto._replace(source=node[onto.source], target=count + 1 + goal[onto.source]),
        ]
        own = self.roadmap.edges
        size, samples = len(own.source), int(own.first[-1])
        more, columns = joined_edges(parts), {}
        for name in Edges._fields:
            if name == "first":
                continue
            extra, place = getattr(more, name), getattr(room, name)
            begin = samples if name in SAMPLED else size
            if begin + len(extra) > len(place):
                columns[name] = np.concatenate([getattr(own, name), extra])
            else:
                place[begin : begin + len(extra)] = extra
                columns[name] = place[: begin + len(extra)]
        first = np.concatenate([own.first, samples + more.first[1:]])
        return np.vstack([nodes, start, goals]), Edges(first=first, **columns)

    def _passage(
        self, path: MachinePath, beta: float, others: Traffic, begin: float, end: float
    ) -> Passage:
        """When a cart may be at each station of a path, between two times."""
        at = path.stations_every(WAY)
        tractor = path.pose_at(at)
        betas = trailer_angles(path, self.cart, beta, at)
        trailer = trailer_poses(tractor, betas, self.cart)
        bend = _sharpest(path, np.maximum(at - WAY, 0.0), np.minimum(at + WAY, path.length))
        limits = cornering_limits(bend, self.cart.speed, self.cart.lateral_acceleration)
        opens = AFTER_CUT + np.maximum(
            opens_along(self.ground, self.boxes[0], tractor),
            opens_along(self.ground, self.boxes[1], trailer),
        )
        opens[np.abs(betas) > JACKKNIFE] = np.inf
        first = math.floor(begin / MOMENT) * MOMENT
        count = math.ceil((end - first) / MOMENT) + 1
        gap = GAP + HALF_WAY
        span = first - MOMENT, first + (count + 1) * MOMENT
        traffic = joined(during(self.combines, *span), during(others, *span))
        blocked = blocked_along(traffic, self.boxes, tractor, trailer, gap, first, MOMENT, count)
        # Moments are counted from `begin`, which may be later than `first` by part of a MOMENT.
        return Passage(at, limits, opens, blocked, begin)


def make_planner(
    ground: OpenGround,
    cart: Cart,
    roadmap: Roadmap,
    combines: Traffic,
    trucks: np.ndarray,
    before: RoutePlanner | None = None,
    since: float = 0.0,
) -> RoutePlanner:
    """Make a planner: find when combines are near nodes, and which nodes have ways to the trucks.

    Args:
        ground: When each cell of the ground opens to carts.
        cart: One of the equal carts.
        roadmap: On this ground.
        combines: Traffic of all combines.
        trucks: Poses of the tractor at the trucks, shape (K, 3).
        before: Planner on the same roadmap, for combines that moved differently from `since` on.
        since: When the combines begin to move differently [s].
    """
    count = int(combines.poses.shape[1] * MOMENT / STEP) + 2
    if before is None:
        blocked = _blocked_at(roadmap.nodes, cart, combines, 0.0, count)
        room = _with_room(roadmap.edges)
        truck, node = near_nodes(roadmap, trucks, onto=False)
        onto = connect(ground, cart, roadmap.nodes[node], np.zeros(len(node)), trucks[truck])
        exits = np.unique(node[onto.source])
    else:
        exits = before.exits
        same = min(max(int(since / STEP) - 2, 0), before.blocked.shape[1] - 2, count - 2)
        later = _blocked_at(roadmap.nodes, cart, combines, same * STEP, count - same)
        blocked = np.hstack([before.blocked[:, :same], later])
        # Searches write only behind the edges, and of these only the opening times have changed.
        opens = before.room.opens.copy()
        opens[: len(roadmap.edges.opens)] = roadmap.edges.opens
        room = before.room._replace(opens=opens)
    out = opens_to(roadmap, exits, _too_near_in_the_end(roadmap.edges, cart, combines))
    last = _last_of_each(blocked)
    return RoutePlanner(ground, cart, roadmap, combines, blocked, last, exits, out, room)


def _blocked_at(
    nodes: np.ndarray, cart: Cart, traffic: Traffic, begin: float, count: int
) -> np.ndarray:
    """Moments STEP apart at which carts in line at nodes are too near to others, (n, count)."""
    behind = trailer_poses(nodes, np.zeros(len(nodes)), cart)
    gap = GAP + ROUGH
    return blocked_along(traffic, cart_boxes(cart), nodes, behind, gap, begin, STEP, count)


def _too_near_in_the_end(edges: Edges, cart: Cart, combines: Traffic) -> np.ndarray:
    """Edges that lead too near to where combines stand in the end, shape (E,)."""
    stand = combines.poses[:, -1]
    x, y, radius = edges.circle.T
    away = np.hypot(x - stand[:, :1], y - stand[:, 1:2]) - radius
    found = (away < np.abs(combines.boxes).sum(axis=1)[:, None] + GAP + ROUGH).any(axis=0)
    near = np.flatnonzero(found)
    along = take_edges(edges, near)
    late = np.full(len(along.tractor), combines.begin + combines.poses.shape[1] * MOMENT)
    gaps = least_gaps(combines, cart_boxes(cart), along.tractor, along.trailer, late)
    found[near] = np.minimum.reduceat(gaps, along.first[:-1]) < GAP + ROUGH
    return found


def _with_room(edges: Edges) -> Edges:
    """Edges with spare rows behind them."""
    return Edges(
        *(
            np.concatenate([each, np.zeros((size, *each.shape[1:]), dtype=each.dtype)])
            for each, size in zip(
                edges,
                [SAMPLES if name in SAMPLED else EXTRA for name in Edges._fields],
                strict=True,
            )
        )
    )


@compiled
def _last_of_each(blocked):
    """Number of the last moment at which each is blocked, -1 for none, shape (n,)."""
    last = np.full(len(blocked), -1)
    for n in range(len(blocked)):
        for k in range(blocked.shape[1] - 1, -1, -1):
            if blocked[n, k]:
                last[n] = k
                break
    return last


def _sharpest(path: MachinePath, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Largest curvature of a path between stations, shape (n,), (n,) -> (n,) [1/m]."""
    bends = np.abs(path.curvatures)
    piece, last = path.piece_at(begin), path.piece_at(end)
    found = bends[piece]
    while (piece < last).any():
        # A piece may be shorter than the way between two stations.
        piece = np.minimum(piece + 1, last)
        found = np.maximum(found, bends[piece])
    return found


def _with_moment(intervals: Intervals, node: int, time: float) -> Intervals:
    """Replace the intervals of one node by a single moment."""
    a, b = intervals.first[node], intervals.first[node + 1]
    begins = np.concatenate([intervals.begins[:a], [time], intervals.begins[b:]])
    ends = np.concatenate([intervals.ends[:a], [time], intervals.ends[b:]])
    first = intervals.first.copy()
    first[node + 1 :] += 1 - (b - a)
    return Intervals(first, begins, ends)


def _path_of(edges: Edges, chosen: np.ndarray, run_in: np.ndarray | None) -> MachinePath:
    """The path along edges, followed by the run-in, without pieces of zero length."""
    poses = [edges.poses[chosen[0], 0]]
    for e in chosen:
        for k in range(4):
            if edges.lengths[e, k] > 1e-6:
                pose = edges.poses[e, k + 1].copy()
                # Headings of successive edges may differ by whole turns.
                start = edges.poses[e, k, 2]
                pose[2] = poses[-1][2] + (pose[2] - start)
                poses.append(pose)
    if run_in is not None:
        poses.append(np.array([*run_in[1][:2], poses[-1][2]]))
    return MachinePath.of(poses)
