"""The closed loop of a stand-off controller: its parameters, and its equations, which stand here.

The pursuer drives at the evader's velocity plus what the controller makes of the miss
eps = y - e(y) - r, estimated minus wanted distance. With f = -eps,

    f(y) = a y^2 + (b - 1) y + c + r,    f'(y) = 2 a y + b - 1,

the block diagram says y' = K_P f + K_I z + K_D f'(y) y' with z' = f, z(0) = 0. Solved for y':

    P    y'  = K_P f
    PI   y'' = K_P f' y' + K_I f
    PD   y'  = K_P f / (1 - K_D f')
    PID  y'' = (K_P f' y' + K_I f + 2 a K_D y'^2) / (1 - K_D f')

Source: Zhang 2014, (2.9)-(2.12). Printed one derivative too high on the left of (2.10)-(2.12), and
with the denominator 1 - 2 a K_D y - (b - 1) in (2.12), which is right for K_D = 1 only.

Everything is plain arithmetic, so that NumPy arrays and Drake's scalars all go through it.
"""

from dataclasses import dataclass, field

from ..errors import require_finite, require_non_negative, require_one_of, require_positive
from .error_model import THESIS_ERROR, ErrorModel

# The controllers of (2.9) to (2.12), by the names that `StandoffLoop` takes.
CONTROLLERS = ("P", "PI", "PD", "PID")


@dataclass(frozen=True, kw_only=True)
class StandoffLoop:
    """A controller, its gains, the distance that it is to keep, and the estimate's error.

    A gain that the controller has no use for is ignored. The defaults are the thesis's.

    Raises:
        InvalidInput: An unknown controller, or a gain out of its range.
    """

    # P, PI, PD or PID.
    controller: str = "PID"
    # Gains [1/s], [1/s^2], [1].
    kp: float = 10.0
    ki: float = 5.0
    kd: float = 1.0
    # Distance to keep, r [m].
    reference: float = 0.2
    error: ErrorModel = field(default=THESIS_ERROR)

    def __post_init__(self) -> None:
        require_one_of("controller", self.controller, CONTROLLERS)
        require_positive("kp", self.kp)
        # Without it a PI or PID controller has a whole line of states at rest.
        if self.integrates:
            require_positive("ki", self.ki)
        else:
            require_non_negative("ki", self.ki)
        require_non_negative("kd", self.kd)
        require_finite("reference", self.reference)

    @property
    def integrates(self) -> bool:
        """Whether the controller has an integral part."""
        return "I" in self.controller

    @property
    def derivative_gain(self) -> float:
        """K_D, and 0 without a derivative part."""
        return self.kd if "D" in self.controller else 0.0

    @property
    def integral_gain(self) -> float:
        """K_I, and 0 without an integral part [1/s^2]."""
        return self.ki if self.integrates else 0.0

    def miss(self, y):
        """f(y) = a y^2 + (b - 1) y + c + r, wanted minus estimated distance [m]."""
        return self.error.error(y) - y + self.reference

    def slope(self, y):
        """f'(y) = 2 a y + b - 1 [1]."""
        return 2 * self.error.a * y + self.error.b - 1

    def inertia(self, y):
        """1 - K_D f'(y) [1]: zero at the singularity; below it derivative action runs away."""
        return 1 - self.derivative_gain * self.slope(y)

    def rate(self, y, integral=0.0):
        """y' for an integral z of f [m s]; [m/s]."""
        drive = self.kp * self.miss(y) + self.integral_gain * integral
        return drive / self.inertia(y)

    def acceleration(self, y, y_rate):
        """y'' of PI and PID, by the corrected (2.10) and (2.12) [m/s^2].

        Args:
            y: Distance [m].
            y_rate: Its rate [m/s].
        """
        curvature = 2 * self.error.a * self.derivative_gain
        pull = self.kp * self.slope(y) * y_rate + self.ki * self.miss(y)
        return (pull + curvature * y_rate * y_rate) / self.inertia(y)
