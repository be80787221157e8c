"""`sightfield study map`: how much of what is seen can be kept in sight, on which maps."""

import os
import sys
from dataclasses import asdict, fields
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ...systems.numerics.errors import require, require_one_of
from ...systems.numerics.geometry.random_arena import Arena
from ...systems.numerics.geometry.world_files import load_world
from ..outputs import optional_folder
from ..scenario_files import build, with_settings
from ..studies.map_study import (
    FACTORS,
    VALUES,
    MapResult,
    MapStudy,
    map_tables,
    run_map_study,
    summarise_maps,
    write_map_report,
)
from .shared import JsonSummaryOption, counting_bar, tell, titled_table


def study_map(
    factor: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help=f"What to vary, of {', '.join(FACTORS)}; again for more [all]."
        ),
    ] = None,
    arenas: Annotated[int, typer.Option(help="Random arenas of each value.")] = 10,
    speed_ratio: Annotated[
        float, typer.Option(help="Evader's speed over the pursuer's, where it is not varied.")
    ] = 0.3,
    grid: Annotated[float, typer.Option(help="Between the pursuer's nodes [m].")] = 0.1,
    bound: Annotated[
        str, typer.Option(help="Of the visibility game: lower, middle or upper.")
    ] = "middle",
    seed: Annotated[int, typer.Option(help="Root of all seeds.")] = 0,
    setting: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="KEY=VALUE", help="Of the random arenas, as arena.obstacles=8."
        ),
    ] = None,
    world: Annotated[
        Path | None,
        typer.Option(help="Vary the ratio alone, in this world (WKT, GeoJSON or ROS map)."),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help="Processes; 0: solve in this one [default: one a core].")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for table, summary and picture.")] = None,
    as_json: JsonSummaryOption = False,
) -> None:
    """What the map decides: which part of what a pursuer sees can be kept in sight for ever.

    The visibility game is solved in random arenas, over number, size and spacing of their obstacles
    and over the speed ratio; no games are played.
    """
    chosen = _choose(factor, arenas, speed_ratio, grid, bound, seed, setting or [], world)
    count = (os.cpu_count() or 1) if workers is None else workers
    console = Console(stderr=as_json)
    with optional_folder(out) as folder:
        result = _solve(chosen, count, console, shown=sys.stdout.isatty() and not as_json)
        summary = summarise_maps(result)
        written = [] if folder is None else write_map_report(result, summary, folder)
    tables = [titled_table(each.title, each.head, each.rows) for each in map_tables(summary)]
    tell(summary, *tables, as_json=as_json, written=written, out=out)


def _choose(
    factors: list[str] | None,
    arenas: int,
    speed_ratio: float,
    grid: float,
    bound: str,
    seed: int,
    settings: list[str],
    world: Path | None,
) -> MapStudy:
    """The study that the options describe."""
    known = [f"arena.{each.name}" for each in fields(Arena)]
    for each in settings:
        require_one_of("--set", each.partition("=")[0], known)
    require(not (settings and world), "--set", "not set the arena with --world", settings)
    tree = with_settings({"arena": asdict(Arena())}, settings)["arena"]
    own = None if world is None else load_world(world).world
    for name in factors or []:
        require_one_of("factor", name, FACTORS)
        fits = own is None or name == "speed_ratio"
        require(fits, "factor", "be speed_ratio in a world of your own", name)
    return MapStudy(
        arena=build(Arena, tree),
        world=own,
        speed_ratio=speed_ratio,
        values={name: VALUES[name] for name in dict.fromkeys(factors or FACTORS)},
        arenas=arenas,
        seed=seed,
        grid=grid,
        bound=bound,
    )


def _solve(chosen: MapStudy, workers: int, console: Console, *, shown: bool) -> MapResult:
    """Solve all maps below a bar."""
    with counting_bar(console, "maps", shown=shown) as progress:
        return run_map_study(chosen, workers=workers, progress=progress)
