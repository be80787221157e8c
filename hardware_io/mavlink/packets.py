"""MAVLink 2 packets in datagrams, signed where both sides have a key."""

import time
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from ...systems.numerics.errors import InvalidInput, require

# ArduPilot Rover's modes.
GUIDED, HOLD = 15, 4
# Of the autopilot within its vehicle.
AUTOPILOT = dialect.MAV_COMP_ID_AUTOPILOT1
# A work station's numbers, as ground stations have them.
STATION, STATION_COMPONENT = 255, dialect.MAV_COMP_ID_MISSIONPLANNER
# Of a setpoint: vx, vy and the yaw rate count (the "Vel+Yaw Rate" of ArduPilot's Rover).
SPEED_AND_TURN_RATE = 0x5E7
# A disarm that a moving vehicle takes, too.
FORCE = 21196
# Signatures count from here, in units of ten microseconds (MAVLink 2: 1 January 2015).
_EPOCH, _TICKS = 1_420_070_400, 100_000


class Packer:
    """One side of a stream of packets between a station and one vehicle.

    Args:
        system: Number of who sends.
        component: Of it.
        key: 32 bytes that both sides have, which sign every packet; unsigned ones are refused then.
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
        """The messages of a datagram; what is no packet, or not signed as it must be, is left out.

        Args:
            data: The datagram.
        """
        # What is left of the datagram before is not the beginning of this one.
        self._mavlink.buf, self._mavlink.buf_index = bytearray(), 0
        found = self._mavlink.parse_buffer(data) or []
        return [each for each in found if each.get_type() not in ("BAD_DATA", "UNKNOWN")]


def read_key(file: str) -> bytes | None:
    """The key of a file with 64 hexadecimal digits; None: no file is named.

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
