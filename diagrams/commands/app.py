"""The command `sightfield`: its subcommands, and what errors look like."""

import logging
import sys
from collections.abc import Sequence
from importlib import import_module

import typer

from ...systems.numerics.errors import SightfieldError

# Subcommand: a function of its name in its module, or a Typer app for one with subcommands.
COMMANDS = (
    "track",
    "world",
    "corner",
    "camera",
    "standoff",
    "plan",
    "schedule",
    "harvest",
    "social",
    "station",
    "study",
    "reproduce",
)


def make_app(names: Sequence[str] = COMMANDS) -> typer.Typer:
    """The command with some of its subcommands, whose modules are imported now."""
    app = typer.Typer(
        name="sightfield",
        help="Line-of-sight tracking and field logistics for teams of autonomous vehicles.",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        # Units are written [m], which Rich would take for markup.
        rich_markup_mode=None,
    )
    # Without a callback a lone subcommand would take the place of the whole.
    app.callback()(lambda: None)
    for name in names:
        module = import_module(f".{name}", __package__)
        command = getattr(module, name)
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=name)
        else:
            app.command(name)(command)
    return app


def main() -> None:
    """Run the command line: exit code 0 done, 2 bad input in one line, 1 anything else."""
    # What all of them import takes seconds.
    wanted = [name for name in sys.argv[1:2] if name in COMMANDS]
    try:
        app = make_app(wanted or COMMANDS)
        # The commands say themselves where to watch; importing Drake has set a level of its own.
        logging.getLogger("drake").setLevel(logging.WARNING)
        app()
    except SightfieldError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
