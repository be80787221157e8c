"""Grids, turning times and certificates for pursuit by the lower bound of the visibility game."""

import math

import numpy as np

from ...errors import require_non_negative, require_positive
from .bounds import LOWER_STEP


def certified_grid(grid: float, pursuer_speed: float, period: float) -> float:
    """Return the largest spacing, at most `grid`, for which a step is a whole number of periods.

    The lower bound holds for pursuers that are at nodes at the end of a step, and robots get new
    commands once a period. If one period is already longer than the step of `grid`, the step is
    one period, and the spacing larger than `grid`.

    Args:
        grid: Desired spacing, see `solve_visibility_game` [m].
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
    """Longest time that a differential drive turns in place before it drives straight [s].

    It also drives backwards, so it turns by a right angle at most. The time is rounded up to whole
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
    """Factor by which the pursuer's turning makes an evader effectively faster, no unit.

    In a step a pursuer turns for `turning_time` and then drives, while the evader runs all the
    time. Relative to the pursuer's motion, the evader's speed is multiplied by the duration of the
    step divided by the time in which the pursuer drives.

    Args:
        grid: See `solve_visibility_game`, for the lower bound [m].
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
        The shortest time over all evaders, each with its best pursuer; 0 if an evader has none.
    """
    kept = np.zeros(evaders)
    for time, evader in zip(times, assignment, strict=True):
        if evader >= 0:
            kept[int(evader)] = max(kept[int(evader)], time)
    return float(kept.min())
