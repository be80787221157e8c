"""A channel that delays, loses and rounds what goes through it, and the age of what arrives.

Samples of all members are taken together but travel separately: each is lost or late on its own,
and an older one that is overtaken is ignored.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..checked import Checked, Count, Finite, NonNegative
from ..errors import require


@dataclass(frozen=True, kw_only=True)
class Channel(Checked):
    """How bad a channel is.

    Attributes:
        period: Time between samples, a millisecond at least [s].
        delay: From sampling to arrival, at least; with the jitter up to a minute [s].
        jitter: Added to the delay, uniform from zero to this [s].
        dropout: Probability that a member's sample is lost, in [0, 1].
        quantum: Values are rounded to multiples of it, in each value's unit; [-]; 0: not at all.
        seed: Of losses and jitter.

    Raises:
        InvalidInput: A number is out of its range.
    """

    period: Finite = 0.01
    delay: NonNegative = 0.0
    jitter: NonNegative = 0.0
    dropout: NonNegative = 0.0
    quantum: NonNegative = 0.0
    seed: Count = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.period >= 1e-3, "period", "be 0.001 at least", self.period)
        require(
            self.delay + self.jitter <= 60, "delay", "be 60 with the jitter at most", self.delay
        )
        require(self.dropout <= 1, "dropout", "lie in [0, 1]", self.dropout)

    @property
    def slots(self) -> int:
        """How many samples may be under way at once."""
        return math.ceil((self.delay + self.jitter) / self.period - 1e-9) + 1


class Flight(NamedTuple):
    """What is under way, and what came last.

    Attributes:
        values: Under way, shape (slots, N, width).
        arrivals: When each arrives, shape (slots, N) [s]; infinite if lost, or for an empty slot.
        taken: When each sample was taken, shape (slots,) [s].
        held: What came last, shape (N, width).
        stamps: When that was taken, shape (N,) [s]; minus infinity before the first.
    """

    values: np.ndarray
    arrivals: np.ndarray
    taken: np.ndarray
    held: np.ndarray
    stamps: np.ndarray


def empty_flight(channel: Channel, initial: np.ndarray) -> Flight:
    """Nothing under way, `initial` held, shape (N, width)."""
    count, width = initial.shape
    return Flight(
        np.zeros((channel.slots, count, width)),
        np.full((channel.slots, count), np.inf),
        np.full(channel.slots, -np.inf),
        initial.copy(),
        np.full(count, -np.inf),
    )


def received(flight: Flight, time: float) -> tuple[np.ndarray, np.ndarray]:
    """The newest sample of each member that has arrived, shape (N, width), and its time (N,).

    Args:
        flight: What is on its way.
        time: Now [s].
    """
    held, stamps = flight.held.copy(), flight.stamps.copy()
    for slot in np.argsort(flight.taken):
        newer = (flight.arrivals[slot] <= time + 1e-9) & (flight.taken[slot] > stamps)
        held[newer] = flight.values[slot, newer]
        stamps[newer] = flight.taken[slot]
    return held, stamps


def send(channel: Channel, flight: Flight, tick: int, values: np.ndarray) -> Flight:
    """Take sample number `tick`, of shape (N, width), and put it on its way.

    What has arrived by then is held, so that its slot may be used again.

    Args:
        channel: How bad it is.
        flight: What is on its way.
        tick: Number of the sample.
        values: The sample, shape (N, width).
    """
    time = tick * channel.period
    held, stamps = received(flight, time)
    generator = np.random.default_rng([channel.seed, tick])
    lost = generator.random(len(values)) < channel.dropout
    late = channel.delay + channel.jitter * generator.random(len(values))
    sent, arrivals, taken = flight.values.copy(), flight.arrivals.copy(), flight.taken.copy()
    slot = tick % channel.slots
    if channel.quantum > 0:
        values = channel.quantum * np.round(values / channel.quantum)
    sent[slot], taken[slot] = values, time
    arrivals[slot] = np.where(lost, np.inf, time + late)
    return Flight(sent, arrivals, taken, held, stamps)


def freshness(now: float, stamps: np.ndarray, limit: float) -> tuple[np.ndarray, np.ndarray]:
    """Validity and ages.

    Args:
        now: Time [s].
        stamps: When each member was last seen, shape (N,) [s]; minus infinity if never.
        limit: Age beyond which nothing is valid [s].

    Returns:
        valid: 1 up to the limit, else 0, shape (N,).
        ages: Shape (N,) [s]; infinite if never seen.
    """
    ages = np.maximum(now - stamps, 0.0)
    return (ages <= limit + 1e-9).astype(float), ages
