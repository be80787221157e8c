"""A laboratory without hardware: robots with the real firmware, paced to wall time."""

import contextlib
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from queue import SimpleQueue

import numpy as np

from ...systems.numerics.errors import SightfieldError, require
from ...systems.numerics.geometry.edge_index import build_edge_index
from ...systems.numerics.geometry.world import World
from ...systems.numerics.social.routes.infrared import InfraredRing, infrared_ranges
from .air import Air, AirSettings
from .emulated_radio import EmulatedRadio
from .robot_body import RobotBody
from .robot_cores import CoresReport, RobotCores

# Period of the exchange between modules and processors [s].
_STEP = 0.002
# Period of the infrared sensors, the same as in the firmware [s].
_SENSING = 0.05


@dataclass(frozen=True)
class LaboratorySnapshot:
    """The true state of a laboratory.

    Attributes:
        time: Time since it was entered [s].
        moment: The same by time.monotonic [s]; on a busy machine the clock is further on.
        poses: Shape (n, 3) [m], [m], [rad]; headings are not wrapped.
        wheel_speeds: Left and right, shape (n, 2) [m/s].
        still_since: When the wheels of each robot came to rest, shape (n,) [s]; infinite while one
            of them turns.
        unpowered_since: When its motors were cut, shape (n,) [s]; infinite while one has power.
        lag: How far emulation is behind the wall clock [s].
    """

    time: float
    moment: float
    poses: np.ndarray
    wheel_speeds: np.ndarray
    still_since: np.ndarray
    unpowered_since: np.ndarray
    lag: float


