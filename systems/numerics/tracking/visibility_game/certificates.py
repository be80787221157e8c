"""What a team can promise by the lower bound of the visibility game, and when it moves."""

import math

import numpy as np

from ...errors import require_non_negative, require_positive
from .bounds import LOWER_STEP


def certified_grid(grid: float, pursuer_speed: float, period: float) -> float:
    """The largest spacing, if any not above another, with which a step is a number of periods.

    The lower bound holds for pursuers that are at nodes when a step is over; robots get new
    commands once a period. Where even one period is more than the grid's step, one period it is.

    Args:
        grid: The other spacing, as of `solve_visibility_game` [m].
        pursuer_speed: Top speed [m/s].
        period: Between commands [s].

    Raises:
        InvalidInput: A number is not positive.
    """
    for name, value in (("grid", grid), ("pursuer_speed", pursuer_speed), ("period", period)):
        require_positive(name, value)
    periods = max(math.floor(LOWER_STEP * grid / (pursuer_speed * period) + 1e-9), 1)
    return periods * pursuer_speed * period / LOWER_STEP


def turning_time(top_turn_rate: float, period: float) -> float:
    """How long a differential drive turns in place at most, before it drives straight [s].

    It drives backwards too, so that it has to turn by a right angle at most. It turns for whole
    periods.

    Args:
        top_turn_rate: [rad/s].
        period: Between commands [s].

    Raises:
        InvalidInput: A number is not positive.
    """
    require_positive("top_turn_rate", top_turn_rate)
    require_positive("period", period)
    return math.ceil(0.5 * math.pi / (top_turn_rate * period) - 1e-9) * period


def turning_margin(grid: float, pursuer_speed: float, turning_time: float) -> float:
    """By how much turning makes an evader faster, no unit.

    In a step a pursuer turns for `turning_time` and then drives, and the evader runs all the time.
    Measured by how far the pursuer comes, the evader's speed is multiplied by all of the step over
    the part in which the pursuer drives.

    Args:
        grid: As of `solve_visibility_game`, for the lower bound [m].
        pursuer_speed: Top speed [m/s].
        turning_time: [s].

    Raises:
        InvalidInput: A number is out of its range.
    """
    require_positive("grid", grid)
    require_positive("pursuer_speed", pursuer_speed)
    require_non_negative("turning_time", turning_time)
    return 1.0 + pursuer_speed * turning_time / (LOWER_STEP * grid)


def team_certificate(times: np.ndarray, assignment: np.ndarray, evaders: int) -> float:
    """For how long all evaders are kept in sight, whatever they do [s].

    Args:
        times: For how long each pursuer can keep its own evader, shape (n,) [s].
        assignment: Each pursuer's evader, -1 for none, shape (n,).
        evaders: How many there are.

    Returns:
        The shortest time of an evader, with the best of the pursuers that have it; 0 where an
        evader has none.
    """
    kept = np.zeros(evaders)
    for time, evader in zip(times, assignment, strict=True):
        if evader >= 0:
            kept[int(evader)] = max(kept[int(evader)], time)
    return float(kept.min())
