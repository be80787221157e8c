"""Plans that are driven, on time and late: all arrive, none comes near another."""

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.execution.disturbance import Disturbance
from sightfield.systems.numerics.harvest.execution.planned_work import LONGEST_CELL
from sightfield.systems.numerics.harvest.timing.conflicts import GAP

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
