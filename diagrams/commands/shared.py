"""What commands share: options, tables, bars, what is meant by default, and how a story is run."""

import inspect
import json
import sys
from collections.abc import Callable, Collection, Generator, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console, RenderableType
from rich.markup import escape
from rich.progress import (
    MofNCompleteColumn,
    Progress,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text
from typer.core import TyperGroup

from ...systems.numerics.errors import require
from ..outputs import optional_folder
from ..scenario_files import Setting

JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
JsonSummaryOption = Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")]
SecondsOption = Annotated[float | None, typer.Option(help="Horizon [s].")]
SeedOption = Annotated[int | None, typer.Option(help="Of everything random.")]
RunFolderOption = Annotated[
    Path | None, typer.Option(help="Folder for summary, log, plots and replay.")
]
MeshcatOption = Annotated[bool | None, typer.Option(help="Watch it live [default: in a terminal].")]
ReplayOption = Annotated[bool, typer.Option(help="With --out: write replay.html.")]


def with_options(
    settings: Sequence[str] | None, options: Mapping[str, tuple[str, object]]
) -> list[Setting]:
    """Settings of a scenario with those that options of their own say.

    Args:
        settings: As `--set` has them.
        options: Key and value of what each option sets, by the option's name; the value is None
            where the option is not given.

    Raises:
        InvalidInput: A setting has not the form key=value.
    """
    own = [
        Setting(key, str(value), option)
        for option, (key, value) in options.items()
        if value is not None
    ]
    return [*map(Setting.read, settings or []), *own]


def given_options(context: typer.Context) -> dict[str, Any]:
    """Options and arguments that stand on the command line, not those left to their defaults.

    Args:
        context: Of the command.

    Returns:
        Values by the parameter's name.
    """
    sources = {name: context.get_parameter_source(name) for name in context.params}
    return {
        name: context.params[name]
        for name, source in sources.items()
        if source is not None and source.name == "COMMANDLINE"
    }


def refuse_unused(
    given: Mapping[str, object],
    *,
    beside: Mapping[str, Collection[str]] | None = None,
    without: Mapping[str, Collection[str]] | None = None,
) -> None:
    """Refuse options that would change nothing.

    Args:
        given: Values by names of those on the command line, as of `given_options`.
        beside: By the name of an option, what it leaves without a use.
        without: By the name of an option, what is of use with it alone.

    Raises:
        InvalidInput: There is one.
    """
    for option, unused in (beside or {}).items():
        for name in unused if given.get(option) else ():
            require(name not in given, name, f"be left out with {option}", given.get(name))
    for option, unused in (without or {}).items():
        for name in () if given.get(option) else unused:
            require(name not in given, name, f"come with {option}", given.get(name))


class RunByDefault(TyperGroup):
    """A group whose subcommand `run` is meant where none is named."""

    # Any: Typer has a copy of Click of its own, or not, from version to version.
    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the words, with `run` before them where no subcommand stands.

        Args:
            ctx: Click's.
            args: The words.
        """
        if not args or (args[0] not in self.commands and args[0] != "--help"):
            args = ["run", *args]
        return super().parse_args(ctx, args)


def takes(read: Callable[..., Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Decorator that gives a command, after its own options, those that it shares with others.

    Args:
        read: Its parameters are the shared options. The command's first parameter, which is no
            option, is what it returns.
    """
    shared = inspect.signature(read).parameters

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        own = list(inspect.signature(command).parameters.values())[1:]

        def run(**given: Any) -> None:
            words = {name: given.pop(name) for name in shared}
            command(read(**words), **given)

        every = [
            each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in (*own, *shared.values())
        ]
        # What Typer reads.
        run.__name__, run.__doc__ = command.__name__, command.__doc__
        run.__annotations__ = {each.name: each.annotation for each in every}
        run.__signature__ = inspect.Signature(every)
        return run

    return decorate


def shown(value: object, digits: int = 4) -> str:
    """A number, several of them, or anything else, for people.

    Args:
        value: An entry of a summary.
        digits: Of each number that is not whole.
    """
    if isinstance(value, float):
        return f"{value:.{digits}g}"
    if isinstance(value, list):
        return ", ".join(shown(each, digits) for each in value)
    if isinstance(value, dict):
        return ", ".join(f"{key} {shown(each, digits)}" for key, each in value.items())
    return str(value)


def plain_table(summary: dict[str, object]) -> Table:
    """The entries of a summary, one below the other.

    Args:
        summary: Values by their names.
    """
    table = Table(show_header=False, box=None, padding=(0, 2))
    for key, value in summary.items():
        table.add_row(key.replace("_", " "), shown(value))
    return table


def summary_table(
    title: str, summary: dict[str, object], rows: dict[str, tuple[str, str]], digits: int = 4
) -> Table:
    """A summary with units and meanings; entries that are None are left out.

    Args:
        title: Of the table.
        summary: What `rows` describes.
        rows: Unit and meaning of each entry.
        digits: Of each number that is not whole.
    """
    table = Table(title=escape(title))
    for heading in ("", "value", "unit", "meaning"):
        table.add_column(heading, justify="right" if heading == "value" else "left")
    for key, value in summary.items():
        if value is not None:
            table.add_row(key, shown(value, digits), *rows[key])
    return table


def titled_table(title: str, head: Sequence[str], rows: Iterable[Sequence[str]]) -> Table:
    """A table as a study's report has it, with its title above its left end.

    Args:
        title: Words; square brackets are no markup.
        head: Of the columns.
        rows: Cells of each.
    """
    table = Table(title=Text(title), title_justify="left", box=None)
    for number, each in enumerate(head):
        table.add_column(each, justify="right" if number else "left")
    for row in rows:
        table.add_row(*row)
    return table


def tell(
    said: object,
    *shown: RenderableType,
    as_json: bool,
    written: Sequence[str] = (),
    out: Path | None = None,
) -> None:
    """Print what came out.

    Args:
        said: All of it, where one JSON object is wanted and nothing else.
        shown: Tables and sentences for people.
        as_json: Whether that is wanted.
        written: Names of files in `out`, which people are told.
        out: The folder, if there is one.
    """
    if as_json:
        typer.echo(json.dumps(said, indent=2))
        return
    console = Console()
    for each in shown:
        # A sentence is one line, however narrow the terminal.
        console.print(each, soft_wrap=isinstance(each, str | Text))
    if out is not None:
        console.print(f"Wrote {', '.join(written)} to [bold]{escape(str(out))}[/]", soft_wrap=True)


# Rich's type of it has the name of two things of ours, between which the pages could not tell.
def progress_bar(console: Console, attended: bool):
    """A bar with an estimate of the time left, which disappears at its end.

    Args:
        console: Where; where that is no terminal, nothing is written.
        attended: Whether anybody watches; nothing is shown otherwise.
    """
    return Progress(
        *Progress.get_default_columns()[:-1],
        TimeRemainingColumn(),
        console=console,
        transient=True,
        disable=not (attended and console.is_terminal),
    )


@contextmanager
def counting_bar(console: Console, what: str, *, shown: bool):
    """A bar that counts; it disappears at its end.

    Args:
        console: Where.
        what: What is counted.
        shown: Whether to show it; nothing is written where the console is no terminal.

    Yields:
        What is called with how many are done, and of how many.
    """
    columns = (
        *Progress.get_default_columns()[:-1],
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    disable = not (shown and console.is_terminal)
    with Progress(*columns, console=console, transient=True, disable=disable) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


if TYPE_CHECKING:
    from pydrake.geometry import Meshcat


class WatchedRun:
    """A run as options ask for it: `opened`, below a `bar`, then `tell` and `stay`.

    What has to be planned first has its `folder`, and its `page` when there is something to see.
    """

    def __init__(self, out: Path | None, *, as_json: bool, meshcat: bool | None, replay: bool):
        """Find out who watches.

        Args:
            out: Folder of the results; None keeps none.
            as_json: Whether standard output is to have one JSON object alone.
            meshcat: Whether to show it live; None: where somebody sits at a terminal.
            replay: Whether results have a replay.
        """
        self.console = Console(stderr=as_json)
        self.attended = sys.stdout.isatty() and sys.stdin.isatty() and not as_json
        self.live = self.attended if meshcat is None else meshcat
        self.recording = out is not None and replay
        self._out, self._as_json = out, as_json

    @contextmanager
    def opened(self, *, steered: bool = False) -> Generator[tuple[Path | None, "Meshcat | None"]]:
        """The folder to write into, and the page to draw on; either may be None.

        A folder that cannot be written is found out before the run, not after it.

        Args:
            steered: Whether somebody takes part on the page, so that there must be one.

        Raises:
            InvalidInput: See `output_folder`.
        """
        with self.folder() as folder:
            yield folder, self.page(steered=steered)

    def folder(self) -> AbstractContextManager[Path | None]:
        """The folder to write into, which may be None; see `opened`."""
        return optional_folder(self._out)

    def page(self, *, steered: bool = False) -> "Meshcat | None":
        """The page to draw on, which may be None; where somebody watches, its address is told.

        Args:
            steered: Whether somebody takes part on the page, so that there must be one.
        """
        if not (self.live or self.recording or steered):
            return None
        # It loads Drake, for which nonsense among the options should not wait.
        from ..visuals.live_page import open_live_page

        page = open_live_page()
        if self.live:
            self.console.print(f"Watch it at [bold]{page.web_url()}[/]")
        return page

    def bar(self):
        """See `progress_bar`."""
        return progress_bar(self.console, self.attended)

    def tell(self, summary: dict[str, object], written: list[str], *shown: RenderableType) -> None:
        """Print what came out, and what was written.

        Args:
            summary: As JSON.
            written: Names of files.
            shown: Tables and sentences for people.
        """
        tell(summary, *shown, as_json=self._as_json, written=written, out=self._out)

    def stay(self) -> None:
        """Keep the live page while somebody looks at it."""
        if self.live and self.attended:
            self.console.input("The page stays open until you press Enter.")
