"""`sightfield station kind-check`: what every kind of robots has to pass before it drives."""

import json
from dataclasses import asdict
from typing import Annotated

import typer
from rich.console import Console

from ...station.hardware import KINDS, find_kind
from ...station.kind_check import KindTrial, check_kind
from .options import JsonOption


def kind_check(
    kind: Annotated[
        str,
        typer.Argument(
            help=f"One of {', '.join(KINDS)}, or module:NAME of one's own in this folder."
        ),
    ],
    as_json: JsonOption = False,
) -> None:
    """Drop, delay, repeat and reorder messages between a kind's link and robots that stand in, stop
    them, and leave them in silence; exit code 1 if a trial fails. No real robot moves."""
    tried = find_kind(kind)
    console, found = Console(highlight=False), list[KindTrial]()
    for trial in check_kind(tried):
        found.append(trial)
        if not as_json:
            mark = "[green]yes[/]" if trial.passed else "[red]no [/]"
            console.print(f"{mark}  [bold]{trial.name}[/]: ", end="")
            console.print(trial.words, markup=False, soft_wrap=True)
    passed = all(trial.passed for trial in found)
    if as_json:
        about = {"kind": tried.name, "silence": tried.stops_after, "passed": passed}
        about |= {"recognises": sorted(tried.recognises)}
        print(json.dumps(about | {"trials": [asdict(trial) for trial in found]}, indent=2))
    if not passed:
        raise typer.Exit(1)
