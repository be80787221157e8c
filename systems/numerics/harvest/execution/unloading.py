"""Unloading: how much grain must still flow, who waits for whom, and where grain goes in a step.

**At their visits** a combine and a cart that are tied use the other's stopping point s + v^2 / 2 a
instead of its station s, as it cannot stop before that. So they slow down together and speed up
together, and each is beside the other as planned, but for the slack.

**In a step** crop comes in at a constant rate and the auger takes it at its own, so that the load
of the tank is linear in time between events: the tank is empty, the tank is full, the cart is full,
the visit has given what it should. The amounts of the whole step follow without computing the
events: the auger gives all that there is, but no more than it can, than there is room for, and than
the visit still has to give. Each kilogram is added to one place.

**At the end** nothing is left in a tank. A visit gives no more than planned, so that no cart lacks
room at a later one. It leaves no more to the combine's next visit than there is room for in that
visit's cart, and in the tank until then. The last visit takes all that there is.
"""

from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ..machines import (
    BLOCK_TIME,
    BLOCKED,
    COLUMNS,
    CUT,
    CUTTING,
    DONE,
    FULL,
    LOST,
    MODE,
    OVERFLOW_TIME,
    STATION,
    STOP_TIME,
    TANK,
    UNLOADING,
    WAITING,
)
from .fleet import cut_up_to, planned_at, planned_time
from .orders import PASSED, REST, SLACK, last_below
from .planned_work import PIECE

# Grain up to this counts as nothing [kg].
NOTHING = 1e-6
# How far before and after a visit a cart may be filled [m].
NEAR = 10.0

# Part of a tank that counts as nothing.
ROUNDING = 1e-12


class Loads(NamedTuple):
    """Where the grain is.

    Attributes:
        tank: In each combine, shape (N,) [kg].
        given: By each combine to carts, since the beginning, shape (N,) [kg].
        free: What each combine can still pour into the cart alongside, 0 without one, shape (N,)
            [kg].
        room: In each cart, shape (K,) [kg].
        load: In each cart, shape (K,) [kg].
    """

    tank: np.ndarray
    given: np.ndarray
    free: np.ndarray
    room: np.ndarray
    load: np.ndarray


@compiled
def loads_of(accounts, room, load):
    """Where the grain is, while no cart is alongside.

    Args:
        accounts: Of the combines, columns as in `machines`, shape (N * 8,).
        room, load: Of the carts, shape (K,) [kg].
    """
    count = len(accounts) // COLUMNS
    tank, given = np.empty(count), np.empty(count)
    for n in range(count):
        tank[n] = accounts[n * COLUMNS + TANK]
        given[n] = accounts[n * COLUMNS + CUT] - accounts[n * COLUMNS + LOST] - tank[n]
    return Loads(tank, given, np.zeros(count), room, load)


@compiled
def pour_alongside(fleet, ties, loads, stations, alongside):
    """Write to `loads` what combines can still pour into the carts alongside.

    Args:
        fleet: The machines.
        ties: Visits.
        loads: Where the grain is; `free` is written.
        stations: Of all machines, shape (M,) [m].
        alongside: The cart that each combine pours into, or -1, shape (N,).
    """
    asked = wanted_by(fleet, ties, loads, stations)[1]
    for n in range(len(loads.free)):
        cart = int(alongside[n])
        loads.free[n] = min(asked[cart], loads.room[cart]) if cart >= 0 else 0.0


