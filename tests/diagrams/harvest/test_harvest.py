"""Harvests from the first metre to the last kilogram."""

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from sightfield.diagrams.commands.app import make_app
from sightfield.diagrams.harvest import scenarios
from sightfield.diagrams.harvest.job import prepare_harvest
from sightfield.diagrams.harvest.run import STILL, run_harvest
from sightfield.diagrams.harvest.scenario import HarvestScenario
from sightfield.diagrams.harvest.summary import planned_tanks, summarise
from sightfield.diagrams.scenario_files import builtin_scenarios, find_scenario, load_scenario
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.audit.audit import audit_harvest
from sightfield.systems.numerics.harvest.audit.harvest_log import read_harvest

SMALL = [
    "field.width=120",
    "field.height=90",
    "combines.header_width=9",
    "combines.turning_radius=6",
    "combines.capacity=3000",
]


@pytest.fixture(scope="module")
def run():
    scenario = load_scenario(HarvestScenario, find_scenario("thesis_2", scenarios))
    return run_harvest(prepare_harvest(scenario))


@pytest.fixture(scope="module")
def summary(run):
    return summarise(run, "thesis_2")


@pytest.fixture(scope="module")
def small_job():
    scenario = load_scenario(HarvestScenario, find_scenario("thesis_2", scenarios), SMALL)
    return prepare_harvest(scenario)


def test_the_field_of_the_thesis_is_harvested_and_the_audit_passes(summary):
    assert summary["finished"]
    assert summary["stopped"] == ""
    assert summary["audit_faults"] == 0
    assert summary["coverage"] >= 0.995
    assert summary["min_combine_to_combine"] >= 0.3
    assert summary["min_cart_to_combine"] >= 0.3
    assert summary["min_cart_to_cart"] is None
    assert summary["min_to_obstacle"] is None
    assert summary["crop_under_bodies"] <= 0.002 * summary["field_area"]


def test_grain_is_conserved_and_all_of_it_delivered(summary):
    harvested = summary["grain_harvested"]
    assert harvested == pytest.approx(110_000.0 * 0.5, rel=0.005)
    assert abs(summary["grain_error"]) <= 1e-9 * harvested
    assert summary["grain_delivered"] == pytest.approx(harvested, rel=1e-9)
    assert summary["grain_lost"] == summary["overflow_time"] == 0.0


def test_two_combines_hardly_wait_and_are_not_much_longer_than_full_headers(summary):
    assert summary["feasible"]
    assert 1.0 < summary["path_over_bound"] < 1.3
    assert 1.0 < summary["makespan_over_bound"] < 1.5
    assert summary["waiting"] <= 0.03
    assert summary["unloads"] >= 4
    assert summary["trips"] >= 1


def test_tanks_follow_the_plan_and_none_holds_more_than_it_can(run, summary):
    assert summary["load_deviation"] < 0.01
    assert summary["latest"] < 1.0
    assert run.log["tank"].max() <= run.job.scenario.combines.capacity * (1 + 1e-9)
    assert planned_tanks(run)[-1].max() < 10.0


def test_machines_are_where_the_plan_has_them(run):
    for n, plan in enumerate(run.job.plan.service.plans):
        np.testing.assert_allclose(run.log["pose"][:, n], plan.pose_at(run.times), atol=0.5)
    for k, motion in enumerate(run.job.plan.service.motions):
        off = run.log["state"][:, k, :2] - motion.timed.pose_at(run.times)[:, :2]
        assert np.hypot(*off.T).max() < 0.5


@pytest.mark.parametrize("name", builtin_scenarios(scenarios))
def test_every_scenario_that_comes_along_is_valid(name):
    load_scenario(HarvestScenario, find_scenario(name, scenarios))


