"""The work station's end of MAVLink: speeds and turn rates to rovers, and what they report.

Packets are MAVLink 2 in datagrams, signed where both sides have a key.
"""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from ...systems.numerics.errors import InvalidInput, require
from ..links.link_record import RobotClock
from ..links.reporting_link import DatagramLink, NoMessage, Order, What
from ..links.robot_link import RobotReport, RobotState

# ArduPilot Rover's modes.
GUIDED, HOLD = 15, 4
# Component number of the autopilot within its vehicle.
AUTOPILOT = dialect.MAV_COMP_ID_AUTOPILOT1
# System and component number of the work station, those of ground stations.
STATION, STATION_COMPONENT = 255, dialect.MAV_COMP_ID_MISSIONPLANNER
# Type mask of a setpoint by vx, vy and yaw rate (the "Vel+Yaw Rate" of ArduPilot's Rover).
SPEED_AND_TURN_RATE = 0x5E7
# Parameter of a disarm that a moving vehicle accepts, too.
FORCE = 21196
# Epoch of time stamps in signatures, and ticks of ten microseconds (MAVLink 2: 1 January 2015).
_EPOCH, _TICKS = 1_420_070_400, 100_000


class Packer:
    """One side of a stream of packets between a station and one vehicle.

    Args:
        system: System number of the sender.
        component: Component number of the sender.
        key: Shared secret of 32 bytes that signs every packet; unsigned ones are refused then.
            None: nothing is signed.
    """

    def __init__(self, system: int, component: int, key: bytes | None = None) -> None:
        self._mavlink: Any = dialect.MAVLink(None, srcSystem=system, srcComponent=component)
        self._mavlink.robust_parsing = True
        if key is not None:
            self._mavlink.signing.secret_key = key
            self._mavlink.signing.sign_outgoing = True
            self._mavlink.signing.timestamp = int((time.time() - _EPOCH) * _TICKS)

    def pack(self, *messages: Any) -> bytes:
        """The packets of messages, one after the other."""
        packed = bytearray()
        for message in messages:
            packed += message.pack(self._mavlink)
            self._mavlink.seq = (self._mavlink.seq + 1) % 256
        return bytes(packed)

    def unpack(self, data: bytes) -> list[Any]:
        """Return the messages of a datagram; invalid or wrongly signed packets are left out.

        Args:
            data: The datagram.
        """
        # Discard what is left of the datagram before: packets do not span datagrams.
        self._mavlink.buf, self._mavlink.buf_index = bytearray(), 0
        found = self._mavlink.parse_buffer(data) or []
        return [each for each in found if each.get_type() not in ("BAD_DATA", "UNKNOWN")]


def read_key(file: str) -> bytes | None:
    """Read the key from a file with 64 hexadecimal digits; None if no file is named.

    Args:
        file: Its path, or empty.

    Raises:
        InvalidInput: It cannot be read, or holds no key.
    """
    if not file:
        return None
    try:
        text = Path(file).read_text(encoding="ascii").strip()
        key = bytes.fromhex(text)
    except (OSError, ValueError):
        raise InvalidInput(
            f"`radio.options.key_file` must be a file of 64 hexadecimal digits; got {file}"
        ) from None
    require(len(key) == 32, "radio.options.key_file", "hold 64 hexadecimal digits", file)
    return key


# How often a vehicle is told that a ground station is there, and what to report [s].
_HEARTBEAT = 0.5
# Messages that a vehicle is to send, and their intervals [us].
_INTERVALS = {
    dialect.MAVLINK_MSG_ID_HEARTBEAT: 200_000,
    dialect.MAVLINK_MSG_ID_WHEEL_DISTANCE: 50_000,
    dialect.MAVLINK_MSG_ID_SYS_STATUS: 1_000_000,
}
# After a gap of this length in newer packets, older sequence numbers count again: the vehicle was
# restarted [s].
_ANEW = 0.5
# Larger wheel distances are implausible, and ignored; 1e305 could not even be converted [m].
_FURTHEST = 1e9
# A wheel that is slower than this stands [m/s].
_SLOWEST = 0.01


