"""The grid on which a value function stands."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...checked import Checked, Finite, Positive
from ...errors import require, require_finite, require_positive
from ..goal import Goal
from ..trailer import Trailer

# Table 3.1: h_x = h_y = 0.2 and h_theta = h_beta = 0.251 = 2 pi / 25, over twelve turning radii.
THESIS_STEP = 0.2
THESIS_ANGLES = 25
HALF_WIDTH = 6.0

# Room for loops around the start and the goal, in turning radii.
MARGIN = 3.0


@dataclass(frozen=True, kw_only=True)
class StateGrid(Checked):
    """Equally spaced nodes in x and y, and periodic ones in theta and beta.

    Angle number k stands at 2 pi k / n, so that zero is a node and mirror images of nodes are
    nodes. Cost and memory grow with the product of the four counts.

    Raises:
        InvalidInput: A count or a step is out of its range.
    """

    # Position of the first node [m].
    x_min: Finite
    y_min: Finite
    # Distance of nodes, the same in x and y [m].
    step: Positive
    # Numbers of nodes.
    x_count: int
    y_count: int
    theta_count: int
    beta_count: int

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("x_count", "y_count", "theta_count", "beta_count"):
            count = getattr(self, name)
            require(isinstance(count, int) and count >= 8, name, "be an integer >= 8", count)

    @classmethod
    def of_step(cls, step: float, centre=(0.0, 0.0), *, radius: float = 1.0) -> "StateGrid":
        """A square of twelve turning radii around a place, with angles refined alike.

        Args:
            step: Distance of nodes in turning radii; 0.2 is the thesis's.
            centre: (x, y) of its middle [m].
            radius: Smallest turning radius, speed / turn rate [m].

        Raises:
            InvalidInput: The step is not in (0, 1].
        """
        require(0 < step <= 1, "grid", "have a step in (0, 1]", step)
        require_positive("radius", radius)
        x, y = (float(value) for value in centre)
        require_finite("centre", x)
        require_finite("centre", y)
        half = math.ceil(HALF_WIDTH / step - 1e-9)
        angles = max(8, round(THESIS_ANGLES * THESIS_STEP / step))
        return cls(
            x_min=x - half * step * radius,
            y_min=y - half * step * radius,
            step=step * radius,
            x_count=2 * half + 1,
            y_count=2 * half + 1,
            theta_count=angles,
            beta_count=angles,
        )

    @classmethod
    def thesis(cls, centre=(0.0, 0.0), *, radius: float = 1.0) -> "StateGrid":
        """61 x 61 x 25 x 25 nodes (Table 3.1).

        Args:
            centre: (x, y) of its middle [m].
            radius: Smallest turning radius, speed / turn rate [m].
        """
        return cls.of_step(THESIS_STEP, centre, radius=radius)

    @classmethod
    def fine(cls, centre=(0.0, 0.0), *, radius: float = 1.0) -> "StateGrid":
        """The thesis's grid with every step halved.

        Args:
            centre: (x, y) of its middle [m].
            radius: Smallest turning radius, speed / turn rate [m].
        """
        return cls.of_step(THESIS_STEP / 2, centre, radius=radius)

    @classmethod
    def covering(
        cls, bounds: tuple[float, float, float, float], step: float, *, radius: float = 1.0
    ) -> "StateGrid":
        """A grid over a rectangle.

        Args:
            bounds: (x_min, y_min, x_max, y_max) [m].
            step: Distance of nodes in turning radii.
            radius: Smallest turning radius [m].

        Raises:
            InvalidInput: The bounds enclose no area, or the step is not in (0, 1].
        """
        square = cls.of_step(step, radius=radius)
        x_min, y_min, x_max, y_max = (float(value) for value in bounds)
        for value in (x_min, y_min, x_max, y_max):
            require_finite("bounds", value)
        require(x_min < x_max and y_min < y_max, "bounds", "enclose an area", bounds)
        return cls(
            x_min=x_min,
            y_min=y_min,
            step=square.step,
            x_count=max(8, math.ceil((x_max - x_min) / square.step - 1e-9) + 1),
            y_count=max(8, math.ceil((y_max - y_min) / square.step - 1e-9) + 1),
            theta_count=square.theta_count,
            beta_count=square.beta_count,
        )

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """Shape of a table: theta, beta, y, x."""
        return self.theta_count, self.beta_count, self.y_count, self.x_count

    @property
    def theta_step(self) -> float:
        """[rad]."""
        return math.tau / self.theta_count

    @property
    def beta_step(self) -> float:
        """[rad]."""
        return math.tau / self.beta_count

    @property
    def cell(self) -> tuple[float, float, float, float]:
        """Steps in x, y, theta, beta [m], [m], [rad], [rad]."""
        return self.step, self.step, self.theta_step, self.beta_step

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """(x_min, y_min, x_max, y_max) [m]."""
        x_max = self.x_min + (self.x_count - 1) * self.step
        y_max = self.y_min + (self.y_count - 1) * self.step
        return self.x_min, self.y_min, x_max, y_max

    def holds(self, x: float, y: float) -> bool:
        """Whether a place lies on the grid."""
        x_min, y_min, x_max, y_max = self.bounds
        return x_min <= x <= x_max and y_min <= y <= y_max

    def axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Coordinates of nodes along x, y, theta and beta, shape (count,) each.

        Angles go from 0 up to 2 pi.
        """
        return (
            self.x_min + self.step * np.arange(self.x_count),
            self.y_min + self.step * np.arange(self.y_count),
            self.theta_step * np.arange(self.theta_count),
            self.beta_step * np.arange(self.beta_count),
        )


def grid_around(trailer: Trailer, start: Sequence[float], goal: Goal, step: float) -> StateGrid:
    """The usual grid around a goal, grown where the start needs more room.

    Args:
        trailer: For its turning radius.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: The middle.
        step: Distance of nodes in turning radii.
    """
    radius = trailer.radius
    square = StateGrid.of_step(step, goal.state[:2], radius=radius)
    margin = MARGIN * radius
    # Equally far on both sides of the goal, so that it stays a node and a mirror axis.
    widths = [
        max(square.bounds[2 + k] - goal.state[k], abs(start[k] - goal.state[k]) + margin)
        for k in range(2)
    ]
    nodes = [math.ceil(width / square.step - 1e-9) for width in widths]
    return StateGrid(
        x_min=goal.state[0] - nodes[0] * square.step,
        y_min=goal.state[1] - nodes[1] * square.step,
        step=square.step,
        x_count=2 * nodes[0] + 1,
        y_count=2 * nodes[1] + 1,
        theta_count=square.theta_count,
        beta_count=square.beta_count,
    )


def is_mirrored(grid: StateGrid, goal: Goal) -> bool:
    """Whether the mirror image about the goal's axis maps the rectangle and the box to themselves.

    In the goal's frame it is (x, -y, -theta, -beta). Nodes are images of nodes for an axis along x.
    """
    x_min, y_min, x_max, y_max = grid.bounds
    x, y, theta, beta = goal.state
    c, s = math.cos(theta), math.sin(theta)
    aside = y_min + y_max - 2 * y if abs(s) < abs(c) else x_min + x_max - 2 * x
    return (
        abs(aside) < 1e-9 * grid.step
        and min(abs(s), abs(c)) < 1e-12
        and abs(math.sin(beta)) < 1e-12
    )
