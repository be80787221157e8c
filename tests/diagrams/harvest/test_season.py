"""A season's field: 100 ha, six combines, two carts."""

import numpy as np
import pytest

from sightfield.diagrams.harvest import scenarios
from sightfield.diagrams.harvest.job import prepare_harvest
from sightfield.diagrams.harvest.run import run_harvest
from sightfield.diagrams.harvest.scenario import HarvestScenario
from sightfield.diagrams.harvest.summary import summarise
from sightfield.diagrams.scenario_files import find_scenario, load_scenario


@pytest.fixture(scope="module")
def progress():
    return []


@pytest.fixture(scope="module")
def run(progress):
    scenario = load_scenario(HarvestScenario, find_scenario("season", scenarios))
    return run_harvest(prepare_harvest(scenario), progress=progress.append)


@pytest.fixture(scope="module")
def summary(run):
    return summarise(run, "season")


def test_the_field_is_harvested_and_nothing_is_lost(summary):
    assert summary["finished"]
    assert summary["field_area"] == pytest.approx(1e6)
    assert (summary["combines"], summary["carts"]) == (6, 2)
    assert summary["harvested_area_fraction"] > 0.999
    assert summary["grain_lost"] == 0.0
    assert summary["grain_delivered"] == pytest.approx(summary["grain_harvested"], rel=1e-9)
    assert summary["crop_crossings"] == 0


def test_combines_cut_most_of_the_time(run, summary):
    ways = np.array([path.length for path in run.job.coverage.paths])
    work = ways.sum() / run.job.scenario.combines.speed
    assert summary["combine_wait_time"] < 0.05 * work
    assert summary["combine_stop_time"] < 0.01 * work


def test_loads_follow_the_plan(summary):
    assert summary["load_deviation"] < 0.05


def test_progress_is_told_all_along(progress):
    assert len(progress) > 1000
    assert (np.diff(progress) >= 0.0).all()
    assert progress[-1] == pytest.approx(1.0)
