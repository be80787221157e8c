"""Whole games of robots with bodies: none touches another or a wall, and none waits for ever."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem
from pydrake.systems.primitives import LogVectorOutput

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.tracking.game import set_up_game, with_random_starts
from sightfield.diagrams.tracking.make_tracking import MakeTracking
from sightfield.diagrams.tracking.run import TrackingRun, run_tracking
from sightfield.diagrams.tracking.scenario import TrackingScenario

GAMES = 10

# A pursuer that wants to go on and does not is stuck after this long [s]; this near to another
# robot it is that one's fault [m].
PATIENCE, NEAR = 5.0, 0.02


def load(name, model, *settings):
    models = [f"{team}.model={model}" for team in ("pursuers", "evaders")]
    return load_scenario(TrackingScenario, find_scenario(name), [*models, *settings])


def play_random(name, model, *settings, games=GAMES, seconds=40):
    """Games from random starts."""
    scenario = with_random_starts(load(name, model, f"seconds={seconds}", *settings))
    seeds = [replace(scenario, seed=seed) for seed in range(games)]
    return [run_tracking(set_up_game(each)) for each in seeds]


@pytest.fixture(scope="module", params=["thesis_3v4", "thesis_4v3"])
def name(request) -> str:
    """Teams of either size."""
    return request.param


@pytest.fixture(scope="module", params=["point", "differential_drive"])
def games(request, name) -> list[TrackingRun]:
    """Games from random starts, by either kind of robot."""
    return play_random(name, request.param)


def test_no_two_bodies_overlap_and_none_enters_an_obstacle_at_any_moment(games, audit):
    found = [audit(run) for run in games]
    assert min(each.gap for each in found) > 0.0
    assert min(each.clearance for each in found) > 0.0
    assert all(each.inside for each in found)


@pytest.mark.parametrize("model", ["point", "differential_drive"])
def test_robots_without_bodies_do_overlap_but_heed_walls(name, model, audit):
    found = [audit(run) for run in play_random(name, model, "bodies=false", games=5)]
    assert min(each.gap for each in found) < -0.05
    assert min(each.clearance for each in found) > 0.0


def test_the_audit_sees_a_body_in_a_wall_and_one_that_passes_through_another(audit):
    run = play_random("thesis_3v4", "point", seconds=1, games=1)[0]
    assert audit(run).inside
    log = {key: samples.copy() for key, samples in run.log.items()}
    # From one side of a pursuer to the other, between two samples.
    x, y = log["pursuer_position"][5, 0]
    log["evader_position"][5, 0] = x - 0.5, y
    log["evader_position"][6, 0] = x + 0.5, y
    crossed = audit(replace(run, log=log))
    assert crossed.gap == pytest.approx(-0.32, abs=0.02)
    log["evader_position"][5:, 0] = 1.1, 0.9
    walled = audit(replace(run, log=log))
    assert not walled.inside
    assert walled.clearance < -0.1


def longest_wait(run):
    """How long a pursuer that wants more than half of its speed stood beside a robot [s]."""
    scenario = run.game.scenario
    tracks = run.log["pursuer_position"]
    speeds = np.hypot(*np.diff(tracks, axis=0).transpose(2, 0, 1)) / scenario.period
    wishes = np.hypot(*run.log["pursuer_velocity"][:-1].transpose(2, 0, 1))
    blocked = (wishes > 0.5 * scenario.pursuers.top_speed) & (speeds < 0.01)
    offsets = tracks[:-1, :, None] - tracks[:-1, None]
    gaps = np.hypot(offsets[..., 0], offsets[..., 1]) - 2.0 * scenario.pursuers.radius
    gaps[:, np.eye(scenario.pursuers.size, dtype=bool)] = np.inf
    longest, waited = 0, np.zeros(scenario.pursuers.size, dtype=int)
    for waits in blocked & (gaps.min(axis=2) < NEAR):
        waited = np.where(waits, waited + 1, 0)
        longest = max(longest, int(waited.max()))
    return longest * scenario.period


def test_no_pursuer_is_kept_waiting_by_a_teammate(games):
    assert max(longest_wait(run) for run in games) <= PATIENCE


class GoTo(LeafSystem):
    """Velocities straight to goals, at top speed."""

    def __init__(self, goals, speed, period):
        super().__init__()
        goals = np.array(goals, dtype=float)
        port = self.DeclareVectorInputPort("pursuer_position", goals.size)

        def calc(context, output):
            way = goals - port.Eval(context).reshape(-1, 2)
            distance = np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-12)[:, None]
            output.set_value((way / distance * np.minimum(speed, distance / period)).ravel())

        self.DeclareVectorOutputPort("velocity", goals.size, calc)


def cross(model, starts, goals, seconds):
    """Two pursuers on their way from starts to goals in an empty room, watched by nobody else."""
    scenario = load(
        "thesis_3v3",
        model,
        "world.obstacles=[]",
        f"seconds={seconds}",
        f"pursuers.positions={starts}",
        "pursuers.headings=[0.0, 3.1]",
        "evaders.positions=[[0.3, 3.7]]",
        "evaders.policies=[waypoints]",
        "evaders.waypoints=[[[0.3, 3.7]]]",
    )
    game, period = set_up_game(scenario), scenario.period
    builder, pursuit = DiagramBuilder(), GoTo(goals, scenario.pursuers.top_speed, period)
    tracking = builder.AddSystem(MakeTracking(game, pursuit=pursuit))
    ports = ("pursuer_position", "evader_position")
    sinks = {name: LogVectorOutput(tracking.GetOutputPort(name), builder, period) for name in ports}
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(seconds)
    context = simulator.get_context()
    log = {name: sink.FindLog(context).data().T for name, sink in sinks.items()}
    return SimpleNamespace(
        game=game, log={name: each.reshape(len(each), -1, 2) for name, each in log.items()}
    )


@pytest.mark.parametrize("model", ["point", "differential_drive"])
@pytest.mark.parametrize("offset", [0.0, 0.1])
def test_two_teammates_that_meet_head_on_pass(model, offset, audit):
    starts, goals = [[0.5, 1.5], [3.5, 1.5 + offset]], [[3.5, 1.5], [0.5, 1.5 + offset]]
    run = cross(model, starts, goals, seconds=20)
    assert np.hypot(*(run.log["pursuer_position"][-1] - goals).T).max() < 0.05
    assert audit(run).gap > 0.0


@pytest.mark.parametrize("model", ["point", "differential_drive"])
@pytest.mark.parametrize("offset", [0.0, 0.1])
def test_a_teammate_that_stands_in_the_way_is_passed(model, offset, audit):
    starts = [[0.5, 1.5], [2.0, 1.5 + offset]]
    run = cross(model, starts, [[3.5, 1.5], starts[1]], seconds=20)
    assert np.hypot(*(run.log["pursuer_position"][-1, 0] - [3.5, 1.5])) < 0.05
    assert audit(run).gap > 0.0
