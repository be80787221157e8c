"""`sightfield station identify`: is every robot the body that bears its name?"""

import json
from dataclasses import asdict
from typing import Annotated

import typer
from rich.console import Console

from ....systems.numerics.errors import InvalidInput
from ...station.hardware import Devices, Operator
from ...station.identity import Identity, identify
from ...station.session import open_laboratory
from ...tracking.game import set_up_game
from .options import DEFAULT_SCENARIO, JsonOption, ScenarioArgument, SettingOption, load


def identify_robots(
    scenario: ScenarioArgument = DEFAULT_SCENARIO,
    emulate: Annotated[
        bool, typer.Option("--emulate", help="Those of the emulated laboratory.")
    ] = False,
    hardware: Annotated[
        bool, typer.Option("--hardware", help="Those of the laboratory: they move.")
    ] = False,
    setting: SettingOption = None,
    as_json: JsonOption = False,
) -> None:
    """Let each robot turn in place and back, and say which body the motion capture saw turn.

    Exit code 1 if it was another than the scenario says.
    """
    if emulate == hardware:
        got = "both" if emulate else "neither"
        raise InvalidInput(f"`--emulate` or --hardware must say which robots; got {got}")
    laboratory = load(scenario, setting)
    game, operator = set_up_game(laboratory.tracking), Operator()
    console, found = Console(highlight=False), list[Identity]()
    mode = "emulate" if emulate else "hardware"
    with open_laboratory(laboratory, game, mode, operator) as devices:
        assert isinstance(devices, Devices)
        for each in identify(laboratory, devices):
            found.append(each)
            if not as_json:
                mark = "[green]yes[/]" if each.right else "[red]no [/]"
                console.print(f"{mark}  ", end="")
                console.print(each.words, markup=False, soft_wrap=True)
    right = all(each.right for each in found)
    if as_json:
        print(json.dumps({"right": right, "robots": [asdict(each) for each in found]}, indent=2))
    if not right:
        raise typer.Exit(1)