@kernel
def tie_hold(fleet, ties, loads, stations, speeds, m, trusts):
    """Station up to which a machine may drive, by the machines that it is tied to [m].

    Args:
        fleet: The machines.
        ties: Visits.
        loads: Where the grain is.
        stations, speeds: Of all machines, shape (M,) [m], [m/s].
        m: Number of the machine.
        trusts: Whether it is on time, and no machine is disturbed.
    """
    hold = np.inf
    own = 0 if m < fleet.combines else 1
    reach = stations[m] + speeds[m] * speeds[m] / (2 * fleet.brakes[m])
    for t in range(len(ties.machines)):
        if ties.machines[t, own] != m or ties.ends[t, own] < stations[m] - PASSED:
            continue
        if ties.begins[t, own] > reach + 100.0:
            break
        n = ties.machines[t, 1 - own]
        if stations[n] > ties.ends[t, 1 - own] + PASSED:
            # The other one could leave, so this one can too, though the tank fills again.
            continue
        begin, end = ties.begins[t, own], ties.ends[t, own]
        moves = ties.ends[t, 0] > ties.begins[t, 0]
        # What has still to flow, and what flows until the machine is at the end.
        rest = rest_of(fleet, ties, loads, stations, t)
        rate = fleet.unload_rates[ties.machines[t, 0]]
        flows = 0.0
        if moves:
            flows = rate * max(end - stations[m], 0.0) / max(speeds[m], 0.1)
        if not ties.last[t]:
            # Grain that there is no room for later must flow first, whatever flows on the way.
            leaves = min(flows + rate * REST, ties.rooms[t])
        elif trusts:
            leaves = flows - rate / 2
        else:
            # A machine beside one that may be late cannot count on what flows on the way.
            leaves = 0.0
        if rest <= max(leaves, NOTHING):
            continue
        far = stations[n] + speeds[n] * speeds[n] / (2 * fleet.brakes[n])
        beyond = ties.slacks[t, own] - begin
        beyond += _beside(fleet, ties, t, own, far)
        if trusts and moves and not ties.last[t] and beyond > 0.0:
            lasting = planned_time(fleet.planned, m, end)
            lasting -= planned_time(fleet.planned, m, stations[m])
            if rest <= ties.rooms[t] + rate * lasting + NOTHING:
                continue
        hold = min(
            hold, begin + max(min(beyond, end - begin), min(ties.waits[t, own], end - begin))
        )
    return hold


@kernel
def rest_of(fleet, ties, loads, stations, t):
    """Grain that has still to flow in a visit [kg].

    Args:
        fleet: The machines.
        ties: Visits.
        loads: Where the grain is.
        stations: Of all machines, shape (M,) [m].
        t: Number of the visit.
    """
    n, k = ties.machines[t, 0], ties.machines[t, 1] - fleet.combines
    coming = cut_up_to(fleet, n, ties.ends[t, 0]) - cut_up_to(fleet, n, stations[n])
    rest = min(ties.given[t] - loads.given[n], loads.tank[n] + max(coming, 0.0))
    return max(min(rest, loads.room[k]), 0.0)


@kernel
def _beside(fleet, ties, t, own, station):
    """Planned station of one of two tied machines when the other one is at a station [m]."""
    begin = ties.begins[t, 1 - own]
    if station <= begin:
        return ties.begins[t, own] + station - begin
    n = ties.machines[t, 1 - own]
    time = planned_time(fleet.planned, n, min(station, ties.ends[t, 1 - own]))
    return planned_at(fleet.planned, ties.machines[t, own], time)[0]


@kernel
def place_beside(fleet, ties, stations, speeds, m, step):
    """Station beside a cart's combine a step later, plus the slack; infinite if not at a visit [m].

    Args:
        fleet: The machines.
        ties: Visits.
        stations, speeds: Of all machines, shape (M,) [m], [m/s].
        m: Number of the machine.
        step: [s].
    """
    if m < fleet.combines:
        return np.inf
    for t in range(len(ties.machines)):
        if ties.machines[t, 1] != m or ties.ends[t, 1] < stations[m] - PASSED:
            continue
        n = ties.machines[t, 0]
        if ties.begins[t, 1] > stations[m] or ties.ends[t, 0] < stations[n]:
            return np.inf
        return _beside(fleet, ties, t, 1, stations[n]) + speeds[n] * step + SLACK
    return np.inf


@kernel
def full_hold(fleet, loads, station, n):
    """Station at which a combine's tank will be full, if only the cart alongside takes grain [m].

    Args:
        fleet: The machines.
        loads: Where the grain is.
        station: Of the combine [m].
        n: Its number.
    """
    if fleet.spill[n]:
        return np.inf
    full = cut_up_to(fleet, n, station) + fleet.capacities[n] - loads.tank[n] + loads.free[n]
    low, high = fleet.grain_at[n], fleet.grain_at[n + 1]
    k = last_below(fleet.grain, low, high, full)
    if k == high - 1:
        return np.inf
    way = PIECE * (k - low) + PIECE * (full - fleet.grain[k]) / (
        fleet.grain[k + 1] - fleet.grain[k]
    )
    return max(way, station)


