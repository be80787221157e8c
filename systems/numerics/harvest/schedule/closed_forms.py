"""One cart and N equal combines in closed form: Zhang 2014, (3.1) to (3.10), corrected.

Tank C, fill rate r_f, unload rate r_u, travel time dT between neighbours, (N - 1) dT from the
last back to the first. A cart that waits t_n with the n-th combine after emptying it finds every
tank full in every round if

    t_1 + ... + t_(N-1) = C / r_f - (N - 1) C / (r_u - r_f) - (2N - 2) dT >= 0,     (3.9)

where the thesis prints the right-hand side with the opposite sign. The sum of any N - 1 waits
in a row is then the same, so that the waits repeat after N - 1; here they are all equal. The
condition is also necessary: see docs/errata.md.

One combine needs no condition but r_u > r_f: a cart can stay beside it for ever.
"""

import math
from dataclasses import dataclass

from ...errors import require, require_non_negative
from .fleet import Fleet

# Part of a bound that rounding may cost.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class EqualCombines:
    """The inputs of the thesis, checked: N, C [kg], r_f, r_u [kg/s] and dT [s].

    Attributes:
        combines: Number of combines N.
        capacity: C [kg].
        fill_rate: r_f [kg/s].
        unload_rate: r_u [kg/s].
        travel_time: dT [s].

    Raises:
        InvalidInput: A value is out of its range.
    """

    combines: int
    capacity: float
    fill_rate: float
    unload_rate: float
    travel_time: float

    def __post_init__(self) -> None:
        require_non_negative("travel_time", self.travel_time)
        self.fleet()

    def fleet(self) -> Fleet:
        """The same as one of the general fleets."""
        return Fleet.equal(
            self.combines, self.capacity, self.fill_rate, self.unload_rate, self.travel_time
        )

    @property
    def emptying(self) -> float:
        """How long a full tank takes to empty, C / (r_u - r_f) [s]."""
        return self.capacity / (self.unload_rate - self.fill_rate)

    @property
    def filling(self) -> float:
        """How long an empty tank takes to fill, C / r_f [s]."""
        return self.capacity / self.fill_rate


def combines_max(fill_rate: float, unload_rate: float) -> int:
    """N_max = floor(r_u / r_f): more combines fill faster than one cart unloads.

    Args:
        fill_rate: r_f [kg/s].
        unload_rate: r_u [kg/s].

    Raises:
        InvalidInput: The rates are not comparable.
    """
    quotient = unload_rate / fill_rate
    require(math.isfinite(quotient), "fill_rate", "be comparable to the unload rate", fill_rate)
    return math.floor(quotient * (1.0 + _ROUNDING))


def waiting_sum(equal: EqualCombines) -> float:
    """t_1 + ... + t_(N-1) of (3.9) [s]; negative: there is no schedule."""
    others = equal.combines - 1
    return equal.filling - others * equal.emptying - 2 * others * equal.travel_time


def travel_time_max(equal: EqualCombines) -> float:
    """(3.1), (3.7), (3.10): the largest dT [s]; negative: none; infinite for one combine."""
    others = equal.combines - 1
    if others == 0:
        return math.inf
    return (equal.filling - others * equal.emptying) / (2 * others)


def is_feasible(equal: EqualCombines) -> bool:
    """Whether one cart can serve all of them so that no tank ever runs over."""
    limit = travel_time_max(equal)
    return equal.travel_time <= limit + _ROUNDING * equal.filling


def waiting_time(equal: EqualCombines) -> float:
    """Each of the equal waits [s]; for one combine 0, though any wait will do.

    Negative: driving takes so long that there is no schedule.
    """
    others = equal.combines - 1
    return waiting_sum(equal) / others if others else 0.0


def period(equal: EqualCombines) -> float:
    """C / r_f + C / (r_u - r_f) + t: from one start beside a combine to the next [s].

    The longest of the possible periods, in which every tank is full when its turn comes. It means
    nothing where there is no schedule (`is_feasible`).
    """
    return equal.filling + equal.emptying + waiting_time(equal)


def period_min(equal: EqualCombines) -> float:
    """(2N - 2) dT / (1 - N r_f / r_u): the period of a cart that never waits [s]."""
    share = equal.combines * equal.fill_rate / equal.unload_rate
    driving = 2 * (equal.combines - 1) * equal.travel_time
    if share >= 1.0:
        return math.inf if driving > 0 else 0.0
    return driving / (1.0 - share)


def loads_at_start(equal: EqualCombines) -> tuple[float, ...]:
    """C, C'_1, ..., C'_(N-2), C: what the cart finds in its first round, (N,) [kg].

    As in Figures 3.4 to 3.6: the first combine is full at time 0, the others have begun with
    empty tanks (N - 1) dT earlier. From the second round on every tank is full.
    """
    wait = waiting_time(equal)
    leads = (
        (equal.combines - 1 + n) * equal.travel_time + n * (equal.emptying + wait)
        for n in range(1, equal.combines)
    )
    return (equal.capacity, *(equal.fill_rate * lead for lead in leads))


def first_waits(equal: EqualCombines) -> tuple[float, ...]:
    """t'_1, ..., t'_(N-2) of (3.8): waits of the first round where a tank was not full [s]."""
    wait, loads = waiting_time(equal), loads_at_start(equal)
    net = equal.unload_rate - equal.fill_rate
    return tuple(wait + (equal.capacity - load) / net for load in loads[1:-1])


def jitter_max(equal: EqualCombines) -> float:
    """The largest part j by which every way and every emptying may take longer than planned.

    If each takes up to 1 + j times as long, a cart that never waits finds loads that grow to
    L = r_f (1 + j) ((2N - 2) dT + (N - 1) L / (r_u - r_f)); that is C for

        1 + j = (C / r_f) / ((2N - 2) dT + (N - 1) C / (r_u - r_f)).

    No sequential strategy tolerates more.
    """
    others = equal.combines - 1
    busy = others * (2 * equal.travel_time + equal.emptying)
    return equal.filling / busy - 1.0 if busy else math.inf


def capacity_min(equal: EqualCombines) -> float:
    """The smallest tank [kg] with which there is a schedule; infinite: none."""
    spare = equal.unload_rate - equal.combines * equal.fill_rate
    net = equal.unload_rate - equal.fill_rate
    needed = 2 * (equal.combines - 1) * equal.fill_rate * net * equal.travel_time
    if needed == 0:
        return 0.0 if spare >= 0 else math.inf
    return needed / spare if spare > 0 else math.inf


def unload_rate_min(equal: EqualCombines) -> float:
    """The smallest r_u [kg/s] with which there is a schedule; infinite: none."""
    others = equal.combines - 1
    room = equal.capacity - 2 * others * equal.fill_rate * equal.travel_time
    if room <= 0:
        return math.inf
    return equal.fill_rate * (1.0 + others * equal.capacity / room)


def fill_rate_max(equal: EqualCombines) -> float:
    """The largest r_f [kg/s] with which there is a schedule.

    The smaller root of a r_f^2 - (N C + a r_u) r_f + C r_u = 0 with a = (2N - 2) dT.
    """
    a = 2 * (equal.combines - 1) * equal.travel_time
    b = equal.combines * equal.capacity + a * equal.unload_rate
    c = equal.capacity * equal.unload_rate
    return 2 * c / (b + math.sqrt(b * b - 4 * a * c))


def combines_feasible(equal: EqualCombines) -> int:
    """The largest N with which there is a schedule, all else as it is; at least 1."""
    busy = 2 * equal.travel_time + equal.emptying
    return 1 + math.floor(equal.filling / busy * (1.0 + _ROUNDING))
