"""The air between radio modules: frames are lost, late, and come out of order; or it is cut."""

import heapq
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...systems.numerics.checked import Checked, NonNegative
from ...systems.numerics.errors import require

# A module tries a frame to a single other one so many times, as the 802.15.4 MAC does.
TRIES = 4


@dataclass(frozen=True, kw_only=True)
class AirSettings(Checked):
    """How bad the air is.

    Attributes:
        frame_loss: Probability that a frame does not reach a receiver, 0 to 1.
        delay: From module to module [s].
        jitter: Largest addition to it, uniform [s]; frames may overtake each other.
        rssi: Strength at the receivers [dBm], -255 to 0.

    Raises:
        InvalidInput: A value is out of its range.
    """

    frame_loss: float = 0.0
    delay: NonNegative = 0.002
    jitter: NonNegative = 0.0
    rssi: int = -48

    def __post_init__(self) -> None:
        super().__post_init__()
        require(0 <= self.frame_loss <= 1, "frame_loss", "be 0 to 1", self.frame_loss)
        require(-255 <= self.rssi <= 0, "rssi", "be -255 to 0 dBm", self.rssi)


@dataclass(frozen=True)
class Flight:
    """A payload on its way to one receiver.

    Attributes:
        sender, receiver: Numbers of modules.
        payload: What is sent.
        broadcast: Whether it goes to all.
    """

    sender: int
    receiver: int
    payload: bytes
    broadcast: bool


class Air:
    """What is on its way between modules, which go by numbers.

    Attributes:
        settings: How bad it is; may be set while it is used.
        cut: Whether nothing gets through.

    Args:
        settings: How bad it is.
        seed: Of what is lost and how late frames are.
    """

    def __init__(self, settings: AirSettings, seed: int) -> None:
        self.settings = settings
        self._random = np.random.default_rng(seed)
        self._queue: list[tuple[float, int, Flight]] = []
        self._count = 0
        self._kept: list[Flight] | None = None
        self._lock = threading.Lock()
        self.cut = False

    def send(self, flight: Flight, time: float) -> bool:
        """Send a payload; False where none of the tries of a frame to one receiver got through.

        A broadcast is tried once, and nobody knows who received it: True.

        Args:
            flight: What, from whom to whom.
            time: Now [s].
        """
        settings = self.settings
        with self._lock:
            if self._kept is not None:
                self._kept.append(flight)
                return True
            for _ in range(1 if flight.broadcast else TRIES):
                if not self.cut and self._random.random() >= settings.frame_loss:
                    arrival = time + settings.delay + settings.jitter * self._random.random()
                    self._push(flight, arrival)
                    return True
        return flight.broadcast

    def arrivals(self, time: float) -> list[Flight]:
        """Take what has arrived by a time; nothing does while the air is cut."""
        arrived = []
        with self._lock:
            while self._queue and self._queue[0][0] <= time:
                _, _, flight = heapq.heappop(self._queue)
                if not self.cut:
                    arrived.append(flight)
        return arrived

    def next_arrival(self) -> float:
        """When the next payload arrives [s]; infinite if none is on its way."""
        return self._queue[0][0] if self._queue else math.inf

    def keep(self) -> None:
        """Keep from now on what is sent, instead of carrying it: a fault."""
        with self._lock:
            self._kept = []

    def kept(self) -> list[Flight]:
        """What has been kept so far, in the order in which it was sent."""
        with self._lock:
            return list(self._kept or ())

    def let_go(self, arrange: Callable[[list[Flight]], list[Flight]] = lambda sent: sent) -> None:
        """Let what was kept arrive at once, and carry what is sent from now on.

        Args:
            arrange: Given what was kept, what arrives, in its order.
        """
        with self._lock:
            for flight in arrange(self._kept or []):
                self._push(flight, -math.inf)
            self._kept = None

    def _push(self, flight: Flight, arrival: float) -> None:
        # The count keeps the order of what arrives at one time.
        self._count += 1
        heapq.heappush(self._queue, (arrival, self._count, flight))
