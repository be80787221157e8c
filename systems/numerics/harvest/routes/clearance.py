"""Whether a cart fits: its outline off the crop, and clear of the combines."""

import math
from itertools import pairwise

import numpy as np

from ...compiled import compiled
from ..machines.cart import Cart
from .ground import drivable, pose_on_path, station_at
from .others import gap_to_carts

# Points of the outlines are at most so far apart [m].
SPACING = 1.5


def outline(cart: Cart) -> np.ndarray:
    """Points round tractor and trailer, shape (m, 3): which (0 or 1), ahead, to the left [m]."""
    points = []
    for body, (rear, front) in enumerate((cart.tractor_ends, cart.box_ends)):
        half = cart.width / 2
        ring = [(rear, -half), (front, -half), (front, half), (rear, half), (rear, -half)]
        for (a, b), (c, d) in pairwise(ring):
            count = max(1, math.ceil(math.hypot(c - a, d - b) / SPACING))
            for k in range(count):
                share = k / count
                points.append((body, a + share * (c - a), b + share * (d - b)))
    return np.array(points)


@compiled
def outline_at(points, length, hitch_offset, state):
    """The outline of a cart in a state x, y, theta, beta; shape (m, 2) [m].

    Args:
        points: Outline of the cart, shape (m, 2) [m].
        length: From the hitch to the trailer's axle [m].
        hitch_offset: From the tractor's axle back to the hitch [m].
    """
    x, y, theta, beta = state[0], state[1], state[2], state[3]
    heading = theta - beta
    ax = x - hitch_offset * np.cos(theta) - length * np.cos(heading)
    ay = y - hitch_offset * np.sin(theta) - length * np.sin(heading)
    placed = np.empty((len(points), 2))
    for k in range(len(points)):
        if points[k, 0] == 0:
            ox, oy, c, s = x, y, np.cos(theta), np.sin(theta)
        else:
            ox, oy, c, s = ax, ay, np.cos(heading), np.sin(heading)
        placed[k, 0] = ox + c * points[k, 1] - s * points[k, 2]
        placed[k, 1] = oy + s * points[k, 1] + c * points[k, 2]
    return placed


@compiled
def distance_to_combine(px, py, pose, size):
    """From a point to a combine: a header, and a body behind it; 0 inside [m].

    Args:
        px: Of the point [m].
        py: Of the point [m].
        pose: x, y, theta of the combine [m], [m], [rad].
        size: Of a combine, as in `Traffic`, shape (3,) [m].
    """
    dx, dy = px - pose[0], py - pose[1]
    c, s = np.cos(pose[2]), np.sin(pose[2])
    ahead, left = c * dx + s * dy, abs(c * dy - s * dx)
    gap = max(left - size[0], 0.0)
    along = max(max(ahead - 1.0, -1.0 - ahead), 0.0)
    to_header = np.hypot(gap, along)
    gap = max(left - size[1], 0.0)
    along = max(max(ahead - 1.0, -size[2] - ahead), 0.0)
    return min(to_header, np.hypot(gap, along))


@compiled
def crop_under(ground, traffic, placed, time, early):
    """Number of points of an outline that stand in crop or out of bounds.

    Args:
        ground: Raster of the crop.
        traffic: The combines.
        placed: Outline of the cart where it is, shape (m, 2) [m].
        time: At which [s].
        early: By how much sooner crop has to be gone [s].
    """
    count = 0
    for k in range(len(placed)):
        if not drivable(ground, traffic, placed[k, 0], placed[k, 1], time, early):
            count += 1
    return count


@compiled
def gap_to_combines(traffic, placed, time):
    """Least distance of an outline from any combine at a time [m].

    Args:
        traffic: The combines.
        placed: Outline of the cart where it is, shape (m, 2) [m].
    """
    least = np.inf
    for combine in range(len(traffic.progress)):
        pose = pose_on_path(traffic, combine, station_at(traffic, combine, time))
        reach = traffic.size[0] + traffic.size[2]
        if np.hypot(placed[0, 0] - pose[0], placed[0, 1] - pose[1]) > reach + 40.0 + least:
            continue
        for k in range(len(placed)):
            least = min(least, distance_to_combine(placed[k, 0], placed[k, 1], pose, traffic.size))
    return least


@compiled
def is_near(traffic, placed, time, gaps):
    """Whether an outline is nearer to a combine, or to another cart, than gaps (2,) allow [m].

    Args:
        traffic: The combines.
        placed: Outline of the cart where it is, shape (m, 2) [m].
        time: At which [s].
    """
    if gap_to_combines(traffic, placed, time) < gaps[0]:
        return True
    return gap_to_carts(traffic.others, placed, time - traffic.time) < gaps[1]


@compiled
def way_is_clear(ground, traffic, points, length, hitch_offset, states, times, early, gaps, under):
    """Index of the first state of a way that does not fit; the number of states if all do.

    Args:
        ground: Raster.
        traffic: Combines.
        points: Outline of the cart.
        length: Of its trailer [m].
        hitch_offset: [m].
        states: x, y, theta, beta, shape (n, 4).
        times: When it is there, shape (n,) [s].
        early: How much earlier the crop must be gone, and how much later a combine may come [s].
        gaps: To keep from combines, and from other carts, shape (2,) [m].
        under: Number of points of the outline that stand in crop at first: it may leave it.
    """
    for k in range(len(states)):
        placed = outline_at(points, length, hitch_offset, states[k])
        count = crop_under(ground, traffic, placed, times[k], early)
        if count > under:
            return k
        under = count
        for shift in (0.0, early):
            if is_near(traffic, placed, times[k] + shift, gaps):
                return k
    return len(states)


@compiled
def combines_to_halt(traffic, points, length, hitch_offset, states, look, gap):
    """Which combines would come too near to a cart, and nearer than they are.

    Args:
        traffic: Combines, now.
        points: Outline of a cart.
        length: Of its trailer [m].
        hitch_offset: [m].
        states: x, y, theta, beta of the carts, shape (K, 4).
        look: For how long they look ahead [s].
        gap: To keep [m].

    Returns:
        1 where a combine has to stop, shape (N,).
    """
    halts = np.zeros(len(traffic.progress))
    reach = traffic.size[0] + traffic.size[2] + 20.0
    for n in range(len(halts)):
        here = pose_on_path(traffic, n, traffic.progress[n])
        there = pose_on_path(traffic, n, traffic.progress[n] + look * traffic.speed)
        for k in range(len(states)):
            if np.hypot(states[k, 0] - here[0], states[k, 1] - here[1]) > reach:
                continue
            placed = outline_at(points, length, hitch_offset, states[k])
            now, then = np.inf, np.inf
            for p in placed:
                now = min(now, distance_to_combine(p[0], p[1], here, traffic.size))
                then = min(then, distance_to_combine(p[0], p[1], there, traffic.size))
            if then < gap and then < now:
                halts[n] = 1.0
    return halts
