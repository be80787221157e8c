"""A laboratory of stand-in robots of any kind: messages, air, wheels and true poses."""

import contextlib
import selectors
import socket
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Protocol, Self

import numpy as np

from ...systems.numerics.errors import SightfieldError, require
from ...systems.numerics.geometry.edge_index import build_edge_index
from ...systems.numerics.geometry.world import World
from ...systems.numerics.social.routes.infrared import InfraredRing, infrared_ranges
from ..links.robot_link import require_robots
from .air import Air, AirSettings, Flight
from .laboratory import LaboratorySnapshot
from .robot_body import RobotBody, StandInWheels

# Time step of messages and wheels, and the longest one, to catch up with the wall clock [s].
_STEP, _LONGEST_STEP = 0.004, 0.02
# Period of the infrared sensors [s].
_SENSING = 0.05
_STATION = 0


@dataclass(frozen=True)
class Sensed:
    """Readings of a robot's sensors.

    Attributes:
        counts: Counts of the left and the right encoder.
        speeds: Speeds of the left and the right wheel [m/s].
        odometry: Pose by its encoders since the start: x, y [m] and heading [rad].
        ranges: Ranges of the four infrared sensors, from left to right [m]; infinite without walls.
        battery: Battery voltage [V].
    """

    counts: tuple[int, int]
    speeds: tuple[float, float]
    odometry: tuple[float, float, float]
    ranges: tuple[float, float, float, float]
    battery: float


class Board(Protocol):
    """The program of a stand-in robot; all times are since the laboratory began."""

    def take(self, payload: bytes, now: float) -> None:
        """Take a message.

        Args:
            payload: The message.
            now: When it came [s].
        """
        ...

    def targets(self, now: float) -> tuple[float, float] | None:
        """Forward speed [m/s] and turn rate [rad/s]; None: the motors are cut.

        Args:
            now: The time [s].
        """
        ...

    def reports(self, now: float, sensed: Sensed) -> list[bytes]:
        """Messages to the work station that are due.

        Args:
            now: The time [s].
            sensed: By its sensors.
        """
        ...


class Wire(Protocol):
    """What carries messages between the work station and robots; a context manager."""

    def __enter__(self) -> Self:
        """Open it."""
        ...

    def __exit__(self, *_: object) -> None:
        """Close it."""
        ...

    def receive(self) -> list[tuple[int, bytes]]:
        """Return the messages that have come, without waiting: robot's number from 0, message."""
        ...

    def send(self, k: int, payload: bytes) -> None:
        """Send a message to the work station.

        Args:
            k: Number of the robot that says it, from 0.
            payload: The message.
        """
        ...


