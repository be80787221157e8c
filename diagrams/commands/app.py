"""The command `sightfield`: its subcommands, and what errors look like."""

import logging
import sys

import typer

from ...systems.numerics.errors import SightfieldError
from .camera import camera_app
from .corner import corner
from .plan import plan_app
from .schedule import schedule
from .standoff import standoff
from .track import track
from .world import world

app = typer.Typer(
    name="sightfield",
    help="Line-of-sight tracking and field logistics for teams of autonomous vehicles.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    # Units are written [m], which Rich would take for markup.
    rich_markup_mode=None,
)
app.command()(track)
app.command()(world)
app.command()(corner)
app.command()(standoff)
app.command()(schedule)
app.add_typer(plan_app, name="plan")
app.add_typer(camera_app, name="camera")


def main() -> None:
    """Run the command line: exit code 0 done, 2 bad input in one line, 1 anything else."""
    # The commands say themselves where to watch.
    logging.getLogger("drake").setLevel(logging.WARNING)
    try:
        app()
    except SightfieldError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
