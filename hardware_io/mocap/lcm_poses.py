"""Poses that come as LCM messages."""

import contextlib
import threading
import time
from collections.abc import Sequence

from pydrake.lcm import DrakeLcm, DrakeLcmParams

from ...systems.numerics.errors import InvalidInput
from .lcm_message import decode
from .pose_source import NewestPoses, PoseReading

# How long one look for messages waits [ms], and between two looks [s].
_WAIT = 0
_PAUSE = 0.002


class LcmPoses:
    """Bodies whose poses come as `sightfield.poses_t` on a channel.

    Stamps are the moments at which messages came; the sender's clock may be another machine's.
    A body that a message calls invalid, and a message that cannot be read, count for nothing.

    Args:
        url: Of the LCM network, as "udpm://239.255.76.67:7667?ttl=0".
        channel: On which they come.
        bodies: Names of the robots, in the order of the rows.
        lcm: Use this instead of the network at `url`.

    Raises:
        InvalidInput: There is no network at `url`.
    """

    def __init__(
        self, url: str, channel: str, bodies: Sequence[str], *, lcm: DrakeLcm | None = None
    ) -> None:
        self._newest = NewestPoses(bodies)
        try:
            # Drake's own receiving thread would keep no message in order with ours.
            self._lcm = lcm or DrakeLcm(DrakeLcmParams(lcm_url=url))
        except RuntimeError as error:
            raise InvalidInput(f"`mocap.url` must be an LCM network; got {url} ({error})") from None
        self._lcm.Subscribe(channel, self._take)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _take(self, data: bytes) -> None:
        now = time.monotonic()
        with contextlib.suppress(InvalidInput):
            message = decode(data)
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
