"""Three combines and a cart on a small field, to the last kilogram."""

import numpy as np
import pytest

from sightfield.diagrams.harvest import scenarios
from sightfield.diagrams.harvest.job import prepare_harvest
from sightfield.diagrams.harvest.run import run_harvest
from sightfield.diagrams.harvest.scenario import HarvestScenario
from sightfield.diagrams.harvest.summary import summarise
from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.systems.numerics.harvest.machines.alongside import STANDING

SMALL = [
    "field.width=240",
    "field.height=160",
    "combines.header_width=20",
    "combines.capacity=6000",
    "combines.spacing=90",
    "routes=car",
    "hours=0.5",
]


@pytest.fixture(scope="module")
def run():
    path = find_scenario("thesis_3", scenarios)
    return run_harvest(prepare_harvest(load_scenario(HarvestScenario, path, SMALL)))


@pytest.fixture(scope="module")
def summary(run):
    return summarise(run, "thesis_3")


def test_all_tanks_are_emptied_in_the_end(run, summary):
    assert summary["finished"]
    assert not run.log["tank"][-1].any()
    assert summary["grain_delivered"] == pytest.approx(summary["grain_harvested"], rel=1e-9)
    assert summary["grain_lost"] == 0.0


def test_no_crop_is_driven_over(summary):
    assert summary["crop_crossings"] == 0
    assert summary["min_cart_to_combine"] > 0.0


def test_a_trailer_is_never_folded_up(run):
    assert np.abs(run.log["state"][:, 0, 3]).max() < np.pi / 2


def test_a_combine_that_has_finished_can_be_reached_by_several_ways(run):
    job = run.job
    lead = job.lanes.lead
    for combine, path in enumerate(job.coverage.paths):
        numbers = job.lanes.numbers_at(combine, path.length)
        ways = [job.lanes.of[combine][number] for number in numbers]
        assert len(ways) > 1
        here = path.pose_at(path.length)[:2]
        for number, way in zip(numbers, ways, strict=True):
            place = job.lanes.place_at(combine, number, path.length)
            box = way.pose_at(place)
            x, y = box[:2] - lead * np.array([np.cos(box[2]), np.sin(box[2])])
            assert np.hypot(x - here[0], y - here[1]) <= STANDING * job.reach
