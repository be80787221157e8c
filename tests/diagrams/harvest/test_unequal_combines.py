"""A harvest with combines that differ, as planned and as simulated."""

import numpy as np
import pytest

from sightfield.harvest import (
    Carts,
    Combines,
    FieldSource,
    HarvestScenario,
    OneCombine,
    Trucks,
    draw_tank_loads,
    find_what_it_takes,
    prepare_harvest,
    run_harvest,
    summarise_harvest,
)
from sightfield.systems.numerics.harvest.machines import CUT

SCENARIO = HarvestScenario(
    field=FieldSource(width=200.0, height=130.0),
    combines=Combines(
        count=2,
        each=(
            OneCombine(speed=1.0, capacity=3500.0, unload_rate=70.0),
            OneCombine(speed=2.0, capacity=9000.0, engine_power=350e3, mass=20000.0),
        ),
    ),
    carts=Carts(capacity=12000.0),
    trucks=Trucks(count=1, capacity=20000.0, road_time=600.0),
)


@pytest.fixture(scope="module")
def run():
    return run_harvest(prepare_harvest(SCENARIO))


def test_it_goes_as_planned(run):
    found = summarise_harvest(run, "unequal")
    assert found["finished"]
    assert found["audit_faults"] == 0
    assert found["grain_lost"] == 0
    assert found["grain_error"] == pytest.approx(0.0, abs=1e-6)
    assert found["makespan"] == pytest.approx(found["makespan_planned"], rel=0.02)
    assert found["load_deviation"] <= 0.02


def test_tanks_and_speeds_are_those_of_each_combine(run):
    capacities = np.array([3500.0, 9000.0])
    assert (run.log["tank"].max(axis=0) <= capacities * (1 + 1e-9)).all()
    assert run.log["tank"][:, 1].max() > capacities[0]
    fastest = np.abs(run.log["speed"]).max(axis=0)
    assert fastest == pytest.approx([1.0, 2.0], rel=0.01)
    cut = run.account[:, CUT]
    assert 1.3 < cut[1] / cut[0] < 3.0


def test_each_tank_is_drawn_up_to_its_own_size(run):
    rows = draw_tank_loads(run).axes[:2]
    assert [row.get_ylim()[1] for row in rows] == pytest.approx([1.08 * 3.5, 1.08 * 9.0])


def test_teams_of_the_table_begin_with_those_that_are_told_apart():
    answer = find_what_it_takes(SCENARIO, most=(3, 1, 1))
    assert answer.table is not None
    times = [answer.table.row(count, 1, 1).makespan for count in (1, 2, 3)]
    # The first is the slow one, the third as any other.
    assert times[1] < 0.6 * times[0]
    assert SCENARIO.combines.machines(3)[2] == SCENARIO.combines.machines(5)[4]
    assert answer.table.row(2, 1, 1).combine_fuel == pytest.approx(
        answer.figures.combine_fuel, rel=0.1
    )
