"""`sightfield harvest`: harvest a field, or audit the log of a harvest."""

from typing import Any

import typer
from typer.core import TyperGroup

from .harvest_commands.audit import audit
from .harvest_commands.run import run


class _RunByDefault(TyperGroup):
    """A group whose first subcommand is meant where none is named."""

    # Any: Typer has a copy of Click of its own, or not, from version to version.
    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if not args or (args[0] not in self.commands and args[0] != "--help"):
            args = ["run", *args]
        return super().parse_args(ctx, args)


harvest: Any = typer.Typer(
    cls=_RunByDefault,
    help=(
        "Harvest a field with combines and grain carts. Without a command: run, whose options "
        "`sightfield harvest run --help` lists."
    ),
    invoke_without_command=True,
    rich_markup_mode=None,
)
harvest.command()(run)
harvest.command()(audit)
