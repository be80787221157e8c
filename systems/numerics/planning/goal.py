"""What a plan is to reach and from where, and which carts and distances planners can compute with.

Outside these ranges, a time step short enough for the trailer is lost in rounding, or there are
more of them than fit into memory.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InvalidInput, require, require_finite, require_type
from .trailer import Trailer

# Half-widths of one cell of the thesis's grid, in the normalised model (3.5.1).
THESIS_TOLERANCE = (0.2, 0.2, 0.251, 0.251)
# All planners count a cart this near to its goal as arrived [m], [rad].
ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True)
class Goal:
    """A box around a configuration, in the goal's own frame: it turns with the goal's heading.

    A time to a point, to a box and with beta free are three different numbers: every result says
    which goal it is for.

    Raises:
        InvalidInput: The state is not four finite numbers, or a tolerance is negative.
    """

    # (x, y, theta, beta) [m], [m], [rad], [rad].
    state: tuple[float, float, float, float]
    # Half-widths of the box; 0: exactly, infinite: free. The first is along the goal's heading, the
    # second across it [m], [m], [rad], [rad].
    tolerance: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        require(len(self.state) == 4, "goal", "be (x, y, theta, beta)", self.state)
        require(len(self.tolerance) == 4, "tolerance", "have four entries", self.tolerance)
        for value in self.state:
            require_finite("goal", value)
        for value in self.tolerance:
            require(value >= 0, "tolerance", "be zero or positive", value)

    @property
    def is_point(self) -> bool:
        """Whether the configuration is to be reached exactly."""
        return not any(self.tolerance)

    @property
    def centred(self) -> "Goal":
        """The same goal in its own frame: at the origin, heading along x."""
        return replace(self, state=(0.0, 0.0, 0.0, self.state[3]))

    def to_frame(self, states) -> np.ndarray:
        """States in the goal's own frame, shape (..., 4); headings turned, but not wrapped.

        Args:
            states: x, y, theta, beta in the world [m], [m], [rad], [rad].
        """
        local = np.array(states, dtype=float)
        x, y, heading, _ = self.state
        c, s = math.cos(heading), math.sin(heading)
        dx, dy = local[..., 0] - x, local[..., 1] - y
        local[..., 0], local[..., 1] = c * dx + s * dy, c * dy - s * dx
        local[..., 2] -= heading
        return local

    def from_frame(self, local) -> np.ndarray:
        """States in the world, shape (..., 4).

        Args:
            local: x, y, theta, beta in the goal's own frame [m], [m], [rad], [rad].
        """
        states = np.array(local, dtype=float)
        x, y, heading, _ = self.state
        c, s = math.cos(heading), math.sin(heading)
        ahead, left = states[..., 0].copy(), states[..., 1].copy()
        states[..., 0], states[..., 1] = x + c * ahead - s * left, y + s * ahead + c * left
        states[..., 2] += heading
        return states

    def gaps(self, states) -> np.ndarray:
        """From the goal to states: ahead, to the left, heading and beta, shape (..., 4).

        Angles lie in [-pi, pi).
        """
        gaps = self.to_frame(states)
        gaps[..., 3] -= self.state[3]
        gaps[..., 2:] = np.remainder(gaps[..., 2:] + math.pi, math.tau) - math.pi
        return gaps

    def contains(self, states) -> np.ndarray:
        """Whether states are in the box, shape (..., 4) -> (...,)."""
        return np.asarray((np.abs(self.gaps(states)) <= self.tolerance).all(axis=-1))

    def reached(self, state) -> bool:
        """Whether a state is in the box, but for a rounding of `ROUNDING`."""
        return max(self.miss(state)) <= ROUNDING

    def miss(self, state) -> tuple[float, float, float, float]:
        """How far a state is outside the box, entry by entry [m], [m], [rad], [rad]."""
        outside = np.maximum(np.abs(self.gaps(state)) - self.tolerance, 0.0)
        x, y, theta, beta = outside.tolist()
        return x, y, theta, beta

    def corners(self) -> np.ndarray:
        """Corners of a box of finite widths on the ground, counterclockwise, shape (4, 2) [m]."""
        wide, high = self.tolerance[:2]
        sides = np.array([(1, -1, 0, 0), (1, 1, 0, 0), (-1, 1, 0, 0), (-1, -1, 0, 0)])
        return self.from_frame(sides * [wide, high, 0.0, 0.0])[:, :2]


# Range of the trailer's length in turning radii, and largest hitch offset in trailer lengths.
SHORTEST, LONGEST = 1e-3, 1e3
MOST_OFFSET = 100.0
# Longest way from start to goal, and from either to the origin, in turning radii; largest angle
# of either [rad].
FARTHEST, FARTHEST_OUT = 1e4, 1e7
MOST_TURNED = 1e6


def require_plannable_cart(trailer: Trailer) -> None:
    """Refuse a cart whose trailer is much shorter or longer than it can turn.

    Args:
        trailer: The cart.

    Raises:
        InvalidInput: In one line that says what is out of range.
    """
    radius = trailer.radius
    require(0 < radius < math.inf, "speed / turn_rate", "be a turning radius", radius)
    least, most = SHORTEST * radius, LONGEST * radius
    words = f"be {SHORTEST:g} to {LONGEST:g} turning radii, {least:g} to {most:g} m"
    require(least <= trailer.length <= most, "length", words, trailer.length)
    offset = abs(trailer.hitch_offset)
    words = f"be at most {MOST_OFFSET:g} lengths of the trailer"
    require(offset <= MOST_OFFSET * trailer.length, "hitch_offset", words, trailer.hitch_offset)


def require_plannable(trailer: Trailer, start: Sequence[float], goal: Goal) -> None:
    """Refuse a start and goal so far apart, or so far out, that rounding would spoil the answer.

    Args:
        trailer: The cart.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: What is to be reached.

    Raises:
        InvalidInput: In one line that says what is out of range.
    """
    require_plannable_cart(trailer)
    radius = trailer.radius
    for name, state in (("start", start), ("goal", goal.state)):
        words = f"be within {FARTHEST_OUT:g} turning radii of the origin"
        require(max(map(abs, state[:2])) <= FARTHEST_OUT * radius, name, words, list(state[:2]))
        words = f"have angles of at most {MOST_TURNED:g} rad"
        require(max(map(abs, state[2:])) <= MOST_TURNED, name, words, list(state[2:]))
    away = math.dist(start[:2], goal.state[:2])
    words = f"be within {FARTHEST:g} turning radii of the goal"
    require(away <= FARTHEST * radius, "start", words, f"{away:g} m")


def checked_start(trailer: Trailer, start: Sequence[float], goal: Goal) -> np.ndarray:
    """Return the start as an array, shape (4,), after checking it, the cart and the goal.

    Raises:
        InvalidInput: It is not x, y, theta and beta, finite, with beta within the jackknife limit,
            or the cart is none that planners can compute with.
    """
    require_type("trailer", trailer, Trailer)
    require_type("goal", goal, Goal)
    try:
        entries = [float(value) for value in start]
    except (TypeError, ValueError):
        raise InvalidInput(f"`start` must be four numbers; got {start}") from None
    require(len(entries) == 4, "start", "be (x, y, theta, beta)", start)
    for value in entries:
        require_finite("start", value)
    require_plannable_cart(trailer)
    bent = abs(math.remainder(start[3], math.tau))
    require(bent <= trailer.jackknife, "start", "have |beta| within jackknife", start[3])
    return np.array(start, dtype=float)
