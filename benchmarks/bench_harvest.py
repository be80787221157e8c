"""How long a harvest takes to plan, to simulate and to audit, and how the two strategies fare."""

import time

import pytest
from pydrake.geometry import Meshcat

from sightfield.diagrams.harvest import scenarios
from sightfield.diagrams.harvest.job import prepare_harvest
from sightfield.diagrams.harvest.report import summarise_harvest
from sightfield.diagrams.harvest.run import run_harvest
from sightfield.diagrams.harvest.scenario import HarvestScenario
from sightfield.diagrams.scenario_files import find_scenario, load_scenario

pytestmark = pytest.mark.benchmarks

# Scenarios, with what a plan with its audit, and a simulation, may take [s].
TARGETS = {"thesis_2": (10.0, 60.0), "thesis_3": (10.0, 60.0), "season": (60.0, 60.0)}


def scenario_of(name, *settings):
    return load_scenario(HarvestScenario, find_scenario(name, scenarios), list(settings))


@pytest.fixture(scope="module")
def compiled():
    settings = ("field.width=200", "field.height=150", "combines.header_width=12", "hours=0.1")
    small = scenario_of("thesis_2", *settings)
    run_harvest(prepare_harvest(small))


def timed(work):
    """What comes of some work, and the CPU time that it takes [s]."""
    began = time.process_time()
    found = work()
    return found, time.process_time() - began


@pytest.mark.parametrize(("name", "drawn"), [*((n, False) for n in TARGETS), ("season", True)])
def test_a_scenario(compiled, name, drawn):
    page = Meshcat() if drawn else None
    job, planned = timed(lambda: prepare_harvest(scenario_of(name)))
    run, simulated = timed(lambda: run_harvest(job, page, recording=drawn))
    numbers, audited = timed(lambda: summarise_harvest(run, name))
    most_planned, most_simulated = TARGETS[name]
    print(
        f"\n{name}, {numbers['field_area'] / 1e4:.0f} ha, {numbers['combines']} combines, "
        f"{numbers['carts']} carts, {'recorded for a replay' if drawn else 'nothing drawn'}: "
        f"planned in {planned:.1f} s of CPU, audited in {audited:.1f} s, together "
        f"{most_planned / (planned + audited):.2f} times as fast as the target; "
        f"{numbers['makespan']:.0f} s simulated in {simulated:.1f} s, "
        f"{most_simulated / simulated:.2f} times as fast as the target; "
        f"makespan over bound {numbers['makespan_over_bound']:.2f}, "
        f"waiting {numbers['waiting']:.1%}, stops {numbers['combine_stop_time']:.0f} s, "
        f"{numbers['unloads_missed']} of {numbers['unloads']} unloads missed"
    )
    assert numbers["finished"]
    assert numbers["audit_faults"] == 0
    assert numbers["grain_lost"] == 0.0


@pytest.mark.parametrize("name", ["thesis_2", "thesis_3"])
def test_both_strategies(compiled, name):
    told = []
    for strategy in ("sequential", "on-demand"):
        job = prepare_harvest(scenario_of(name, f"strategy={strategy}"))
        numbers = summarise_harvest(run_harvest(job), name)
        assert numbers["finished"]
        told.append(
            f"{strategy} {numbers['makespan']:.0f} s, "
            f"cart idle {numbers['cart_idle_fraction']:.0%}, "
            f"combines stood for it {numbers['combine_stop_time']:.0f} s"
        )
    print(f"\n{name}: " + "; ".join(told))