class DatagramWire:
    """A loopback socket for each robot, which replies to the last sender.

    Attributes:
        addresses: Of the robots, once it is open.

    Args:
        count: Number of robots.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self.addresses: tuple[str, ...] = ()
        self._sockets: list[socket.socket] = []
        self._peers: dict[int, tuple[str, int]] = {}
        self._selector = selectors.DefaultSelector()

    def __enter__(self) -> Self:
        for k in range(self._count):
            each = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            each.bind(("127.0.0.1", 0))
            each.setblocking(False)
            self._selector.register(each, selectors.EVENT_READ, k)
            self._sockets.append(each)
        self.addresses = tuple(f"127.0.0.1:{each.getsockname()[1]}" for each in self._sockets)
        return self

    def __exit__(self, *_: object) -> None:
        self._selector.close()
        for each in self._sockets:
            each.close()

    def receive(self) -> list[tuple[int, bytes]]:
        """See `Wire`."""
        found = []
        for key, _ in self._selector.select(0):
            source = self._sockets[key.data]
            # An error means an empty socket, or that an earlier answer was not received.
            with contextlib.suppress(OSError):
                while True:
                    payload, self._peers[key.data] = source.recvfrom(2048)
                    found.append((key.data, payload))
        return found

    def send(self, k: int, payload: bytes) -> None:
        """See `Wire`.

        Args:
            k: Number of the robot.
            payload: The message.
        """
        peer = self._peers.get(k)
        if peer is not None:
            with contextlib.suppress(OSError):
                self._sockets[k].sendto(payload, peer)


class StandInLaboratory:
    """Stand-in robots of any kind, paced to wall time; a context manager.

    Messages go over a wire of the kind, and through air that loses and delays them, to a board for
    each robot. Robots drive through walls: only the infrared sensors see them.

    Attributes:
        air: Air between work station, number 0, and robots, from 1 on.

    Args:
        robots: Their numbers.
        starts: Start poses, shape (n, 3) [m], [m], [rad].
        make_board: Makes the program of a robot, given its number from 0; called again at a reset.
        wire: The kind's way of carrying messages.
        air: How bad the air is.
        seed: Seed of the random losses and delays.
        world: Walls that the infrared sensors see; None: there are none.
        body: Body of all robots.

    Raises:
        InvalidInput: An argument is out of its range.
    """

    def __init__(
        self,
        robots: Sequence[int],
        starts: np.ndarray,
        make_board: Callable[[int], Board],
        wire: Wire,
        *,
        air: AirSettings,
        seed: int = 0,
        world: World | None = None,
        body: RobotBody | None = None,
    ) -> None:
        self.robots = require_robots(robots)
        count = len(self.robots)
        starts = np.asarray(starts, dtype=float)
        require(starts.shape == (count, 3), "starts", f"have shape ({count}, 3)", starts)
        require(bool(np.isfinite(starts).all()), "starts", "be finite", starts)
        self.body = body or RobotBody()
        self.air = Air(air, seed)
        self._make_board, self._wire = make_board, wire
        self._boards = [make_board(k) for k in range(count)]
        self._wheels = StandInWheels(starts, self.body)
        self._ring = InfraredRing()
        self._edges = None if world is None else build_edge_index(world).edges
        self._ranges = np.full((count, 4), np.inf)
        self._still_since = np.zeros(count)
        self._unpowered_since = np.zeros(count)
        # Only this laboratory's thread advances it. Other threads read the last snapshot, and queue
        # their requests here.
        self._asked: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._time = self._began = self._sensed = 0.0
        self._snapshot = self._look(0.0)
        self._failure: Exception | None = None
        self._leaving = threading.Event()
        self._thread = threading.Thread(target=self._run, name="laboratory", daemon=True)

    def __enter__(self) -> Self:
        if self._edges is not None:
            # Compile or load the kernel before the clock starts.
            self._feel()
        self._wire.__enter__()
        self._began = time.monotonic()
        self._snapshot = self._look(0.0)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._leaving.set()
        self._thread.join()
        self._wire.__exit__()

    def time(self) -> float:
        """Time since the laboratory was entered [s]."""
        return self.snapshot().time

    def snapshot(self) -> LaboratorySnapshot:
        """The true state now.

        Raises:
            SightfieldError: A robot's program has failed.
        """
        if self._failure is not None:
            raise SightfieldError(f"a robot that stands in has failed: {self._failure!r}")
        return self._snapshot

    def poses(self) -> np.ndarray:
        """True poses now, shape (n, 3) [m], [m], [rad]."""
        return self.snapshot().poses

    def wheel_speeds(self) -> np.ndarray:
        """Left and right, now, shape (n, 2) [m/s]."""
        return self.snapshot().wheel_speeds

    def cut_radio(self) -> float:
        """Let no messages through any more; returns the time of the cut [s]."""
        self.air.cut = True
        return self.time()

    def restore_radio(self) -> None:
        """Let messages through again."""
        self.air.cut = False

    def place(self, k: int, pose: np.ndarray) -> None:
        """Move robot k to a pose, shape (3,) [m], [m], [rad], at the next step."""
        self._asked.put(lambda: self._wheels.poses.__setitem__(k, pose))

    def set_encoder(self, k: int, wheel: int, sense: int) -> None:
        """Set in which direction an encoder counts from the next step on: a fault.

        Args:
            k: Number of the robot, from 0.
            wheel: 0 for the left, 1 for the right.
            sense: 1 the wheel's way, -1 the other way, 0 nothing.
        """
        self._asked.put(lambda: self._wheels.sense.__setitem__((k, wheel), sense))

    def reset_robot(self, k: int) -> None:
        """Restart robot k's program at the next step."""
        self._asked.put(lambda: self._boards.__setitem__(k, self._make_board(k)))

    def _run(self) -> None:
        """Keep up with the wall clock until the laboratory is left."""
        while not self._leaving.is_set():
            behind = time.monotonic() - self._began - self._time
            if behind < _STEP:
                time.sleep(_STEP - behind)
                continue
            try:
                while not self._asked.empty():
                    self._asked.get()()
                self._step(min(behind, _LONGEST_STEP), behind)
            except Exception as error:
                self._failure = error
                return

    def _step(self, dt: float, behind: float) -> None:
        now = self._time
        for k, payload in self._wire.receive():
            # A message is tried only once, like a broadcast.
            self.air.send(Flight(_STATION, k + 1, payload, True), now)
        for flight in self.air.arrivals(now):
            if flight.receiver == _STATION:
                self._wire.send(flight.sender - 1, flight.payload)
            else:
                self._boards[flight.receiver - 1].take(flight.payload, now)
        told = [board.targets(now) for board in self._boards]
        self._wheels.step(np.array([each or (0.0, 0.0) for each in told]), dt)
        self._time = now = now + dt
        turns = (self._wheels.speeds != 0).any(axis=1)
        powered = np.array([each is not None for each in told])
        for since, goes_on in ((self._still_since, turns), (self._unpowered_since, powered)):
            since[goes_on] = np.inf
            since[~goes_on & np.isinf(since)] = now
        if now >= self._sensed + _SENSING and self._edges is not None:
            self._feel()
            self._sensed = now
        counts = self._wheels.counts()
        for k, board in enumerate(self._boards):
            for payload in board.reports(now, self._sense(k, counts)):
                self.air.send(Flight(k + 1, _STATION, payload, True), now)
        self._snapshot = self._look(max(behind - _STEP, 0.0))

    def _sense(self, k: int, counts: np.ndarray) -> Sensed:
        wheels = self._wheels
        (left, right), (x, y, heading) = counts[k].tolist(), wheels.odometry[k].tolist()
        first, second, third, fourth = self._ranges[k].tolist()
        speeds = wheels.speeds[k].tolist()
        return Sensed(
            counts=(left, right),
            speeds=(speeds[0], speeds[1]),
            odometry=(x, y, heading),
            ranges=(first, second, third, fourth),
            battery=self.body.battery,
        )

    def _feel(self) -> None:
        assert self._edges is not None
        found = infrared_ranges(self._edges, self._wheels.poses, self.body.radius, self._ring)
        self._ranges = np.asarray(found)

    def _look(self, lag: float) -> LaboratorySnapshot:
        return LaboratorySnapshot(
            time=self._time,
            moment=self._began + self._time,
            poses=self._wheels.poses.copy(),
            wheel_speeds=self._wheels.speeds,
            still_since=self._still_since.copy(),
            unpowered_since=self._unpowered_since.copy(),
            lag=lag,
        )
