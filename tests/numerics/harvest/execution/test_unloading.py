"""What a combine cuts, pours, keeps and spills in a step, against small steps."""

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.execution.unloading import work_for
from sightfield.systems.numerics.harvest.machines import (
    BLOCKED,
    COLUMNS,
    CUT,
    CUTTING,
    DONE,
    FULL,
    LOST,
    MODE,
    STATION,
    STOP_TIME,
    TANK,
    UNLOADING,
)


def account(tank, station=10.0):
    found = np.zeros(COLUMNS)
    found[TANK], found[CUT], found[STATION] = tank, tank, station
    return found


def by_small_steps(tank, cut, capacity, rate, room, duration, count=20000):
    """Tank, what was given and what was spilt, from the rates."""
    given = lost = 0.0
    for _ in range(count):
        tank += cut / count
        out = min(rate * duration / count, tank, room - given)
        tank, given = tank - out, given + out
        over = max(tank - capacity, 0.0)
        tank, lost = tank - over, lost + over
    return tank, given, lost


@pytest.mark.parametrize(
    ("tank", "cut", "capacity", "rate", "room"),
    [
        (500.0, 8.0, 9000.0, 0.0, 1e9),
        (500.0, 8.0, 9000.0, 120.0, 1e9),
        (12.0, 8.0, 9000.0, 120.0, 1e9),
        (0.0, 8.0, 9000.0, 120.0, 1e9),
        (500.0, 8.0, 9000.0, 120.0, 7.0),
        (8995.0, 8.0, 9000.0, 0.0, 1e9),
    ],
)
def test_amounts_of_a_step_are_those_of_many_small_ones(tank, cut, capacity, rate, room):
    found = account(tank)
    given = work_for(found, 12.0, 100.0, cut, capacity, rate, room, 0.5)
    expected = by_small_steps(tank, cut, capacity, rate, room, 0.5)
    assert [found[TANK], given, found[LOST]] == pytest.approx(expected, abs=2e-3)
    assert found[CUT] == pytest.approx(found[TANK] + given + found[LOST], abs=1e-9)


@pytest.mark.parametrize(
    ("station", "tank", "rate", "mode"),
    [
        (12.0, 500.0, 0.0, CUTTING),
        (12.0, 500.0, 120.0, UNLOADING),
        (10.0, 500.0, 0.0, BLOCKED),
        (10.0, 9000.0, 0.0, FULL),
        (100.0, 500.0, 0.0, DONE),
    ],
)
def test_modes_tell_what_it_does(station, tank, rate, mode):
    found = account(tank)
    cut = 0.0 if station == 10.0 else 1.0
    work_for(found, station, 100.0, cut, 9000.0, rate, 1e9, 0.5)
    assert found[MODE] == mode
    assert found[STATION] == station
    assert found[STOP_TIME] == (0.5 if mode == FULL else 0.0)


def test_what_rounding_leaves_over_in_a_full_tank_is_no_loss():
    found = account(8999.0)
    work_for(found, 12.0, 100.0, 1.0 + 1e-12, 9000.0, 0.0, 0.0, 0.5)
    assert found[TANK] == 9000.0
    assert found[LOST] == 0.0
    assert found[CUT] == 9000.0
