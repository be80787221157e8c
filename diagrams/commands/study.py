"""`sightfield study`: play grids of games, compare them, replay any single one."""

import json
import os
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ...systems.numerics.errors import require, require_one_of
from ...systems.numerics.geometry.random_arena import Arena
from ..outputs import NoRoom, optional_folder, output_folder
from ..scenario_files import build, with_settings
from ..studies.engine import run_study
from ..studies.opponents import FEWER, OPPONENTS, POLICIES, RUNS, fewer_runs, read_opponent_runs
from ..studies.records import recorded_study
from ..studies.report import write_scenario, write_study_report
from ..studies.study import Study
from ..studies.summary import StudyGrid, mean_tables, summarise_study
from ..studies.team_studies import (
    POLICY_RUNS,
    PURSUIT,
    SECONDS,
    SIZES,
    USUAL,
    assignment_grid,
    assignment_study,
    policies_grid,
    policies_study,
    thesis_base,
    tracking_grid,
    tracking_study,
)
from ..tracking.game import set_up_game
from ..tracking.report import summarise_tracking, write_tracking_report
from ..tracking.run import run_tracking
from ..tracking.scenario import TrackingScenario
from ..visuals.live_page import open_live_page
from ..world_source import WorldSource
from .shared import counting_bar
from .study_map import study_map

study = typer.Typer(help="Play a grid of games many times over, with statistics.")
study.command("map")(study_map)


def _runs_option(runs: int) -> Any:
    return typer.Option(help=f"Runs of each cell [default: {runs}].")


Opponents = Annotated[
    list[str] | None,
    typer.Option(
        metavar="POLICY",
        help=f"Evaders to play against; again for more [default: {', '.join(OPPONENTS)}].",
    ),
]
OpponentRuns = Annotated[
    list[str] | None,
    typer.Option(
        metavar="POLICY=RUNS",
        help="Runs of each cell against these evaders, where not --runs [default: "
        f"{', '.join(f'{name}={number}' for name, number in FEWER.items())}, or --runs if fewer].",
    ),
]
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
    typer.Option(metavar="CELL:RUN", help="Replay this run, as 3v4-uniform-best_response:17."),
]
Out = Annotated[
    Path | None, typer.Option(help="Folder for table, summary and pictures; or of the replay.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")]


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """What the options say of a study; None: nothing.

    Attributes:
        runs: Of each cell.
        opponents: Policies of the evaders.
        opponent_runs: Runs against some of them, "best_response=100".
        seed: Root of all seeds.
        seconds: Horizon [s].
        settings: "key=value", for every game or, as "arena.key=value", for the random worlds.
        world: A map in which all is played.
        sizes: Of the teams, "3v4".
        starts: Runs that share an arena.
        pursuers: Names in the study of policies.
    """

    runs: int | None
    opponents: list[str] | None
    opponent_runs: list[str] | None
    seed: int | None
    seconds: float | None
    settings: list[str] | None
    world: Path | None
    sizes: list[str] | None = None
    starts: int | None = None
    pursuers: list[str] | None = None


@study.command()
def tracking(
    runs: Annotated[int | None, _runs_option(RUNS)] = None,
    opponent: Opponents = None,
    opponent_runs: OpponentRuns = None,
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

    Figures 2.16 to 2.18 of the thesis, against each opponent.
    """
    wanted = Wanted(
        runs=runs,
        opponents=opponent,
        opponent_runs=opponent_runs,
        seed=seed,
        seconds=seconds,
        settings=setting,
        world=world,
    )
    chosen = _choose(tracking_study, "tracking", wanted, resume, OPPONENTS, RUNS)
    _do(chosen, tracking_grid, workers, cluster, resume, only, out, as_json)


@study.command()
def assignment(
    runs: Annotated[int | None, _runs_option(RUNS)] = None,
    opponent: Opponents = None,
    opponent_runs: OpponentRuns = None,
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

    Figure 2.19 of the thesis, against each opponent.
    """
    wanted = Wanted(
        runs=runs,
        opponents=opponent,
        opponent_runs=opponent_runs,
        seed=seed,
        seconds=seconds,
        settings=setting,
        world=world,
    )
    chosen = _choose(assignment_study, "assignment", wanted, resume, OPPONENTS, RUNS)
    _do(chosen, assignment_grid, workers, cluster, resume, only, out, as_json)


@study.command()
def policies(
    runs: Annotated[int | None, _runs_option(POLICY_RUNS)] = None,
    opponent: Annotated[
        list[str] | None,
        typer.Option(
            metavar="POLICY", help="Evaders to play against; again for more [default: all of them]."
        ),
    ] = None,
    opponent_runs: OpponentRuns = None,
    size: Annotated[
        list[str] | None,
        typer.Option(metavar="NvM", help=f"Teams; again for more [default: {', '.join(SIZES)}]."),
    ] = None,
    pursuers: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help=f"Of {', '.join(PURSUIT)}; again for more [default: {', '.join(USUAL)}].",
        ),
    ] = None,
    starts: Annotated[
        int | None, typer.Option(help="Runs that share a random arena [default: 1].")
    ] = None,
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
    """What each way to pursue is worth against each way to escape: a matrix for each pair of teams.

    The thesis's pursuers, with and without holding their assignments, on the field of margins, with
    a look ahead, and by the solved visibility game.
    """
    wanted = Wanted(
        runs=runs,
        opponents=opponent,
        opponent_runs=opponent_runs,
        seed=seed,
        seconds=seconds,
        settings=setting,
        world=world,
        sizes=size,
        starts=starts,
        pursuers=pursuers,
    )
    chosen = _choose(policies_study, "policies", wanted, resume, POLICIES, POLICY_RUNS)
    _do(chosen, policies_grid, workers, cluster, resume, only, out, as_json)


