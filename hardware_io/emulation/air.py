"""The air between radio modules: frames are lost, late, and come out of order; or it is cut."""

import heapq
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...systems.numerics.checked import Checked, NonNegative
from ...systems.numerics.errors import require

# How often a module tries to send a frame to a single other one, as in the 802.15.4 MAC.
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
    """Payloads on their way between modules, which are identified by numbers.

    Attributes:
        settings: How bad the air is; may be changed at any time.
        cut: Whether nothing gets through.

    Args:
        settings: How bad the air is.
        seed: Seed of the random losses and delays.
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
        """Send a payload; returns False if it is for one receiver and no try got through.

        A broadcast is tried once, and always returns True: the sender cannot know who received it.

        Args:
            flight: Payload, sender and receiver.
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
        """Take the payloads that have arrived by a time; while the air is cut they are lost."""
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
        """From now on hold back what is sent: a fault."""
        with self._lock:
            self._kept = []

    def kept(self) -> list[Flight]:
        """What has been kept so far, in the order in which it was sent."""
        with self._lock:
            return list(self._kept or ())

    def let_go(self, arrange: Callable[[list[Flight]], list[Flight]] = lambda sent: sent) -> None:
        """Let the kept payloads arrive at once, and carry later ones normally.

        Args:
            arrange: Maps the kept payloads to those that arrive, in their order.
        """
        with self._lock:
            for flight in arrange(self._kept or []):
                self._push(flight, -math.inf)
            self._kept = None

    def _push(self, flight: Flight, arrival: float) -> None:
        # The count keeps the order of payloads that arrive at the same time.
        self._count += 1
        heapq.heappush(self._queue, (arrival, self._count, flight))
