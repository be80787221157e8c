"""Encoding and decoding of `sightfield.poses_t`, the type in sightfield_poses.lcm.

Written by hand, in the layout that lcm-gen gives the type: its fingerprint, then the fields in
order, big-endian, a string as its length with the closing zero, its bytes and the zero.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

from ...systems.numerics.errors import InvalidInput, require

# Of the type's names, sizes and order, as lcm-gen computes it: the base, turned left by a bit.
_BASE = 0x8478D689F84F501B
FINGERPRINT = struct.pack(">Q", ((_BASE << 1) & 0xFFFFFFFFFFFFFFFF) | (_BASE >> 63))


@dataclass(frozen=True)
class PosesMessage:
    """What one message says.

    Attributes:
        utime: When the bodies were seen, by the sender's clock [us].
        names: Of the bodies.
        poses: x, y [m], heading [rad] of each.
        valid: Whether each is seen now.
    """

    utime: int
    names: tuple[str, ...]
    poses: tuple[tuple[float, float, float], ...]
    valid: tuple[bool, ...]


def encode(message: PosesMessage) -> bytes:
    """The message as LCM carries it.

    Raises:
        InvalidInput: Names, poses and validity differ in number.
    """
    count = len(message.names)
    same = len(message.poses) == len(message.valid) == count
    require(same, "message", f"have {count} poses and validities", message)
    parts = [FINGERPRINT, struct.pack(">qi", message.utime, count)]
    for name in message.names:
        text = name.encode() + b"\0"
        parts += [struct.pack(">i", len(text)), text]
    for column in range(3):
        parts.append(struct.pack(f">{count}d", *(pose[column] for pose in message.poses)))
    parts.append(struct.pack(f">{count}b", *message.valid))
    return b"".join(parts)


def decode(data: bytes) -> PosesMessage:
    """The message in what LCM carried.

    Args:
        data: The bytes.

    Raises:
        InvalidInput: It is of another type, too short or too long.
    """
    require(data[:8] == FINGERPRINT, "message", "be a sightfield.poses_t", data[:8].hex())
    try:
        return _decode(data)
    except (struct.error, UnicodeDecodeError, IndexError) as error:
        raise InvalidInput(
            f"`message` must be a whole sightfield.poses_t; got {len(data)} bytes ({error})"
        ) from None


def _decode(data: bytes) -> PosesMessage:
    utime, count = struct.unpack_from(">qi", data, 8)
    at = 20
    # A body takes 30 bytes at least: no count beyond that is believed.
    require(0 <= 30 * count <= len(data), "message", "have room for its bodies", count)
    names = []
    for _ in range(count):
        (length,) = struct.unpack_from(">i", data, at)
        text = data[at + 4 : at + 4 + length]
        require(length > 0 and text[-1] == 0, "message", "close its strings by a zero", length)
        names.append(text[:-1].decode())
        at += 4 + length
    columns: list[Sequence[float]] = []
    for _ in range(3):
        columns.append(struct.unpack_from(f">{count}d", data, at))
        at += 8 * count
    valid = struct.unpack_from(f">{count}b", data, at)
    require(at + count == len(data), "message", "end where its fields do", len(data))
    poses = tuple((x, y, theta) for x, y, theta in zip(*columns, strict=True))
    return PosesMessage(utime, tuple(names), poses, tuple(each != 0 for each in valid))
