"""A simulation of cart and combines that shares nothing with the package."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest


def watch(
    *, capacity, fill, unload, travel, wait, first_wait, loads, rounds
) -> tuple[float, np.ndarray, np.ndarray]:
    """Let a cart go round equal combines; it starts beside the first one at time 0.

    All tanks are advanced together from event to event, so that the largest load of all is seen
    at every corner of the load diagram. Nothing runs over: loads may exceed the capacity.

    Args:
        capacity, fill, unload: Of each combine.
        travel: From each combine to the next; the last leads back to the first.
        wait: After emptying a tank.
        first_wait: The same in the first round, for each combine.
        loads: At time 0.
        rounds: How many.

    Returns:
        The largest load ever, over the capacity; when each visit started, and what it found,
        both (rounds, N).
    """
    loads = np.array(loads, dtype=float)
    count, now, largest = len(loads), 0.0, 0.0
    starts, found = np.zeros((rounds, count)), np.zeros((rounds, count))

    def advance(duration, beside=None, flow=0.0):
        nonlocal now, largest
        rates = np.full(count, float(fill))
        if beside is not None:
            rates[beside] = flow
        loads[:] = loads + rates * duration
        now += duration
        largest = max(largest, loads.max() / capacity)

    for lap in range(rounds):
        for n in range(count):
            starts[lap, n], found[lap, n] = now, loads[n]
            advance(loads[n] / (unload - fill), beside=n, flow=fill - unload)
            loads[n] = 0.0
            advance(first_wait[n] if lap == 0 else wait, beside=n)
            advance(travel[n])
    return largest, starts, found


@pytest.fixture
def event_simulation() -> Callable[..., tuple[float, np.ndarray, np.ndarray]]:
    """The function `watch`."""
    return watch


@pytest.fixture(scope="session")
def check_timetable() -> Callable[..., None]:
    """A checker: grain is conserved, no tank overflows, a cart is in one place at a time."""

    def check(fleet, timetable, rel=1e-9):
        assert not timetable.overflows
        assert timetable.lost == (0.0,) * fleet.size
        for n, tank in enumerate(timetable.tanks):
            assert (np.diff(tank.times) >= -1e-9).all()
            assert tank.loads.min() >= 0
            assert tank.loads.max() <= fleet.capacities[n] * (1 + rel)
            cut = fleet.fill_rates[n] * (tank.times[-1] - tank.times[0])
            taken = sum(visit.taken for visit in timetable.visits if visit.combine == n)
            assert tank.loads[0] + cut == pytest.approx(taken + tank.loads[-1], rel=1e-9)
        for k in range(len(timetable.carts)):
            visits = timetable.of_cart(k)
            for visit in visits:
                assert visit.arrive <= visit.start_unloading <= visit.emptied <= visit.leave
            for here, there in pairwise(visits):
                assert there.arrive >= here.leave - 1e-9

    return check
