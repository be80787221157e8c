"""`sightfield study`: play grids of games, compare them, replay any single one."""

import json
import os
import sys
import tempfile
from collections.abc import Callable
from contextlib import contextmanager, nullcontext
from dataclasses import asdict, fields
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from ...systems.numerics.errors import require, require_one_of
from ...systems.numerics.geometry.arenas.random_arena import Arena
from ..outputs import output_folder
from ..scenario_files import build, with_settings
from ..studies.assignment_study import assignment_grid, assignment_study
from ..studies.engine import run_study
from ..studies.grid import Grid
from ..studies.records import recorded_study
from ..studies.report import write_scenario, write_study_report
from ..studies.study import Study
from ..studies.summary import summarise
from ..studies.tracking_study import SECONDS, thesis_base, tracking_grid, tracking_study
from ..tracking.game import set_up_game
from ..tracking.live_page import open_live_page
from ..tracking.report import write_report
from ..tracking.run import run_tracking
from ..tracking.scenario import TrackingScenario
from ..tracking.summary import summarise as summarise_run
from ..world_source import WorldSource

study = typer.Typer(help="Play a grid of games many times over, with statistics.")

Runs = Annotated[int | None, typer.Option(help="Runs of each cell [default: 1000].")]
Seed = Annotated[int | None, typer.Option(help="Root of all seeds [default: 0].")]
Seconds = Annotated[float | None, typer.Option(help=f"Horizon [s] [default: {SECONDS:g}].")]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Set a key of every game, as evaders.top_speed=0.15, or of the random worlds, as "
        "arena.obstacles=8.",
    ),
]
OneWorld = Annotated[
    Path | None,
    typer.Option(
        "--world", help="Play in this world (WKT, GeoJSON or ROS map), not in random ones."
    ),
]
Workers = Annotated[
    int | None, typer.Option(help="Processes; 0: play in this one [default: one a core].")
]
Cluster = Annotated[
    str | None, typer.Option(help="Dask scheduler to play on instead, as tcp://host:8786.")
]
Resume = Annotated[
    Path | None, typer.Option(help="Folder of an interrupted study: go on where it stopped.")
]
Only = Annotated[
    str | None,
    typer.Option(metavar="CELL:RUN", help="Replay this run alone, as 3v4-uniform:17."),
]
Out = Annotated[
    Path | None, typer.Option(help="Folder for table, summary and pictures; or of the replay.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")]


