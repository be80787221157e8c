"""`sightfield harvest`: harvest a field, or audit the log of a harvest."""

from typing import Any

import typer

from .harvest_commands.audit import audit
from .harvest_commands.run import run
from .run_by_default import RunByDefault

harvest: Any = typer.Typer(
    cls=RunByDefault,
    help=(
        "Harvest a field with combines and grain carts. Without a command: run, whose options "
        "`sightfield harvest run --help` lists."
    ),
    invoke_without_command=True,
    rich_markup_mode=None,
)
harvest.command()(run)
harvest.command()(audit)
