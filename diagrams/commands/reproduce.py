"""`sightfield reproduce`: every figure and table of the thesis again, on one page."""

import math
import os
import platform
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from ...systems.numerics.errors import require, require_one_of
from ..outputs import output_folder, write_json
from ..reproduction.exhibits.evidence import Exhibit, Workshop
from ..reproduction.make_exhibits import FAILED, Made, chosen_exhibits, make_exhibits, summarise
from ..reproduction.page import make_page
from ..studies.opponents import POLICIES, read_opponent_runs
from ..world_source import WorldSource
from .shared import JsonOption, tell


def reproduce(
    only: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ID",
            help="Of a figure or table, as figure-2.19, table-2.1, or beyond; again for more.",
        ),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Few runs and coarse grids: minutes instead of an hour.")
    ] = False,
    runs: Annotated[
        int | None,
        typer.Option(
            help="Of each cell of the studies, for a shorter report [default: up to 1000]."
        ),
    ] = None,
    opponent_runs: Annotated[
        list[str] | None,
        typer.Option(
            metavar="POLICY=RUNS",
            help="Of each cell against these evaders, as best_response=300; again for more.",
        ),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(help="Longest game of the studies [default: 120 in most]."),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help="Processes for studies, 0: none [default: one a core].")
    ] = None,
    world: Annotated[
        Path | None,
        typer.Option(help="Judge claims in this world as well (WKT, GeoJSON or ROS map)."),
    ] = None,
    out: Annotated[
        Path, typer.Option(help="Folder for report.html, summary.json and the pictures.")
    ] = Path("out/reproduction"),
    as_json: JsonOption = False,
) -> None:
    """Make the thesis's figures and tables again, and say where they agree with what it states.

    The page holds everything. Runs of Monte Carlo studies are kept in the folder's studies/, and
    continued there. If an exhibit cannot be made the page says why, the others are made, and the
    exit code is 1.
    """
    exhibits = chosen_exhibits(only or [])
    count = os.cpu_count() or 1 if workers is None else workers
    require(count >= 0, "workers", "be zero or positive", count)
    require(runs is None or runs > 1, "runs", "be two at least", runs)
    if seconds is not None:
        require(0.0 < seconds < math.inf, "seconds", "be positive and finite", seconds)
    numbers = read_opponent_runs(opponent_runs or [])
    for opponent, number in numbers.items():
        require_one_of("opponent-runs", opponent, POLICIES)
        require(number > 1, "opponent-runs", "be two at least", number)
    if world is not None:
        WorldSource(file=str(world)).load()
    console = Console(stderr=as_json)
    with output_folder(out) as folder:
        pictures = folder / "pictures"
        pictures.mkdir()
        workshop = Workshop(
            quick=quick,
            pictures=pictures,
            studies=out / "studies",
            workers=count,
            world=world,
            runs=runs,
            opponent_runs=numbers,
            seconds=seconds,
        )
        made = _make(exhibits, workshop, console)
        summary = summarise(made, quick=quick)
        page = make_page(made, quick=quick, made_with=_made_with())
        (folder / "report.html").write_text(page, encoding="utf-8")
        write_json(folder / "summary.json", summary)
    written = ("report.html", "summary.json", "pictures")
    tell(summary, _table(made), as_json=as_json, written=written, out=out)
    if any(each.verdict == FAILED for each in made):
        raise typer.Exit(1)


def _make(exhibits: tuple[Exhibit, ...], workshop: Workshop, console: Console) -> tuple[Made, ...]:
    """Make exhibits below a bar that says which is being made, and how far its study is."""
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        whole = bar.add_task("", total=len(exhibits))
        study = bar.add_task("", total=None, visible=False)

        def begin(exhibit: Exhibit) -> None:
            number = exhibits.index(exhibit)
            bar.update(study, visible=False)
            bar.update(whole, completed=number, description=", ".join(exhibit.covers) or exhibit.id)

        def play(done: int, total: int) -> None:
            words = f"{done} of {total} games"
            bar.update(study, completed=done, total=total, visible=True, description=words)

        told = replace(workshop, progress=play)
        return make_exhibits(exhibits, told, begin)


def _made_with() -> str:
    """Versions and machine."""
    names = ("sightfield", "drake", "numpy")
    versions = ", ".join(f"{name} {version(name)}" for name in names)
    return f"{versions}, Python {platform.python_version()}, {platform.system()}"


def _table(made: tuple[Made, ...]) -> Table:
    table = Table(box=None, padding=(0, 2))
    for heading in ("exhibit", "title", "verdict"):
        table.add_column(heading)
    table.add_column("s", justify="right")
    for each in made:
        covers = ", ".join(each.exhibit.covers) or each.exhibit.id
        table.add_row(covers, each.exhibit.title, each.verdict, f"{each.seconds:.1f}")
    return table
