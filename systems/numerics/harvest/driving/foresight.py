"""What a cart is going to do, as far as its driver knows: next, and later."""

import math

import numpy as np

from ..machines.cart import hitch_of
from ..machines.filling import STANDING_MODES
from ..routes.ground import Traffic, stations_at
from ..routes.lane import STEP
from ..routes.meeting import Lanes
from ..routes.others import EVERY, others_of
from ..routes.way import poses_on, trailing
from .memory import (
    BESIDE,
    DEPART,
    DOING,
    EN_ROUTE,
    LANE,
    POINTS,
    SPACING,
    STUCK,
    TARGET,
    WAY,
)


def expected_states(
    memory: np.ndarray,
    line: np.ndarray,
    state: np.ndarray,
    lanes: Lanes,
    traffic: Traffic,
    count: int,
) -> np.ndarray:
    """States of a cart from now on, EVERY seconds, shape (count, 4).

    It drives its line at its speed, and then beside the combine that it is sent to as long as
    there is a lane; one that something is in the way of stays where it is.

    Args:
        memory: What its driver remembers, shape (MEMORY,).
        line: x, y, theta of its route, shape (POINTS, 3).
        state: x, y, theta, beta, shape (4,) [m], [m], [rad], [rad].
        lanes: Beside the combines.
        traffic: The combines, now.
        count: How many states, at least 2.
    """
    still = np.tile(state, (count, 1))
    if memory[DOING] not in (EN_ROUTE, BESIDE) or math.isfinite(memory[STUCK]):
        return still
    late = EVERY * np.arange(count)
    poses = still[:, :3]
    target, arrives = int(memory[TARGET]), 0.0
    if memory[DOING] == EN_ROUTE:
        end = memory[SPACING] * (POINTS - 1)
        sets_out = max(memory[DEPART] - traffic.time, 0.0)
        speed = lanes.cart.speed
        ways = memory[WAY] + speed * np.maximum(late - sets_out, 0.0)
        poses = poses_on(line, memory[SPACING], np.minimum(ways, end))
        arrives = sets_out + (end - memory[WAY]) / speed
    beside = late >= arrives
    if target >= 0 and beside.any():
        stations = stations_at(traffic, target, traffic.time + late[beside])
        if memory[DOING] == EN_ROUTE:
            number = next(iter(lanes.numbers_at(target, float(stations[0]))), None)
        else:
            number = int(memory[LANE])
        if number is not None:
            lane = lanes.of[target][number]
            places = np.interp(stations, lane.stations, lane.slots) + lanes.lead
            poses[beside] = poses_on(lane.points, STEP, places)
    poses[:, 2] = np.unwrap(np.concatenate([state[2:3], poses[:, 2]]))[1:]
    driven = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))])
    betas = trailing(poses, float(state[3]), hitch_of(lanes.cart), driven)
    return np.column_stack([poses, betas])


def seen_by(
    cart: int,
    memories: np.ndarray,
    lines: np.ndarray,
    states: np.ndarray,
    lanes: Lanes,
    traffic: Traffic,
    count: int,
    reach: float = math.inf,
) -> Traffic:
    """Traffic with the other carts as one sees them, those first that one lets pass.

    Whoever works beside a combine comes first, then those of lower numbers.

    Args:
        cart: Number of the one.
        memories: Of all drivers, shape (K, 12).
        lines: Their routes, shape (K, POINTS, 3).
        states: Of the carts, shape (K, 4).
        lanes: Beside the combines.
        traffic: The combines, now.
        count: How many states of each are foreseen.
        reach: How far off others count [m].
    """
    gaps = np.hypot(*(states[:, :2] - states[cart, :2]).T)
    rank = [(memory[DOING] != BESIDE, k) for k, memory in enumerate(memories)]
    others = sorted(k for k in range(len(states)) if k != cart and gaps[k] < reach)
    if not others:
        return traffic
    others.sort(key=lambda k: rank[k])
    foreseen = [
        expected_states(memories[k], lines[k], states[k], lanes, traffic, count) for k in others
    ]
    before = sum(rank[k] < rank[cart] for k in others)
    return traffic._replace(others=others_of(foreseen, before, lanes.cart))


def wish_of(
    memory: np.ndarray,
    line: np.ndarray,
    lanes: Lanes,
    traffic: Traffic,
    modes: np.ndarray,
    period: float,
) -> tuple[np.ndarray, float, float]:
    """The line that a cart follows, the spacing of its points, and the speed it would drive at.

    Args:
        memory: What its driver remembers, shape (MEMORY,).
        line: x, y, theta of its route, shape (POINTS, 3).
        lanes: Beside the combines.
        traffic: The combines, now.
        modes: Theirs, shape (N,).
        period: For which the speed is held [s].
    """
    if memory[DOING] == EN_ROUTE:
        if traffic.time < memory[DEPART] - 1e-9:
            return line, memory[SPACING], 0.0
        left = memory[SPACING] * (POINTS - 1) - memory[WAY]
        return line, memory[SPACING], min(lanes.cart.speed, left / period)
    if memory[DOING] != BESIDE:
        return line, 1.0, 0.0
    combine, number = int(memory[TARGET]), int(memory[LANE])
    speed = 0.0 if modes[combine] in STANDING_MODES else traffic.speed
    station = float(traffic.progress[combine])
    wish = lanes.speed_beside(combine, number, station, speed, memory[WAY])
    return lanes.of[combine][number].points, STEP, wish
