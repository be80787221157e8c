"""One step of all machines along their paths, and what disturbs them.

A machine is never ahead of its plan. One that is on time does what the plan does; one that is late
drives as fast as its path lets it, less what disturbs it, so that

- v^2 <= 2 a (hold - s) for all holds before it: of orders, of ties, of a full tank, of trips;
- s + v^2 / 2 a is at most that of the plan at that time, so that it meets its plan at its speed;
- it speeds up and slows down by a at most, from one step to the next.

**Disturbances**, machines that are slow, that stop, and a cart that fails, are a function of the
seed, the machine and the time, so that they need no state: time is divided into slots, and each
slot of each machine has random numbers of its own.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ...errors import require, require_non_negative
from ...units import PerHour, Seconds
from ..carts.cart_plan import Failure
from .fleet import fastest_at, planned_at
from .orders import PASSED, hold_by, last_below
from .unloading import NOTHING, full_hold, loads_of, place_beside, pour_alongside, tie_hold

# How long a machine keeps its slowness [s], and the time in which it stops once at most [s].
PACE_SLOT, STOP_SLOT = 45.0, 600.0
# What a slot's random numbers are for.
PACE, STOPS, BEGINS, LASTS = range(4)

# Largest error of stations [m] and speeds [m/s] of machines that count as on time: rounding.
ON_TIME = 1e-6
# A late machine so near to its plan has caught up [m], [m/s].
CAUGHT_UP = 1e-4


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
    """Part of its possible speed that a machine drives when disturbed, 0 while it stops.

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


@compiled
def drive_on(
    fleet,
    orders,
    pace,
    stations,
    speeds,
    accounts,
    alongside,
    room,
    load,
    carts,
    now,
    step,
):
    """Stations and then speeds of all machines a step later, shape (2 M,) [m], [m/s].

    The arguments are the values of the drivers' ports, as they come.

    Args:
        fleet: The machines.
        orders: What they need of one another.
        pace: How they are disturbed.
        stations, speeds: Of the combines, shape (N,) [m], [m/s].
        accounts, room, load: See `loads_of`.
        alongside: The cart that each combine pours into, or -1, shape (N,).
        carts: Stations and then speeds of the carts, shape (2 K,) [m], [m/s].
        now: [s].
        step: [s].
    """
    half = len(carts) // 2
    loads, places = loads_of(accounts, room, load), np.concatenate((stations, carts[:half]))
    pour_alongside(fleet, orders.ties, loads, places, alongside)
    driven = np.concatenate((speeds, carts[half:]))
    return np.concatenate(advance(fleet, orders, pace, loads, places, driven, now, step))


@compiled
def advance(fleet, orders, pace, loads, stations, speeds, now, step):
    """Stations and speeds of all machines a step later.

    Args:
        fleet: The machines.
        orders: What they need of one another.
        pace: How they are disturbed.
        loads: Where the grain is.
        stations, speeds: Where they are, shape (M,) [m], [m/s].
        now: [s].
        step: [s].

    Returns:
        Shape (M,) each [m], [m/s].
    """
    after, after_speeds = np.empty(len(stations)), np.empty(len(stations))
    for m in range(len(stations)):
        at, speed = planned_at(fleet.planned, m, now)
        punctual = abs(stations[m] - at) <= ON_TIME and abs(speeds[m] - speed) <= ON_TIME
        trusts = pace.undisturbed and punctual
        hold = np.inf
        for n in range(len(stations)):
            if n == m:
                continue
            at, speed = planned_at(fleet.planned, n, now)
            # Machines that are on time, and that nothing disturbs, keep their plan: it is safe.
            if trusts and abs(stations[n] - at) <= ON_TIME and abs(speeds[n] - speed) <= ON_TIME:
                continue
            hold = min(hold, hold_by(orders, m, n, stations[n]))
        hold = min(hold, tie_hold(fleet, orders.ties, loads, stations, speeds, m, trusts))
        if m < fleet.combines:
            hold = min(hold, full_hold(fleet, loads, stations[m], m))
        else:
            load = loads.load[m - fleet.combines]
            for j in range(fleet.trips_at[m], fleet.trips_at[m + 1]):
                if fleet.trips[j] >= stations[m] - PASSED and load > NOTHING:
                    hold = min(hold, fleet.trips[j])
                    break
        beside = place_beside(fleet, orders.ties, stations, speeds, m, step)
        factor = factor_at(pace, m, now)
        after[m], after_speeds[m] = _step(
            fleet, m, stations[m], speeds[m], now, step, hold, beside, factor, punctual
        )
    return after, after_speeds


@kernel
def _step(fleet, m, station, speed, now, step, hold, beside, factor, punctual):
    """The step of one machine, up to its hold and not beyond its place beside a combine.

    Ten arguments: the machine, where it is, the step, and what keeps it back.
    """
    brake = fleet.brakes[m]
    target, target_speed = planned_at(fleet.planned, m, now + step)
    ahead = target + target_speed * target_speed / (2 * brake)
    # Holds where the plan comes to a stop may be off by rounding.
    if (
        punctual
        and ahead <= hold + ON_TIME
        and (factor >= 1.0 or target_speed <= factor * fastest_at(fleet.fastest, m, target))
    ):
        return target, target_speed
    end = fleet.halts[fleet.halts_at[m + 1] - 1]
    for h in range(fleet.halts_at[m], fleet.halts_at[m + 1]):
        if fleet.halts[h] > station + PASSED:
            end = fleet.halts[h]
            break
    hold = min(hold, end, ahead)
    most = max(min(target, beside), station)
    low = max(speed - brake * step, 0.0)
    high = speed + brake * step
    if low == 0.0 and station + speed * step / 2 >= hold:
        # It comes to stand within the step, at its hold if that can be.
        least = station + speed * speed / (2 * brake)
        there, then = max(min(hold, target), least), 0.0
    else:
        for _ in range(40):
            middle = (low + high) / 2
            there = station + (speed + middle) * step / 2
            if (
                there <= most
                and there + middle * middle / (2 * brake) <= hold
                and _within(fleet.fastest, m, station, speed, there, middle, factor)
            ):
                low = middle
            else:
                high = middle
        there, then = station + (speed + low) * step / 2, low
    if (
        0.0 <= target - there <= CAUGHT_UP
        and abs(target_speed - then) <= CAUGHT_UP
        and ahead <= hold + CAUGHT_UP
    ):
        return target, target_speed
    return there, then


@kernel
def _within(fastest, m, station, speed, there, then, factor):
    """Whether a step keeps to the path's speed limits, at its end and at stations it passes."""
    if then > factor * fastest_at(fastest, m, there):
        return False
    k = last_below(fastest.stations, fastest.starts[m], fastest.starts[m + 1], station) + 1
    while k < fastest.starts[m + 1] and fastest.stations[k] < there:
        share = (fastest.stations[k] - station) / (there - station)
        square = speed * speed + share * (then * then - speed * speed)
        if square > fastest.speeds[k] ** 2 * (1 + 1e-9) and then > speed:
            return False
        if square > fastest.speeds[k] ** 2 * (1 + 1e-9) + 1e-9 and share > 0.0:
            return False
        k += 1
    return True