@pytest.mark.parametrize(
    ("setting", "named"),
    [
        ("combines.tanks=3", r"combines\.tanks"),
        ("disturbance.slow=1", r"disturbance\.slow"),
        ("disturbance.slowness=2", "slowness"),
        ("pattern=spiral", "pattern"),
        ("period=0.8", "period"),
        ("carts.count=0", "count"),
    ],
)
def test_a_setting_that_cannot_be_is_named(setting, named):
    path = find_scenario("thesis_2", scenarios)
    with pytest.raises(InvalidInput, match=named):
        load_scenario(HarvestScenario, path, [setting])


def command(*words):
    return CliRunner().invoke(make_app(), ["harvest", *words], catch_exceptions=False)


def test_the_command_writes_its_report_and_prints_json(tmp_path):
    out = tmp_path / "out"
    words = [f"--set={each}" for each in SMALL]
    result = command("thesis_2", *words, "--strategy=on-demand", "--out", str(out), "--json")
    assert result.exit_code == 0
    summary = json.loads(result.stdout)
    assert summary["strategy"] == "on-demand"
    assert summary["finished"]
    names = {"summary.json", "log.npz", "log_units.json", "loads.png", "field.png", "replay.html"}
    assert {path.name for path in out.iterdir()} == names | {"machines.json"}
    log, site = read_harvest(out)
    assert np.diff(log.time).max() <= 0.5
    assert (len(site.combines), len(site.carts), site.margin) == (2, 1, 12.0)
    assert site.parts[0].boundary.area == pytest.approx(120 * 90)
    audit = audit_harvest(log, site)
    assert audit.faults == ()
    for name in ("min_cart_to_combine", "min_combine_to_combine", "crop_under_bodies"):
        assert audit.figures[name] == pytest.approx(summary[name], abs=1e-9)
    assert log.delivered[-1] == pytest.approx(summary["grain_harvested"], rel=1e-9)


def test_where_there_is_no_plan_the_command_exits_with_1_and_says_why():
    result = command("thesis_2", "--set=combines.turning_radius=200", "--json")
    assert result.exit_code == 1
    assert result.stdout == ""
    assert result.stderr.startswith("no plan: ")
    assert "200 m" in result.stderr
    assert len(result.stderr.splitlines()) == 1


def test_more_combines_than_there_is_work_for_are_refused_not_dropped():
    result = command("thesis_2", "--combines=500", "--json")
    assert result.exit_code == 1
    assert "room for 500 combines" in result.stderr
    assert "a combine has nothing to cut" in result.stderr


def test_a_run_that_does_not_finish_exits_with_1_and_says_who_is_where():
    words = [f"--set={each}" for each in [*SMALL, "hours=0.05"]]
    result = command("thesis_2", *words, "--json")
    assert result.exit_code == 1
    summary = json.loads(result.stdout)
    assert not summary["finished"]
    assert summary["stopped"].startswith("the time is up after 180 s; combine 0 is at (")
    assert result.stderr == f"not finished: {summary['stopped']}\n"


def test_a_run_in_which_nothing_moves_any_more_ends(small_job):
    """Nobody empties the combines: they stand with their grain."""
    service = replace(small_job.plan.service, visits=[])
    job = replace(small_job, plan=replace(small_job.plan, service=service))
    run = run_harvest(job)
    assert not run.finished
    assert run.stopped.startswith("nothing has moved since ")
    assert "combine 1 is at (" in run.stopped
    since = float(run.stopped.split(" s;")[0].split()[-1])
    assert STILL <= run.makespan - since <= STILL + 20.0
    assert run.log["tank"].max() <= 3000.0 * (1 + 1e-9)


def test_a_disturbed_run_is_later_and_keeps_the_order(small_job):
    asked = replace(small_job.scenario.disturbance, slowness=0.2, stops=6.0, seed=3)
    job = replace(small_job, scenario=replace(small_job.scenario, disturbance=asked))
    summary = summarise(run_harvest(job), "late")
    assert summary["finished"]
    assert summary["audit_faults"] == 0
    assert summary["latest"] > 20.0
    assert summary["makespan"] > small_job.plan.makespan + 20.0
