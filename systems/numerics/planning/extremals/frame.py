"""The normalised model, seen from the goal: what the extremals are computed in."""

import math
from dataclasses import dataclass

import numpy as np

from ...errors import require, require_finite
from ..goal import Goal
from ..trailer import Trailer

# Relative; rounding in speed = turn rate * length is no reason to refuse a trailer.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class GoalFrame:
    """Unit of length: the trailer's; of time: one radian at the greatest turn rate.

    Attributes:
        trailer: Whose scaling reduces to the normalised model.
        goal: Lies at the origin, heading along x.
        start: x, y, theta, beta there; theta in (-pi, pi].
        theta: Heading of the start in the world, as given [rad].
    """

    trailer: Trailer
    goal: Goal
    start: tuple[float, float, float, float]
    theta: float

    def world_times(self, times: np.ndarray) -> np.ndarray:
        """Of normalised times, shape (n,) [s]."""
        return times / self.trailer.turn_rate

    def world_states(self, states: np.ndarray) -> np.ndarray:
        """Of normalised states, shape (n, 4); theta as continuous as it was."""
        x, y, heading, _ = self.goal.state
        east, north = math.cos(heading), math.sin(heading)
        length = self.trailer.length
        world = np.array(states, dtype=float)
        world[:, 0] = x + length * (east * states[:, 0] - north * states[:, 1])
        world[:, 1] = y + length * (north * states[:, 0] + east * states[:, 1])
        world[:, 2] += self.theta - self.start[2]
        return world


def goal_frame(trailer: Trailer, start, goal: Goal) -> GoalFrame | None:
    """The question in the normalised model, or None where the trailer does not scale to it.

    It does with the hitch on the axle and speed = turn rate * length.

    Raises:
        InvalidInput: The start is not four finite numbers.
    """
    require(len(start) == 4, "start", "be (x, y, theta, beta)", start)
    for value in start:
        require_finite("start", float(value))
    scales = math.isclose(trailer.speed, trailer.turn_rate * trailer.length, rel_tol=_ROUNDING)
    if trailer.hitch_offset != 0 or not scales:
        return None
    x, y, heading, _ = goal.state
    east, north = math.cos(heading), math.sin(heading)
    dx, dy = (float(start[0]) - x) / trailer.length, (float(start[1]) - y) / trailer.length
    theta = math.remainder(float(start[2]) - heading, math.tau)
    beta = math.remainder(float(start[3]), math.tau)
    local = (east * dx + north * dy, east * dy - north * dx, theta, beta)
    return GoalFrame(trailer, goal, local, float(start[2]))


NOT_SCALABLE = "not applicable: needs speed = turn rate * length and the hitch on the axle"
