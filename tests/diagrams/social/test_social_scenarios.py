"""What a scenario of the social story may say, and what becomes of it."""

import numpy as np
import pytest

from sightfield.diagrams.scenario_files import builtin_scenarios, find_scenario, load_scenario
from sightfield.diagrams.social import scenarios
from sightfield.diagrams.social.networks import NetworkChoice, open_network
from sightfield.diagrams.social.scenario import SocialScenario
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index, clearances
from sightfield.systems.numerics.social.network.acceptance import (
    MemoryNetwork,
    MutualFriendsAcceptance,
)


def test_the_thesis_maze_has_the_tables_of_the_thesis(social_game):
    game = social_game()
    assert len(game.maze.landmarks) == 13
    np.testing.assert_allclose(np.ptp(game.maze.world.bounds.reshape(2, 2), axis=0), 8 * 0.3048)
    limits = game.limits
    assert (limits.requests, limits.patience, limits.friends) == (3, 10, 3)
    assert game.scenario.search.pictures == 1
    assert game.temperaments.acceptance.friending == (0.4, 0.5, 0.3)
    assert game.temperaments.unfriending == (0.05, 0.02, 0.04)


def test_the_choosy_crowd_trusts_friends_of_friends(social_game):
    game = social_game(name="choosy_crowd")
    acceptance = game.temperaments.acceptance
    assert isinstance(acceptance, MutualFriendsAcceptance)
    assert acceptance.probability(2, {0, 1}) > acceptance.probability(2, ())
    assert game.limits.friends == 3


def test_robots_start_apart_and_off_the_walls(social_game):
    for seed in range(10):
        game = social_game(f"seed={seed}")
        places = game.starts[:, :2]
        walls = clearances(build_edge_index(game.maze.world), places)
        assert walls.min() >= game.maze.robot_radius
        apart = np.linalg.norm(places[:, None] - places[None], axis=-1)
        assert apart[np.triu_indices(len(places), 1)].min() > 2 * game.maze.robot_radius
    assert not np.array_equal(places, social_game("seed=0").starts[:, :2])


def test_robots_start_where_the_scenario_says(social_game):
    game = social_game("pursuer.pose=[0.3, 0.3, 1.0]", "evader.pose=[2.1, 2.1, -1.0]")
    np.testing.assert_array_equal(game.starts[:2], [[0.3, 0.3, 1.0], [2.1, 2.1, -1.0]])


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("agents.friending=[]", "`agents.friending` must name an agent at least"),
        ("agents.friending=[0.4, 2, 0.3]", "`agents.friending.1` must be a probability; got 2"),
        ("agents.unfriending=[0.1]", "`agents.unfriending` must have 3 entries"),
        ("agents.rejection=[0.1]", "`agents.rejection` must have 3 entries or none"),
        ("agents.acquaintances=[[0, 3]]", "`agents.acquaintances.0` must be two agents below 3"),
        ("agents.poses=[[1, 1, 0]]", "`agents.poses` must have 3 entries or none; got 1"),
        ("evader.policy=hide", "`evader.policy` must be one of wander, rest; got hide"),
        ("evader.pose=[1, 1]", "`evader.pose` must be .x, y, heading., all finite"),
        ("evader.pose=[0.05, 1, 0]", "`evader.pose` must be 0.13 m from walls"),
        ("pursuer.speed=0", "`pursuer.speed` must be positive"),
        ("camera.period=0.13", "`camera.period` must be a multiple of the period"),
        ("period=1e-300", "`period` must be 0.001 at least; got 1e-300"),
        ("camera.view_angle=170", "`camera.view_angle` must lie in .0, 150. deg; got 170"),
        ("search.pictures=0", "`search.pictures` must be at least 1; got 0"),
        ("search.method=akaze", "`search.method` must be one of sift, orb, surf; got akaze"),
        ("search.order=alphabet", "`search.order` must be one of in_turn, information"),
        ("search.friend=3", "`search.friend` must be a key of the scenario"),
        ("maze.landmarks=0", "`maze.landmarks` must be at least 1"),
        ("seconds=-1", "`seconds` must be positive"),
    ],
)
def test_bad_scenarios_are_named(setting, message, social_game):
    with pytest.raises(InvalidInput, match=message):
        social_game(setting)


def test_two_robots_do_not_start_on_one_spot(social_game):
    with pytest.raises(InvalidInput, match=r"`evader\.pose` must not touch another robot"):
        social_game("pursuer.pose=[0.3, 0.3, 0]", "evader.pose=[0.4, 0.3, 0]")


def test_a_crowd_that_does_not_fit_is_told(social_game):
    many = [0.5] * 40
    with pytest.raises(InvalidInput, match="`agents` must fit into the maze; no room for"):
        social_game(f"agents={{friending: {many}, unfriending: {many}}}")


def test_all_built_in_scenarios_load():
    names = builtin_scenarios(scenarios)
    assert {"thesis_maze", "choosy_crowd"} <= set(names)
    for name in names:
        load_scenario(SocialScenario, find_scenario(name, scenarios))


def test_the_network_is_in_memory_unless_accounts_say_otherwise(social_game, tmp_path):
    game = social_game()
    with open_network(game, NetworkChoice()) as network:
        assert isinstance(network, MemoryNetwork)
        assert network.agents() == (0, 1, 2)
    accounts = tmp_path / "accounts.yaml"
    accounts.write_text(
        "homeserver: http://127.0.0.1:1\n"
        "pursuer: {user: '@p:test', token: t}\n"
        "agents:\n  - {user: '@a:test', album: '!a:test', token: t}\n"
    )
    accounts.chmod(0o600)
    choice = NetworkChoice(kind="matrix", accounts=accounts)
    with (
        pytest.raises(InvalidInput, match="`--accounts` must have 3 common agents; got 1"),
        open_network(game, choice),
    ):
        pass


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ({"kind": "facebook"}, "`--network` must be one of memory, matrix; got facebook"),
        ({"kind": "matrix"}, "`--accounts` must name a file of accounts"),
        ({"homeserver": "http://x"}, "`--homeserver` must be given with --network matrix alone"),
    ],
)
def test_bad_choices_of_a_network_are_named(choice, message):
    with pytest.raises(InvalidInput, match=message):
        NetworkChoice(**choice)
