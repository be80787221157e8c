"""A route to what a cart is sent to."""

import math

import numpy as np

from ..routes.ground import Traffic, pose_on_path
from ..routes.meeting import Lanes
from ..routes.planner import RoutePlanner
from ..routes.route import Route, staying_at
from ..strategies.serving import TRUCK

# A combine that has not begun is left alone until a cart would need half of the time that is left,
# and so much more [s], to drive straight there.
AMPLE, SPARE = 2.0, 60.0

# To how many places round a combine that stands full a way is searched for.
TRIED = 3


def route_to(
    target: int,
    truck: np.ndarray,
    state: np.ndarray,
    traffic: Traffic,
    planner: RoutePlanner,
    lanes: Lanes,
    reach: float,
) -> Route | None:
    """The soonest route found, or None.

    A combine that stands full is reached beside its lane too, since its auger swings round.

    Args:
        target: Number of a combine, or `strategies.serving.TRUCK`.
        truck: Where the cart stands at its truck: x, y, theta of the tractor, shape (3,).
        state: x, y, theta, beta, shape (4,).
        traffic: Combines and other carts, now.
        planner: Of routes.
        lanes: Beside the combines.
        reach: Of the augers, from a combine's middle to its lane [m].
    """
    if target >= 0 and _begins_late(target, state, traffic, lanes):
        return None
    stands_full = target >= 0 and math.isinf(traffic.waits[target])
    if stands_full:
        # Whoever waits may wait for that one.
        waits = np.where(traffic.waits > 0.0, math.inf, traffic.waits)
        traffic = traffic._replace(waits=waits)
    ways = [staying_at(truck)] if target == TRUCK else lanes.meetings(traffic, target)
    routes = (planner.plan(traffic, state, traffic.time, each) for each in ways)
    route = next(filter(None, routes), None)
    if route is None and stands_full:
        pose = np.array(pose_on_path(traffic, target, traffic.progress[target]))
        places = lanes.places_at_standing(pose, reach)
        route = planner.to_any(traffic, state, traffic.time, places)
        for place in [each for each in places if planner.has_room(traffic, each)][:TRIED]:
            route = route or planner.plan(traffic, state, traffic.time, staying_at(place))
    return route


def _begins_late(target: int, state: np.ndarray, traffic: Traffic, lanes: Lanes) -> bool:
    """Whether a combine has not begun, and will not for so long that no way is to be sought yet."""
    left = traffic.waits[target]
    if traffic.progress[target] > 0.0 or math.isinf(left):
        return False
    x, y, _ = pose_on_path(traffic, target, 0.0)
    way = math.hypot(x - state[0], y - state[1]) / lanes.cart.speed
    return bool(left > AMPLE * way + SPARE)
