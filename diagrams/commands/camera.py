"""`sightfield camera`: calibrate an omni-directional camera, take pictures, and read them.

`track` has pursuers that know of evaders only what their pictures show.
"""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from ...systems.numerics.errors import InvalidInput, require, require_non_negative
from ..outputs import optional_folder
from ..scenario_files import builtin_scenarios, find_scenario, load_scenario
from ..tracking.game import with_random_starts
from ..vision import scenarios
from ..vision.report import (
    WeightSweep,
    summarise_picture_tracking,
    sweep_weights,
    write_picture_report,
    write_sweep,
)
from ..vision.run import run_picture_tracking
from ..vision.scenario import PictureTrackingScenario, set_up_picture_game
from .camera_calibrate import calibrate
from .camera_pictures import convert, estimate, render
from .shared import (
    JsonSummaryOption,
    MeshcatOption,
    ReplayOption,
    RunFolderOption,
    SecondsOption,
    SeedOption,
    WatchedRun,
    given_options,
    plain_table,
    progress_bar,
    refuse_unused,
    shown,
    tell,
    with_options,
)

# A sweep of weights is not watched, and has no weight of its own.
BESIDE_SWEEP = ("weight", "meshcat", "replay", "realtime")


def track_on_pictures(
    context: typer.Context,
    scenario: Annotated[
        str,
        typer.Argument(help=f"YAML file, or one of: {', '.join(builtin_scenarios(scenarios))}."),
    ] = "omni_1v1",
    setting: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Set a key, as vision.quality.noise=8."),
    ] = None,
    weight: Annotated[
        float | None, typer.Option(help="w of (2.7): 1 the pursuit field alone, 0 the pull alone.")
    ] = None,
    truth: Annotated[
        bool, typer.Option("--truth", help="Track on true positions instead, to compare.")
    ] = False,
    sweep: Annotated[
        str | None,
        typer.Option(metavar="W,W,...", help="Run at each of these weights, and compare."),
    ] = None,
    seeds: Annotated[
        int,
        typer.Option(help="With --sweep: runs at each weight; more than 1 start at random places."),
    ] = 1,
    seconds: SecondsOption = None,
    seed: SeedOption = None,
    out: RunFolderOption = None,
    as_json: JsonSummaryOption = False,
    meshcat: MeshcatOption = None,
    replay: ReplayOption = True,
    realtime: Annotated[
        float | None,
        typer.Option(
            help="Simulated seconds per second, 0: as fast as possible [default: 1 live, else 0]."
        ),
    ] = None,
) -> None:
    """Track on the pictures of omni-cameras alone, by the modified pursuit field."""
    given = given_options(context)
    refuse_unused(given, beside={"sweep": BESIDE_SWEEP}, without={"sweep": ["seeds"]})
    require_non_negative("--realtime", realtime or 0.0)
    options = {
        "--weight": ("vision.weight", weight),
        "--seconds": ("seconds", seconds),
        "--seed": ("seed", seed),
        "--truth": ("vision.senses", "truth" if truth else None),
    }
    path = find_scenario(scenario, scenarios)
    loaded = load_scenario(PictureTrackingScenario, path, with_options(setting, options))
    loaded = replace(loaded, world=loaded.world.beside(path.parent))
    if sweep is not None:
        _sweep(loaded, _weights(sweep), seeds, out, as_json)
        return
    game = set_up_picture_game(loaded)
    watched = WatchedRun(out, as_json=as_json, meshcat=meshcat, replay=replay)
    with watched.opened() as (folder, page):
        with watched.bar() as bar:
            task = bar.add_task("simulated", total=loaded.seconds)
            run = run_picture_tracking(
                game,
                page,
                recording=watched.recording,
                live=watched.live,
                realtime_rate=realtime if realtime is not None else float(watched.live),
                progress=lambda time: bar.update(task, completed=time),
            )
        summary = summarise_picture_tracking(run, path.stem)
        written = write_picture_report(run, summary, folder) if folder is not None else []
    watched.tell(summary, written, plain_table(summary))
    watched.stay()


def _sweep(
    scenario: PictureTrackingScenario,
    weights: list[float],
    seeds: int,
    out: Path | None,
    as_json: bool,
) -> None:
    """Run every weight with every seed, and show the means."""
    require(seeds > 0, "--seeds", "be positive", seeds)
    console = Console(stderr=as_json)
    if seeds > 1:
        elsewhere = with_random_starts(scenario)
        scenario = replace(scenario, pursuers=elsewhere.pursuers, evaders=elsewhere.evaders)
    numbers = range(scenario.seed, scenario.seed + seeds)
    with optional_folder(out) as folder:
        with progress_bar(console, not as_json) as bar:
            task = bar.add_task("runs", total=len(weights) * seeds)
            found = sweep_weights(
                scenario, weights, numbers, lambda done: bar.update(task, completed=done)
            )
        written = write_sweep(found, folder) if folder is not None else []
    said = {"seeds": found.seeds.tolist(), "means": found.table()}
    tell(said, _sweep_table(found), as_json=as_json, written=written, out=out)


def _sweep_table(sweep: WeightSweep) -> Table:
    rows = sweep.table()
    units = {"tracking_time": "s", "estimation_error_rms": "m", "mean_distance": "m"}
    table = Table(box=None, padding=(0, 2))
    for name in rows[0]:
        unit = f" [{units[name]}]" if name in units else ""
        # Square brackets would be markup.
        table.add_column(f"{name.replace('_', ' ')}{unit}".replace("[", r"\["), justify="right")
    for row in rows:
        # A run in which sight was kept says only that it would have lasted at least so long.
        least = {"tracking_time": ">="} if row["censored_runs"] else {}
        table.add_row(*(least.get(name, "") + shown(value) for name, value in row.items()))
    return table


def _weights(words: str) -> list[float]:
    try:
        return [float(word) for word in words.split(",")]
    except ValueError:
        raise InvalidInput(f"`--sweep` must be numbers, as 0,0.5,1; got {words}") from None


camera = typer.Typer(
    help="Calibrate an omni-directional camera, take pictures with it, and read them.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
camera.command()(calibrate)
camera.command()(convert)
camera.command()(render)
camera.command()(estimate)
camera.command("track")(track_on_pictures)