@dataclass
class _Vehicle:
    """What is known of one vehicle, with its stream of packets.

    Attributes:
        packer: Packs and unpacks its packets.
        hailed: When it was last told that a ground station is there [s].
        number: Sequence number of its last packet, -1 before the first.
        came: When that packet came [s].
        state: State by its heartbeats; None before the first.
        counts: Counts of the left and the right wheel.
        measured: When the wheels had these counts [s].
        drives: Whether a wheel turned between the last two reports of the counts.
        battery: Battery voltage [V].
        clock: Compares its clock with ours; it may be set to the time of a GPS.
    """

    packer: Packer
    hailed: float = -math.inf
    number: int = -1
    came: float = -math.inf
    state: RobotState | None = None
    counts: tuple[int, int] = (0, 0)
    measured: float = -math.inf
    drives: bool = False
    battery: float = 0.0
    clock: RobotClock = field(default_factory=lambda: RobotClock(settable=True))


class MavlinkLink(DatagramLink):
    """Commands to ArduPilot Rovers in mode GUIDED, over UDP, and their reports.

    A robot's number is its system number (SYSID_THISMAV). An arm sets the mode and arms the
    vehicle; a stop disarms it and sets HOLD. Reports need wheel encoders: counts are computed from
    WHEEL_DISTANCE, the left wheel first. MAVLink has no deadlines: a command whose deadline has
    passed is not sent, but one that is delayed in the air is followed. A vehicle that hears no
    command goes on for 3 s.

    Args:
        robots: Their system numbers, 1 to 254.
        addresses: Of each, as "192.168.1.21:14550".
        counts_per_metre: Scale of the computed counts [1/m].
        key: 32 bytes that sign every packet, known to the vehicles too; None: nothing is signed.

    Raises:
        InvalidInput: See `DatagramLink`; a number is 0.
    """

    def __init__(
        self,
        robots: Sequence[int],
        addresses: Sequence[str],
        *,
        counts_per_metre: float,
        key: bytes | None = None,
    ) -> None:
        super().__init__(robots, addresses)
        require(0 not in self.robots, "robots", "be 1 to 254, as systems of MAVLink", robots)
        self._counts_per_metre = counts_per_metre
        self._vehicles = {
            robot: _Vehicle(Packer(STATION, STATION_COMPONENT, key)) for robot in self.robots
        }
        self._opened = time.monotonic()

    def encode(self, robot: int, order: Order) -> bytes:
        """See `DatagramLink`; a ground station's periodic messages are sent along."""
        vehicle, now = self._vehicles[robot], time.monotonic()
        messages: list[Any] = []
        if order.what != What.STOP and (
            now >= vehicle.hailed + _HEARTBEAT or order.what == What.ARM
        ):
            vehicle.hailed = now
            messages += _hail(robot)
        if order.what == What.ARM:
            messages += [_mode(robot, GUIDED), _armed(robot, True)]
        elif order.what == What.STOP:
            messages += [_armed(robot, False), _mode(robot, HOLD)]
        elif order.what == What.COMMAND and now <= order.deadline:
            since = int(1000 * (now - self._opened)) % (1 << 32)
            messages.append(_speeds(robot, since, order.speed, order.turn_rate))
        return vehicle.packer.pack(*messages)

    def decode(self, robot: int, data: bytes) -> None:
        """See `DatagramLink`.

        Args:
            robot: Number of the robot.
            data: The datagram.
        """
        now = time.monotonic()
        with self._changed:
            vehicle, taken = self._vehicles[robot], False
            for message in vehicle.packer.unpack(data):
                ours = (message.get_srcSystem(), message.get_srcComponent()) == (robot, AUTOPILOT)
                if ours and self._is_newer(vehicle, message.get_seq(), now):
                    self._take(vehicle, message, now)
                    taken = True
            if not taken:
                raise NoMessage("no packet of the vehicle that is newer than the last")
            if vehicle.state is not None:
                state = vehicle.state
                if state == RobotState.IDLE and vehicle.drives:
                    state = RobotState.DRIVING
                report = RobotReport(
                    # The counts belong to this time: they are compared with the motion seen then.
                    time=max(vehicle.measured, now - 2 * _HEARTBEAT),
                    state=state,
                    counts=vehicle.counts,
                    battery=vehicle.battery,
                )
                self.heard(robot, report)

    def _is_newer(self, vehicle: _Vehicle, number: int, now: float) -> bool:
        newer = vehicle.number < 0 or 0 < (number - vehicle.number) % 256 < 128
        if not newer and now < vehicle.came + _ANEW:
            return False
        if not newer:
            vehicle.clock = RobotClock(settable=True)
        vehicle.number, vehicle.came = number, now
        return True

    def _take(self, vehicle: _Vehicle, message: Any, now: float) -> None:
        kind = message.get_type()
        if kind == "HEARTBEAT":
            armed = message.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED
            guided = message.custom_mode == GUIDED
            # In another mode somebody else has taken over.
            vehicle.state = (
                (RobotState.IDLE if guided else RobotState.STOPPED)
                if armed
                else RobotState.DISARMED
            )
        elif kind == "WHEEL_DISTANCE" and message.count >= 2:
            ways = message.distance[:2]
            if all(abs(each) < _FURTHEST for each in ways):
                left, right = (round(self._counts_per_metre * each) for each in ways)
                gone = max(abs(left - vehicle.counts[0]), abs(right - vehicle.counts[1]))
                least = _SLOWEST * (now - vehicle.measured) * self._counts_per_metre
                vehicle.drives = math.isfinite(least) and gone > least
                # A report without a time stamp is never late.
                stamp = 1e-6 * message.time_usec or now
                vehicle.counts = (left, right)
                vehicle.measured = now - vehicle.clock.late(now, stamp)
        elif kind == "SYS_STATUS" and message.voltage_battery != 0xFFFF:
            vehicle.battery = message.voltage_battery / 1000


