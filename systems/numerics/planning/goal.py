"""What a plan is to reach: a configuration, and how near is near enough."""

import math
from dataclasses import dataclass

from ..errors import require, require_finite

# Half-widths of one cell of the thesis's grid, in the normalised model (3.5.1).
THESIS_TOLERANCE = (0.2, 0.2, 0.251, 0.251)


@dataclass(frozen=True, kw_only=True)
class Goal:
    """A box around a configuration.

    A time to a point, to a box and with beta free are three different numbers: every result says
    which goal it is for.

    Raises:
        InvalidInput: The state is not four finite numbers, or a tolerance is negative.
    """

    # (x, y, theta, beta) [m], [m], [rad], [rad].
    state: tuple[float, float, float, float]
    # Half-widths of the box; 0: exactly, infinite: free.
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

    def miss(self, state) -> tuple[float, float, float, float]:
        """How far a state is outside the box, entry by entry [m], [m], [rad], [rad]."""
        gaps = [float(a) - b for a, b in zip(state, self.state, strict=True)]
        gaps[2:] = [math.remainder(gap, math.tau) for gap in gaps[2:]]
        x, y, theta, beta = (
            max(abs(gap) - width, 0.0) for gap, width in zip(gaps, self.tolerance, strict=True)
        )
        return x, y, theta, beta