class EmulatedLaboratory:
    """Robots, their radio and true poses; a context manager.

    Every byte between work station and robots goes through a pty, emulated modules and air, and
    the UART of an emulated ATmega2560 that runs the real firmware. Robots drive through walls: only
    the infrared sensors see them.

    Args:
        robots: Numbers of the robots.
        starts: Start poses, shape (n, 3) [m], [m], [rad].
        frame_loss: Probability that a frame is lost, 0 to 1.
        delay: Delay of frames [s].
        jitter: Largest addition to the delay [s].
        seed: Seed of losses and jitter.
        world: Walls that the infrared sensors see; None: their ranges are set by `set_infrared`.
        ring: Directions of the four sensors.
        body: Body of all robots.

    Raises:
        InvalidInput: An argument is out of its range.
        ToolchainError: On entering: firmware or emulator cannot be built.
    """

    def __init__(
        self,
        robots: Sequence[int],
        starts: np.ndarray,
        *,
        frame_loss: float = 0.0,
        delay: float = 0.002,
        jitter: float = 0.0,
        seed: int = 0,
        world: World | None = None,
        ring: InfraredRing | None = None,
        body: RobotBody | None = None,
    ) -> None:
        self._cores = RobotCores(robots, starts, body=body)
        self.robots, self.body = self._cores.robots, self._cores.body
        air = AirSettings(frame_loss=frame_loss, delay=delay, jitter=jitter)
        self._radio = EmulatedRadio(len(self.robots), air, seed)
        self._ring = ring or InfraredRing()
        require(self._ring.count == 4, "ring", "have four sensors", self._ring.count)
        self._edges = None if world is None else build_edge_index(world).edges
        # Only this laboratory's thread advances it. Other threads read the last report, and put
        # their requests into `_ranges`, `air.cut` and `_asked`, each of which is thread-safe: one
        # reference, or with its own lock.
        self._asked: SimpleQueue[Callable[[RobotCores], None]] = SimpleQueue()
        self._ranges: np.ndarray | None = None
        self._open = contextlib.ExitStack()
        self._leaving = threading.Event()
        self._thread = threading.Thread(target=self._run, name="laboratory", daemon=True)
        self._began = self._lag = 0.0
        self._report: CoresReport | None = None
        self._failure: SightfieldError | None = None

    def __enter__(self) -> "EmulatedLaboratory":
        with contextlib.ExitStack() as stack:
            stack.enter_context(self._cores)
            stack.enter_context(self._radio)
            self._report = self._cores.advance(_STEP)
            self._began = time.monotonic()
            self._thread.start()
            stack.callback(self._thread.join)
            stack.callback(self._leaving.set)
            self._open = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    @property
    def radio_port(self) -> str:
        """Path of the work station's serial device."""
        return self._radio.port

    @property
    def air(self) -> Air:
        """Air between the modules."""
        return self._radio.air

    def time(self) -> float:
        """Time since it was entered, by the robots' clock [s]."""
        return self.snapshot().time

    def snapshot(self) -> LaboratorySnapshot:
        """The true state now.

        Raises:
            EmulationError: The emulator has died.
        """
        if self._failure is not None:
            raise self._failure
        report = self._report
        if report is None:
            raise SightfieldError("the laboratory is closed: use it in a `with` statement")
        return LaboratorySnapshot(
            time=report.time,
            moment=self._began + report.time,
            poses=report.poses,
            wheel_speeds=report.wheel_speeds,
            still_since=report.still_since,
            unpowered_since=report.unpowered_since,
            lag=self._lag,
        )

    def poses(self) -> np.ndarray:
        """True poses now, shape (n, 3) [m], [m], [rad]."""
        return self.snapshot().poses

    def wheel_speeds(self) -> np.ndarray:
        """Left and right, now, shape (n, 2) [m/s]."""
        return self.snapshot().wheel_speeds

    def cut_radio(self) -> float:
        """Let nothing through the air any more; returns the time of the cut [s]."""
        self._radio.air.cut = True
        return self.time()

    def restore_radio(self) -> None:
        """Let frames through again."""
        self._radio.air.cut = False

    def stall_line(self) -> None:
        """Make the work station's module stop reading its serial line: a fault."""
        self._radio.stalled = True

    def place(self, k: int, pose: np.ndarray) -> None:
        """Move robot k to a pose, shape (3,) [m], [m], [rad], at the next step."""
        self._asked.put(lambda cores: cores.place(k, pose))

    def set_encoder(self, k: int, wheel: int, sense: int) -> None:
        """Set in which direction an encoder counts from the next step on: a fault.

        Args:
            k: Number of the robot.
            wheel: 0 for the left, 1 for the right.
            sense: 1 the wheel's way, -1 the other way, 0 nothing.
        """
        self._asked.put(lambda cores: cores.set_encoder(k, wheel, sense))

    def reset_robot(self, k: int) -> None:
        """Restart robot k's firmware at the next step."""
        self._asked.put(lambda cores: cores.jump(k, 0))

    def set_infrared(self, ranges: np.ndarray) -> None:
        """Set the infrared ranges, shape (n, 4) [m] from the rim; for a laboratory without walls.

        Raises:
            InvalidInput: The shape does not fit, or there is a world to feel.
        """
        require(self._edges is None, "world", "be None where ranges are set", "a world")
        ranges = np.asarray(ranges, dtype=float)
        shape = (len(self.robots), 4)
        require(ranges.shape == shape, "ranges", f"have shape {shape}", ranges.shape)
        require(bool((ranges >= 0).all()), "ranges", "be zero or positive", ranges)
        self._ranges = ranges

    def _run(self) -> None:
        """Keep emulation up with the wall clock until the laboratory is left."""
        sense = 0.0
        while not self._leaving.is_set():
            behind = time.monotonic() - self._began - self._cores.time
            if behind < _STEP:
                time.sleep(_STEP - behind)
                continue
            try:
                while not self._asked.empty():
                    self._asked.get()(self._cores)
                if self._cores.time >= sense:
                    self._feel()
                    sense += _SENSING
                self._step(behind)
            except SightfieldError as error:
                self._failure = error
                return

    def _step(self, behind: float) -> None:
        assert self._report is not None
        to_robots = self._radio.exchange(self._cores.time, self._report.serial)
        for k, data in enumerate(to_robots):
            if data:
                self._cores.send(k, data)
        self._lag = max(behind - _STEP, 0.0)
        # Catch up a small lag in one step, a large one in several small steps.
        self._report = self._cores.advance(min(behind, 5 * _STEP))

    def _feel(self) -> None:
        assert self._report is not None
        if self._edges is not None:
            poses, radius = self._report.poses, self.body.radius
            self._ranges = infrared_ranges(self._edges, poses, radius, self._ring)
        if self._ranges is not None:
            for k, each in enumerate(self._ranges):
                self._cores.set_sensors(k, each, self.body.battery)
