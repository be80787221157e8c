"""Plans that are driven, on time and late: all arrive, none comes near another."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.execution.advance import Disturbance, factor_at, pace_of
from sightfield.systems.numerics.harvest.execution.planned_work import LONGEST_CELL
from sightfield.systems.numerics.harvest.timing.conflicts import GAP

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


# What the audit of a run asks for [m].
LEAST = 0.3


def test_what_a_late_machine_may_slip_leaves_the_distance_that_is_asked_for():
    assert GAP - LONGEST_CELL >= LEAST - 1e-12


@pytest.mark.parametrize("kind", range(4))
def test_combines_that_nothing_disturbs_keep_their_plan_exactly(crew_of, combines_only, kind):
    work = combines_only(kind, np.random.default_rng(kind), 3)
    driven = crew_of(work).run()
    assert driven.arrived
    assert driven.times[-1] <= work.end + 0.5
    planned = np.stack([path.station_at(driven.times) for path in work.plans], axis=1)
    assert driven.stations == pytest.approx(planned, abs=1e-6)


@pytest.mark.parametrize("seed", range(8))
def test_late_combines_arrive_and_keep_their_distance(crew_of, combines_only, seed):
    rng = np.random.default_rng([3, seed])
    work = combines_only(seed % 4, rng, 2 + seed % 3)
    crew = crew_of(work)
    driven = crew.run(Disturbance(slowness=0.2, stops=6.0, seed=seed))
    assert driven.arrived
    audit = crew.audit(driven)
    assert audit.figures["min_combine_to_combine"] >= LEAST
    assert not [fault for fault in audit.faults if "acceleration" in fault.kind]
    rate = np.diff(driven.speeds, axis=0) / crew.step
    assert np.abs(rate).max() <= work.combines[0].acceleration + 1e-6
    # Nobody is ahead of the plan.
    planned = np.stack([path.station_at(driven.times) for path in work.plans], axis=1)
    assert (driven.stations <= planned + 1e-6).all()


def test_a_cart_and_its_combine_keep_their_plan_exactly(crew_of, served):
    crew = crew_of(served)
    driven = crew.run()
    assert driven.arrived
    planned = np.stack([path.station_at(driven.times) for path in served.timed], axis=1)
    assert driven.stations == pytest.approx(planned, abs=1e-6)
    grain = served.grain[0][-1]
    assert driven.delivered[-1] == pytest.approx(grain, abs=1e-6)
    assert driven.lost.max() == 0.0


@pytest.mark.parametrize("seed", range(3))
def test_late_machines_lose_no_grain_and_meet_for_all_visits(crew_of, served, seed):
    crew = crew_of(served)
    driven = crew.run(Disturbance(slowness=0.2, stops=6.0, seed=seed))
    assert driven.arrived
    assert driven.lost.max() == 0.0
    assert driven.tank.max() <= served.combines[0].capacity
    held = driven.tank.sum(axis=1) + driven.load.sum(axis=1) + driven.delivered
    assert held == pytest.approx(driven.cut.sum(axis=1), abs=1e-6)
    assert driven.delivered[-1] == pytest.approx(served.grain[0][-1], abs=1e-6)
    audit = crew.audit(driven)
    assert audit.figures["min_cart_to_combine"] >= LEAST
    assert not [fault for fault in audit.faults if "acceleration" in fault.kind]
    rates = np.abs(np.diff(driven.speeds, axis=0)).max(axis=0) / crew.step
    assert (rates <= crew.fleet.brakes + 1e-6).all()