@study.command()
def tracking(
    runs: Runs = None,
    seed: Seed = None,
    seconds: Seconds = None,
    setting: Settings = None,
    world: OneWorld = None,
    workers: Workers = None,
    cluster: Cluster = None,
    resume: Resume = None,
    only: Only = None,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """How long 1 to 4 pursuers keep 1 to 4 evaders in sight, with each risk vector.

    Figures 2.16 to 2.18 of the thesis.
    """
    chosen = _choose(tracking_study, "tracking", runs, seed, seconds, setting, world, resume)
    _do(chosen, tracking_grid, workers, cluster, resume, only, out, as_json)


@study.command()
def assignment(
    runs: Runs = None,
    seed: Seed = None,
    seconds: Seconds = None,
    setting: Settings = None,
    world: OneWorld = None,
    workers: Workers = None,
    cluster: Cluster = None,
    resume: Resume = None,
    only: Only = None,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Whether three pursuers with three risk functions gain from ranking and aggregation.

    Figure 2.19 of the thesis.
    """
    chosen = _choose(assignment_study, "assignment", runs, seed, seconds, setting, world, resume)
    _do(chosen, assignment_grid, workers, cluster, resume, only, out, as_json)


def _choose(
    make: Callable[..., Study],
    name: str,
    runs: int | None,
    seed: int | None,
    seconds: float | None,
    settings: list[str] | None,
    world: Path | None,
    resume: Path | None,
) -> Study:
    """The study that is begun in a folder, or that the options describe."""
    if resume is not None:
        given = (runs, seed, seconds, settings, world)
        require(
            all(each is None for each in given),
            "--resume",
            "come without --runs, --seed, --seconds, --set and --world, which its folder knows",
            "one of them",
        )
        begun = recorded_study(resume)
        require(begun.name == name, "--resume", f"hold the study {name}", begun.name)
        return begun
    source = None if world is None else WorldSource(file=str(world.resolve()))
    base = thesis_base(SECONDS if seconds is None else seconds, source)
    arena = [each.removeprefix("arena.") for each in settings or [] if each.startswith("arena.")]
    others = [each for each in settings or [] if not each.startswith("arena.")]
    known = [each.name for each in fields(Arena)]
    for each in arena:
        require_one_of("--set arena", each.partition("=")[0], known)
    require(not (arena and world), "--set", "not set the arena with --world", f"arena.{arena[:1]}")
    return make(
        runs=1000 if runs is None else runs,
        seed=0 if seed is None else seed,
        base=build(TrackingScenario, with_settings(asdict(base), others)),
        arena=build(Arena, with_settings(asdict(Arena()), arena)) if world is None else None,
    )


def _do(
    chosen: Study,
    grid_of: Callable[[Study], Grid],
    workers: int | None,
    cluster: str | None,
    resume: Path | None,
    only: str | None,
    out: Path | None,
    as_json: bool,
) -> None:
    """Play a study or one run of it, show what came out, and keep it."""
    console = Console(stderr=as_json)
    if only is not None:
        summary = _replay(chosen, only, out, console)
        if as_json:
            print(json.dumps(summary, indent=2))
        return
    require(resume is None or out in (None, resume), "--out", "be left out with --resume", out)
    place = resume or out
    grid = grid_of(chosen)
    count = (os.cpu_count() or 1) if workers is None else workers
    with tempfile.TemporaryDirectory() if place is None else nullcontext(place) as folder:
        with _bar(console, shown=sys.stdout.isatty() and not as_json) as progress:
            try:
                result = run_study(
                    chosen, Path(folder), workers=count, cluster=cluster, progress=progress
                )
            except KeyboardInterrupt:
                if place is not None:
                    console.print(f"Go on with: sightfield study {chosen.name} --resume {place}")
                raise
        summary = summarise(result, grid)
        written = ["table.parquet"]
        if place is not None:
            with output_folder(place) as scratch:
                written += write_study_report(result, grid, summary, scratch)
    if as_json:
        print(json.dumps(summary, indent=2))
        return
    _show(console, summary, grid)
    if place is not None:
        console.print(f"Wrote {', '.join(written)} to [bold]{place}[/]")


def _replay(chosen: Study, only: str, out: Path | None, console: Console) -> dict[str, object]:
    """Play one run with its log and replay."""
    name, colon, number = only.rpartition(":")
    require(bool(colon) and number.isdigit(), "--only", "have the form CELL:RUN", only)
    scenario = chosen.scenario(chosen.cell(name), int(number))
    game = set_up_game(scenario)
    with output_folder(out) if out is not None else nullcontext() as folder:
        page = open_live_page() if folder is not None else None
        run = run_tracking(game, page, recording=page is not None)
        summary = summarise_run(run, f"{chosen.name}, cell {name}, run {number}")
        if folder is not None:
            written = write_report(run, summary, folder)
            write_scenario(scenario, folder / "scenario.yaml")
            console.print(f"Wrote {', '.join([*written, 'scenario.yaml'])} to [bold]{out}[/]")
    ended = "the horizon" if run.lost_evader is None else f"the loss of evader {run.lost_evader}"
    console.print(f"{name}, run {number}: {run.tracking_time:.6f} s, to {ended}")
    return summary


@contextmanager
def _bar(console: Console, *, shown: bool):
    """A progress bar with an estimate of the time left; yields what a study reports to."""
    columns = (
        *Progress.get_default_columns()[:-1],
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    with Progress(*columns, console=console, transient=True, disable=not shown) as bar:
        task = bar.add_task("games", total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _show(console: Console, summary: dict[str, Any], grid: Grid) -> None:
    """Print restricted means and the clearest comparisons."""
    cells, level = summary["cells"], f"{summary['confidence']:.0%}"
    for panel in grid.means:
        evaders = sorted({m for series in panel.series.values() for m in series})
        # Text: Rich would take [s] for markup.
        title = Text(f"{panel.title}: mean up to the horizon [s], {level} interval")
        table = Table(title=title, title_justify="left", box=None)
        table.add_column("evaders")
        for m in evaders:
            table.add_column(str(m), justify="right", no_wrap=True)
        for label, series in panel.series.items():
            table.add_row(label, *(_interval(cells[series[m]]["mean"]) for m in evaders))
        console.print(table)
    clear = [each for each in summary["comparisons"] if each["holm_p"] < 0.05]
    console.print(
        f"{len(clear)} of {len(summary['comparisons'])} paired differences are significant at 5% "
        "after Holm's correction; summary.json has all."
    )


def _interval(mean: dict[str, float]) -> str:
    return f"{_short(mean['value'])} ({_short(mean['low'])}-{_short(mean['high'])})"


def _short(value: float) -> str:
    return f"{value:.1f}" if value < 9.95 else f"{value:.0f}"
