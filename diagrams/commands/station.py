"""`sightfield station`: run a game in the laboratory, look what is connected, play a log again."""

from typing import Any

import typer
from typer.core import TyperGroup

from .station_commands.check import check
from .station_commands.replay import replay
from .station_commands.run import run


class _RunByDefault(TyperGroup):
    """A group whose first subcommand is meant where none is named."""

    # Any: Typer has a copy of Click of its own, or not, from version to version.
    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if not args or (args[0] not in self.commands and args[0] != "--help"):
            args = ["run", *args]
        return super().parse_args(ctx, args)


station: Any = typer.Typer(
    cls=_RunByDefault,
    help=(
        "Run a tracking game in the laboratory: simulated, emulated, or real. Without a command: "
        "run, whose options `sightfield station run --help` lists."
    ),
    rich_markup_mode=None,
)
station.command()(run)
station.command()(check)
station.command()(replay)
