"""Orders: which machine waits for which, wherever the way of one depends on another.

For each ordered pair of machines (m, n) a table gives, for each cell of m's path, the station that
n must have passed before m enters the cell. Its entries follow from the plan's own times:

- where outlines of m and n on two cells may come nearer than the gap, whoever enters its cell
  first in the plan goes first; the other waits until it has left that cell;
- ground under a body must have been cut;
- no machine is more than AHEAD ahead of any other in the plan.

While grain flows a cart and a combine are tied: each needs the other beside it, but for a slack.
They part when no more grain is left than there is room for, in the tank until the combine's next
visit and in the cart that comes then.

**No deadlock.** No entry asks for more of n than n has driven in the plan by the time at which m
enters the cell. However late machines are on the field, take the machine whose plan clock (the time
at which the plan has it where it is) is least, and whose next cell the plan enters first. All
others are at least where the plan has them at that time, and so have passed all that it needs: it
can go on. The same holds for ties: the machine that is behind has the other at its side or ahead.
No tank gets full before its combine is where the next cart comes to it, as the last visit left room
for that: if a cart waits for a combine, the combine gets there. So as long as some machine has not
arrived, one can drive on, provided that grain flows beside it.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ..carts.cart_plan import CartVisit
from ..carts.cut_times import OpenGround, opens_along
from ..carts.traffic import cart_boxes
from ..paths import TimedPath
from ..timing.conflicts import (
    GAP,
    RUN,
    cells_are_near,
    discs_are_near,
    near_runs,
    run_discs,
)
from ..timing.sweep import Sweep
from .planned_work import PlannedWork, grain_stations

# No machine is farther ahead of another in the plan [s]; this also bounds what is compared.
AHEAD = 1800.0
# How far a tied machine may be beyond its place beside the other one [m].
SLACK = 0.5
# Grain that may be left when tied machines part on the way, as time at the auger's rate [s]; the
# next visit takes it, if there is room for it until then.
REST = 1.5
# A station counts as passed this much before it, for rounding [m].
PASSED = 1e-6


@kernel
def last_below(values, low, high, value):
    """Index of the last of sorted values that is not above a value, low - 1 for none.

    Args:
        values: Never decreasing from low to high, shape (n,).
        low, high: The first number, and one after the last.
        value: In the units of the values.
    """
    while low < high:
        middle = (low + high) // 2
        if values[middle] <= value:
            low = middle + 1
        else:
            high = middle
    return low - 1


class Ties(NamedTuple):
    """Visits: T times in which a combine and a cart drive, or stand, side by side.

    Of two columns the first is for the combine, the second for the cart.

    Attributes:
        machines: Numbers of both, shape (T, 2).
        begins, ends: Their stations when grain begins and ceases to flow, shape (T, 2) [m].
        waits: How far beyond its beginning each may be while the other is not there yet, so that
            neither has to brake if both are on time, shape (T, 2) [m].
        slacks: How far each may be beyond its place beside the other's stopping point, shape (T, 2)
            [m].
        given: What the combine has given in all when the visit is over, infinite at its last one,
            which takes all that there is, shape (T,) [kg].
        rooms: The most of that which may be left to the combine's next visit. The tank has room for
            it until then, and so has the next cart, besides all that it is to take until it is
            emptied. Infinite at the combine's last visit, shape (T,) [kg].
        last: Whether it is the combine's last visit, shape (T,).
    """

    machines: np.ndarray
    begins: np.ndarray
    ends: np.ndarray
    waits: np.ndarray
    slacks: np.ndarray
    given: np.ndarray
    rooms: np.ndarray
    last: np.ndarray


class Orders(NamedTuple):
    """What machines need of one another; cells of all M machines are stored one after the other.

    Attributes:
        starts: Index of the first cell of each machine, and the total number last, shape (M + 1,).
        stations: At which each cell begins, shape (c,) [m].
        needs: needs[n, i]: what machine n must have passed before cell i is entered, never
            decreasing along the cells of one machine, -inf for nothing, shape (M, c) [m].
        ties: Visits.
    """

    starts: np.ndarray
    stations: np.ndarray
    needs: np.ndarray
    ties: Ties


def find_orders(work: PlannedWork) -> Orders:
    """What machines need of one another, by the plan's times.

    Cells on which outlines may be nearer than GAP are not entered together.
    """
    sweeps, timed = work.sweeps, work.timed
    starts = np.concatenate([[0], np.cumsum([sweep.cells for sweep in sweeps])])
    needs = np.full((len(sweeps), starts[-1]), -np.inf)
    entered = [entering_times(path, sweep) for path, sweep in zip(timed, sweeps, strict=True)]
    for m, sweep in enumerate(sweeps):
        for n, other in enumerate(sweeps):
            if m == n:
                continue
            passed = timed[n].station_at(entered[m])
            least = np.maximum(
                _crop_needs(work, m, n, sweep), timed[n].station_at(entered[m] - AHEAD)
            )
            # Nothing is asked for that has not happened in the plan, whatever the grids are like.
            least = np.maximum.accumulate(np.minimum(least, passed))
            own = slice(starts[m], starts[m + 1])
            needs[n, own] = _first_come(
                sweep, other, entered[m], entered[n], passed, least, GAP, n < m
            )
    return Orders(
        starts, np.concatenate([sweep.stations[:-1] for sweep in sweeps]), needs, find_ties(work)
    )


def find_ties(work: PlannedWork) -> Ties:
    """The visits of a plan, in the order of their beginnings."""
    visits = sorted(work.visits, key=lambda visit: visit.begin)
    count = len(work.plans)
    rows = {name: np.zeros((len(visits), 2)) for name in ("begins", "ends", "waits", "slacks")}
    machines = np.zeros((len(visits), 2), dtype=np.int64)
    given, last = np.zeros(len(visits)), np.zeros(len(visits), dtype=np.bool_)
    total = np.zeros(count)
    for t, visit in enumerate(visits):
        both = work.plans[visit.combine], work.motions[visit.cart].timed
        machines[t] = visit.combine, count + visit.cart
        for side, path in enumerate(both):
            rows["begins"][t, side] = path.station_at(visit.begin)
            rows["ends"][t, side] = path.station_at(visit.end)
        moves = rows["ends"][t, 0] - rows["begins"][t, 0] > PASSED
        if moves:
            combine = work.combines[visit.combine]
            brakes = np.array([combine.acceleration, work.cart.acceleration])
            speed = max(float(combine.speed), float(both[0].speed_at(visit.begin)))
            ways = speed**2 / (2 * brakes)
            # The machine that brakes more gently has to know earlier.
            rows["slacks"][t] = np.maximum(ways - ways[::-1], 0.0) + SLACK
            rows["waits"][t] = ways + SLACK / 2
        else:
            rows["ends"][t] = rows["begins"][t]
        total[visit.combine] += visit.taken
        given[t] = total[visit.combine] * _more(work, visit.combine, rows["ends"][t, 0])
        last[t] = all(other.combine != visit.combine for other in visits[t + 1 :])
    rooms = _rooms(work, visits, rows["begins"][:, 0], given)
    return Ties(machines, **rows, given=np.where(last, np.inf, given), rooms=rooms, last=last)


def _rooms(
    work: PlannedWork, visits: Sequence[CartVisit], begins: np.ndarray, given: np.ndarray
) -> np.ndarray:
    """What each visit may leave to its combine's next one at most, shape (T,) [kg].

    Carts that the plan fills have no room for it, nor have tanks that are full in the plan when the
    next cart comes. So every cart has room for all that it may have to take, the last visits leave
    nothing, and no combine is full before it is where its cart comes.

    Args:
        work: The plan.
        visits: In order.
        begins: Stations of their combines when they begin, shape (T,) [m].
        given: What the combine has given in all when each visit is over, shape (T,) [kg].
    """
    combines = np.array([visit.combine for visit in visits], dtype=np.int64)
    taken = given.copy()
    for n in set(combines.tolist()):
        taken[combines == n] = np.diff(given[combines == n], prepend=0.0)
    # Visits of one cart between two of its trips.
    tours: dict[tuple[int, int], list[int]] = {}
    for t, visit in enumerate(visits):
        trips = sum(trip.cart == visit.cart and trip.begin < visit.begin for trip in work.trips)
        tours.setdefault((visit.cart, trips), []).append(t)
    spare = np.zeros(len(visits))
    for tour in tours.values():
        spare[tour] = max(work.cart.capacity - taken[tour].sum(), 0.0) / len(tour)
    rooms = np.full(len(visits), np.inf)
    for n in set(combines.tolist()):
        own = np.flatnonzero(combines == n)
        at = grain_stations(work.plans[n].path)
        tank = np.interp(begins[own[1:]], at, work.grain[n]) - given[own[:-1]]
        free = np.maximum(work.combines[n].capacity - tank, 0.0)
        rooms[own[:-1]] = np.minimum(free, spare[own[1:]])
    return rooms


def _more(work: PlannedWork, combine: int, station: float) -> float:
    """Ratio of what a combine has cut by a station to what was planned; visits scale with it.

    Args:
        work: The plan, and what grows in fact.
        combine: Its number.
        station: [m].
    """
    if work.grown is None:
        return 1.0
    at = grain_stations(work.plans[combine].path)
    planned = float(np.interp(station, at, work.planned_grain[combine]))
    return float(np.interp(station, at, work.grain[combine])) / planned if planned > 0 else 1.0


def entering_times(timed: TimedPath, sweep: Sweep) -> np.ndarray:
    """When a machine enters each cell, which is when it leaves the one before, shape (n,) [s].

    It is on its first cell from the beginning, and still on a cell while it stands at its end.
    """
    at = sweep.stations[:-1] + PASSED
    number = np.searchsorted(timed.stations, at, side="right") - 1
    following = np.minimum(number + 1, len(timed.times) - 1)
    lasting = timed.times[following] - timed.times[number]
    change = timed.speeds[following] - timed.speeds[number]
    rate = np.divide(change, lasting, out=np.zeros(len(at)), where=lasting > 0)
    way, speed = at - timed.stations[number], timed.speeds[number]
    root = speed + np.sqrt(np.maximum(speed**2 + 2 * rate * way, 0.0))
    since = np.divide(2 * way, root, out=np.zeros(len(at)), where=root > 0)
    times = timed.times[number] + np.minimum(since, lasting)
    times[0] = -np.inf
    return np.maximum.accumulate(times)


def _crop_needs(work: PlannedWork, m: int, n: int, sweep: Sweep) -> np.ndarray:
    """Station that n must have passed for the ground under m to be cut, for each cell of m."""
    count = len(work.plans)
    found = np.full(sweep.cells, -np.inf)
    if n >= count:
        return found
    if m < count:
        if work.precedence is None:
            return found
        passed = work.precedence.needed_at(m, n, sweep.stations)
        return np.maximum(passed[:-1], passed[1:])
    path, trailer = work.towed[m - count]
    # Ground opens by stations of the combine here, not by times: carts never leave the grid.
    own = np.where(work.cut.cutter == n, work.cutting_stations, -np.inf)
    ground, boxes = OpenGround(own, work.cut.corner), cart_boxes(work.cart)
    least = np.maximum(
        opens_along(ground, boxes[0], path.poses), opens_along(ground, boxes[1], trailer)
    )
    for side in (-PASSED, PASSED):
        cell = np.searchsorted(sweep.stations, path.stations + side, side="right") - 1
        np.maximum.at(found, np.clip(cell, 0, sweep.cells - 1), least)
    return found


@compiled
def _first_come(own, other, entered, others, passed, least, gap, even):
    """Station that another machine must have passed before each cell of a machine is entered.

    Args:
        own, other: Sweeps of both.
        entered, others: When cells are entered, shapes (n,) and (k,) [s].
        passed: Where the other one is when each cell is entered, shape (n,) [m].
        least: What is needed anyway, never decreasing, shape (n,) [m].
        gap: [m].
        even: Whether the other one goes first when both come at the same moment.

    Returns:
        Shape (n,) [m].
    """
    needs = least.copy()
    own_runs, runs = run_discs(own), run_discs(other)
    # Runs of the other one's cells that the machine's present run of cells may come near.
    near, count = np.zeros(len(runs), dtype=np.int64), 0
    need, last = -np.inf, -1
    for i in range(len(entered)):
        need = max(need, least[i])
        last = _entered_by(others, last, entered[i], even)
        if i % RUN == 0:
            ends = min(i + RUN, len(entered)) - 1
            begins = np.searchsorted(other.stations, need, side="right") - 1
            final = _entered_by(others, last, entered[ends], even)
            first, behind = max(begins, 0) // RUN, final // RUN + 1
            count = near_runs(own_runs[i // RUN], runs, first, behind, gap, near)
        disc = own.discs[i, 0], own.discs[i, 1], own.discs[i, 2] + own.margins[i]
        found = False
        for k in range(count - 1, -1, -1):
            j = min((near[k] + 1) * RUN - 1, last)
            if found or other.stations[max(j, 0) + 1] <= need:
                break
            if j < near[k] * RUN or not discs_are_near(disc, runs[near[k]], gap):
                continue
            while j >= near[k] * RUN and other.stations[j + 1] > need:
                if cells_are_near(own, other, i, j, gap):
                    need = max(need, min(other.stations[j + 1], passed[i]))
                    found = True
                    break
                j -= 1
        needs[i] = need
    return needs


@kernel
def _entered_by(others, last, time, even):
    """Number of the last cell that the other machine has entered by a time, from `last` on."""
    while last + 1 < len(others) and (
        others[last + 1] < time or (even and others[last + 1] == time)
    ):
        last += 1
    return last


@kernel
def hold_by(orders, m, n, station):
    """The station up to which machine m may drive while machine n is at a station [m].

    Args:
        orders: What machines need.
        m, n: Numbers of the machines.
        station: Of machine n [m].
    """
    low, high = orders.starts[m], orders.starts[m + 1]
    # The first cell that needs more.
    cell = last_below(orders.needs[n], low, high, station + PASSED) + 1
    return orders.stations[cell] if cell < high else np.inf
