"""The work station's end of CRTP: speeds and turn rates to Crazyflies, and what they log.

A packet is a byte with port and channel, and up to 30 bytes. Little-endian; angles in degrees.
Source: cflib 0.1.34, and the firmware's documentation of CRTP.
"""

import contextlib
import math
import struct
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from cflib import crtp
from cflib.crazyflie.commander import Commander
from cflib.crtp.crtpstack import CRTPPacket

from ...systems.numerics.errors import require, require_positive
from ...systems.numerics.station.motion_checks import Chassis
from ..links.link_record import OdometryCounts, RobotClock
from ..links.reporting_link import Order, ReportingLink, What
from ..links.robot_link import LinkError, RobotReport, RobotState

# Ports with their channels.
SETPOINT = (7, 0)
TABLE, SETTINGS, DATA = (5, 0), (5, 1), (5, 2)
PLATFORM_COMMAND, VERSION = (13, 0), (13, 1)
SUPERVISOR_COMMAND = (9, 1)
# Further requests of cflib's own client: source, parameters, memories.
SOURCE, PARAMETERS, MEMORIES = (15, 1), (2, 0), (4, 0)

# Types of setpoints: stop, and ground speeds at a height.
STOP, HOVER_LEGACY, HOVER = 0, 5, 10
# Versions of the protocol from which on turn rates are positive to the left, and arming is asked of
# the supervisor.
LEFT_IS_POSITIVE, SUPERVISOR = 9, 12
ARM, ARM_LEGACY = 1, 1
# Commands to the table of loggable variables.
ITEM, INFO = 2, 3
# Command that asks for the number of memories.
COUNT = 1
START, RESET, CREATE = 3, 5, 6
# Types of values, and the supervisor's bit for armed motors.
FLOAT, UINT16 = 7, 2
IS_ARMED = 1 << 1

# What the link logs, and its type; the values of a block in this order.
LOGGED = {
    "stateEstimate.x": FLOAT,
    "stateEstimate.y": FLOAT,
    "stateEstimate.yaw": FLOAT,
    "pm.vbat": FLOAT,
    "supervisor.info": UINT16,
}
VALUES = struct.Struct("<4fH")


def header(where: tuple[int, int]) -> int:
    """The first byte of a packet.

    Args:
        where: Port and channel.
    """
    port, channel = where
    return port << 4 | 3 << 2 | channel


def where(first: int) -> tuple[int, int]:
    """Port and channel of a packet.

    Args:
        first: Its first byte.
    """
    return first >> 4, first & 3


# How long a receiving thread waits for a packet, and how soon it repeats a request [s].
_LOOK, _AGAIN = 0.05, 0.1
# A robot without a report for this long is taken to have restarted, and asked to log again [s].
_SILENT = 0.4
# How long `connect` waits at most until all robots report [s].
_SETTING_UP = 8.0
# The block that is logged, and how often: 50 ms in units of 10 ms.
_BLOCK, _PERIOD = 1, 5
# A robot that moves more slowly stands [m/s].
_STANDS = 0.02


@dataclass
class _Vehicle:
    """What is known of one vehicle.

    Attributes:
        driver: Driver of cflib, which carries packets.
        counts: Wheel counts computed from its poses.
        version: Version of its protocol; -1 before it is known.
        size: Number of rows of its table; 0 before it is known.
        row: The next row of the table to ask for.
        rows: Rows of the logged variables, by name.
        asked: When it was last asked for something [s].
        came: When its last report came [s].
        stamp: Time stamp of its last report, modulo 2^24 [ms].
        place: x, y of its last report [m].
        elapsed: Sum of the steps of `stamp` between reports [s].
        clock: Compares `elapsed` with our clock.
    """

    driver: Any
    counts: OdometryCounts
    version: int = -1
    size: int = 0
    row: int = 0
    rows: dict[str, int] = field(default_factory=dict)
    asked: float = -math.inf
    came: float = -math.inf
    stamp: int = -1
    place: tuple[float, float] = (0.0, 0.0)
    elapsed: float = 0.0
    clock: RobotClock = field(default_factory=RobotClock)

    @property
    def platform(self) -> "_Vehicle":
        """As cflib's commander asks for it."""
        return self

    def get_protocol_version(self) -> int:
        """As cflib's commander asks for it."""
        return self.version

    def send_packet(self, packet: Any) -> None:
        """Send a packet, as cflib's commander does."""
        self.driver.send_packet(packet)

    def send(self, to: tuple[int, int], *data: int) -> None:
        """Send bytes to a port and channel."""
        packet = CRTPPacket()
        packet.set_header(*to)
        packet.data = data
        self.driver.send_packet(packet)


