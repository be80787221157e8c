"""What the driver of a cart remembers from step to step, in arrays."""

import numpy as np

from ..routes.route import Route

# What a driver does.
RESTING, EN_ROUTE, BESIDE, AT_TRUCK, BACKING = range(5)
# Columns of what a driver remembers: that; where it is sent; number of the lane; way along its
# line [m]; when to set out, when to try again, since when something is in the way [s]; spacing of
# its line's points [m]; how many steps of its trail it could still go back, from where to where;
# how often in a row it has planned without getting on; since when it stands [s].
DOING, TARGET, LANE, WAY, DEPART, RETRY, STUCK, SPACING, OLDEST, NEWEST, FAILS, STILL = range(12)
MEMORY = 12
# Steps of a trail that are remembered, and how far a cart backs up that finds no route [m].
TRAIL, BACK = 400, 20.0
# A cart so slow stands [m/s]; one that has driven so far has got on [m].
SLOW, GOT_ON = 0.05, 12.0
# Points of a line that is remembered.
POINTS = 1000


def evenly(route: Route) -> tuple[np.ndarray, float]:
    """A route's line as POINTS poses at equal ways, and the ways between them [m].

    The poses have the shape (POINTS, 3).
    """
    at = np.linspace(0.0, route.way.length, POINTS)
    columns = route.way.states[:, :3].T
    line = np.stack([np.interp(at, route.way.distances, column) for column in columns], axis=1)
    return line, max(route.way.length / (POINTS - 1), 1e-6)


def note_move(
    memory: np.ndarray,
    trail: np.ndarray,
    v: float,
    omega: float,
    way: float,
    stopped: bool,
    time: float,
) -> None:
    """Remember a move in place: on the trail, how far it led, and whether the cart stands.

    Args:
        memory: Of one driver, shape (MEMORY,).
        trail: Its controls, shape (TRAIL, 2).
        v: Speed [m/s].
        omega: Turn rate [rad/s].
        way: Along its line, then [m].
        stopped: Something is in the way.
        time: Now [s].
    """
    memory[WAY] = way
    if v > SLOW:
        trail[int(memory[NEWEST]) % TRAIL] = v, omega
        memory[NEWEST] += 1
        memory[OLDEST] = max(memory[OLDEST], memory[NEWEST] - TRAIL)
    elif v < 0.0:
        memory[NEWEST] -= 1
    memory[STILL] = min(memory[STILL], time) if abs(v) < SLOW else np.inf
    memory[STUCK] = min(memory[STUCK], time) if stopped else np.inf
    if memory[DOING] == EN_ROUTE and memory[WAY] > GOT_ON:
        memory[FAILS] = 0


def note_task(memory: np.ndarray, task: float, time: float) -> None:
    """Remember in place where a cart is sent; if it is somewhere new, what it did is over.

    Args:
        memory: Of one driver, shape (MEMORY,).
        task: Number of a combine, or one of `strategies.serving`: what a scheduler says.
        time: Now [s].
    """
    if memory[TARGET] != task:
        memory[TARGET], memory[DOING], memory[RETRY] = task, RESTING, time


def last_control(memory: np.ndarray, trail: np.ndarray) -> np.ndarray:
    """The last speed and turn rate on a trail, shape (2,) [m/s], [rad/s].

    Args:
        memory: Of one driver, shape (MEMORY,).
        trail: Its controls, shape (TRAIL, 2).
    """
    return trail[int(memory[NEWEST] - 1) % TRAIL]
