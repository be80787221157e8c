"""The emulated robot: dimensions, motors, sensors, and wheel dynamics.

`firmware/robot.h` has the firmware's part of it.

The thesis names the parts (differential drive, Arduino Mega 2560, XBee, four infrared sensors;
2.2.8 and 2.3.4) but no dimension. These are of a common kit: wheels of 65 mm, a gear motor of 34:1
with 48 counts a turn, Sharp GP2Y0A41SK0F sensors, two lithium cells.
"""

import math
from dataclasses import dataclass

import numpy as np

from ...systems.numerics.checked import Checked, NonNegative, Positive
from ...systems.numerics.errors import require

# Counts of the analogue-digital converter per volt: 10 bits for 5 V.
VOLT = 1024 / 5.0


@dataclass(frozen=True, kw_only=True)
class RobotBody(Checked):
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

    radius: Positive = 0.10
    track_width: Positive = 0.16
    wheel_diameter: Positive = 0.065
    counts: Positive = 48 * 34.014 / 2
    top_speed: Positive = 0.9
    friction: NonNegative = 0.06
    time_constant: Positive = 0.045
    coasting_constant: Positive = 0.3
    battery: float = 7.6

    def __post_init__(self) -> None:
        super().__post_init__()
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
    """Voltages at the inputs of one robot's analogue-digital converter.

    Args:
        ranges: Free distance from the rim before the four infrared sensors, shape (4,) [m].
        battery: Battery voltage, halved by a divider [V].

    Returns:
        Inputs 0 to 4, shape (5,) [V]. The sensor's curve is the hyperbola that the firmware
        inverts, of a sensor that sits 40 mm behind the rim.
    """
    readings = 11 + 20.76 / (np.asarray(ranges, dtype=float) + 0.04)
    return np.append(readings, 0.5 * battery * VOLT) / VOLT


# Greatest commanded wheel speed; faster pairs are scaled down together, to keep the curve [m/s].
_TOP_WHEEL_SPEED = 0.6


class StandInWheels:
    """Wheels of n robots, modelled as in `wheels_model.c` for the robots in simavr.

    A motor follows tau v' = power top_speed - v - friction sign(v), in closed form over a step,
    with the power that holds the commanded speed.

    Attributes:
        poses: Shape (n, 3) [m], [m], [rad]; headings are not wrapped.
        speeds: Speeds of the left and the right wheel, shape (n, 2) [m/s].
        odometry: Poses since the start by the encoders alone, shape (n, 3): without displacements
            by hand, and with the encoders' faults.
        sense: Direction in which encoders count, shape (n, 2): 1 the wheel's way, -1 the other way,
            0 not at all.

    Args:
        starts: Start poses, shape (n, 3) [m], [m], [rad].
        body: Body of all robots.
    """

    def __init__(self, starts: np.ndarray, body: RobotBody) -> None:
        self._body = body
        self.poses = np.array(starts, dtype=float)
        self.speeds = np.zeros((len(self.poses), 2))
        self.odometry = np.zeros_like(self.poses)
        self.sense = np.ones_like(self.speeds)
        self._counts = np.zeros_like(self.speeds)

    def counts(self) -> np.ndarray:
        """Counts of the left and the right encoder, integers, shape (n, 2)."""
        return np.floor(self._counts).astype(int)

    def step(self, targets: np.ndarray, dt: float) -> None:
        """Advance the wheels, poses and encoders by one time step.

        Args:
            targets: Forward speeds and turn rates, shape (n, 2) [m/s], [rad/s]; zero brakes.
            dt: Length of the step [s].
        """
        body = self._body
        across = 0.5 * body.track_width * targets[:, 1]
        wanted = np.stack([targets[:, 0] - across, targets[:, 0] + across], axis=1)
        top = np.abs(wanted).max(axis=1, keepdims=True)
        wanted = wanted * (_TOP_WHEEL_SPEED / np.maximum(top, _TOP_WHEEL_SPEED))
        pull = np.clip(wanted + body.friction * np.sign(wanted), -body.top_speed, body.top_speed)
        before = self.speeds
        sticks = (before == 0) & (np.abs(pull) <= body.friction)
        direction = np.where(before != 0, before, pull)
        limit = pull - np.copysign(body.friction, direction)
        speeds = limit + (before - limit) * math.exp(-dt / body.time_constant)
        self.speeds = np.where(sticks | (speeds * direction <= 0), 0.0, speeds)
        ways = 0.5 * (before + self.speeds) * dt
        self._counts += self.sense * body.counts_per_metre * ways
        for poses, rolled in ((self.poses, ways), (self.odometry, self.sense * ways)):
            way, turn = rolled.mean(axis=1), (rolled[:, 1] - rolled[:, 0]) / body.track_width
            middle = poses[:, 2] + 0.5 * turn
            poses += np.column_stack([way * np.cos(middle), way * np.sin(middle), turn])
