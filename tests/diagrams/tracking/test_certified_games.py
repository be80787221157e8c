"""Games of certified pursuers: they keep their word, whoever plays against them."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.diagrams.tracking.game import set_up_game
from sightfield.diagrams.tracking.make_tracking import MakeTracking
from sightfield.diagrams.tracking.report import write_report
from sightfield.diagrams.tracking.run import run_tracking
from sightfield.diagrams.tracking.scenario import Evaders, Pursuers, TrackingScenario
from sightfield.diagrams.tracking.summary import summarise
from sightfield.diagrams.world_source import WorldSource
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.arenas.random_arena import Arena, draw_arena

EVADERS = ("adversarial", "best_response", "optimal", "optimal_distance", "random_walk")


def make_scenario(world, policy="adversarial", seed=0, size=1, seconds=25.0, **pursuing):
    chasing = {"top_speed": 0.3, "count": size, "field": "certified", "grid": 0.2} | pursuing
    return TrackingScenario(
        world=WorldSource(
            boundary=world.boundary.tolist(),
            obstacles=[ring.tolist() for ring in world.obstacles],
        ),
        pursuers=Pursuers(**chasing),
        evaders=Evaders(top_speed=0.09, count=size, policies=[policy]),
        seconds=seconds,
        seed=seed,
    )


@pytest.fixture(scope="module")
def arenas():
    return [draw_arena(Arena(), seed) for seed in range(3)]


@pytest.mark.parametrize("policy", EVADERS)
def test_no_game_is_over_before_the_certificate(arenas, policy):
    promised = []
    for seed in range(12):
        world = arenas[seed % 3]
        run = run_tracking(set_up_game(make_scenario(world, policy, seed), world))
        certificate = run.log["certificate"][:, 0]
        end = run.tracking_time if run.lost_evader is not None else math.inf
        # At the start, and at every sample later on.
        stands = certificate > 0
        assert (run.times[stands] + certificate[stands] <= end + 1e-6).all()
        promised.append(certificate[0])
        # It runs down no faster than time does.
        assert (certificate[1:] >= certificate[:-1] - 0.05 - 1e-9).all()
    assert sum(promise > 0 for promise in promised) >= 6


@pytest.mark.parametrize("size", [2, 3])
def test_a_team_keeps_its_word_while_it_keeps_its_assignment(arenas, size):
    for seed in range(3):
        world = arenas[seed]
        scenario = make_scenario(world, "optimal_distance", seed, size)
        run = run_tracking(set_up_game(scenario, world))
        certificate, end = run.log["certificate"][:, 0], run.tracking_time
        changed = np.flatnonzero((np.diff(run.log["assignment"], axis=0) != 0).any(axis=1))
        until = run.times[changed[0]] if len(changed) else end
        if run.lost_evader is not None:
            assert end >= min(certificate[0], until) - 1e-6


def test_a_game_goes_on_from_a_copy_of_its_context_as_it_would_have_gone_on(arenas):
    scenario = make_scenario(arenas[0], "optimal", 4)
    diagram = MakeTracking(set_up_game(scenario, arenas[0]))
    simulator = Simulator(diagram)
    # In the midst of a commitment.
    simulator.AdvanceTo(1.0)
    copy = simulator.get_context().Clone()
    futures = []
    for context in (simulator.get_context(), copy):
        resumed = simulator if context is simulator.get_context() else Simulator(diagram, context)
        resumed.AdvanceTo(4.0)
        names = ("pursuer_position", "evader_position", "pursuer_velocity", "certificate")
        futures.append(np.concatenate([diagram.GetOutputPort(n).Eval(context) for n in names]))
    np.testing.assert_array_equal(*futures)


def test_a_run_says_what_was_certified_and_when_that_was_withdrawn(arenas, tmp_path):
    game = set_up_game(make_scenario(arenas[0], "adversarial", 3, seconds=6.0))
    run = run_tracking(game)
    summary = summarise(run, "certified")
    assert summary["certified"] is True
    assert summary["certificate_withdrawn"] == 0
    first = run.log["certificate"][0, 0]
    assert summary["certificate"] == (None if np.isinf(first) else first)
    assert "tracks.png" in write_report(run, summary, tmp_path)
    with np.load(tmp_path / "log.npz") as log:
        np.testing.assert_array_equal(log["certificate"], run.log["certificate"])
        assert set(log.files) == set(json.loads((tmp_path / "log_units.json").read_text()))
    # What is not certified cannot be withdrawn.
    scenario = make_scenario(arenas[0], "adversarial", 3, seconds=1.0, field="guarantee")
    other = summarise(run_tracking(set_up_game(scenario)), "guarantee")
    assert (other["certified"], other["certificate_withdrawn"]) == (False, None)
    # And without the solved game nothing is said.
    scenario = make_scenario(arenas[0], "adversarial", 3, seconds=1.0, field="margin")
    assert "certificate" not in summarise(run_tracking(set_up_game(scenario)), "margin")


def test_bodies_in_the_way_withdraw_the_certificate_for_that_moment(arenas):
    # Of a few dozen starts one where a pursuer has to make way in the midst of a commitment.
    scenario = make_scenario(arenas[0], "adversarial", 26, 2, 10.0, radius=0.15)
    scenario = replace(scenario, evaders=replace(scenario.evaders, radius=0.15))
    run = run_tracking(set_up_game(scenario, arenas[0]))
    summary = summarise(run, "bodies")
    assert summary["contacts"] == 0
    assert summary["assignment_changes"] == 0
    assert summary["certificate_withdrawn"] == 1
    # It goes on with less.
    kept = run.log["certificate"][:, 0]
    (at,) = np.flatnonzero(kept[1:] < kept[:-1] - 0.05 - 1e-9)
    assert 0.0 < kept[at + 1] < kept[at]


def test_what_cannot_be_certified_is_refused(arenas):
    with pytest.raises(InvalidInput, match="`model` must be point where the field is certified"):
        make_scenario(arenas[0], model="differential_drive")
