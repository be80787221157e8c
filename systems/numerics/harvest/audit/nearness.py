"""How near outlines come to one another and to edges of the ground, between samples too.

Between two samples every outline moves by a constant twist. Seen from the frame of one of them, a
point of the other at q moves with the difference of the two twists there, D(q). So their distance
changes no faster than the largest |D(q)| of all points of the other. The difference of two constant
twists is D(q) = D(p) + w J (q - p), w the difference of the turn rates, J a quarter turn. Let p be
the other's middle, which moves by at most v h within h of an instant, and r its reach: then
|D(q)| <= L = |D(p)| + |w| (r + v h) at all points and all times within h of it. If their distance
is d at that instant, then it is at least d - L h for as long as h before and after.

Intervals are halved until this bound rules out any distance below the one asked for, less
TOLERANCE. So nothing nearer than that is missed: the true least distance is below the one returned
by at most TOLERANCE, and the one returned does occur at some instant.
"""

import math
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from .motion import MovingOutline

# Error of least distances [m].
TOLERANCE = 1e-3

# An interval is halved this often at most: 1 s becomes 1e-12 s.
DEEPEST = 40


class Nearness(NamedTuple):
    """How near two things come in each interval between samples.

    Attributes:
        least: Least distance seen, exact to TOLERANCE where it is below what was asked for;
            infinite where they are farther apart than that; shape (T - 1,) [m].
        share: When that is, as a share of the interval, shape (T - 1,).
        nearest: Least distance of all times, exact to TOLERANCE, if it is below `best` [m].
    """

    least: np.ndarray
    share: np.ndarray
    nearest: float


def nearness(
    one: MovingOutline, other: MovingOutline, asked: float, best: float = math.inf
) -> Nearness:
    """How near two outlines come to each other.

    Args:
        one: An outline.
        other: Another one, at the same times.
        asked: Distances below this are found for all times [m].
        best: The least distance of all times is found if it is below this [m].
    """
    return Nearness(
        *_between_outlines(
            one.points,
            one.poses,
            one.reach,
            other.points,
            other.poses,
            other.reach,
            asked,
            best,
            TOLERANCE,
        )
    )


def nearness_to_edges(
    one: MovingOutline,
    edges: np.ndarray,
    *,
    inside: bool,
    asked: float = 0.0,
    best: float = math.inf,
) -> Nearness:
    """How near an outline comes to forbidden ground; 0: it is in it, or touches it.

    Args:
        one: The outline.
        edges: Of all rings round a region, x and y of both ends, shape (e, 4) [m].
        inside: Whether the region itself is forbidden, or all that is outside of it.
        asked: Distances below this are found for all times [m].
        best: The least distance of all times is found if it is below this [m].
    """
    return Nearness(
        *_to_edges(one.points, one.poses, one.reach, edges, inside, asked, best, TOLERANCE)
    )


@kernel
def _twist(poses, k):
    """The middle's motion from a sample to the next: arc length, direction of chord, and turn."""
    dx, dy = poses[k + 1, 0] - poses[k, 0], poses[k + 1, 1] - poses[k, 1]
    turn = poses[k + 1, 2] - poses[k, 2]
    way = math.sqrt(dx * dx + dy * dy)
    half = turn / 2
    if abs(half) > 1e-9:
        way *= half / math.sin(half)
    return way, math.atan2(dy, dx), turn


@kernel
def _pose(poses, k, way, along, turn, share):
    """Pose after a share of the time from a sample to the next."""
    part = turn * share / 2
    chord = way * share
    if abs(part) > 1e-9:
        chord *= math.sin(part) / part
    direction = along - turn * (1 - share) / 2
    x = poses[k, 0] + chord * math.cos(direction)
    y = poses[k, 1] + chord * math.sin(direction)
    return x, y, poses[k, 2] + turn * share


@kernel
def _place(points, x, y, theta, placed):
    c, s = math.cos(theta), math.sin(theta)
    for i in range(len(points)):
        placed[i, 0] = x + c * points[i, 0] - s * points[i, 1]
        placed[i, 1] = y + s * points[i, 0] + c * points[i, 1]


@kernel
def _squared_to_segment(px, py, ax, ay, bx, by):
    dx, dy = bx - ax, by - ay
    length = dx * dx + dy * dy
    share = 0.0
    if length > 0.0:
        share = min(max(((px - ax) * dx + (py - ay) * dy) / length, 0.0), 1.0)
    ex, ey = px - ax - share * dx, py - ay - share * dy
    return ex * ex + ey * ey


