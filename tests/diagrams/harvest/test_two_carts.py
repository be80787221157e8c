"""Two carts that share a field, and one of little room that drives to its truck again and again."""

import numpy as np
import pytest

from sightfield.diagrams.harvest.job import prepare_harvest
from sightfield.diagrams.harvest.run import run_harvest
from sightfield.diagrams.harvest.scenario import Carts, Combines, FieldSource, HarvestScenario
from sightfield.diagrams.harvest.summary import summarise

SMALL = HarvestScenario(
    field=FieldSource(width=200.0, height=200.0),
    density=0.6,
    combines=Combines(count=4, capacity=12_000.0, unload_rate=150.0, spacing=60.0, least_gap=30.0),
    carts=Carts(count=2, capacity=40_000.0),
    routes="car",
    period=0.5,
    fill=0.8,
    hours=1.0,
)


@pytest.fixture(scope="module")
def run():
    return run_harvest(prepare_harvest(SMALL))


@pytest.fixture(scope="module")
def summary(run):
    return summarise(run, "small")


def test_all_grain_comes_to_the_trucks(summary):
    assert summary["finished"]
    assert summary["harvested_area_fraction"] >= 0.99
    assert summary["grain_lost"] == 0.0
    assert summary["grain_delivered"] == pytest.approx(summary["grain_harvested"], rel=1e-9)
    assert abs(summary["grain_error"]) <= 1e-9 * summary["grain_harvested"]


def test_carts_keep_apart_and_off_the_crop(summary):
    assert summary["crop_crossings"] == 0
    assert summary["min_cart_to_cart"] > 0.5
    assert summary["min_cart_to_combine"] > 0.0


def test_each_cart_serves_combines_that_follow_one_another(run):
    served = [
        {visit.combine for visit in run.job.timetable.of_cart(k)}
        for k in range(run.job.scenario.carts.count)
    ]
    assert sorted(n for group in served for n in group) == list(range(4))
    assert all(max(group) - min(group) == len(group) - 1 for group in served)


def test_routes_are_told_by_kind_and_compared_with_what_no_path_can_beat(run, summary):
    assert sum(summary["routes"].values()) == len(run.routes)
    assert summary["routes"]["car"] > 0
    assert summary["route_time_ratio_median"] >= 1.0 - 1e-9
    assert summary["route_time_ratio_worst"] >= summary["route_time_ratio_median"]


@pytest.mark.parametrize("strategy", ["sequential", "on-demand"])
def test_a_cart_of_little_room_brings_all_grain_to_its_truck(strategy):
    scenario = HarvestScenario(
        field=FieldSource(width=140.0, height=100.0),
        density=0.5,
        combines=Combines(count=2, capacity=2500.0, unload_rate=60.0),
        carts=Carts(capacity=4000.0),
        strategy=strategy,
        routes="car",
        period=0.5,
        hours=0.6,
    )
    run = run_harvest(prepare_harvest(scenario))
    assert run.finished
    assert run.delivered.sum() == pytest.approx(summarise(run, strategy)["grain_harvested"])
    loads = run.log["load"][:, 0]
    assert loads.max() <= 4000.0 * (1 + 1e-9)
    trips = np.diff((np.diff(loads) < 0).astype(int)) == 1
    assert trips.sum() >= 2
