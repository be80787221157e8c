"""How fast the tracking diagram runs."""

import time
from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.tracking.game import set_up_game, with_random_starts
from sightfield.diagrams.tracking.make_tracking import MakeTracking
from sightfield.diagrams.tracking.scenario import TrackingScenario
from sightfield.diagrams.visuals.live_page import open_live_page
from sightfield.diagrams.world_source import WorldSource

pytestmark = pytest.mark.benchmarks


def rate(diagram, seconds, rounds):
    """Simulated seconds per second, and per second of CPU time, which a busy machine does not lower
    as much; medians over the rounds of one simulation."""
    simulator = Simulator(diagram)
    simulator.AdvanceTo(1.0)
    rates = np.empty((rounds, 2))
    for k in range(rounds):
        began = np.array([time.perf_counter(), time.process_time()])
        simulator.AdvanceTo(1.0 + (k + 1) * seconds)
        ended = np.array([time.perf_counter(), time.process_time()])
        rates[k] = seconds / (ended - began)
    return np.median(rates, axis=0)


def said(rates):
    """Both rates in words."""
    return f"{rates[0]:.0f} simulated seconds per second, {rates[1]:.0f} per second of CPU time"


@pytest.mark.parametrize("model", ["point", "differential_drive"])
def test_four_against_four_in_the_thesis_arena(model):
    settings = [f"{team}.model={model}" for team in ("pursuers", "evaders")]
    scenario = load_scenario(TrackingScenario, find_scenario("thesis_4v3"), settings)
    scenario = replace(
        scenario, evaders=replace(scenario.evaders, positions=[], headings=[], count=4)
    )
    diagram = MakeTracking(with_random_starts(scenario))
    print(f"\n4 against 4, {model}: {said(rate(diagram, 20.0, 9))}")


def test_twenty_against_twenty_with_a_page_open(polygon_world):
    world = polygon_world(200)
    scenario = load_scenario(TrackingScenario, find_scenario("thesis_4v3"))
    scenario = replace(
        scenario,
        world=WorldSource(
            boundary=world.boundary.tolist(), obstacles=[ring.tolist() for ring in world.obstacles]
        ),
        pursuers=replace(
            scenario.pursuers, positions=[], headings=[], count=20, radius=0.05, model="point"
        ),
        evaders=replace(
            scenario.evaders, positions=[], headings=[], count=20, radius=0.05, model="point"
        ),
    )
    game = set_up_game(scenario)
    bare = rate(MakeTracking(game), 5.0, 5)
    drawn = rate(MakeTracking(game, open_live_page()), 5.0, 5)
    print(
        f"\n20 against 20, {world.vertex_count} vertices: {said(bare)}; with Meshcat open "
        f"{said(drawn)}"
    )


def test_four_that_look_ahead_against_four():
    settings = [f"{team}.model=point" for team in ("pursuers", "evaders")]
    settings.append("pursuers.field=lookahead")
    scenario = load_scenario(TrackingScenario, find_scenario("thesis_4v3"), settings)
    scenario = replace(
        scenario, evaders=replace(scenario.evaders, positions=[], headings=[], count=4)
    )
    diagram = MakeTracking(with_random_starts(scenario))
    print(f"\n4 against 4, lookahead: {said(rate(diagram, 5.0, 9))}")


def test_four_that_play_by_the_solved_game_against_four():
    settings = [f"{team}.model=point" for team in ("pursuers", "evaders")]
    settings += ["pursuers.field=guarantee", "pursuers.assignment=guarantee"]
    scenario = load_scenario(TrackingScenario, find_scenario("thesis_4v3"), settings)
    scenario = replace(
        scenario,
        pursuers=replace(scenario.pursuers, hold="certificate"),
        evaders=replace(scenario.evaders, positions=[], headings=[], count=4),
    )
    for policy in ("adversarial", "optimal_distance"):
        evaders = replace(scenario.evaders, policies=[policy])
        diagram = MakeTracking(with_random_starts(replace(scenario, evaders=evaders)))
        print(f"\n4 against 4 {policy}, guarantee: {said(rate(diagram, 10.0, 9))}")