class CrtpLink(ReportingLink):
    """Commands to Crazyflies, and other vehicles that speak CRTP, by cflib, and their reports.

    An arm asks the supervisor to arm, a stop cuts the motors and asks it to disarm; a command is a
    ground speed and a turn rate, at a height. Reports are logged by the vehicle: its own position
    estimate, from which wheel counts are computed, and whether it is armed. CRTP has no deadlines
    or sequence numbers: a command whose deadline has passed is not sent, but one that is delayed in
    the air is followed.

    Args:
        robots: Their numbers, in the order of the commands.
        addresses: Of each, as "radio://0/80/2M/E7E7E7E701" or "udp://127.0.0.1:19850".
        chassis: Wheels for which counts are computed.
        height: Height at which flying vehicles stay [m].

    Raises:
        InvalidInput: Addresses are missing, malformed or repeated; the height is not positive.
    """

    def __init__(
        self,
        robots: Sequence[int],
        addresses: Sequence[str],
        *,
        chassis: Chassis,
        height: float = 0.4,
    ) -> None:
        super().__init__(robots)
        fits = len(addresses) == len(self.robots) == len(set(addresses))
        fits = fits and all(each.startswith(("radio://", "udp://")) for each in addresses)
        wish = f"name {len(self.robots)} robots, as radio://0/80/2M/E7E7E7E701 or udp://HOST:PORT"
        require(fits, "radio.addresses", wish, list(addresses) or "none")
        require_positive("radio.options.height", height)
        self._addresses, self._chassis, self._height = addresses, chassis, height
        self._vehicles: dict[int, _Vehicle] = {}
        self._closing = threading.Event()
        self._threads: list[threading.Thread] = []

    def connect(self) -> None:
        """Open the links to the robots, and wait some seconds at most until all report.

        Raises:
            LinkError: There is no radio for an address, or the address is invalid.
        """
        if not crtp.CLASSES:
            crtp.init_drivers()
        self._closing.clear()
        for robot, address in zip(self.robots, self._addresses, strict=True):
            try:
                driver = crtp.get_link_driver(address, None, lambda _: None)
            except Exception as error:
                # Whatever cflib raises for a radio that is not there.
                self.close()
                raise LinkError(f"no way to {address}: {error}") from None
            vehicle = self._vehicles[robot] = _Vehicle(driver, OdometryCounts(self._chassis))
            thread = threading.Thread(target=self._listen, args=(robot, vehicle), daemon=True)
            self._threads.append(thread)
            thread.start()
        # A vehicle sends its table row by row before it logs, for longer than an arm would wait.
        with self._changed:
            vehicles = self._vehicles.values()
            self._changed.wait_for(lambda: all(each.came > 0 for each in vehicles), _SETTING_UP)

    def close(self) -> None:
        """End the threads that listen, and let go of the radio."""
        self._closing.set()
        # Each waits for a thread of cflib's that looks once a second.
        closers = [
            threading.Thread(target=vehicle.driver.close) for vehicle in self._vehicles.values()
        ]
        for thread in closers:
            thread.start()
        for thread in (*closers, *self._threads):
            thread.join()
        self._threads.clear()
        self._vehicles.clear()

    def transmit(self, robot: int, order: Order) -> None:
        """See `ReportingLink`."""
        vehicle = self._vehicles.get(robot)
        if vehicle is None:
            raise LinkError("the link is not open: use it in a `with` statement")
        # The sign of the turn rate depends on the version.
        if vehicle.version < 0:
            return
        if order.what == What.STOP:
            Commander(vehicle).send_stop_setpoint()
            _ask_to_arm(vehicle, False)
        elif order.what == What.ARM:
            _ask_to_arm(vehicle, True)
        elif order.what == What.COMMAND and time.monotonic() <= order.deadline:
            rate = math.degrees(order.turn_rate)
            Commander(vehicle).send_hover_setpoint(order.speed, 0.0, rate, self._height)

    def take(self, robot: int, packet: bytes) -> None:
        """Take a packet.

        Args:
            robot: Number of the robot that has sent it.
            packet: Its first byte, and what follows.
        """
        vehicle, taken = self._vehicles[robot], False
        # Errors raised by a packet that is too short.
        with self._changed, contextlib.suppress(struct.error, IndexError):
            taken = self._take(robot, vehicle, where(packet[0]), packet[1:], time.monotonic())
        if not taken:
            self.heard_nothing_of_use()

    def _listen(self, robot: int, vehicle: _Vehicle) -> None:
        while not self._closing.is_set():
            packet, now = vehicle.driver.receive_packet(_LOOK), time.monotonic()
            with self._changed:
                if packet is not None:
                    self.take(robot, bytes([packet.header, *packet.data]))
                if now >= max(vehicle.asked + _AGAIN, vehicle.came + _SILENT):
                    self._ask(vehicle, now)

    def _ask(self, vehicle: _Vehicle, now: float) -> None:
        """Send the next request of the set-up: version, table size, table rows, start of log."""
        vehicle.asked = now
        if vehicle.version < 0:
            vehicle.send(VERSION, 0)
        elif not vehicle.size:
            vehicle.send(TABLE, INFO)
        elif len(vehicle.rows) < len(LOGGED):
            vehicle.send(TABLE, ITEM, *vehicle.row.to_bytes(2, "little"))
        else:
            rows = [
                byte
                for name, kind in LOGGED.items()
                for byte in (kind | kind << 4, *vehicle.rows[name].to_bytes(2, "little"))
            ]
            vehicle.send(SETTINGS, RESET)
            vehicle.send(SETTINGS, CREATE, _BLOCK, *rows)
            vehicle.send(SETTINGS, START, _BLOCK, _PERIOD)

    def _take(
        self, robot: int, vehicle: _Vehicle, at: tuple[int, int], data: bytes, now: float
    ) -> bool:
        """Take a packet; returns whether it was one that is waited for."""
        if at == DATA:
            return self._report(robot, vehicle, data, now)
        if at == SETTINGS:
            return True
        if at == VERSION and data[0] == 0 and vehicle.version < 0:
            vehicle.version = data[1]
        elif at == TABLE and data[0] == INFO and not vehicle.size:
            (vehicle.size,) = struct.unpack_from("<H", data, 1)
        elif at == TABLE and data[0] == ITEM and vehicle.size:
            if int.from_bytes(data[1:3], "little") != vehicle.row:
                return False
            name = ".".join(data[4:].decode("latin-1").split("\0")[:2])
            if LOGGED.get(name) == data[3] & 0xF:
                vehicle.rows[name] = vehicle.row
            # Begin again after the last row, in case a packet was lost.
            vehicle.row = (vehicle.row + 1) % vehicle.size
        else:
            return False
        self._ask(vehicle, now)
        return True

    def _report(self, robot: int, vehicle: _Vehicle, data: bytes, now: float) -> bool:
        if len(data) != 4 + VALUES.size or data[0] != _BLOCK:
            return False
        x, y, yaw, battery, info = VALUES.unpack_from(data, 4)
        stamp = int.from_bytes(data[1:4], "little")
        came_anew = now > vehicle.came + _SILENT
        newer = came_anew or 0 < (stamp - vehicle.stamp) % (1 << 24) < 1 << 23
        if not (newer and all(map(math.isfinite, (x, y, yaw, battery)))):
            return False
        place, since = (x, y), ((stamp - vehicle.stamp) % (1 << 24)) / 1000
        drives = math.dist(place, vehicle.place) > _STANDS * since
        vehicle.stamp, vehicle.came, vehicle.place = stamp, now, place
        state = RobotState.DRIVING if drives else RobotState.IDLE
        if came_anew:
            vehicle.clock = RobotClock()
        vehicle.elapsed += since
        self.heard(
            robot,
            RobotReport(
                time=now - vehicle.clock.late(now, vehicle.elapsed),
                state=state if info & IS_ARMED else RobotState.DISARMED,
                counts=vehicle.counts.after(x, y, math.radians(yaw)),
                battery=battery,
            ),
        )
        return True


def _ask_to_arm(vehicle: _Vehicle, armed: bool) -> None:
    if vehicle.version >= SUPERVISOR:
        vehicle.send(SUPERVISOR_COMMAND, ARM, int(armed))
    else:
        vehicle.send(PLATFORM_COMMAND, ARM_LEGACY, int(armed))
