"""Tanks fill, overflow and are emptied; every kilogram is somewhere."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.harvest.machines.filling import (
    CUT,
    DONE,
    FULL,
    LOST,
    MODE,
    OVERFLOW_TIME,
    STATION,
    STOP_TIME,
    TANK,
    advance_combine,
)

STATIONS = np.array([0.0, 100.0, 110.0, 200.0])
GRAIN = np.array([800.0, 0.0, 720.0])


def work(account, duration, *, unload_rate=0.0, room=1e9, spill=False, capacity=500.0, limit=1e9):
    return advance_combine(
        account, STATIONS, GRAIN, 2.0, limit, capacity, unload_rate, room, spill, duration
    )


def test_a_full_combine_stands_from_the_moment_its_tank_is_full():
    account = np.zeros(8)
    work(account, 100.0)
    # 8 kg/m at 2 m/s: 500 kg after 31.25 s and 62.5 m.
    assert account[[STATION, TANK, STOP_TIME]] == pytest.approx([62.5, 500.0, 68.75], rel=1e-12)
    assert account[MODE] == FULL


def test_a_combine_that_spills_goes_on_and_loses_what_is_cut_while_full():
    account = np.zeros(8)
    work(account, 200.0, spill=True)
    assert account[MODE] == DONE
    assert account[[TANK, LOST, CUT]] == pytest.approx([500.0, 1020.0, 1520.0], rel=1e-12)
    # Nothing spills between the two rows.
    assert account[OVERFLOW_TIME] == pytest.approx(100.0 - 31.25 - 5.0, rel=1e-12)


def test_an_auger_empties_a_tank_at_the_difference_of_the_rates():
    account = np.zeros(8)
    work(account, 25.0)
    given = work(account, 5.0, unload_rate=60.0)
    assert given == pytest.approx(300.0)
    assert account[TANK] == pytest.approx(400.0 - 5.0 * (60.0 - 16.0))
    # Emptied, it passes on what it cuts.
    given = work(account, 10.0, unload_rate=60.0)
    assert account[TANK] == 0.0
    assert given == pytest.approx(180.0 + 10.0 * 16.0)


def test_nothing_flows_into_a_full_cart():
    account = np.zeros(8)
    work(account, 25.0)
    assert work(account, 5.0, unload_rate=60.0, room=70.0) == 70.0
    assert account[TANK] == pytest.approx(400.0 + 5.0 * 16.0 - 70.0)


def test_a_combine_waits_at_its_limit():
    account = np.zeros(8)
    work(account, 30.0, limit=40.0)
    assert account[STATION] == 40.0


@given(
    steps=st.lists(
        st.tuples(st.floats(0.05, 20.0), st.sampled_from([0.0, 40.0, 90.0]), st.floats(0.0, 900.0)),
        min_size=1,
        max_size=30,
    ),
    spill=st.booleans(),
)
def test_grain_is_conserved_whatever_happens(steps, spill):
    account, given_away = np.zeros(8), 0.0
    for duration, rate, room in steps:
        given_away += work(account, duration, unload_rate=rate, room=room, spill=spill)
        assert 0.0 <= account[TANK] <= 500.0 * (1 + 1e-12)
        on_path = np.interp(account[STATION], STATIONS, [0.0, 800.0, 800.0, 1520.0])
        assert account[CUT] == pytest.approx(on_path, abs=1e-8)
    assert account[CUT] == pytest.approx(account[TANK] + account[LOST] + given_away, abs=1e-9)


@given(cuts=st.lists(st.floats(0.1, 0.9), min_size=1, max_size=6))
def test_the_result_does_not_depend_on_the_steps(cuts):
    whole, parts = np.zeros(8), np.zeros(8)
    given_whole = work(whole, 60.0, unload_rate=10.0)
    edges = np.concatenate([[0.0], np.sort(np.array(cuts)), [1.0]]) * 60.0
    given_parts = sum(work(parts, step, unload_rate=10.0) for step in np.diff(edges) if step > 0)
    assert parts[:MODE] == pytest.approx(whole[:MODE], abs=1e-7)
    assert given_parts == pytest.approx(given_whole, abs=1e-7)
