"""What a step does to a combine's grain: what it cuts, pours into a cart, keeps or spills.

In a step crop comes in at a constant rate and the auger takes it at its own, so that the tank is
linear in time between its events: it is empty, it is full, the cart is full. Then the amounts of
the whole step follow without looking at the events: the auger gives all that there is, but no more
than it can and than there is room for. Each kilogram is added to one place.
"""

from ...compiled import compiled, kernel
from ..machines.filling import (
    BLOCK_TIME,
    BLOCKED,
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
from .fleet import cut_up_to

# Part of a tank that is nothing.
ROUNDING = 1e-12


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
    # A combine stops where its tank is full: what rounding leaves over goes where it came from.
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
        room: In each cart, shape (K,) [kg].
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