@kernel
def _squared_between(ax, ay, bx, by, cx, cy, dx, dy):
    """Squared distance of two segments; 0 where they cross."""
    o1 = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    o2 = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
    o3 = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
    o4 = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
    if o1 * o2 < 0.0 and o3 * o4 < 0.0:
        return 0.0
    return min(
        _squared_to_segment(ax, ay, cx, cy, dx, dy),
        _squared_to_segment(bx, by, cx, cy, dx, dy),
        _squared_to_segment(cx, cy, ax, ay, bx, by),
        _squared_to_segment(dx, dy, ax, ay, bx, by),
    )


@kernel
def _in_polygon(px, py, ring):
    inside = False
    j = len(ring) - 1
    for i in range(len(ring)):
        if (ring[i, 1] > py) != (ring[j, 1] > py):
            x = ring[i, 0] + (py - ring[i, 1]) * (ring[j, 0] - ring[i, 0]) / (
                ring[j, 1] - ring[i, 1]
            )
            if px < x:
                inside = not inside
        j = i
    return inside


@kernel
def _polygon_distance(a, b):
    """Distance of two simple polygons, convex or not; 0 where they overlap or touch [m]."""
    least = math.inf
    i0 = len(a) - 1
    for i in range(len(a)):
        j0 = len(b) - 1
        for j in range(len(b)):
            squared = _squared_between(
                a[i0, 0], a[i0, 1], a[i, 0], a[i, 1], b[j0, 0], b[j0, 1], b[j, 0], b[j, 1]
            )
            if squared == 0.0:
                return 0.0
            least = min(least, squared)
            j0 = j
        i0 = i
    if _in_polygon(a[0, 0], a[0, 1], b) or _in_polygon(b[0, 0], b[0, 1], a):
        return 0.0
    return math.sqrt(least)


@kernel
def _drift(x, y, theta_rate, vx, vy, ox, oy, other_rate, ux, uy):
    """Speed of a middle (ox, oy) seen from a frame at (x, y) that moves and turns; turn rate."""
    dx = ux - vx + theta_rate * (oy - y)
    dy = uy - vy - theta_rate * (ox - x)
    return math.sqrt(dx * dx + dy * dy), abs(other_rate - theta_rate)


@compiled
def _between_outlines(
    points_a, poses_a, reach_a, points_b, poses_b, reach_b, asked, best, tolerance
):
    count = len(poses_a) - 1
    least, at = np.full(count, np.inf), np.zeros(count)
    a, b = np.empty_like(points_a), np.empty_like(points_b)
    lefts, halves = np.empty(DEEPEST + 2), np.empty(DEEPEST + 2)
    # The least distance is likely to be near the sample where the middles are nearest: the distance
    # there rules out most other times at once.
    first, squared = 0, np.inf
    for k in range(count + 1):
        dx, dy = poses_a[k, 0] - poses_b[k, 0], poses_a[k, 1] - poses_b[k, 1]
        if dx * dx + dy * dy < squared:
            first, squared = k, dx * dx + dy * dy
    if np.sqrt(squared) - reach_a - reach_b < best:
        _place(points_a, poses_a[first, 0], poses_a[first, 1], poses_a[first, 2], a)
        _place(points_b, poses_b[first, 0], poses_b[first, 1], poses_b[first, 2], b)
        best = min(best, _polygon_distance(a, b))
    for k in range(count):
        way_a, along_a, turn_a = _twist(poses_a, k)
        way_b, along_b, turn_b = _twist(poses_b, k)
        dx, dy = poses_a[k, 0] - poses_b[k, 0], poses_a[k, 1] - poses_b[k, 1]
        far = reach_a + reach_b + way_a + way_b + max(asked, best)
        if dx * dx + dy * dy > far * far:
            continue
        low = np.inf
        lefts[0], halves[0], depth = 0.0, 0.5, 1
        while depth > 0:
            depth -= 1
            half = halves[depth]
            share = lefts[depth] + half
            xa, ya, ta = _pose(poses_a, k, way_a, along_a, turn_a, share)
            xb, yb, tb = _pose(poses_b, k, way_b, along_b, turn_b, share)
            dx, dy = xa - xb, ya - yb
            distance = np.sqrt(dx * dx + dy * dy) - reach_a - reach_b
            wanted = low if low < asked else max(asked, best)
            # Where the outlines are far apart, the circles round them are enough.
            near = distance < wanted
            if near:
                _place(points_a, xa, ya, ta, a)
                _place(points_b, xb, yb, tb, b)
                distance = _polygon_distance(a, b)
                if distance < low:
                    low, at[k] = distance, share
                    best = min(best, low)
                    if low == 0.0:
                        break
                wanted = low if low < asked else max(asked, best)
            da = along_a + turn_a * (share - 0.5)
            db = along_b + turn_b * (share - 0.5)
            vx, vy = way_a * np.cos(da), way_a * np.sin(da)
            ux, uy = way_b * np.cos(db), way_b * np.sin(db)
            speed, rate = _drift(xa, ya, turn_a, vx, vy, xb, yb, turn_b, ux, uy)
            bound = speed + rate * (reach_b + way_b * half)
            speed, rate = _drift(xb, yb, turn_b, ux, uy, xa, ya, turn_a, vx, vy)
            bound = min(bound, speed + rate * (reach_a + way_a * half))
            if distance - bound * half < wanted - tolerance and depth < DEEPEST:
                lefts[depth], halves[depth] = share, half / 2
                lefts[depth + 1], halves[depth + 1] = share - half, half / 2
                depth += 2
        least[k] = low
    return least, at, best


