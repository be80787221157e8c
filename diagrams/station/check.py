"""What of a laboratory is connected and what is missing, in plain words, and who is who.

For that each robot turns in place, and one body must turn.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass

import numpy as np

from ...systems.numerics.errors import SightfieldError, install_line, missing_modules
from ...systems.numerics.station.channel import freshness
from ...systems.numerics.station.pose_checks import angle_between
from .hardware import (
    Devices,
    build_emulator,
    find_kind,
    find_view,
    open_camera,
    open_poses,
    open_radio,
    serial_ports,
    without_password,
)
from .scenario import StationScenario

# How long a device may take to show that somebody is there [s].
_PATIENCE = 1.5


@dataclass(frozen=True)
class Finding:
    """What was found of one thing.

    Attributes:
        thing: What was looked for.
        found: Whether it is there.
        words: What that means, and what to do about it if it is not.
    """

    thing: str
    found: bool
    words: str


def check_laboratory(scenario: StationScenario, port: int) -> Iterator[Finding]:
    """Look for every device of a laboratory, one after the other; none is made to move.

    Args:
        scenario: The laboratory.
        port: Of the operator's view.
    """
    yield _packages(scenario)
    if scenario.radio.kind == "xbee":
        yield _serial(scenario)
    yield _asked("radio and robots", lambda: _robots(scenario))
    yield _asked("motion capture", lambda: _bodies(scenario))
    yield _asked("omni-camera", lambda: _camera(scenario))
    yield _asked("emulated laboratory", lambda: _emulation(scenario))
    yield _asked("operator's view", lambda: _view(port))


def _asked(thing: str, ask: Callable[[], str]) -> Finding:
    """What a question found; its error says what is missing."""
    try:
        return Finding(thing, True, ask())
    except SightfieldError as error:
        return Finding(thing, False, str(error))


def _packages(scenario: StationScenario) -> Finding:
    names = {"motioncapture": "motioncapture"}
    if scenario.radio.kind == "xbee":
        names = {"digi-xbee": "digi.xbee", "pyserial": "serial"} | names
    gone = missing_modules(names.values())
    missing = [name for name, module in names.items() if module in gone]
    if missing:
        words = f"missing: {', '.join(missing)}; {install_line('hardware')}"
        return Finding("packages", False, words)
    words = f"{', '.join(names)} {'are' if len(names) > 1 else 'is'} installed"
    return Finding("packages", True, words)


def _serial(scenario: StationScenario) -> Finding:
    ports = serial_ports()
    if scenario.radio.port in ports:
        return Finding("serial port", True, f"{scenario.radio.port} is there")
    others = f"others: {', '.join(ports)}" if ports else "no serial port is plugged in"
    return Finding("serial port", False, f"{scenario.radio.port} is not there; {others}")


def _robots(scenario: StationScenario) -> str:
    """Which robots report. The link is closed with a stop, which harms none."""
    with open_radio(scenario) as link:
        deadline = time.monotonic() + _PATIENCE
        while time.monotonic() < deadline and len(link.telemetry()) < len(scenario.robots):
            link.heartbeat()
            time.sleep(0.05)
        heard = link.telemetry()
    silent = [each for each in scenario.robots if each not in heard]
    if silent:
        raise SightfieldError(
            f"{_way(scenario)}; robots that are silent: {', '.join(map(str, silent))}: are they "
            "on, and their numbers right?"
        )
    return f"{_way(scenario)}, and robots {', '.join(map(str, scenario.robots))} report"


def _way(scenario: StationScenario) -> str:
    if scenario.radio.kind == "xbee":
        return f"the module answers at {scenario.radio.port}"
    return f"the link to robots of kind {scenario.radio.kind} opens"


def _bodies(scenario: StationScenario) -> str:
    with closing(open_poses(scenario.mocap, scenario.bodies)) as source:
        deadline = time.monotonic() + _PATIENCE
        while True:
            stamps = source.read().stamps
            valid, _ = freshness(time.monotonic(), stamps, scenario.mocap.stale_after)
            if valid.all() or time.monotonic() > deadline:
                break
            time.sleep(0.02)
    unseen = [name for name, good in zip(scenario.bodies, valid, strict=True) if not good]
    if unseen:
        names = ", ".join(unseen)
        raise SightfieldError(f"{scenario.mocap.source} is connected, but does not see {names}")
    return f"{scenario.mocap.source} sees {', '.join(scenario.bodies)}"


def _camera(scenario: StationScenario) -> str:
    if scenario.omni_camera.source == "none":
        return "the scenario has none"
    place = without_password(scenario.omni_camera.place)
    with closing(open_camera(scenario.omni_camera)) as source:
        deadline = time.monotonic() + _PATIENCE
        frame = source.read()
        while frame is None and time.monotonic() < deadline:
            time.sleep(0.02)
            frame = source.read()
    if frame is None:
        raise SightfieldError(f"{place} opens, but gives no picture")
    height, width = np.shape(frame.picture)[:2]
    return f"{place} gives pictures of {width} x {height}"


def _emulation(scenario: StationScenario) -> str:
    """What `--emulate` needs for robots of the scenario's kind."""
    kind = find_kind(scenario.radio.kind)
    kind.require_installed()
    if kind.name == "xbee":
        return build_emulator()
    return f"robots of kind {kind.name} have others that stand in for them"


def _view(port: int) -> str:
    view = find_view(port)
    if view is None:
        return f"not open; a run opens it on port {port}"
    return f"open at {view.url}"


def all_found(findings: list[Finding]) -> bool:
    """Whether nothing is missing that `--hardware` needs."""
    return all(each.found for each in findings if each.thing != "emulated laboratory")


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
