"""Small searches of the built-in scenarios."""

from collections.abc import Callable

import pytest

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.social import scenarios
from sightfield.diagrams.social.run import SocialRun, run_social_search
from sightfield.diagrams.social.scenario import SocialScenario
from sightfield.diagrams.social.social_game import SocialGame, set_up_social_game
from sightfield.systems.numerics.social.network.acceptance import MemoryNetwork

# The evader rests where all agents see it, and landmarks behind it; they hardly move.
STANDING = (
    "agents.speed=0.001",
    "agents.poses=[[1.47, 1.73, -2.08], [1.02, 0.48, 1.57], [0.39, 1.42, -0.54]]",
    "evader={policy: rest, pose: [1.1, 1.1, 0.4]}",
    "pursuer.pose=[0.25, 0.6, 1.57]",
    "agents.unfriending=[0, 0, 0]",
)


@pytest.fixture(scope="session")
def social_game() -> Callable[..., SocialGame]:
    """A function of settings, and the name of a scenario: the game."""

    def make(*settings: str, name: str = "thesis_maze") -> SocialGame:
        path = find_scenario(name, scenarios)
        return set_up_social_game(load_scenario(SocialScenario, path, settings))

    return make


@pytest.fixture(scope="session")
def search(social_game) -> Callable[..., SocialRun]:
    """A function of settings, and what `run_social_search` takes: a search in memory."""

    def run(*settings: str, standing: bool = False, meshcat=None, **options) -> SocialRun:
        game = social_game(*(STANDING if standing else ()), *settings)
        network = MemoryNetwork(game.temperaments, game.scenario.seed)
        return run_social_search(game, network, meshcat, **options)

    return run


@pytest.fixture(scope="session")
def found(search) -> SocialRun:
    """All accept at once, and what they see is plain: 8 s."""
    return search("agents.friending=[1, 1, 1]", "seconds=8", standing=True)