@compiled
def wanted_by(fleet, ties, loads, stations):
    """The combine that each cart is to empty now, or -1, and what it is to take from it still [kg].

    Args:
        fleet: The machines.
        ties: Visits.
        loads: Where the grain is.
        stations: Of all machines, shape (M,) [m].

    Returns:
        Both, shapes (K,).
    """
    wanted = np.full(len(stations) - fleet.combines, -1.0)
    asked = np.zeros(len(wanted))
    for t in range(len(ties.machines)):
        n, m = ties.machines[t]
        k = m - fleet.combines
        if wanted[k] < 0.0 and (
            ties.begins[t, 1] - NEAR <= stations[m] <= ties.ends[t, 1] + NEAR
            and ties.begins[t, 0] - NEAR <= stations[n] <= ties.ends[t, 0] + NEAR
            and rest_of(fleet, ties, loads, stations, t) > NOTHING
        ):
            wanted[k] = n
            asked[k] = max(ties.given[t] - loads.given[n], 0.0)
    return wanted, asked


@compiled
def wanted_at(fleet, ties, stations, accounts, room, carts):
    """What `wanted_by` tells; arguments as in `drive_on`."""
    loads = loads_of(accounts, room, room)
    return wanted_by(fleet, ties, loads, np.concatenate((stations, carts[: len(carts) // 2])))


@kernel
def work_for(account, station, end, cut, capacity, unload_rate, room, duration):
    """Let a combine work for a while.

    Args:
        account: Its columns at the beginning, changed to those at the end, shape (8,).
        station: Where it is at the end of it [m].
        end: Of its path [m].
        cut: What it cuts meanwhile [kg].
        capacity: Of the tank [kg].
        unload_rate: Of the auger; 0: no cart is alongside [kg/s].
        room: What the cart alongside can still take [kg].
        duration: [s].

    Returns:
        What flowed into the cart [kg].
    """
    moved = station > account[STATION]
    before = account[TANK] + cut
    given = max(min(unload_rate * duration, before, room), 0.0)
    left = before - given
    # A combine stops where its tank is full: a surplus from rounding counts as not cut.
    over = max(left - capacity, 0.0)
    lost = over if over > ROUNDING * capacity else 0.0
    full = left >= (1.0 - ROUNDING) * capacity
    account[STATION] = station
    account[CUT] += cut - (over - lost)
    account[LOST] += lost
    account[TANK] = left - over
    if lost > 0.0:
        account[OVERFLOW_TIME] += duration
    if station >= end:
        account[MODE] = DONE
    elif moved:
        account[MODE] = UNLOADING if given > 0.0 else CUTTING
    elif station <= 0.0:
        account[MODE] = WAITING
    elif full:
        account[MODE] = FULL
        account[STOP_TIME] += duration
    else:
        account[MODE] = BLOCKED
        account[BLOCK_TIME] += duration
    return given


@compiled
def work_together(fleet, accounts, stations, ends, alongside, room, given, duration):
    """Let all combines work for a while.

    Args:
        fleet: The machines.
        accounts: Of the combines, changed, shape (N, 8).
        stations: Where they are at the end of it, shape (N,) [m].
        ends: Of their paths, shape (N,) [m].
        alongside: Number of the cart that each one pours into, or -1, shape (N,).
        room: What each cart has room for and is to take, shape (K,) [kg].
        given: What flows into each cart is added to it, shape (K,) [kg].
        duration: [s].
    """
    for n in range(len(accounts)):
        cut = cut_up_to(fleet, n, stations[n]) - cut_up_to(fleet, n, accounts[n, STATION])
        cart = int(alongside[n])
        rate = fleet.unload_rates[n] if cart >= 0 else 0.0
        free = room[cart] - given[cart] if cart >= 0 else 0.0
        amount = work_for(
            accounts[n], stations[n], ends[n], cut, fleet.capacities[n], rate, free, duration
        )
        if cart >= 0:
            given[cart] += amount
