"""Poses from LCM messages of the type `sightfield.poses_t`, in sightfield_poses.lcm.

They are decoded here without lcm-gen, in its layout: the type's fingerprint, then the fields in
order, big-endian; a string is its length with the closing zero, its bytes and the zero.
"""

import contextlib
import struct
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass

from pydrake.lcm import DrakeLcm

from ...systems.numerics.errors import InvalidInput, require
from .pose_receiver import NewestPoses, PoseReading

# Hash of the type's names, sizes and order, as lcm-gen computes it: the base rotated left by a bit.
_BASE = 0x8478D689F84F501B
FINGERPRINT = struct.pack(">Q", ((_BASE << 1) & 0xFFFFFFFFFFFFFFFF) | (_BASE >> 63))


@dataclass(frozen=True)
class PosesMessage:
    """What one message says.

    Attributes:
        utime: When the bodies were seen, by the sender's clock [us].
        names: Names of the bodies.
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
    # A body takes at least 30 bytes: a larger count than fits is refused.
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


# How long one look for messages waits [ms], and between two looks [s].
_WAIT = 0
_PAUSE = 0.002


class LcmPoses:
    """Bodies whose poses come as `sightfield.poses_t` on a channel.

    Stamps are the times at which messages came, as the sender's clock may be another machine's.
    Bodies marked invalid are ignored, and so is a message that cannot be read, or that repeats the
    time of the one before: then the sender still runs, but gets no new poses itself.

    Args:
        url: Address of the LCM network, as "udpm://239.255.76.67:7667?ttl=0".
        channel: Channel of the messages.
        bodies: Names of the robots, in the order of the rows.
        lcm: LCM instance to use instead of the network at `url`.

    Raises:
        InvalidInput: `url` is not an LCM address, or bodies' names are missing or not distinct.
    """

    def __init__(
        self, url: str, channel: str, bodies: Sequence[str], *, lcm: DrakeLcm | None = None
    ) -> None:
        # LCM itself only reports a wrong address on standard error, and goes on.
        require(url.startswith(("udpm://", "memq://")), "mocap.url", "begin with udpm://", url)
        self._newest = NewestPoses(bodies)
        self._last_utime: int | None = None
        self._lcm = lcm or DrakeLcm(url)
        self._lcm.Subscribe(channel, self._take)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _take(self, data: bytes) -> None:
        now = time.monotonic()
        with contextlib.suppress(InvalidInput):
            message = decode(data)
            if message.utime == self._last_utime:
                return
            self._last_utime = message.utime
            for name, pose, valid in zip(message.names, message.poses, message.valid, strict=True):
                if valid:
                    self._newest.see(name, pose, now)

    def _listen(self) -> None:
        while not self._ended.wait(_PAUSE):
            self._lcm.HandleSubscriptions(_WAIT)

    def read(self) -> PoseReading:
        """See `PoseSource`."""
        return self._newest.read()

    def close(self) -> None:
        """Listen no more."""
        self._ended.set()
        self._thread.join()
