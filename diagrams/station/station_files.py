"""Laboratories from YAML files."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from ..scenario_files import build, find_scenario, read_tree, with_settings
from ..tracking.game import TrackingGame
from . import scenarios
from .hardware import without_password
from .scenario import StationScenario


def load_station(scenario: str | Path, overrides: Sequence[str] = ()) -> StationScenario:
    """Read a laboratory; its `tracking` is the name or file of a scenario of `sightfield track`.

    Args:
        scenario: Its file, or the name of a built-in one.
        overrides: `key=value` settings, the game's below `tracking.`.

    Raises:
        InvalidInput: See `load_scenario`.
    """
    path = find_scenario(scenario, scenarios) if isinstance(scenario, str) else scenario
    tree = with_settings(read_tree(path), [each for each in overrides if _names_game(each)])
    game = tree.get("tracking")
    folder = path.parent
    if isinstance(game, str):
        file = path.parent / game
        file = file if file.is_file() else find_scenario(game)
        tree["tracking"], folder = read_tree(file), file.parent
    settings = [each for each in overrides if not _names_game(each)]
    station = build(StationScenario, with_settings(tree, settings))
    tracking = station.tracking
    return replace(station, tracking=replace(tracking, world=tracking.world.beside(folder)))


def station_tree(scenario: StationScenario, game: TrackingGame) -> dict[str, Any]:
    """A laboratory as nested mappings, complete without any file, for `build`.

    Passwords of the camera are left out: nobody who reads a log shall look through it.
    """
    tree = asdict(scenario)
    tree["omni_camera"]["place"] = without_password(tree["omni_camera"]["place"])
    world = game.world
    if scenario.tracking.world.file:
        tree["tracking"]["world"] = {
            "boundary": world.boundary.tolist(),
            "obstacles": [ring.tolist() for ring in world.obstacles],
        }
    return tree


def _names_game(override: str) -> bool:
    return override.split("=")[0] == "tracking"
