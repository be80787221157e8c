"""`sightfield harvest`: harvest a field, say what it would take, or audit a log."""

from typing import Any

import typer

from .harvest_audit import audit
from .harvest_plan import plan
from .harvest_run import run
from .shared import RunByDefault

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
harvest.command()(plan)
harvest.command()(audit)
