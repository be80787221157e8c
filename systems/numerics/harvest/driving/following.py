"""What a cart does in the next step: it follows its line, and stops before what is in its way."""

import numpy as np

from ...compiled import compiled
from ..routes.clearance import crop_under, gap_to_combines, outline_at
from ..routes.others import gap_to_cart, gap_to_carts
from ..routes.search import FOLDED
from ..routes.steering import drive, nearest_way, steer

# How near combines and other carts may come before a cart stops [m], and how far ahead in the
# combines' time it looks [s].
STOP_GAP, OTHERS_GAP, LOOK = 0.8, 1.5, 3.0
# By how much nearer it may come in a step all the same, where its route leads past them, and how
# near never [m].
CREEP, LEAST_GAP = 0.1, 0.4
# Parts of its speed that it tries.
STRIDES = (1.0, 0.5, 0.25)
# How far a line may have been followed since the last step, and back [m].
WINDOW = 4.0


@compiled
def follow(line, step, state, way, wish, radius, hitch, points, ground, traffic, period):
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
        traffic: Combines and other carts, now.
        period: [s].
    """
    way = nearest_way(line, step, state[0], state[1], way, WINDOW)
    if wish <= 0.0:
        return 0.0, 0.0, way, False
    now = traffic.time
    stays = outline_at(points, hitch.length, hitch.hitch_offset, state)
    under = crop_under(ground, traffic, stays, now, 0.0)
    speed, omega, placed = 0.0, 0.0, stays
    # Routes are looked at in places that are not those of these steps: beside what is left of the
    # crop the next one may be too far.
    for share in STRIDES:
        speed = share * wish
        omega = steer(line, step, state, way, speed, radius, period)
        then = drive(state, speed, omega, hitch, period, 2)
        placed = outline_at(points, hitch.length, hitch.hitch_offset, then)
        if crop_under(ground, traffic, placed, now, 0.0) <= under:
            break
    else:
        return 0.0, 0.0, way, True
    if meets_cart(traffic.others, placed, stays, period):
        return 0.0, 0.0, way, True
    for ahead in (period, LOOK / 2, LOOK):
        gap = gap_to_combines(traffic, placed, now + ahead)
        if comes_too_near(gap, STOP_GAP, gap_to_combines(traffic, stays, now + ahead)):
            return 0.0, 0.0, way, True
    return speed, omega, way, False


@compiled
def comes_too_near(gap, least, before):
    """Whether a gap that a step leaves is too small, and the step to blame; all in [m].

    Args:
        least: To be kept [m].
    """
    return (gap < least and gap < before - CREEP) or (gap < LEAST_GAP and gap < before)


@compiled
def back_up(ground, traffic, points, hitch, state, control, way, period):
    """Speed, turn rate and way of a cart that backs up, and whether something is in the way.

    It takes a control of its trail the other way round, so that the trailer retraces its way too,
    unless that brings it into crop or too near to others, or folds it.

    Args:
        ground: Raster of the crop.
        traffic: The combines.
        points: Outline of the cart, shape (m, 2) [m].
        hitch: Of the cart.
        state: x, y, theta, beta of the cart, shape (4,) [m], [m], [rad], [rad].
        control: Speed and turn rate of the tractor that it had, shape (2,) [m/s], [rad/s].
        way: How far it is still to back up [m].
        period: [s].
    """
    v, omega = -control[0], -control[1]
    then = drive(state, v, omega, hitch, period, 2)
    if abs(then[3]) > FOLDED and abs(then[3]) > abs(state[3]):
        return 0.0, 0.0, way, True
    gaps, under = np.empty(2), np.empty(2)
    for k, at in enumerate((state, then)):
        placed = outline_at(points, hitch.length, hitch.hitch_offset, at)
        under[k] = crop_under(ground, traffic, placed, traffic.time, 0.0)
        gaps[k] = min(
            gap_to_combines(traffic, placed, traffic.time),
            gap_to_carts(traffic.others, placed, 0.0) - OTHERS_GAP + STOP_GAP,
        )
    if under[1] > under[0] or (gaps[1] < STOP_GAP and gaps[1] < gaps[0]):
        return 0.0, 0.0, way, True
    return v, omega, way + v * period, False


@compiled
def meets_cart(others, placed, stays, period):
    """Whether an outline comes too near to another cart, and nearer than if it stays.

    Of those that one lets pass also where they will be soon.

    Args:
        others: The other carts.
        placed: Outline of the cart where it is, shape (m, 2) [m].
        period: Time step [s].
    """
    for number in range(len(others.states)):
        looks = 4 if number < others.before else 2
        for k in range(looks):
            ahead = (0.0, period, LOOK / 2, LOOK)[k]
            gap = gap_to_cart(others, number, placed, ahead)
            if comes_too_near(gap, OTHERS_GAP, gap_to_cart(others, number, stays, ahead)):
                return True
    return False
