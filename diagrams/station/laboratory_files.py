"""Laboratories from YAML files, with a game beside or within, and robots of a known kind."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ..scenario_files import (
    Setting,
    build,
    find_scenario,
    read_settings,
    read_tree,
    with_settings,
)
from . import scenarios
from .hardware import find_kind
from .scenario import StationScenario


def load_station(scenario: str | Path, overrides: Sequence[str | Setting] = ()) -> StationScenario:
    """Read a laboratory; its `tracking` is the name or file of a scenario of `sightfield track`.

    Args:
        scenario: Its file, or the name of a built-in one.
        overrides: `key=value` settings, the game's below `tracking.`.

    Raises:
        InvalidInput: See `load_scenario`; or there is no such kind of robots, though they may only
            be simulated.
    """
    path = find_scenario(scenario, scenarios) if isinstance(scenario, str) else scenario
    settings = read_settings(overrides)
    # Which game it is comes first, whatever is changed in it.
    tree = with_settings(read_tree(path), [each for each in settings if each.key == "tracking"])
    game = tree.get("tracking")
    folder = path.parent
    if isinstance(game, str):
        file = path.parent / game
        file = file if file.is_file() else find_scenario(game)
        tree["tracking"], folder = read_tree(file), file.parent
    others = [each for each in settings if each.key != "tracking"]
    station = build(StationScenario, with_settings(tree, others))
    # Whether or not its robots will be driven.
    find_kind(station.radio.kind)
    tracking = station.tracking
    return replace(station, tracking=replace(tracking, world=tracking.world.beside(folder)))
