"""Stand-in for a Crazyflie: it speaks CRTP and drives on wheels."""

import math
import struct

from ..emulation.stand_in_laboratory import Sensed
from .crtp_link import (
    ARM,
    ARM_LEGACY,
    COUNT,
    CREATE,
    DATA,
    FLOAT,
    HOVER,
    HOVER_LEGACY,
    INFO,
    IS_ARMED,
    ITEM,
    LEFT_IS_POSITIVE,
    MEMORIES,
    PARAMETERS,
    PLATFORM_COMMAND,
    RESET,
    SETPOINT,
    SETTINGS,
    SOURCE,
    START,
    STOP,
    SUPERVISOR,
    SUPERVISOR_COMMAND,
    TABLE,
    UINT16,
    VERSION,
    header,
    where,
)

# Variables that it can log, with types, in the order of its table: a selection of a real one's.
_TABLE = [
    ("stateEstimate.x", FLOAT),
    ("stateEstimate.y", FLOAT),
    ("stateEstimate.z", FLOAT),
    ("stabilizer.roll", FLOAT),
    ("supervisor.info", UINT16),
    ("pm.vbat", FLOAT),
    ("stateEstimate.yaw", FLOAT),
]
_SUM = 0x5EED


class Crazyflie:
    """Takes setpoints while it is armed, logs what it is asked for, and stops in silence.

    Flight is not modelled: it has no height and cannot fall. Like a real one it follows setpoints
    that are late, repeated or reordered.

    Args:
        silence: Silence after which it cuts its motors [s].
        version: Version of its protocol.
    """

    def __init__(self, silence: float, *, version: int = SUPERVISOR) -> None:
        self._silence, self._version = silence, version
        self._armed, self._told, self._targets = False, -math.inf, (0.0, 0.0)
        self._answers: list[bytes] = []
        self._block: list[str] = []
        self._number, self._period, self._due = 0, 0.0, math.inf

    def take(self, payload: bytes, now: float) -> None:
        """Take a packet.

        Args:
            payload: What came.
            now: The time [s].
        """
        if len(payload) < 2 or len(payload) > 31:
            return
        to, data = where(payload[0]), payload[1:]
        arms = (SUPERVISOR_COMMAND, ARM)
        if self._version < SUPERVISOR:
            arms = (PLATFORM_COMMAND, ARM_LEGACY)
        if to == SETPOINT:
            self._follow(data, now)
        elif to == VERSION and data[0] == 0:
            self._answer(VERSION, bytes([0, self._version]))
        elif (to, data[0]) == arms and len(data) == 2 and data[1] < 2:
            self._armed = data[1] == 1
            self._told = -math.inf
        elif to == TABLE and data[0] == INFO:
            self._answer(TABLE, struct.pack("<BHIBB", INFO, len(_TABLE), _SUM, 16, 128))
        elif to == TABLE and data[0] == ITEM and len(data) == 3:
            self._item(int.from_bytes(data[1:], "little"))
        elif to == SETTINGS:
            self._set(data, now)
        elif to == SOURCE:
            self._answer(SOURCE, b"Bitcraze Crazyflie\0")
        elif to == PARAMETERS and data[0] == INFO:
            self._answer(PARAMETERS, struct.pack("<BHI", INFO, 0, ~_SUM & 0xFFFF))
        elif to == MEMORIES and data[0] == COUNT:
            self._answer(MEMORIES, bytes([COUNT, 0]))

    def targets(self, now: float) -> tuple[float, float] | None:
        """Forward speed [m/s] and turn rate [rad/s]; None: the motors are cut.

        Args:
            now: The time [s].
        """
        return self._targets if self._armed and now - self._told < self._silence else None

    def reports(self, now: float, sensed: Sensed) -> list[bytes]:
        """Answers, and what is logged if that is due.

        Args:
            now: The time [s].
            sensed: By its sensors.
        """
        answers, self._answers = self._answers, []
        if now < self._due:
            return answers
        self._due = now + self._period
        x, y, heading = sensed.odometry
        known = {
            "stateEstimate.x": x,
            "stateEstimate.y": y,
            # A real one's goes from -180 to 180 degrees.
            "stateEstimate.yaw": math.degrees(math.remainder(heading, math.tau)),
            "pm.vbat": sensed.battery,
            "supervisor.info": IS_ARMED if self._armed else 0,
        }
        kinds = dict(_TABLE)
        values = [
            struct.pack("<f" if kinds[name] == FLOAT else "<H", known.get(name, 0))
            for name in self._block
        ]
        stamp = (int(1000 * now) % (1 << 24)).to_bytes(3, "little")
        logged = bytes([header(DATA), self._number]) + stamp + b"".join(values)
        return [*answers, logged]

    def _answer(self, to: tuple[int, int], data: bytes) -> None:
        self._answers.append(bytes([header(to)]) + data)

    def _item(self, row: int) -> None:
        if row < len(_TABLE):
            name, kind = _TABLE[row]
            text = name.replace(".", "\0").encode() + b"\0"
            self._answer(TABLE, struct.pack("<BHB", ITEM, row, kind) + text)

    def _set(self, data: bytes, now: float) -> None:
        what = data[0]
        if what == RESET:
            self._block, self._due = [], math.inf
        elif what == CREATE and len(data) > 2 and len(data) % 3 == 2:
            rows = [low | high << 8 for low, high in zip(data[3::3], data[4::3], strict=True)]
            if max(rows) >= len(_TABLE):
                return
            self._number, self._block = data[1], [_TABLE[row][0] for row in rows]
        elif what == START and len(data) == 3 and self._block and data[1] == self._number:
            self._period, self._due = data[2] / 100, now
        else:
            return
        self._answer(SETTINGS, bytes([what, data[1] if len(data) > 1 else 0, 0]))

    def _follow(self, data: bytes, now: float) -> None:
        if data[0] == STOP and len(data) == 1:
            self._told = -math.inf
            return
        wanted, sign = (HOVER, 1) if self._version >= LEFT_IS_POSITIVE else (HOVER_LEGACY, -1)
        if data[0] != wanted or len(data) != 17:
            return
        forward, aside, rate, height = struct.unpack_from("<4f", data, 1)
        if all(map(math.isfinite, (forward, aside, rate, height))):
            self._targets, self._told = (forward, math.radians(sign * rate)), now
