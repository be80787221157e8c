"""Searches from pixels to the evader."""

import json

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

from sightfield.diagrams.social.make_social_search import VECTORS, MakeSocialSearch
from sightfield.diagrams.social.report import UNITS, gaps, log_arrays, summarise_search
from sightfield.diagrams.social.robots import AddRobots
from sightfield.systems.numerics.geometry.edge_index import build_edge_index, clearances

EVADER = np.array([1.1, 1.1])


def test_an_evader_in_plain_view_is_located_and_approached(found):
    numbers = summarise_search(found, "standing")
    # The pictures of 0 s are read a moment later.
    assert numbers["time_to_first_location"] < 0.3
    # Twelve pictures; now and then the pursuer stands before the evader.
    assert numbers["pictures_scanned"] == 12
    assert 6 <= numbers["locations"] <= 12
    assert numbers["location_error"]["median"] < 0.01
    assert numbers["tracking_error"]["p90"] < 0.01
    assert numbers["connected_fraction"] == pytest.approx([1, 1, 1], abs=0.01)
    assert numbers["all_connected_fraction"] == pytest.approx(1, abs=0.01)
    assert numbers["requests_sent"] == 3
    assert numbers["collisions"] == 0
    # It came along its route, as near as it stands off.
    pursuer = found.log["pose"][:, 0, :2]
    assert np.hypot(*(pursuer[0] - EVADER)) > 0.95
    assert np.hypot(*(pursuer[-1] - EVADER)) < 0.4


def test_the_summary_is_json_and_the_log_has_units(found):
    assert json.loads(json.dumps(summarise_search(found, "standing")))["scenario"] == "standing"
    arrays = log_arrays(found)
    assert set(arrays) == set(UNITS)
    assert {len(each) for each in arrays.values()} == {len(found.times)}
    assert len(found.times) == round(8 / 0.05) + 1


def test_routes_lead_from_the_pursuer_to_the_estimate(found):
    last = found.log["route"][-1]
    np.testing.assert_allclose(last[0], found.log["pose"][-1, 0, :2])
    np.testing.assert_allclose(last[-1], EVADER, atol=0.02)


def test_without_friends_nothing_is_read_and_the_pursuer_rests(search):
    run = search(
        "agents.friending=[0, 0, 0]", "agents.rejection=[1, 1, 0]", "seconds=5", standing=True
    )
    numbers = summarise_search(run, "alone")
    assert numbers["pictures_scanned"] == numbers["locations"] == 0
    assert numbers["time_to_first_location"] is None
    assert numbers["location_error"] is None
    assert numbers["tracking_error"] is None
    # Rejections are answered by asking again: in iterations 0, 1 and 2.
    assert numbers["requests_sent"] == 3 + 2 * 3
    pursuer = run.log["pose"][:, 0]
    np.testing.assert_array_equal(pursuer, np.tile(pursuer[0], (len(pursuer), 1)))


def test_a_search_repeats_exactly_and_another_seed_is_another_search(search):
    first, again = (search("seconds=0.4", "seed=5") for _ in range(2))
    other = search("seconds=0.4", "seed=6")
    for name in VECTORS:
        np.testing.assert_array_equal(first.log[name], again.log[name])
    assert [each.picture.data for each in first.readings] == [
        each.picture.data for each in again.readings
    ]
    assert not np.array_equal(first.log["pose"], other.log["pose"])


@pytest.mark.parametrize("name", ["thesis_maze", "choosy_crowd"])
def test_every_scenario_runs_a_second(name, social_game):
    diagram = MakeSocialSearch(social_game("seconds=1", name=name))
    assert [diagram.get_output_port(i).get_name() for i in range(diagram.num_output_ports())] == [
        "pose",
        "posted",
        "connected",
        "waiting",
        "requests_sent",
        "pictures_scanned",
        "readings",
        "locations",
        "evader_position",
        "evader_covariance",
        "located_at",
        "route",
    ]
    assert all(each.get_name() for each in diagram.GetSystems())
    assert diagram.HasSubsystemNamed("agent_interest") == (name == "choosy_crowd")
    simulator = Simulator(diagram)
    simulator.AdvanceTo(1.0)
    context = simulator.get_context()
    posted = diagram.GetOutputPort("posted").Eval(context)
    assert len(posted) == social_game(name=name).scenario.agents.size


def test_nobody_runs_into_a_wall_or_another_robot(social_game):
    for seed in range(6):
        game = social_game(f"seed={seed}", "agents.speed=0.2", "evader.speed=0.15")
        builder = DiagramBuilder()
        robots = AddRobots(builder, game)
        # The evader is said to be in the middle, so that the pursuer has somewhere to go.
        for port, value in ((robots.evader_position, [1.22, 1.22]), (robots.located_at, [0.0])):
            source = builder.AddSystem(ConstantVectorSource(value))
            builder.Connect(source.get_output_port(), port)
        sink = LogVectorOutput(robots.pose, builder, game.scenario.period)
        simulator = Simulator(builder.Build())
        simulator.AdvanceTo(40.0)
        track = sink.FindLog(simulator.get_context()).data().T.reshape(-1, game.robots, 3)
        index, radius = build_edge_index(game.maze.world), game.maze.robot_radius
        assert clearances(index, track[:, :, :2].reshape(-1, 2)).min() > radius
        apart = np.linalg.norm(track[:, :, None, :2] - track[:, None, :, :2], axis=-1)
        i, j = np.triu_indices(game.robots, 1)
        assert apart[:, i, j].min() > 2 * radius
        # Those who wander do not stand still.
        ways = np.hypot(*np.diff(track[:, 1:, :2], axis=0).transpose(2, 0, 1)).sum(axis=0)
        assert ways.min() > 0.5


def test_gaps_are_from_rim_to_wall_and_from_rim_to_rim(found):
    walls, between = gaps(found)
    assert walls.shape == (len(found.times), 5)
    assert between.shape == (len(found.times), 10)
    assert walls[0, 0] == pytest.approx(0.25 - 0.1)
    assert between[0, 0] == pytest.approx(np.hypot(0.85, 0.5) - 0.2)


@pytest.mark.parametrize(
    ("name", "own"), [("thesis_maze", ["network_evolution.interest"]), ("choosy_crowd", [])]
)
def test_every_input_is_connected(social_game, unconnected, name, own):
    """Agents of the thesis answer whoever asks: nobody tells their interest."""
    assert unconnected(MakeSocialSearch(social_game(name=name))) == own
