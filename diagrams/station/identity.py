"""Whether robot and body of one name are one: each robot turns in place, and one body must turn."""

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...systems.numerics.errors import SightfieldError
from ...systems.numerics.station.pose_checks import angle_between
from .hardware import Devices
from .scenario import StationScenario

# How fast robots turn [rad/s], for how long each way [s], and how often they are told [s].
_RATE, _TIME, _PERIOD = 1.0, 0.8, 0.05
# A body has turned by more than this [rad]; robots that turn do not go further than this [m].
_TURNED, _GONE = 0.25, 0.1
# How long a robot may take to come to rest [s].
_REST = 0.4


@dataclass(frozen=True)
class Identity:
    """What a robot that was told to turn did.

    Attributes:
        robot: Its number on the radio.
        body: The body that should be its own.
        turned: The bodies that turned.
        gone: The bodies that went elsewhere.
    """

    robot: int
    body: str
    turned: tuple[str, ...]
    gone: tuple[str, ...]

    @property
    def right(self) -> bool:
        """Whether its own body turned, on its place, and nothing else."""
        return self.turned == (self.body,) and not self.gone

    @property
    def words(self) -> str:
        """The same in words."""
        told = f"robot {self.robot} turned as {self.body}"
        if self.right:
            return told
        seen = f"{' and '.join(self.turned)} turned" if self.turned else "nothing turned"
        where = f", and {' and '.join(self.gone)} went elsewhere" if self.gone else ""
        return f"robot {self.robot} was told to turn, which is {self.body}; {seen}{where}"


def identify(scenario: StationScenario, devices: Devices) -> Iterator[Identity]:
    """Let robots, which are armed, turn in place and back, one after the other.

    Args:
        scenario: The laboratory.
        devices: Of the laboratory, open.

    Raises:
        SightfieldError: A device fails.
    """
    names = np.array(scenario.bodies)
    for k, robot in enumerate(scenario.robots):
        start = devices.poses.read().poses
        turned, gone = np.zeros(len(names), bool), np.zeros(len(names), bool)
        for rate, duration in ((_RATE, _TIME), (-_RATE, _TIME), (0.0, _REST)):
            for _ in range(round(duration / _PERIOD)):
                commands = np.zeros((len(names), 2))
                commands[k, 1] = rate
                devices.radio.send_commands(commands)
                time.sleep(_PERIOD)
                poses = devices.poses.read().poses
                turned |= np.abs(angle_between(poses[:, 2], start[:, 2])) > _TURNED
                gone |= np.hypot(*(poses - start)[:, :2].T) > _GONE
        yield Identity(robot, str(names[k]), tuple(names[turned]), tuple(names[gone]))


def require_identity(scenario: StationScenario, devices: Devices) -> None:
    """Let robots turn, and go on only if every one is who it should be.

    Raises:
        SightfieldError: One is not.
    """
    wrong = [each.words for each in identify(scenario, devices) if not each.right]
    if wrong:
        raise SightfieldError(f"robots and bodies must be the same: {'; '.join(wrong)}")
