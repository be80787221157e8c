"""Whether a cart has to make room for others, and whether it is stuck."""

import math

import numpy as np

from ..machines.alongside import ALONG
from ..routes.clearance import gap_to_combines
from ..routes.ground import Traffic
from ..routes.meeting import Lanes
from ..routes.others import gap_to_carts
from ..routes.refuge import is_met
from .memory import BESIDE, DOING, FAILS, LANE, NEWEST, OLDEST, TARGET, WAY

# How soon somebody would be where a cart stands [s], and how near [m].
IN_THE_WAY, MET = 20.0, 1.0
# How near others are that wait for a cart, or that it cannot get away from [m]; after how many
# tries it is stuck anyhow.
CLOSE, HOPELESS = 8.0, 3


def driving_on(traffic: Traffic, begins: np.ndarray) -> Traffic:
    """Traffic in which only those combines wait that are full, or begin later, shape (N,) [s]."""
    later = np.maximum(begins - traffic.time, 0.0)
    return traffic._replace(waits=np.where(np.isinf(traffic.waits), math.inf, later))


def is_in_the_way(
    memory: np.ndarray, placed: np.ndarray, traffic: Traffic, begins: np.ndarray
) -> bool:
    """Whether somebody would run into a cart that stays, or waits for it to go.

    Args:
        memory: What its driver remembers, shape (MEMORY,).
        placed: Its outline, shape (m, 2).
        traffic: Combines and other carts.
        begins: When each combine sets out, shape (N,) [s].
    """
    if is_met(driving_on(traffic, begins), placed, IN_THE_WAY, MET):
        return True
    return memory[FAILS] >= HOPELESS and gap_to_carts(traffic.others, placed, 0.0) < CLOSE


def has_missed_place(memory: np.ndarray, lanes: Lanes, traffic: Traffic) -> bool:
    """Whether a cart is so far ahead of its place beside a combine that only that one could come.

    Args:
        memory: What its driver remembers, shape (MEMORY,).
        lanes: Beside the combines.
        traffic: The combines, now.
    """
    if memory[DOING] != BESIDE:
        return False
    combine, number = int(memory[TARGET]), int(memory[LANE])
    place = lanes.place_at(combine, number, float(traffic.progress[combine]))
    return bool(memory[WAY] > place + ALONG)


def is_wedged(memory: np.ndarray, placed: np.ndarray, traffic: Traffic) -> bool:
    """Whether a cart has no way forward, for a combine that is near or for long.

    Args:
        memory: What its driver remembers, shape (MEMORY,).
        placed: Its outline, shape (m, 2) [m].
        traffic: Combines and other carts.
    """
    if memory[NEWEST] <= memory[OLDEST]:
        return False
    near = gap_to_combines(traffic, placed, traffic.time)
    return near < CLOSE or memory[FAILS] >= HOPELESS
