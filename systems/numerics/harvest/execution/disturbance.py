"""What goes wrong on the way: machines that are slow, that stop, and a cart that fails.

All of it is a function of the seed, the machine and the time, so that nothing has to be remembered:
time is cut into slots, and each slot of each machine has random numbers of its own.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ...errors import require, require_non_negative
from ...units import PerHour, Seconds
from ..carts.cart_plan import Failure

# How long a machine keeps its slowness [s], and in what time it stops once at most [s].
PACE_SLOT, STOP_SLOT = 45.0, 600.0
# What a slot's random numbers are for.
PACE, STOPS, BEGINS, LASTS = range(4)


@dataclass(frozen=True, kw_only=True)
class Disturbance:
    """What goes wrong.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # By what part of its speed a machine is slower, at most; each 45 s it is another part.
    slowness: float = 0.0
    # How often each machine stops, on average [1/h].
    stops: PerHour = 0.0
    # How long it then stands at most [s].
    longest_stop: Seconds = 120.0
    # Of the random numbers.
    seed: int = 0
    # Number of a cart that fails for good, -1: none. What comes after it is planned anew, for the
    # others, so it has to be told when the harvest is planned: see `plan_harvest`.
    failing_cart: int = -1
    # When it fails [s].
    fails_at: Seconds = 0.0

    def __post_init__(self) -> None:
        require(0 <= self.slowness < 1, "slowness", "be at least 0, below 1", self.slowness)
        most = 3600.0 / STOP_SLOT
        require(0 <= self.stops <= most, "stops", f"be from 0 to {most:g} 1/h", self.stops)
        require_non_negative("longest_stop", self.longest_stop)
        within = self.longest_stop <= STOP_SLOT
        require(within, "longest_stop", f"be at most {STOP_SLOT:g} s", self.longest_stop)
        require(self.seed >= 0, "seed", "be zero or positive", self.seed)
        require(self.failing_cart >= -1, "failing_cart", "be a cart or -1", self.failing_cart)
        require_non_negative("fails_at", self.fails_at)

    @property
    def failure(self) -> Failure | None:
        """The cart that fails, if there is one."""
        return Failure(self.failing_cart, self.fails_at) if self.failing_cart >= 0 else None

    @property
    def is_none(self) -> bool:
        """Whether no machine is slowed down or stops."""
        return self.slowness == 0 and (self.stops == 0 or self.longest_stop == 0)


class Pace(NamedTuple):
    """A disturbance in a form that compiles; see `Disturbance`.

    Attributes:
        slowness: Part of the speed.
        chance: Probability of a stop in a slot.
        longest: Of stops [s].
        seed: Of the random numbers.
        undisturbed: Whether no machine is slowed down or stops.
    """

    slowness: float
    chance: float
    longest: float
    seed: int
    undisturbed: bool


def pace_of(disturbance: Disturbance) -> Pace:
    """How machines are slowed down."""
    return Pace(
        float(disturbance.slowness),
        float(disturbance.stops * STOP_SLOT / 3600.0),
        float(disturbance.longest_stop),
        int(disturbance.seed),
        disturbance.is_none,
    )


@kernel
def _random(seed, machine, slot, use):
    """A number from 0 to 1 (splitmix64)."""
    z = np.uint64(seed) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(machine * 4 + use)
    z = z * np.uint64(0xD1342543DE82EF95) + np.uint64(slot)
    for _ in range(2):
        z = z + np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        z = z ^ (z >> np.uint64(31))
    return float(z >> np.uint64(11)) / 9007199254740992.0


@compiled
def factor_at(pace, machine, time):
    """Part of the speed that a machine could drive which it does drive, 0 while it stops.

    Args:
        pace: How machines are slowed down.
        machine: Its number.
        time: [s].
    """
    slot = int(time // STOP_SLOT)
    for each in range(max(slot - 1, 0), slot + 1):
        if _random(pace.seed, machine, each, STOPS) < pace.chance:
            begin = (each + _random(pace.seed, machine, each, BEGINS)) * STOP_SLOT
            lasts = pace.longest * _random(pace.seed, machine, each, LASTS)
            if begin <= time < begin + lasts:
                return 0.0
    return 1.0 - pace.slowness * _random(pace.seed, machine, int(time // PACE_SLOT), PACE)
