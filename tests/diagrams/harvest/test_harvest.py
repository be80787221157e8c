"""Harvests from the first metre to the last kilogram."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from sightfield.diagrams.commands.app import make_app
from sightfield.diagrams.harvest import scenarios
from sightfield.diagrams.harvest.job import prepare_harvest
from sightfield.diagrams.harvest.run import run_harvest
from sightfield.diagrams.harvest.scenario import HarvestScenario
from sightfield.diagrams.harvest.summary import summarise
from sightfield.diagrams.scenario_files import builtin_scenarios, find_scenario, load_scenario
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.audit.harvest_log import read_harvest


@pytest.fixture(scope="module")
def thesis_run():
    scenario = load_scenario(HarvestScenario, find_scenario("thesis_2", scenarios))
    return run_harvest(prepare_harvest(scenario))


@pytest.fixture(scope="module")
def thesis_summary(thesis_run):
    return summarise(thesis_run, "thesis_2")


def test_the_field_of_the_thesis_is_harvested(thesis_summary):
    assert thesis_summary["finished"]
    assert thesis_summary["harvested_area_fraction"] >= 0.99


def test_grain_is_conserved(thesis_summary):
    harvested = thesis_summary["grain_harvested"]
    assert harvested == pytest.approx(110_000.0 * 0.5, rel=0.01)
    assert abs(thesis_summary["grain_error"]) <= 1e-9 * harvested
    assert thesis_summary["grain_delivered"] == pytest.approx(harvested, rel=1e-9)


def test_nothing_is_lost_and_nobody_stands_full_when_the_schedule_is_feasible(thesis_summary):
    assert thesis_summary["feasible"]
    assert thesis_summary["grain_lost"] == 0.0
    assert thesis_summary["overflow_time"] == 0.0
    assert thesis_summary["combine_stop_time"] == 0.0


def test_the_cart_drives_over_no_crop_and_into_no_combine(thesis_summary):
    assert thesis_summary["crop_crossings"] == 0
    assert thesis_summary["min_cart_to_combine"] > 0.0


def test_no_tank_holds_more_than_it_can(thesis_run):
    capacity = thesis_run.job.scenario.combines.capacity
    assert thesis_run.log["tank"].max() <= capacity * (1 + 1e-12)


def test_tanks_follow_the_planned_diagram(thesis_run, thesis_summary):
    """Three percent of a tank on the mean of the whole run; to the kilogram for the first lap."""
    assert thesis_summary["load_deviation"] < 0.03
    early = thesis_run.times < 400.0
    planned = thesis_run.job.timetable.tanks[0](thesis_run.times[early])
    assert thesis_run.log["tank"][early, 0] == pytest.approx(planned, abs=20.0)


@pytest.mark.parametrize("name", builtin_scenarios(scenarios))
def test_every_scenario_that_comes_along_is_valid(name):
    load_scenario(HarvestScenario, find_scenario(name, scenarios))


def test_an_unknown_key_is_named():
    path = find_scenario("thesis_2", scenarios)
    with pytest.raises(InvalidInput, match=r"combines\.tanks"):
        load_scenario(HarvestScenario, path, ["combines.tanks=3"])


SMALL = (
    "--set=field.width=120",
    "--set=field.height=90",
    "--set=combines.header_width=9",
    "--set=combines.turning_radius=6",
    "--set=combines.capacity=3000",
    "--set=routes=car",
    "--set=hours=0.1",
)


@pytest.mark.parametrize("strategy", ["sequential", "on-demand"])
def test_the_command_writes_its_report_and_prints_json(tmp_path, strategy):
    out = tmp_path / "out"
    words = ["harvest", "thesis_2", *SMALL, "--strategy", strategy, "--out", str(out), "--json"]
    result = CliRunner().invoke(make_app(), words, catch_exceptions=False)
    assert result.exit_code == 0
    summary = json.loads(result.stdout)
    assert summary["strategy"] == strategy
    assert summary["makespan"] == pytest.approx(360.0)
    assert abs(summary["grain_error"]) <= 1e-9 * summary["grain_harvested"]
    names = {"summary.json", "log.npz", "log_units.json", "loads.png", "field.png", "replay.html"}
    assert {path.name for path in out.iterdir()} == names | {"machines.json"}
    log, site = read_harvest(out)
    assert np.diff(log.time).max() <= 0.5
    assert (len(site.combines), len(site.carts), site.margin) == (2, 1, 12.0)
    assert site.parts[0].boundary.area == pytest.approx(120 * 90)
    grain = log.tank[-1].sum() + log.cart_load[-1].sum() + log.delivered[-1]
    assert grain == pytest.approx(summary["grain_harvested"], rel=1e-9)


def test_a_header_wider_than_the_field_is_refused():
    words = ["harvest", "thesis_2", "--set=combines.header_width=500"]
    with pytest.raises(InvalidInput, match="header"):
        CliRunner().invoke(make_app(), words, catch_exceptions=False)
