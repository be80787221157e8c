"""Stand-in for an ArduPilot Rover: it answers a ground station by real MAVLink."""

import math
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from ..emulation.stand_in_laboratory import Sensed
from .mavlink_link import AUTOPILOT, FORCE, GUIDED, HOLD, SPEED_AND_TURN_RATE, Packer

_HEARTBEAT, _WHEELS, _STATUS = (
    dialect.MAVLINK_MSG_ID_HEARTBEAT,
    dialect.MAVLINK_MSG_ID_WHEEL_DISTANCE,
    dialect.MAVLINK_MSG_ID_SYS_STATUS,
)


class Rover:
    """An autopilot with wheel encoders, in mode HOLD and disarmed at first.

    Like ArduPilot it follows every setpoint, as nothing in one says that it is late or was
    overtaken. Signed packets are accepted only in order.

    Args:
        robot: Its system number.
        silence: Silence after which it stops by itself: 3 s in ArduPilot's mode GUIDED [s].
        counts_per_metre: Resolution of its encoders [1/m].
        key: 32 bytes that sign every packet, or None.
    """

    def __init__(
        self,
        robot: int,
        silence: float,
        *,
        counts_per_metre: float,
        key: bytes | None = None,
    ) -> None:
        self._robot, self._silence = robot, silence
        self._counts_per_metre = counts_per_metre
        self._packer = Packer(robot, AUTOPILOT, key)
        self._armed, self._mode = False, HOLD
        self._targets, self._told = (0.0, 0.0), -math.inf
        # Unless asked otherwise it sends a heartbeat once a second.
        self._intervals = {_HEARTBEAT: 1.0}
        self._due = {_HEARTBEAT: 0.0}
        self._answers: list[Any] = []

    def take(self, payload: bytes, now: float) -> None:
        """Take a datagram.

        Args:
            payload: What came.
            now: The time [s].
        """
        for message in self._packer.unpack(payload):
            if getattr(message, "target_system", 0) != self._robot:
                continue
            if message.get_type() == "COMMAND_LONG":
                done = self._obey(message, now)
                result = dialect.MAV_RESULT_ACCEPTED if done else dialect.MAV_RESULT_DENIED
                self._answers.append(dialect.MAVLink_command_ack_message(message.command, result))
            elif message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
                self._follow(message, now)

    def targets(self, now: float) -> tuple[float, float] | None:
        """Forward speed [m/s] and turn rate [rad/s]; None: the motors are cut.

        Args:
            now: The time [s].
        """
        drives = self._armed and self._mode == GUIDED and now - self._told < self._silence
        return self._targets if drives else None

    def reports(self, now: float, sensed: Sensed) -> list[bytes]:
        """Return one datagram with answers and the requested messages that are due.

        Args:
            now: The time [s].
            sensed: By its sensors.
        """
        messages, self._answers = self._answers, []
        for number, interval in self._intervals.items():
            if now >= self._due[number]:
                self._due[number] = now + interval
                messages.append(self._message(number, now, sensed))
        return [self._packer.pack(*messages)] if messages else []

    def _obey(self, message: Any, now: float) -> bool:
        """Carry out a command; returns whether it was accepted."""
        first, second = message.param1, message.param2
        if message.command == dialect.MAV_CMD_COMPONENT_ARM_DISARM:
            # A moving rover can be disarmed only with `FORCE`.
            if first == 0 and second != FORCE and self.targets(now) not in (None, (0.0, 0.0)):
                return False
            if first == 1 and not self._armed:
                self._told = -math.inf
            self._armed = first == 1
            # Report a change at once.
            self._due[_HEARTBEAT] = now
            return True
        if message.command == dialect.MAV_CMD_DO_SET_MODE:
            if second not in (GUIDED, HOLD):
                return False
            if second != self._mode:
                self._mode, self._told = int(second), -math.inf
                self._due[_HEARTBEAT] = now
            return True
        if message.command == dialect.MAV_CMD_SET_MESSAGE_INTERVAL:
            if first not in (_HEARTBEAT, _WHEELS, _STATUS) or second <= 0:
                return False
            self._intervals[int(first)] = second / 1e6
            self._due.setdefault(int(first), now)
            return True
        return False

    def _follow(self, message: Any, now: float) -> None:
        numbers = (message.vx, message.yaw_rate)
        known = message.coordinate_frame == dialect.MAV_FRAME_BODY_NED
        known = known and message.type_mask == SPEED_AND_TURN_RATE
        if known and all(map(math.isfinite, numbers)):
            # Its yaw turns to the right.
            self._targets, self._told = (message.vx, -message.yaw_rate), now

    def _message(self, number: int, now: float, sensed: Sensed) -> Any:
        if number == _WHEELS:
            ways = [each / self._counts_per_metre for each in sensed.counts]
            distances = [*ways, *[0.0] * 14]
            return dialect.MAVLink_wheel_distance_message(int(1e6 * now), 2, distances)
        if number == _STATUS:
            voltage = round(1000 * sensed.battery)
            return dialect.MAVLink_sys_status_message(0, 0, 0, 0, voltage, -1, -1, 0, 0, 0, 0, 0, 0)
        flags = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        if self._armed:
            flags |= dialect.MAV_MODE_FLAG_SAFETY_ARMED
        return dialect.MAVLink_heartbeat_message(
            dialect.MAV_TYPE_GROUND_ROVER,
            dialect.MAV_AUTOPILOT_ARDUPILOTMEGA,
            flags,
            self._mode,
            dialect.MAV_STATE_ACTIVE if self._armed else dialect.MAV_STATE_STANDBY,
            3,
        )
