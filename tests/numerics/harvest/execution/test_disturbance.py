"""Slowness and stops: as stated, and the same whenever they are asked for."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.execution.disturbance import (
    Disturbance,
    factor_at,
    pace_of,
)

HOURS = 60


def factors(machine, *, hours=HOURS, every=1.0, **values):
    """Factors of a machine, by default every second."""
    pace = pace_of(Disturbance(**values))
    return np.array([factor_at(pace, machine, t) for t in np.arange(0.0, 3600.0 * hours, every)])


def test_speeds_are_off_by_up_to_the_slowness_and_evenly():
    found = factors(3, slowness=0.2, seed=5, every=15.0)
    assert found.min() >= 0.8
    assert found.max() <= 1.0
    assert np.mean(found) == pytest.approx(0.9, abs=0.003)
    assert np.percentile(found, 25) == pytest.approx(0.85, abs=0.005)


def test_stops_come_as_often_and_last_as_long_as_stated():
    stands = factors(1, stops=3.0, longest_stop=120.0, seed=2) == 0.0
    edges = np.diff(np.concatenate([[0], stands, [0]]))
    begins, ends = np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)
    lasting = ends - begins
    assert len(begins) / HOURS == pytest.approx(3.0, rel=0.25)
    # Two stops may touch.
    assert np.percentile(lasting, 98) <= 121
    assert lasting.mean() == pytest.approx(60.0, rel=0.2)


def test_machines_and_seeds_differ_and_the_same_is_the_same():
    one = factors(0, slowness=0.2, stops=2.0, hours=1)
    assert (one == factors(0, slowness=0.2, stops=2.0, hours=1)).all()
    assert (one != factors(1, slowness=0.2, stops=2.0, hours=1)).mean() > 0.5
    assert (one != factors(0, slowness=0.2, stops=2.0, seed=1, hours=1)).mean() > 0.5


def test_without_a_disturbance_all_are_at_their_speed():
    assert Disturbance().is_none
    assert not Disturbance(stops=1.0).is_none
    assert factor_at(pace_of(Disturbance()), 0, 100.0) == 1.0


@pytest.mark.parametrize(
    "values",
    [
        {"fails_at": -1.0},
        {"failing_cart": -2},
        {"slowness": 1.0},
        {"slowness": -0.1},
        {"stops": 7.0},
        {"longest_stop": 601.0},
        {"seed": -1},
    ],
)
def test_what_cannot_be_is_refused(values):
    with pytest.raises(InvalidInput):
        Disturbance(**values)
