"""Poses that come as LCM messages."""

import contextlib
import threading
import time
from collections.abc import Sequence

from pydrake.lcm import DrakeLcm

from ...systems.numerics.errors import InvalidInput, require
from .lcm_message import decode
from .pose_source import NewestPoses, PoseReading

# How long one look for messages waits [ms], and between two looks [s].
_WAIT = 0
_PAUSE = 0.002


class LcmPoses:
    """Bodies whose poses come as `sightfield.poses_t` on a channel.

    Stamps are the moments at which messages came; the sender's clock may be another machine's.
    A body that a message calls invalid counts for nothing, nor does a message that cannot be read,
    or that repeats the time of the one before: its sender lives, but what it listens to does not.

    Args:
        url: Of the LCM network, as "udpm://239.255.76.67:7667?ttl=0".
        channel: On which they come.
        bodies: Names of the robots, in the order of the rows.
        lcm: Use this instead of the network at `url`.

    Raises:
        InvalidInput: `url` is none of LCM, or a body has no name of its own.
    """

    def __init__(
        self, url: str, channel: str, bodies: Sequence[str], *, lcm: DrakeLcm | None = None
    ) -> None:
        # LCM itself reports another on standard error alone, and goes on.
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
