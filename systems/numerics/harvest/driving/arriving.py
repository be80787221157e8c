"""The end of a way, or of a lane."""

import math

import numpy as np

from ..routes.ground import Traffic
from ..routes.meeting import Lanes
from ..strategies.serving import TRUCK
from .memory import AT_TRUCK, BESIDE, DOING, EN_ROUTE, LANE, POINTS, RESTING, SPACING, TARGET, WAY

# How near to the end of its way a cart is there, and how near to its lane it has found it [m],
# if it is turned against the lane by less than an angle [rad].
THERE, FOUND, ALONG = 0.5, 5.0, 0.8


def notice_arrival(memory: np.ndarray, state: np.ndarray, lanes: Lanes, traffic: Traffic) -> None:
    """Change what a driver remembers where its way ends, or its lane, in place.

    Args:
        memory: Of one driver, shape (MEMORY,).
        state: x, y, theta, beta, shape (4,) [m], [m], [rad], [rad].
        lanes: Beside the combines.
        traffic: The combines, now.
    """
    target = int(memory[TARGET])
    station = float(traffic.progress[max(target, 0)])
    numbers = lanes.numbers_at(target, station) if target >= 0 else []
    end = memory[SPACING] * (POINTS - 1)
    if memory[DOING] == EN_ROUTE and memory[WAY] >= end - THERE:
        if target == TRUCK:
            memory[DOING] = AT_TRUCK
        elif numbers:
            memory[WAY], gap, memory[LANE] = lanes.nearest(target, station, state)
            course = lanes.of[target][int(memory[LANE])].pose_at(memory[WAY])[2]
            along = abs(math.remainder(state[2] - course, math.tau)) < ALONG
            memory[DOING] = BESIDE if gap < FOUND and along else RESTING
        else:
            memory[DOING] = RESTING
    elif memory[DOING] == BESIDE and memory[LANE] not in numbers:
        memory[DOING] = RESTING