@kernel
def _in_edges(px, py, edges):
    inside = False
    for e in range(len(edges)):
        if (edges[e, 1] > py) != (edges[e, 3] > py):
            share = (py - edges[e, 1]) / (edges[e, 3] - edges[e, 1])
            if px < edges[e, 0] + share * (edges[e, 2] - edges[e, 0]):
                inside = not inside
    return inside


@kernel
def _distance_to_edges(a, edges, chosen, count):
    """Distance of a polygon to some of the edges; 0 where it crosses or contains one [m]."""
    least = math.inf
    for c in range(count):
        e = chosen[c]
        cx, cy, dx, dy = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
        i0 = len(a) - 1
        for i in range(len(a)):
            squared = _squared_between(a[i0, 0], a[i0, 1], a[i, 0], a[i, 1], cx, cy, dx, dy)
            if squared == 0.0:
                return 0.0
            least = min(least, squared)
            i0 = i
        if _in_polygon(cx, cy, a):
            return 0.0
    return math.sqrt(least)


@compiled
def _to_edges(points, poses, reach, edges, inside, asked, best, tolerance):
    count = len(poses) - 1
    least, at = np.full(count, np.inf), np.zeros(count)
    placed = np.empty_like(points)
    chosen = np.empty(len(edges), dtype=np.int64)
    lefts, halves = np.empty(DEEPEST + 2), np.empty(DEEPEST + 2)
    on_it = False
    for k in range(count):
        way, along, turn = _twist(poses, k)
        far = reach + way + max(asked, best)
        x, y = poses[k, 0], poses[k, 1]
        chosen_count = 0
        for e in range(len(edges)):
            if (
                min(edges[e, 0], edges[e, 2]) <= x + far
                and max(edges[e, 0], edges[e, 2]) >= x - far
                and min(edges[e, 1], edges[e, 3]) <= y + far
                and max(edges[e, 1], edges[e, 3]) >= y - far
            ):
                chosen[chosen_count] = e
                chosen_count += 1
        # Where no edge is near, none has been crossed since the last sample.
        within = on_it
        if k == 0 or chosen_count > 0:
            within = False
            for end in range(2):
                _place(points, poses[k + end, 0], poses[k + end, 1], poses[k + end, 2], placed)
                on_it = _in_edges(placed[0, 0], placed[0, 1], edges) == inside
                if on_it:
                    within = True
                    at[k] = end
        if within:
            least[k], best = 0.0, 0.0
            continue
        if chosen_count == 0:
            continue
        # Every point of the outline keeps its speed all the way.
        bound = way + abs(turn) * reach
        low = np.inf
        lefts[0], halves[0], depth = 0.0, 0.5, 1
        while depth > 0:
            depth -= 1
            half = halves[depth]
            share = lefts[depth] + half
            x, y, theta = _pose(poses, k, way, along, turn, share)
            _place(points, x, y, theta, placed)
            distance = _distance_to_edges(placed, edges, chosen, chosen_count)
            if distance < low:
                low, at[k] = distance, share
                best = min(best, low)
                if low == 0.0:
                    break
            wanted = low if low < asked else max(asked, best)
            if distance - bound * half < wanted - tolerance and depth < DEEPEST:
                lefts[depth], halves[depth] = share, half / 2
                lefts[depth + 1], halves[depth + 1] = share - half, half / 2
                depth += 2
        least[k] = low
    return least, at, best
