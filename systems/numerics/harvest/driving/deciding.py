"""What the driver of a cart decides at a step: to look for a route, to get aside, to back up."""

import math

import numpy as np

from ..routes.ground import Traffic
from ..routes.meeting import Lanes
from ..routes.planner import RoutePlanner
from ..routes.route import Route
from ..strategies.serving import STAY
from .giving_way import HOPELESS, driving_on, has_missed_place, is_in_the_way, is_wedged
from .memory import (
    BACK,
    BACKING,
    BESIDE,
    DEPART,
    DOING,
    EN_ROUTE,
    FAILS,
    NEWEST,
    OLDEST,
    RESTING,
    RETRY,
    SPACING,
    STILL,
    STUCK,
    TARGET,
    WAY,
    evenly,
)
from .routing import route_to

# Between two tries to find a route, and how long something may be in the way before another
# is looked for [s]; how much longer for each cart that comes after in precedence; and how many
# times as long it waits after tries in vain, at most.
AGAIN, PATIENCE, MORE_PATIENCE, SELDOM = 4.0, 10.0, 6.0, 12
# For how long a cart stays aside [s].
ASIDE = 15.0


def deliberate(
    memory: np.ndarray, lanes: Lanes, traffic: Traffic, *, patience: float, pours: bool
) -> tuple[bool, bool]:
    """Whether a driver looks about for something else to do, and whether for a way to its task.

    A driver that has backed up far enough, or cannot any more, rests from then on.

    Args:
        memory: What it remembers, shape (MEMORY,); changed in place.
        lanes: Beside the combines.
        traffic: The combines, now.
        patience: How long something may be in its way [s].
        pours: Grain is being poured into its cart, from a combine that stands.
    """
    now = traffic.time
    waited = now - memory[STUCK] > patience
    done = memory[WAY] <= 0.0 or memory[NEWEST] <= memory[OLDEST]
    if memory[DOING] == BACKING and (done or waited):
        memory[DOING], memory[FAILS] = RESTING, 0
    # What is poured from a combine that stands is poured to the end.
    if memory[DOING] == BACKING or now < memory[RETRY] or pours:
        return False, False
    stands = now - memory[STILL] > patience
    lasting = memory[DOING] in (EN_ROUTE, BESIDE) and waited
    lasting |= stands and has_missed_place(memory, lanes, traffic)
    wants = memory[DOING] == RESTING or lasting
    return bool(wants or stands), bool(wants and memory[TARGET] != STAY)


def choose_route(
    memory: np.ndarray,
    state: np.ndarray,
    placed: np.ndarray,
    traffic: Traffic,
    *,
    goes: bool,
    truck: np.ndarray,
    begins: np.ndarray,
    planner: RoutePlanner,
    lanes: Lanes,
    reach: float,
) -> Route | None:
    """A route to its task, or out of others' way; or None, having perhaps decided to back up.

    Args:
        memory: What the driver remembers, shape (MEMORY,); changed in place.
        state: Of its cart: x, y, theta, beta, shape (4,).
        placed: The cart's outline, shape (m, 2) [m].
        traffic: Combines and other carts, as foreseen.
        goes: Whether a way to the task is wanted.
        truck: Where the cart stands at its truck: x, y, theta of the tractor, shape (3,).
        begins: When each combine sets out, shape (N,) [s].
        planner: Of routes.
        lanes: Beside the combines.
        reach: Of the augers, from a combine's middle to its lane [m].
    """
    now, route = traffic.time, None
    if goes:
        route = route_to(int(memory[TARGET]), truck, state, traffic, planner, lanes, reach)
        memory[FAILS] += 1
    memory[RETRY] = now + AGAIN * min(1 + memory[FAILS], SELDOM)
    late = route is None or route.depart > now + PATIENCE or memory[FAILS] >= HOPELESS
    if late and is_in_the_way(memory, placed, traffic, begins):
        aside = None
        if memory[FAILS] <= HOPELESS:
            aside = planner.aside(driving_on(traffic, begins), state, now)
        if aside is not None:
            memory[RETRY] = aside.arrive + ASIDE
            return aside
        if is_wedged(memory, placed, traffic):
            memory[DOING], memory[WAY] = BACKING, BACK
            return None
    elif route is None and goes and is_wedged(memory, placed, traffic):
        memory[DOING], memory[WAY] = BACKING, BACK
    return route


def set_out(memory: np.ndarray, route: Route) -> np.ndarray:
    """Have a driver drive a route; its line, to remember beside, shape (POINTS, 3).

    Args:
        memory: What the driver remembers, shape (MEMORY,); changed in place.
        route: From where its cart stands.
    """
    memory[DOING], memory[WAY], memory[STUCK] = EN_ROUTE, 0.0, math.inf
    memory[DEPART], memory[STILL] = route.depart, math.inf
    line, memory[SPACING] = evenly(route)
    return line


def patience_of(number: int, carts: int) -> float:
    """How long something may be in the way of a cart: those that come first try again first [s].

    Args:
        number: Of the cart.
        carts: How many there are.
    """
    return PATIENCE + MORE_PATIENCE * (carts - 1 - number)
