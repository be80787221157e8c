"""`sightfield track`: play a tracking game, watch it, keep what happened."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from ...systems.numerics.errors import require, require_non_negative
from ..rosbag.bag import require_mcap
from ..scenario_files import Setting, builtin_scenarios, find_scenario, load_scenario
from ..tracking.game import STARTS, set_up_game, with_random_starts
from ..tracking.report import summarise_tracking, write_tracking_report, write_tracking_rosbag
from ..tracking.run import TrackingRun, run_tracking
from ..tracking.scenario import TrackingScenario
from ..world_source import WorldSource
from .shared import (
    JsonSummaryOption,
    MeshcatOption,
    ReplayOption,
    SecondsOption,
    SeedOption,
    WatchedRun,
    plain_table,
    with_options,
)

# What the log is called for other tools.
_MCAP = "log.mcap"


def track(
    scenario: Annotated[
        str, typer.Argument(help=f"YAML file, or one of: {', '.join(builtin_scenarios())}.")
    ] = "thesis_3v4",
    setting: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Set a key, as pursuers.top_speed=0.4."),
    ] = None,
    seconds: SecondsOption = None,
    seed: SeedOption = None,
    world: Annotated[
        Path | None,
        typer.Option(help="Play in this world (WKT, GeoJSON or ROS map), from random starts."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for summary, log and replay.")] = None,
    as_json: JsonSummaryOption = False,
    meshcat: MeshcatOption = None,
    replay: ReplayOption = True,
    mcap: Annotated[
        bool, typer.Option("--mcap", help="With --out: write log.mcap, a ROS 2 bag.")
    ] = False,
    realtime: Annotated[
        float | None,
        typer.Option(
            help="Simulated seconds per second, 0: as fast as possible [default: 1 live, else 0]."
        ),
    ] = None,
) -> None:
    """Pursuers keep evaders in sight among polygons, until one is lost or time is up."""
    game = set_up_game(_load(scenario, setting or [], seconds, seed, world))
    require_non_negative("--realtime", realtime or 0.0)
    require(out is not None or not mcap, "--mcap", "come with --out", "none")
    if mcap:
        require_mcap()
    watched = WatchedRun(out, as_json=as_json, meshcat=meshcat, replay=replay)
    steered = "you" in game.scenario.evaders.policy_of_each
    with watched.opened(steered=steered) as (folder, page):
        with watched.bar() as bar:
            task = bar.add_task("simulated", total=game.scenario.seconds)
            run = run_tracking(
                game,
                page,
                recording=watched.recording,
                live=watched.live,
                realtime_rate=realtime if realtime is not None else float(watched.live),
                progress=lambda time: bar.update(task, completed=time),
            )
        name = Path(scenario).stem if world is None else f"{Path(scenario).stem} in {world.stem}"
        summary = summarise_tracking(run, name)
        written = write_tracking_report(run, summary, folder) if folder is not None else []
        if folder is not None and mcap:
            write_tracking_rosbag(run, folder / _MCAP)
            written.append(_MCAP)
    watched.tell(summary, written, plain_table(summary), _ending(run))
    watched.stay()


def _load(
    name: str, settings: list[str], seconds: float | None, seed: int | None, world: Path | None
) -> TrackingScenario:
    """The scenario with everything that the command line changes in it."""
    path = find_scenario(name)
    every = with_options(settings, {"--seconds": ("seconds", seconds), "--seed": ("seed", seed)})
    if world is not None:
        # It puts both teams elsewhere, too: a team of another size has no places of its own.
        counted = {each.key.removesuffix(".count") for each in every if each.key.endswith(".count")}
        every += [
            Setting(key, "[]" if key.split(".")[0] in counted else None, "--world")
            for key in ("world", *STARTS)
        ]
    scenario = load_scenario(TrackingScenario, path, every)
    if world is None:
        return replace(scenario, world=scenario.world.beside(path.parent))
    elsewhere = with_random_starts(scenario)
    return replace(elsewhere, world=WorldSource(file=str(world)))


def _ending(run: TrackingRun) -> str:
    if run.lost_evader is None:
        return f"Every evader was in sight for {run.tracking_time:.2f} s."
    return f"Evader {run.lost_evader} was out of sight at {run.tracking_time:.2f} s."
