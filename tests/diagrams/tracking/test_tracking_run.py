"""Games played to the end: repeatable, in bounds, and true to the corner game."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.diagrams.scenario_files import builtin_scenarios, find_scenario, load_scenario
from sightfield.diagrams.tracking.game import set_up_game, with_random_starts
from sightfield.diagrams.tracking.make_tracking import MakeTracking
from sightfield.diagrams.tracking.report import UNITS, log_arrays, summarise_tracking
from sightfield.diagrams.tracking.run import run_tracking
from sightfield.diagrams.tracking.scenario import TrackingScenario
from sightfield.systems.numerics.tracking.corner_game import (
    corner_table,
    escape_time,
    to_corner_frame,
)

BUILT_IN = [name for name in builtin_scenarios() if name.startswith(("thesis", "corner", "risk"))]


def load(name, *settings):
    return load_scenario(TrackingScenario, find_scenario(name), settings)


def play(scenario):
    return run_tracking(set_up_game(scenario))


def numbers(run):
    """The summary without what differs from run to run."""
    summary = summarise_tracking(run, "test")
    return {key: summary[key] for key in summary if key not in ("wall_time", "realtime_factor")}


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_games_repeat_exactly_and_stay_clear_of_obstacles(name):
    first, again = play(load(name)), play(load(name))
    assert numbers(first) == numbers(again)
    for key in first.log:
        np.testing.assert_array_equal(first.log[key], again.log[key])
    assert numbers(first)["min_clearance"] >= first.game.scenario.pursuers.radius
    assert 0 < first.tracking_time <= first.game.scenario.seconds


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_diagram_runs_for_a_second(name, unconnected):
    diagram = MakeTracking(load(name))
    assert unconnected(diagram) == []
    simulator = Simulator(diagram)
    simulator.AdvanceTo(1.0)
    ports = [diagram.get_output_port(k).get_name() for k in range(diagram.num_output_ports())]
    assert ports[:4] == ["pursuer_position", "evader_position", "visibility", "assignment"]
    for each in ports:
        value = diagram.GetOutputPort(each).Eval(simulator.get_context())
        assert not np.isnan(value).any()
    assert all(system.get_name() for system in diagram.GetSystems())


def test_the_log_is_complete_and_has_units():
    run = play(load("thesis_3v4"))
    arrays = log_arrays(run)
    assert set(arrays) == set(UNITS)
    samples = len(run.times)
    assert {len(each) for each in arrays.values()} == {samples}
    assert arrays["pursuer_position"].shape == (samples, 3, 2)
    assert arrays["visibility"].shape == (samples, 3, 4)
    np.testing.assert_allclose(np.diff(run.times), 0.05)
    # The log ends a sample after the first at which nobody sees the evader.
    assert run.lost_evader is not None
    assert run.times[-3] <= run.tracking_time <= run.times[-2]
    assert not arrays["visibility"][-2, :, run.lost_evader].any()
    assert arrays["visibility"][:-2].any(axis=1).all()


def test_pursuers_that_hear_nobody_choose_alone():
    deaf = ("seconds=2", "pursuers.assignment=hungarian_max", "pursuers.radio_range=0")
    alone = ("seconds=2", "pursuers.assignment=own_riskiest")
    runs = [play(load("thesis_3v4", *settings)) for settings in (deaf, alone)]
    np.testing.assert_array_equal(runs[0].log["assignment"], runs[1].log["assignment"])


def test_the_corner_game_ends_when_theory_says():
    run = play(load("corner_1v1"))
    game = run.game
    ((x, y, heading, angle),) = corner_table(game.world)[:, :4]
    p, e = game.pursuer_starts[0, :2], game.evader_starts[0, :2]
    state = to_corner_frame(*p, *e, x, y, heading, angle)[:4]
    ratio, speed = game.scenario.speed_ratio, game.scenario.pursuers.top_speed
    expected = escape_time(*state, angle, ratio, speed)
    assert math.isfinite(expected)
    assert run.tracking_time == pytest.approx(expected, rel=0.01)


def test_halving_the_step_hardly_changes_the_corner_game():
    times = [play(load("corner_1v1", f"period={h}")).tracking_time for h in (0.05, 0.025)]
    assert times[0] == pytest.approx(times[1], rel=0.01)


@pytest.mark.parametrize("angle", [0.0, 0.9, math.pi / 2, -2.3])
@pytest.mark.parametrize("mirror", [False, True])
@pytest.mark.parametrize("shift", [(0.0, 0.0), (13.0, -250.0)])
@pytest.mark.parametrize("radius", [0.0, 0.1])
def test_the_corner_game_does_not_know_where_it_is(angle, mirror, shift, radius):
    scenario = load("corner_1v1")
    c, s = math.cos(angle), math.sin(angle)
    matrix = np.array([[c, -s], [s, c]]) @ np.diag([1.0, -1.0 if mirror else 1.0])

    def carry(points):
        return (np.array(points) @ matrix.T + shift).tolist()

    def with_radius(team, **changes):
        return replace(team, radius=radius, **changes)

    base = replace(
        scenario,
        pursuers=with_radius(scenario.pursuers),
        evaders=with_radius(scenario.evaders),
    )
    moved = replace(
        base,
        world=replace(base.world, boundary=carry(base.world.boundary)),
        pursuers=with_radius(base.pursuers, positions=carry(base.pursuers.positions)),
        evaders=with_radius(base.evaders, positions=carry(base.evaders.positions)),
    )
    expected = play(base).tracking_time
    assert expected < scenario.seconds
    assert play(moved).tracking_time == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("model", ["point", "differential_drive"])
@pytest.mark.parametrize("period", [0.05, 0.7])
def test_no_robot_enters_a_grown_obstacle_whatever_its_speed(model, period):
    settings = [f"{team}.model={model}" for team in ("pursuers", "evaders")]
    settings += ["pursuers.top_speed=9", "evaders.top_speed=8", f"period={period}", "seconds=20"]
    for seed in range(5):
        scenario = with_random_starts(load("thesis_4v3", *settings, f"seed={seed}"))
        summary = numbers(play(replace(scenario, evaders=_wandering(scenario.evaders))))
        assert summary["min_clearance"] >= 0.16


def _wandering(evaders):
    """The same evaders on a random walk: they never rest behind a corner."""
    return replace(evaders, policies=["random_walk"], turn_period=1.0)


def test_pursuit_keeps_evaders_longer_than_waiting_does():
    def tracking_times(rule):
        games = [load("thesis_3v3", f"pursuers.assignment={rule}", f"seed={k}") for k in range(8)]
        return [play(with_random_starts(game)).tracking_time for game in games]

    assert np.mean(tracking_times("hungarian")) > 1.3 * np.mean(tracking_times("stay"))


def test_policies_may_differ_from_evader_to_evader():
    run = play(
        load(
            "thesis_3v3",
            "evaders.model=point",
            # So that nobody has to make way for another.
            "bodies=false",
            "evaders.policies=[adversarial, waypoints, random_walk]",
            "evaders.waypoints=[[], [[3.5, 1.8], [3.5, 2.2]], []]",
            "seconds=10",
        )
    )
    second = run.log["evader_position"][:, 1]
    np.testing.assert_allclose(second[:40, 1], 1.8, atol=1e-9)
    assert np.hypot(*(second - [3.5, 1.8]).T).min() < 1e-6
    speeds = np.hypot(*np.diff(run.log["evader_position"][:, 2], axis=0).T) / 0.05
    assert np.median(speeds) == pytest.approx(0.09)


def test_the_horizon_censors():
    run = play(load("thesis_4v3", "seconds=3.02"))
    summary = numbers(run)
    assert summary["censored"]
    assert summary["lost_evader"] is None
    assert summary["tracking_time"] == 3.02
