"""What a cart does in the next step: it follows its line, and stops before what is in its way."""

import numpy as np

from ...compiled import compiled
from .clearance import crop_under, gap_to_combines, outline_at
from .search import FOLDED
from .steering import drive, nearest_way, steer

# How near combines and other carts may come before a cart stops [m], and how far ahead in the
# combines' time it looks [s].
STOP_GAP, OTHERS_GAP, LOOK = 0.8, 1.5, 3.0
# A combine so near has come to a cart [m].
MET = 1.0
# How far a line may have been followed since the last step, and back [m].
WINDOW = 4.0


@compiled
def follow(line, step, state, way, wish, radius, hitch, points, ground, traffic, others, period):
    """Speed, turn rate and way along a line; and whether something is in the way.

    Args:
        line: x, y, theta, theta unwrapped, shape (m, 3).
        step: Spacing of its points [m].
        state: x, y, theta, beta of the cart.
        way: Along the line where it was [m].
        wish: Speed that it would drive at [m/s].
        radius: Least turning radius [m].
        hitch: Of the cart.
        points: Its outline.
        ground: Raster.
        traffic: Combines, now.
        others: Outlines of the carts that have precedence, shape (k, 2) [m].
        period: [s].
    """
    way = nearest_way(line, step, state[0], state[1], way, WINDOW)
    if wish <= 0.0:
        return 0.0, 0.0, way, False
    omega = steer(line, step, state, way, wish, radius, period)
    now = traffic.time
    then = drive(state, wish, omega, hitch, period, 2)
    placed = outline_at(points, hitch.length, hitch.hitch_offset, then)
    stays = outline_at(points, hitch.length, hitch.hitch_offset, state)
    if crop_under(ground, traffic, placed, now, 0.0) > crop_under(ground, traffic, stays, now, 0.0):
        return 0.0, 0.0, way, True
    if len(others) > 0:
        gap = _gap(placed, others)
        if gap < OTHERS_GAP and gap < _gap(stays, others):
            return 0.0, 0.0, way, True
    for ahead in (period, LOOK / 2, LOOK):
        gap = gap_to_combines(traffic, placed, now + ahead)
        if gap < STOP_GAP and gap < gap_to_combines(traffic, stays, now + ahead):
            return 0.0, 0.0, way, True
    return wish, omega, way, False


@compiled
def backs_into(traffic, points, hitch, state, v, omega, period):
    """Whether a control held for a period brings a cart too near to a combine, or folds it up."""
    then = drive(state, v, omega, hitch, period, 2)
    if abs(then[3]) > FOLDED and abs(then[3]) > abs(state[3]):
        return True
    gaps = np.empty(2)
    for k, at in enumerate((state, then)):
        placed = outline_at(points, hitch.length, hitch.hitch_offset, at)
        gaps[k] = gap_to_combines(traffic, placed, traffic.time)
    return gaps[1] < STOP_GAP and gaps[1] < gaps[0]


@compiled
def will_be_met(traffic, placed, within):
    """Whether a combine comes to an outline, shape (m, 2), within a time [s]."""
    for k in range(int(within / 2.0)):
        if gap_to_combines(traffic, placed, traffic.time + 2.0 * k) < MET:
            return True
    return False


@compiled
def _gap(points, others):
    """Least distance between two sets of points [m]."""
    least = np.inf
    for a in points:
        for b in others:
            least = min(least, (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2)
    return np.sqrt(least)
