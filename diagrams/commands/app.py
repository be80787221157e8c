"""The command `sightfield`: its subcommands, and what errors look like."""

import logging
import os
import sys
from collections import Counter
from collections.abc import Callable
from importlib import import_module, metadata
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from ...systems.numerics.errors import SightfieldError, require
from ..outputs import lacks_room

# Subcommands: each a function of its name in its module, or a Typer app for one with subcommands.
COMMANDS = {
    "track": "Keep evaders in sight among polygons.",
    "world": "Read a map, report what is in it, and draw it.",
    "guarantee": "How long sight can be kept on a map, whatever the evader does.",
    "corner": "Solve the game of one pursuer and one evader around a corner.",
    "camera": "Calibrate an omni-directional camera, track by pictures.",
    "standoff": "Keep a distance by a biased estimate, and analyse the loop.",
    "plan": "Drive the grain cart in the least time.",
    "schedule": "Say whether carts can serve these combines, and how.",
    "harvest": "Harvest a field with combines and grain carts.",
    "social": "Find an evader in the pictures of friends.",
    "station": "Run a game in the laboratory: simulated, emulated, or real.",
    "study": "Play a grid of games many times over, with statistics.",
    "reproduce": "Make the figures and tables of the thesis again.",
}


class _ImportedWhenAsked(TyperGroup):
    """Lists its subcommands, but imports only the one that is called: all of them take seconds."""

    # Any: Typer has a copy of Click of its own, or not, from version to version.
    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        name, _, rest = super().resolve_command(ctx, args)
        command = name and import_command(name)
        if ctx.obj is not None:
            ctx.obj()
        return name, command, rest


def make_app() -> typer.Typer:
    """The whole command line."""
    app = _empty_app(cls=_ImportedWhenAsked)
    app.callback()(_options)
    for name, line in COMMANDS.items():
        app.command(name, help=line)(lambda: None)
    return app


def import_command(name: str) -> Any:
    """A subcommand, as Typer runs it.

    Args:
        name: One of `COMMANDS`.
    """
    app = _empty_app()
    # Without a callback a lone subcommand would take the place of the whole.
    app.callback()(lambda: None)
    command = getattr(import_module(f".{name}", __package__), name)
    if isinstance(command, typer.Typer):
        app.add_typer(command, name=name)
    else:
        app.command(name)(command)
    # The commands say themselves where to watch; importing Drake has set a level of its own.
    logging.getLogger("drake").setLevel(logging.WARNING)
    if sys.stderr.isatty():
        _show_log()
    group: Any = typer.main.get_command(app)
    _read_options_strictly(group.commands[name])
    return group.commands[name]


def _show_log() -> None:
    """Have the package say on a terminal what takes long, as progress is shown there."""
    log = logging.getLogger(__name__.partition(".")[0])
    if not log.handlers:
        log.addHandler(logging.StreamHandler())
        log.setLevel(logging.INFO)


def main(begin: Callable[[], None] | None = None) -> None:
    """Run the command line: exit code 0 done, 2 bad input in one line, 1 anything else.

    A full disk is bad input, wherever it is met: in a folder of results, which says so itself, in
    temporary files, caches or standard output.

    Args:
        begin: Called once the command is imported, before it does anything.
    """
    try:
        try:
            code = make_app()(standalone_mode=False, obj=begin)
        finally:
            _flush()
    except SightfieldError as error:
        _refuse(str(error))
    except typer.Abort:
        print("Aborted!", file=sys.stderr)
        sys.exit(1)
    except BrokenPipeError:
        # Whoever read the output has read enough.
        sys.exit(1)
    except OSError as error:
        if not lacks_room(error):
            raise
        file = f", {error.filename}" if error.filename else ""
        _refuse(f"`disk` must have room for what is written; got {error.strerror}{file}")
    except Exception as error:
        # Typer has a copy of Click of its own, or not, from version to version.
        if not hasattr(error, "format_message"):
            raise
        _refuse_words(error)
    sys.exit(code or 0)


# Any: Typer has a copy of Click of its own, or not, from version to version.
def _read_options_strictly(command: Any) -> None:
    """Have a command and those below it refuse an option that stands twice, or without a value.

    Click takes the last one without a word, and `--out "$FOLDER"` for the folder that one is in
    where nobody has said what $FOLDER is.
    """
    for each in getattr(command, "commands", {}).values():
        _read_options_strictly(each)
    usual = command.make_parser

    def make_parser(context: Any) -> Any:
        parser = usual(context)
        parse = parser.parse_args

        def parse_args(args: list[str]) -> Any:
            options, rest, order = parse(args)
            for option, times in Counter(order).items():
                again = times == 1 or option.multiple
                name = "/".join([*option.opts, *option.secondary_opts])
                require(again, name, "be given once", f"it {times} times")
                require(options[option.name] != "", name, "have a value", "an empty word")
            return options, rest, order

        parser.parse_args = parse_args
        return parser

    command.make_parser = make_parser


def _refuse(line: str) -> NoReturn:
    print(f"error: {line}", file=sys.stderr)
    sys.exit(2)


def _refuse_words(error: Any) -> NoReturn:
    """Answer words that no command takes; help, where a command is to be named."""
    said, context = error.format_message(), error.ctx
    if context is None:
        _refuse(" ".join(said.split()))
    if said == context.get_help():
        print(said, file=sys.stderr)
        sys.exit(error.exit_code)
    _refuse(f"{' '.join(said.split()).rstrip('.')}; see `{context.command_path} --help`")


def _flush() -> None:
    """Write what is still to be written to standard output, while an error can be answered."""
    try:
        sys.stdout.flush()
    except OSError:
        # Python would try again at its end, and complain in lines of its own.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        raise


def _empty_app(cls: type[TyperGroup] = TyperGroup) -> typer.Typer:
    return typer.Typer(
        cls=cls,
        name="sightfield",
        help="Line-of-sight tracking and field logistics for teams of autonomous vehicles.",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        # Units are written [m], which Rich would take for markup.
        rich_markup_mode=None,
    )


def _say_version(asked: bool) -> None:
    if asked:
        typer.echo(f"sightfield {metadata.version('sightfield')}")
        raise typer.Exit


def _options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_say_version, is_eager=True, help="Show the version and exit."
        ),
    ] = False,
) -> None:
    """Options of the command itself."""
