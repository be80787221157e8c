"""`sightfield study`: play grids of games, compare them, replay any single one."""

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
from rich.console import Console, RenderableType

from ...systems.numerics.errors import require, require_one_of
from ...systems.numerics.geometry.random_arena import Arena
from ..outputs import NoRoom, optional_folder, output_folder
from ..scenario_files import Setting, build, with_settings
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
from ..tracking.game import STARTS, set_up_game
from ..tracking.report import summarise_tracking, write_tracking_report
from ..tracking.run import run_tracking
from ..tracking.scenario import TrackingScenario
from ..visuals.live_page import open_live_page
from ..world_source import WorldSource
from .shared import JsonSummaryOption, counting_bar, takes, tell, titled_table, with_options
from .study_map import study_map

# What Ctrl-C is answered at once.
_FINISHING = "Finishing the games that are being played; Ctrl-C again drops them."

study = typer.Typer(help="Play a grid of games many times over, with statistics.")
study.command("map")(study_map)


def _runs_option(runs: int) -> Any:
    return typer.Option(help=f"Runs of each cell [default: {runs}].")


OpponentsOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="POLICY",
        help=f"Evaders to play against; again for more [default: {', '.join(OPPONENTS)}].",
    ),
]


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What options say that all studies share; None: nothing.

    Attributes:
        opponent_runs: Runs against some of the evaders, "best_response=100".
        seed: Root of all seeds.
        seconds: Horizon [s].
        settings: "key=value", for every game or, as "arena.key=value", for the random worlds.
        world: A map in which all is played.
        workers: Processes; 0: this one.
        cluster: Address of Dask's scheduler.
        resume: Folder of an interrupted study.
        only: "CELL:RUN", which is to be replayed.
        out: Folder of results.
        as_json: Whether to print JSON.
    """

    opponent_runs: list[str] | None
    seed: int | None
    seconds: float | None
    settings: list[str] | None
    world: Path | None
    workers: int | None
    cluster: str | None
    resume: Path | None
    only: str | None
    out: Path | None
    as_json: bool

    @property
    def study(self) -> list[object]:
        """What is said of the games, not of how they are played."""
        return [self.opponent_runs, self.seed, self.seconds, self.settings, self.world]


def read_asked(
    opponent_runs: Annotated[
        list[str] | None,
        typer.Option(
            metavar="POLICY=RUNS",
            help="Runs of each cell against these evaders, where not --runs [default: "
            f"{', '.join(f'{name}={number}' for name, number in FEWER.items())}, or --runs if "
            "fewer].",
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Root of all seeds [default: 0].")] = None,
    seconds: Annotated[
        float | None, typer.Option(help=f"Horizon [s] [default: {SECONDS:g}].")
    ] = None,
    setting: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="KEY=VALUE",
            help="Set a key of every game, as evaders.top_speed=0.15, or of the random worlds, as "
            "arena.obstacles=8.",
        ),
    ] = None,
    world: Annotated[
        Path | None,
        typer.Option(help="Play in this world (WKT, GeoJSON or ROS map), not in random ones."),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help="Processes; 0: play in this one [default: one a core].")
    ] = None,
    cluster: Annotated[
        str | None, typer.Option(help="Dask scheduler to play on instead, as tcp://host:8786.")
    ] = None,
    resume: Annotated[
        Path | None, typer.Option(help="Folder of an interrupted study: go on where it stopped.")
    ] = None,
    only: Annotated[
        str | None,
        typer.Option(metavar="CELL:RUN", help="Replay this run, as 3v4-uniform-best_response:17."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for table, summary and pictures; or of the replay.")
    ] = None,
    as_json: JsonSummaryOption = False,
) -> Asked:
    """What the options say."""
    return Asked(
        opponent_runs=opponent_runs,
        seed=seed,
        seconds=seconds,
        settings=setting,
        world=world,
        workers=workers,
        cluster=cluster,
        resume=resume,
        only=only,
        out=out,
        as_json=as_json,
    )


@study.command()
@takes(read_asked)
def tracking(
    asked: Asked,
    runs: Annotated[int | None, _runs_option(RUNS)] = None,
    opponent: OpponentsOption = None,
) -> None:
    """How long 1 to 4 pursuers keep 1 to 4 evaders in sight, with each risk vector.

    Figures 2.16 to 2.18 of the thesis, against each opponent.
    """
    chosen = _choose(tracking_study, "tracking", asked, (runs, RUNS), (opponent, OPPONENTS))
    _do(chosen, tracking_grid, asked)


@study.command()
@takes(read_asked)
def assignment(
    asked: Asked,
    runs: Annotated[int | None, _runs_option(RUNS)] = None,
    opponent: OpponentsOption = None,
) -> None:
    """Whether three pursuers with three risk functions gain from ranking and aggregation.

    Figure 2.19 of the thesis, against each opponent.
    """
    chosen = _choose(assignment_study, "assignment", asked, (runs, RUNS), (opponent, OPPONENTS))
    _do(chosen, assignment_grid, asked)


@study.command()
@takes(read_asked)
def policies(
    asked: Asked,
    runs: Annotated[int | None, _runs_option(POLICY_RUNS)] = None,
    opponent: Annotated[
        list[str] | None,
        typer.Option(
            metavar="POLICY", help="Evaders to play against; again for more [default: all of them]."
        ),
    ] = None,
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
) -> None:
    """What each way to pursue is worth against each way to escape: a matrix for each pair of teams.

    The thesis's pursuers, with and without holding their assignments, on the field of margins, with
    a look ahead, and by the solved visibility game.
    """
    own = {"sizes": size, "starts": starts, "pursuers": pursuers}
    counted, against = (runs, POLICY_RUNS), (opponent, POLICIES)
    chosen = _choose(policies_study, "policies", asked, counted, against, **own)
    _do(chosen, policies_grid, asked)


def _choose(
    make: Callable[..., Study],
    name: str,
    asked: Asked,
    runs: tuple[int | None, int],
    opponents: tuple[Sequence[str] | None, Sequence[str]],
    **own: object,
) -> Study:
    """The study that is begun in a folder, or that the options describe.

    Runs and opponents are what is asked for, and those of a study of which nothing is said; `own`
    is what only this study has.
    """
    if asked.resume is not None:
        said = (*asked.study, runs[0], opponents[0], *own.values())
        require(
            all(each is None for each in said),
            "--resume",
            "come without options of the study, which its folder knows",
            "one of them",
        )
        begun = recorded_study(asked.resume)
        require(begun.name == name, "--resume", f"hold the study {name}", begun.name)
        return begun
    world, settings = asked.world, asked.settings or []
    source = None if world is None else WorldSource(file=str(world.resolve()))
    every = with_options(settings, {"--seconds": ("seconds", asked.seconds)})
    arena = [each for each in every if each.key.startswith("arena.")]
    others = [each for each in every if not each.key.startswith("arena.")]
    if world is not None:
        others.append(Setting("world", None, "--world"))
    known = [each.name for each in fields(Arena)]
    for each in arena:
        require_one_of("--set arena", each.key.removeprefix("arena."), known)
    require(not (arena and world), "--set", "not set the arena with --world", settings)
    worlds = with_settings({"arena": asdict(Arena())}, arena)["arena"]
    against = opponents[0] or opponents[1]
    number = runs[1] if runs[0] is None else runs[0]
    chosen = make(
        runs=number,
        opponents=against,
        opponent_runs=fewer_runs(against, number, read_opponent_runs(asked.opponent_runs or [])),
        seed=0 if asked.seed is None else asked.seed,
        base=build(TrackingScenario, with_settings(asdict(thesis_base(SECONDS, source)), others)),
        arena=build(Arena, worlds) if world is None else None,
        **{key: value for key, value in own.items() if value is not None},
    )
    # What every cell sets itself would be lost without a word.
    varied = {key.partition("=")[0] for cell in chosen.cells for key in cell.settings}
    varied |= {"seed", *STARTS}
    for key, _, said in others:
        require(key not in varied, "--set", f"leave to the study what it varies: {key}", said)
    return chosen


def _do(chosen: Study, grid_of: Callable[[Study], StudyGrid], asked: Asked) -> None:
    """Play a study or one run of it, show what came out, and keep it."""
    resume, out, as_json = asked.resume, asked.out, asked.as_json
    console = Console(stderr=as_json)
    if asked.only is not None:
        tell(_replay(chosen, asked.only, out, console), as_json=as_json)
        return
    require(resume is None or out in (None, resume), "--out", "be left out with --resume", out)
    place = resume or out
    again = f"sightfield study {chosen.name} --resume {place}"
    grid = grid_of(chosen)
    count = (os.cpu_count() or 1) if asked.workers is None else asked.workers
    shown = sys.stdout.isatty() and not as_json
    try:
        with tempfile.TemporaryDirectory() if place is None else nullcontext(place) as folder:
            with counting_bar(console, "games", shown=shown) as progress:
                result = run_study(
                    chosen,
                    Path(folder),
                    workers=count,
                    cluster=asked.cluster,
                    progress=progress,
                    interrupted=lambda: console.print(_FINISHING),
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
    tell(summary, *_shown(summary, grid), as_json=as_json, written=written, out=place)


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


def _shown(summary: dict[str, Any], grid: StudyGrid) -> list[RenderableType]:
    """Restricted means, whom they are worst against, and the clearest comparisons."""
    tables = [titled_table(each.title, each.head, each.rows) for each in mean_tables(summary, grid)]
    worst = [each for row in summary["worst"].values() for each in row.values()]
    counts = ", ".join(f"{opponent} {count}" for opponent, count in Counter(worst).most_common())
    clear = [each for each in summary["comparisons"] if each["holm_p"] < 0.05]
    return [
        *tables,
        f"Strongest opponent, of {len(worst)} pairs of teams and pursuers: {counts}.",
        f"{len(clear)} of {len(summary['comparisons'])} paired differences are significant at 5% "
        "after Holm's correction; summary.json has all.",
    ]
