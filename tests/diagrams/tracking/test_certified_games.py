"""Games of certified pursuers: they keep their word, whoever plays against them."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.diagrams.tracking.game import set_up_game
from sightfield.diagrams.tracking.make_tracking import MakeTracking
from sightfield.diagrams.tracking.promises import audit_promises
from sightfield.diagrams.tracking.report import summarise_tracking, write_tracking_report
from sightfield.diagrams.tracking.run import run_tracking
from sightfield.diagrams.tracking.scenario import Evaders, Pursuers, TrackingScenario
from sightfield.diagrams.tracking.solved_game import solved_game
from sightfield.diagrams.world_source import WorldSource
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.random_arena import Arena, draw_arena
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.visibility_game.bounds import (
    turning_margin,
    turning_time,
)
from sightfield.systems.tracking.certified_pursuit import CertifiedPursuit

EVADERS = ("adversarial", "best_response", "optimal", "optimal_distance", "random_walk")


def make_scenario(world, policy="adversarial", seed=0, size=1, seconds=25.0, **pursuing):
    chasing = {"top_speed": 0.3, "count": size, "field": "certified", "grid": 0.25} | pursuing
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
    for seed in range(6):
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
    assert sum(promise > 0 for promise in promised) >= 3


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
    summary = summarise_tracking(run, "certified")
    assert summary["certified"] is True
    assert summary["certificate_withdrawn"] == 0
    first = run.log["certificate"][0, 0]
    assert summary["certificate"] == (None if np.isinf(first) else first)
    assert "tracks.png" in write_tracking_report(run, summary, tmp_path)
    with np.load(tmp_path / "log.npz") as log:
        np.testing.assert_array_equal(log["certificate"], run.log["certificate"])
        assert set(log.files) == set(json.loads((tmp_path / "log_units.json").read_text()))
    # What is not certified cannot be withdrawn.
    scenario = make_scenario(arenas[0], "adversarial", 3, seconds=1.0, field="guarantee")
    other = summarise_tracking(run_tracking(set_up_game(scenario)), "guarantee")
    assert (other["certified"], other["certificate_withdrawn"]) == (False, None)
    # And without the solved game nothing is said.
    scenario = make_scenario(arenas[0], "adversarial", 3, seconds=1.0, field="margin")
    assert "certificate" not in summarise_tracking(run_tracking(set_up_game(scenario)), "margin")


CORNER = make_world([(0, 0), (3, 0), (3, 3), (1.53, 3), (1.53, 1.53), (0, 1.53)])


def make_crowd(model, seed, size, radius=0.15):
    """Large robots in two arms of 1.5 m."""
    options = {"radius": radius, "grid": 0.3, "model": model, "top_turn_rate": 6.0}
    scenario = make_scenario(
        CORNER, "adversarial", seed, size, 8.0, assignment="guarantee", **options
    )
    return replace(scenario, evaders=replace(scenario.evaders, radius=radius, model=model))


@pytest.mark.parametrize("model", ["point", "differential_drive"])
def test_robots_with_bodies_keep_their_promises_and_nobody_touches(model):
    promised = 0
    for seed in range(3):
        run = run_tracking(set_up_game(make_crowd(model, seed, 2), CORNER))
        found = audit_promises(run)
        assert found.breach == ""
        assert summarise_tracking(run, "crowd")["contacts"] == 0
        promised += (run.log["certificate"] > 0).mean() > 0.5
    assert promised >= 2


def test_drives_turn_in_place_and_drive_straight_from_place_to_place():
    scenario = make_crowd("differential_drive", 1, 1, radius=0.0)
    game = set_up_game(scenario, CORNER)
    table = solved_game(game, "lower")
    assert table.turning_time == turning_time(6.0, scenario.period)
    # The margin: what an evader is faster by, measured by how far pursuers come in a step.
    reach = table.pursuer_speed * (table.step - table.turning_time)
    margin = turning_margin(table.pursuer_grid.spacing * 2, 0.3, table.turning_time)
    assert table.evader_speed * table.step / reach == pytest.approx(0.3 * margin)
    assert margin > 1.1
    run = run_tracking(game)
    kept = run.log["certificate"][:, 0] > 0
    assert kept.mean() > 0.5
    moves = np.diff(run.log["pursuer_position"][:, 0], axis=0)[kept[:-1]]
    lengths = np.hypot(*moves.T)
    drives = lengths > 1e-9
    # It stands while it turns, and some of its ways are longer than a period.
    assert 0 < drives.sum() < len(drives)
    both = drives[1:] & drives[:-1]
    turned = moves[:-1, 0] * moves[1:, 1] - moves[:-1, 1] * moves[1:, 0]
    assert np.abs(turned[both]).max() <= 1e-6 * lengths.max() ** 2 + 1e-12


def test_who_is_stopped_by_a_body_has_its_promise_withdrawn_for_that_moment(monkeypatch):
    # A pursuer that drives at its evader, and promises 5 s at the beginning of each step.
    def drive_at(self, i, pursuers, evaders, evader, commitments):
        way = evaders[evader] - pursuers[i]
        reach = self._table.pursuer_speed * self._table.step
        return pursuers[i] + min(reach / np.hypot(*way), 1.0) * way, 5.0

    monkeypatch.setattr(CertifiedPursuit, "_best_step", drive_at)
    run = run_tracking(set_up_game(make_crowd("point", 0, 1), CORNER))
    found, summary = audit_promises(run), summarise_tracking(run, "crowd")
    assert summary["contacts"] == 0
    assert summary["certificate_withdrawn"] == found.withdrawn > 0
    withdrawn = run.log["withdrawn"][:, 0]
    assert (run.log["guaranteed_time"][withdrawn] > 0.0).all()
    np.testing.assert_array_equal(run.log["certificate"][:, 0] == 0.0, withdrawn)
    # It is withdrawn in those periods in which it does not go as it wants.
    steps = np.diff(run.log["pursuer_position"][:, 0], axis=0)
    short = steps - 0.05 * run.log["pursuer_velocity"][:-1, 0]
    np.testing.assert_array_equal(np.hypot(*short.T) > 1e-6, withdrawn[:-1])


def test_what_cannot_be_certified_is_refused(arenas):
    scenario = make_scenario(arenas[0], radius=0.1)
    with pytest.raises(InvalidInput, match="`bodies_block_sight` must be false where the field"):
        replace(scenario, bodies_block_sight=True)
