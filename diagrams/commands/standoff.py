"""`sightfield standoff`: keep a distance by a biased estimate, and say what can come of it."""

from typing import Any

import typer

from .run_by_default import RunByDefault
from .standoff_commands.analyse import analyse
from .standoff_commands.design import design
from .standoff_commands.live import live
from .standoff_commands.run import run
from .standoff_commands.simulate import simulate

standoff: Any = typer.Typer(
    cls=RunByDefault,
    help=(
        "Keep a distance by an estimate with error e(y) = a y^2 + b y + c: analyse the loop, "
        "choose gains, simulate, turn them on a page. Without a command: run, whose options "
        "`sightfield standoff run --help` lists. Everything is in metres and seconds; the thesis "
        "has millimetres: a = 0.001062 1/mm, c = 137 mm."
    ),
    invoke_without_command=True,
    rich_markup_mode=None,
)
for command in (run, analyse, design, simulate, live):
    standoff.command()(command)