def _choose(
    make: Callable[..., Study],
    name: str,
    wanted: Wanted,
    resume: Path | None,
    opponents: Sequence[str],
    runs: int,
) -> Study:
    """The study that is begun in a folder, or that the options describe.

    Opponents and runs are those of a study of which the options say nothing.
    """
    if resume is not None:
        require(
            all(each is None for each in vars(wanted).values()),
            "--resume",
            "come without options of the study, which its folder knows",
            "one of them",
        )
        begun = recorded_study(resume)
        require(begun.name == name, "--resume", f"hold the study {name}", begun.name)
        return begun
    world, settings = wanted.world, wanted.settings or []
    source = None if world is None else WorldSource(file=str(world.resolve()))
    base = thesis_base(SECONDS if wanted.seconds is None else wanted.seconds, source)
    arena = [each.removeprefix("arena.") for each in settings if each.startswith("arena.")]
    others = [each for each in settings if not each.startswith("arena.")]
    known = [each.name for each in fields(Arena)]
    for each in arena:
        require_one_of("--set arena", each.partition("=")[0], known)
    require(not (arena and world), "--set", "not set the arena with --world", f"arena.{arena[:1]}")
    against = wanted.opponents or opponents
    number = runs if wanted.runs is None else wanted.runs
    chosen = make(
        runs=number,
        opponents=against,
        opponent_runs=fewer_runs(against, number, read_opponent_runs(wanted.opponent_runs or [])),
        seed=0 if wanted.seed is None else wanted.seed,
        base=build(TrackingScenario, with_settings(asdict(base), others)),
        arena=build(Arena, with_settings(asdict(Arena()), arena)) if world is None else None,
        **({} if wanted.sizes is None else {"sizes": wanted.sizes}),
        **({} if wanted.starts is None else {"starts": wanted.starts}),
        **({} if wanted.pursuers is None else {"pursuers": wanted.pursuers}),
    )
    # What every cell sets itself would be lost without a word.
    varied = {key.partition("=")[0] for cell in chosen.cells for key in cell.settings}
    for each in others:
        key = each.partition("=")[0]
        require(key not in varied, "--set", f"leave to the study what it varies: {key}", each)
    return chosen


def _do(
    chosen: Study,
    grid_of: Callable[[Study], StudyGrid],
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
    again = f"sightfield study {chosen.name} --resume {place}"
    grid = grid_of(chosen)
    count = (os.cpu_count() or 1) if workers is None else workers
    try:
        with tempfile.TemporaryDirectory() if place is None else nullcontext(place) as folder:
            with counting_bar(
                console, "games", shown=sys.stdout.isatty() and not as_json
            ) as progress:
                result = run_study(
                    chosen, Path(folder), workers=count, cluster=cluster, progress=progress
                )
            summary = summarise_study(result, grid)
            written = ["table.parquet"]
            if place is not None:
                with output_folder(place) as scratch:
                    written += write_study_report(result, grid, summary, scratch)
    except KeyboardInterrupt:
        if place is not None:
            console.print(f"Go on with: {again}")
        raise
    except NoRoom as error:
        if place is None or not (place / "study.json").is_file():
            raise
        raise NoRoom(f"{error}; with room go on with: {again}") from None
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
    with optional_folder(out) as folder:
        page = open_live_page() if folder is not None else None
        run = run_tracking(game, page, recording=page is not None)
        summary = summarise_tracking(run, f"{chosen.name}, cell {name}, run {number}")
        if folder is not None:
            written = write_tracking_report(run, summary, folder)
            write_scenario(scenario, folder / "scenario.yaml")
            console.print(f"Wrote {', '.join([*written, 'scenario.yaml'])} to [bold]{out}[/]")
    ended = "the horizon" if run.lost_evader is None else f"the loss of evader {run.lost_evader}"
    console.print(f"{name}, run {number}: {run.tracking_time:.6f} s, to {ended}")
    return summary


def _show(console: Console, summary: dict[str, Any], grid: StudyGrid) -> None:
    """Print restricted means, whom they are worst against, and the clearest comparisons."""
    for each in mean_tables(summary, grid):
        # Text: Rich would take [s] for markup.
        table = Table(title=Text(each.title), title_justify="left", box=None)
        table.add_column(each.head[0])
        for head in each.head[1:]:
            table.add_column(head, justify="right")
        for row in each.rows:
            table.add_row(*row)
        console.print(table)
    worst = [each for row in summary["worst"].values() for each in row.values()]
    counts = ", ".join(f"{opponent} {count}" for opponent, count in Counter(worst).most_common())
    console.print(f"Strongest opponent, of {len(worst)} pairs of teams and pursuers: {counts}.")
    clear = [each for each in summary["comparisons"] if each["holm_p"] < 0.05]
    console.print(
        f"{len(clear)} of {len(summary['comparisons'])} paired differences are significant at 5% "
        "after Holm's correction; summary.json has all."
    )
