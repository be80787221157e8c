"""Small games of tracking on pictures, their cameras calibrated once."""

from collections.abc import Callable

import pytest

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.vision import scenarios
from sightfield.diagrams.vision.scenario import (
    PictureGame,
    PictureTrackingScenario,
    practise,
    set_up_picture_game,
)


@pytest.fixture(scope="session")
def loaded() -> Callable[..., PictureTrackingScenario]:
    """A built-in scenario by name, with `key=value` settings."""

    def load(name: str, *settings: str) -> PictureTrackingScenario:
        return load_scenario(PictureTrackingScenario, find_scenario(name, scenarios), settings)

    return load


@pytest.fixture(scope="session")
def practised(loaded):
    """The calibration of the built-in scenarios' cameras."""
    return practise(loaded("omni_1v1").vision)


@pytest.fixture(scope="session")
def picture_game(loaded, practised) -> Callable[..., PictureGame]:
    """A game of a built-in scenario, with settings."""
    return lambda name, *settings: set_up_picture_game(loaded(name, *settings), practised)
