"""The robot that emulation computes: dimensions, motors, sensors; `firmware/robot.h` has its part.

The thesis names the parts (differential drive, Arduino Mega 2560, XBee, four infrared sensors;
2.2.8 and 2.3.4) but no dimension. These are of a common kit: wheels of 65 mm, a gear motor of 34:1
with 48 counts a turn, Sharp GP2Y0A41SK0F sensors, two lithium cells.
"""

import math
from dataclasses import dataclass

import numpy as np

from ...systems.numerics.errors import require, require_non_negative, require_positive

# Of the converter: 10 bits of 5 V.
VOLT = 1024 / 5.0


@dataclass(frozen=True, kw_only=True)
class RobotBody:
    """A robot and its motors.

    A motor follows tau v' = power top_speed - v - friction sign(v): first order, with dry friction,
    so that a braked wheel comes to rest in finite time.

    Attributes:
        radius: Of the robot's rim [m]; obstacles are offset by 0.16 m (Zhang 2014, 2.2.8).
        track_width: Between the wheels [m].
        wheel_diameter: [m].
        counts: Number of edges of an encoder's channel A per turn of the wheel.
        top_speed: Of a wheel at full power, without friction [m/s].
        friction: Speed that friction takes from it [m/s].
        time_constant: Of a powered or braked wheel [s].
        coasting_constant: Of a wheel whose motor is not connected [s].
        battery: [V].

    Raises:
        InvalidInput: A value is out of its range.
    """

    radius: float = 0.10
    track_width: float = 0.16
    wheel_diameter: float = 0.065
    counts: float = 48 * 34.014 / 2
    top_speed: float = 0.9
    friction: float = 0.06
    time_constant: float = 0.045
    coasting_constant: float = 0.3
    battery: float = 7.6

    def __post_init__(self) -> None:
        for name in ("radius", "track_width", "wheel_diameter", "counts", "top_speed"):
            require_positive(name, getattr(self, name))
        for name in ("time_constant", "coasting_constant"):
            require_positive(name, getattr(self, name))
        require_non_negative("friction", self.friction)
        require(0 <= self.battery <= 10, "battery", "be 0 to 10 V", self.battery)

    @property
    def counts_per_metre(self) -> float:
        """Edges of an encoder's channel A [1/m]."""
        return self.counts / (math.pi * self.wheel_diameter)

    def stopping_time(self, speed: float) -> float:
        """Time that a braked wheel takes to come to rest from a speed [m/s], [s]."""
        if self.friction == 0:
            return math.inf
        return self.time_constant * math.log1p(abs(speed) / self.friction)


def sensor_voltages(ranges: np.ndarray, battery: float) -> np.ndarray:
    """Voltages at the converter of one robot.

    Args:
        ranges: Free way from the rim before the four infrared sensors, shape (4,) [m].
        battery: [V]; a divider halves it.

    Returns:
        Inputs 0 to 4, shape (5,) [V]. The sensor's curve is the hyperbola that the firmware
        inverts, of a sensor that sits 40 mm behind the rim.
    """
    readings = 11 + 20.76 / (np.asarray(ranges, dtype=float) + 0.04)
    return np.append(readings, 0.5 * battery * VOLT) / VOLT