def _hail(robot: int) -> list[Any]:
    """Messages that a ground station is there, and what the vehicle is to report."""
    here = dialect.MAVLink_heartbeat_message(
        dialect.MAV_TYPE_GCS, dialect.MAV_AUTOPILOT_INVALID, 0, 0, dialect.MAV_STATE_ACTIVE, 3
    )
    wishes = [
        _command(robot, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, number, interval)
        for number, interval in _INTERVALS.items()
    ]
    return [here, *wishes]


def _mode(robot: int, mode: int) -> Any:
    custom = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    return _command(robot, dialect.MAV_CMD_DO_SET_MODE, custom, mode)


def _armed(robot: int, armed: bool) -> Any:
    force = 0 if armed else FORCE
    return _command(robot, dialect.MAV_CMD_COMPONENT_ARM_DISARM, int(armed), force)


def _command(robot: int, command: int, first: float, second: float) -> Any:
    rest = (0.0,) * 5
    return dialect.MAVLink_command_long_message(
        robot, AUTOPILOT, command, 0, float(first), float(second), *rest
    )


def _speeds(robot: int, since: int, speed: float, turn_rate: float) -> Any:
    """A setpoint in the vehicle's body frame, whose z points down: its yaw turns to the right."""
    return dialect.MAVLink_set_position_target_local_ned_message(
        since,
        robot,
        AUTOPILOT,
        dialect.MAV_FRAME_BODY_NED,
        SPEED_AND_TURN_RATE,
        *(0.0, 0.0, 0.0),
        *(speed, 0.0, 0.0),
        *(0.0, 0.0, 0.0),
        0.0,
        -turn_rate,
    )
