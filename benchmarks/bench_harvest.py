"""How long a season's field takes to plan and to simulate, and how the two strategies fare."""

import time

import pytest
from pydrake.geometry import Meshcat

from sightfield.diagrams.harvest import scenarios
from sightfield.diagrams.harvest.job import prepare_harvest
from sightfield.diagrams.harvest.run import run_harvest
from sightfield.diagrams.harvest.scenario import HarvestScenario
from sightfield.diagrams.harvest.summary import summarise
from sightfield.diagrams.scenario_files import find_scenario, load_scenario

pytestmark = pytest.mark.benchmarks

# What a season's simulation may take [s].
TARGET = 60.0

# For the strategies: fields, combines and their tanks.
FIELDS = {
    "140 x 100 m, 2 combines": ("thesis_2", ["field.width=140", "field.height=100"]),
    "thesis field, 2 combines": ("thesis_2", []),
    "thesis field, 3 combines": ("thesis_3", []),
}


def scenario_of(name, *settings):
    return load_scenario(HarvestScenario, find_scenario(name, scenarios), list(settings))


@pytest.fixture(scope="module")
def compiled():
    small = scenario_of("thesis_2", "field.width=120", "field.height=90", "routes=car")
    run_harvest(prepare_harvest(small))


@pytest.mark.parametrize("drawn", [False, True])
def test_a_season(compiled, drawn):
    began = time.process_time()
    job = prepare_harvest(scenario_of("season"))
    planned = time.process_time()
    run = run_harvest(job, Meshcat() if drawn else None, recording=drawn)
    took = time.process_time() - planned
    numbers = summarise(run, "season")
    print(
        f"\n{numbers['field_area'] / 1e4:.0f} ha, {numbers['combines']} combines, "
        f"{numbers['carts']} carts, {'recorded for a replay' if drawn else 'nothing drawn'}: "
        f"planned in {planned - began:.1f} s, {numbers['makespan']:.0f} s simulated in "
        f"{took:.1f} s of CPU, {numbers['makespan'] / took:.0f} times as fast as the work, "
        f"{TARGET / took:.2f} times as fast as the target; "
        f"{numbers['harvested_area_fraction']:.2%} harvested, {numbers['grain_lost']:.0f} kg lost, "
        f"combines stood full {numbers['combine_stop_time']:.0f} s, "
        f"waited {numbers['combine_wait_time']:.0f} s; "
        f"loads off plan by {numbers['load_deviation']:.3f} tanks"
    )
    assert numbers["finished"]
    assert numbers["grain_lost"] == 0.0


@pytest.mark.parametrize("field", FIELDS)
def test_both_strategies(field):
    name, settings = FIELDS[field]
    told = []
    for strategy in ("sequential", "on-demand"):
        job = prepare_harvest(scenario_of(name, *settings, f"strategy={strategy}"))
        numbers = summarise(run_harvest(job), name)
        assert numbers["finished"]
        told.append(
            f"{strategy} {numbers['makespan']:.0f} s, "
            f"cart idle {numbers['cart_idle_fraction']:.0%}, "
            f"stood full {numbers['combine_stop_time']:.0f} s, "
            f"{sum(numbers['routes'].values())} routes"
        )
    print(f"\n{field}: " + "; ".join(told))
