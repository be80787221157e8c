"""`sightfield guarantee`: how long sight can be kept on a map, whatever the evader does.

With `--certify`, games of certified pursuers, and whether every promise was kept.
"""

import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from ...systems.numerics.errors import require, require_positive
from ...systems.numerics.geometry.edge_index import build_edge_index
from ...systems.numerics.geometry.segment_sight import segment_is_clear
from ...systems.numerics.geometry.world_files import load_world
from ...systems.numerics.tracking.visibility_game.bounds import BOUNDS
from ...systems.numerics.tracking.visibility_game.files import (
    load_guaranteed_times,
    save_guaranteed_times,
)
from ...systems.numerics.tracking.visibility_game.guaranteed_times import GuaranteedTimes
from ..outputs import optional_folder, write_json
from ..scenario_files import Setting, builtin_scenarios, find_scenario, load_scenario
from ..tracking.certified_games import CertifiedGame, play_certified_games, tally
from ..tracking.game import TrackingGame, set_up_game
from ..tracking.guarantee_picture import save_guarantee_picture, save_promises_picture
from ..tracking.scenario import Evaders, Pursuers, TrackingScenario
from ..tracking.solved_game import games_folder, recall_or_solve
from ..world_source import WorldSource
from .shared import (
    JsonOption,
    counting_bar,
    given_options,
    progress_bar,
    refuse_unused,
    summary_table,
    tell,
)

# Unit and meaning of each entry of a summary.
ROWS = {
    "bound": ("", "which of the three bounds"),
    "pursuer": ("m", "position"),
    "evader": ("m", "position"),
    "in_sight": ("", "whether the one sees the other; null without an evader"),
    "guaranteed_time": ("s", "until sight is lost, by that bound; null: for ever"),
    "lower": ("s", "what is certified, where the lower bound was asked for"),
    "middle": ("s", "by the middle bound, where that was asked for"),
    "upper": ("s", "what no pursuer can exceed, where the upper bound was asked for"),
    "kept_for_ever": ("", "part of all pairs in sight that can be kept so for ever"),
    "speed_ratio": ("", "evader's speed over the pursuer's"),
    "grid": ("m", "between the pursuer's nodes"),
    "evader_grid": ("m", "between the evader's nodes"),
    "step": ("s", "what is counted"),
    "horizon": ("s", "what lasts longer counts as for ever"),
    "pairs": ("", "pairs of nodes in sight of each other"),
    "megabytes": ("MB", "what the table takes"),
    "sight_range": ("m", "how far the pursuer sees; null: any distance"),
    "recalled": ("", "whether it was solved before: from the cache, or the file given"),
    "cpu_seconds": ("s", "to solve the game, or to read it"),
}


# What says nothing beside an option: of one place and one table beside games, and of games beside
# these; of how to solve beside a table that is solved; of a scenario beside a world of points.
_SHORT = {"certify_games": "certify", "setting": "set"}
OF_GAMES = ("games", "seed")
BESIDE = {
    "certify": (
        "pursuer",
        "evader",
        "save",
        "load",
        "bound",
        "horizon",
        "sight_range",
        "memory",
        "cache",
    ),
    "load": ("grid", "bound", "horizon", "sight_range", "memory", "cache"),
    "world": ("scenario", "set"),
}


def guarantee(
    context: typer.Context,
    scenario: Annotated[
        str, typer.Argument(help=f"YAML file, or one of: {', '.join(builtin_scenarios())}.")
    ] = "thesis_3v4",
    setting: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Set a key, as pursuers.top_speed=0.4."),
    ] = None,
    world: Annotated[
        Path | None,
        typer.Option(help="Instead: points in this world (WKT, GeoJSON or ROS map)."),
    ] = None,
    pursuer: Annotated[
        tuple[float, float] | None,
        typer.Option(
            metavar="X Y",
            help="Where the pursuer is [m] [default: the scenario's first; with --world the best].",
        ),
    ] = None,
    evader: Annotated[
        tuple[float, float] | None,
        typer.Option(
            metavar="X Y",
            help="Where the evader is [m] [default: the scenario's first that it sees].",
        ),
    ] = None,
    grid: Annotated[
        float | None,
        typer.Option(
            help="Between the pursuer's nodes; finer for `lower` and `upper` [m] [default: 0.1; "
            "with --certify as in the scenario]."
        ),
    ] = None,
    bound: Annotated[
        str,
        typer.Option(
            help="`middle`, or certified in the plane: `lower`, which the pursuer can keep, or "
            "`upper`, which it cannot exceed."
        ),
    ] = "middle",
    speed_ratio: Annotated[
        float | None,
        typer.Option(help="Evader's speed over the pursuer's [default: as in the scenario, 0.3]."),
    ] = None,
    horizon: Annotated[
        float, typer.Option(help="What lasts longer counts as for ever [s].")
    ] = 120.0,
    sight_range: Annotated[float, typer.Option(help="How far the pursuer sees [m].")] = math.inf,
    memory: Annotated[float, typer.Option(help="What the table may take [GB].")] = 4.0,
    cache: Annotated[
        bool, typer.Option(help="Keep the solved game on disk, and take it from there.")
    ] = True,
    save: Annotated[Path | None, typer.Option(help="File to save the solved game in.")] = None,
    load: Annotated[
        Path | None,
        typer.Option(help="Such a file instead of solving: its own grid, bound, speeds and range."),
    ] = None,
    certify_games: Annotated[
        bool,
        typer.Option(
            "--certify",
            help="Play games instead: certified pursuers from drawn starts, in teams as large as "
            "the scenario's, against every evader; exit code 1 if a promise is broken.",
        ),
    ] = False,
    games: Annotated[int, typer.Option(help="With --certify: starts, against each evader.")] = 5,
    seed: Annotated[int, typer.Option(help="With --certify: of the starts.")] = 0,
    as_json: JsonOption = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder to leave guarantee.png, or with --certify promises.png, and summary.json "
            "in."
        ),
    ] = None,
) -> None:
    """How long one pursuer can keep one evader in sight, whatever the evader does.

    The game of the two is solved on a grid, with all corners of the map at once.
    """
    given = {_SHORT.get(name, name): value for name, value in given_options(context).items()}
    refuse_unused(given, beside=BESIDE, without={"certify": OF_GAMES})
    require_positive("memory", memory)
    later = {
        "--grid": ("pursuers.grid", grid),
        "--speed-ratio": ("evaders.top_speed", speed_ratio),
    }
    own = [Setting(key, None, option) for option, (key, at) in later.items() if at is not None]
    game = _game(scenario, [*(setting or []), *own], world)
    if certify_games:
        certify(_with(game, grid, speed_ratio), games=games, seed=seed, as_json=as_json, out=out)
        return
    fast = game.scenario.pursuers.top_speed
    slow = game.scenario.evaders.top_speed
    if speed_ratio is not None:
        require_positive("speed_ratio", speed_ratio)
        slow = speed_ratio * fast
    if save is not None:
        # Before minutes of work.
        require(save.parent.is_dir(), "save", "be in a folder that exists", save)
    console = Console(stderr=True)
    with optional_folder(out) as folder:
        started = time.process_time()
        if load is not None:
            table, recalled = load_guaranteed_times(load), True
            _require_fit(table, game, load, speed_ratio)
        else:
            with progress_bar(console, not as_json) as bar:
                task = bar.add_task("settled", total=1.0)
                table, recalled = recall_or_solve(
                    game.world,
                    folder=games_folder() if cache else None,
                    pursuer_speed=fast,
                    evader_speed=slow,
                    grid=0.1 if grid is None else grid,
                    bound=bound,
                    pursuer_regions=game.pursuer_regions,
                    evader_regions=game.evader_regions,
                    horizon=horizon,
                    sight_range=sight_range,
                    memory=1e9 * memory,
                    progress=lambda part: bar.update(task, completed=part),
                )
        seconds = time.process_time() - started
        p, e = _positions(game, table, pursuer, evader, placed=world is None)
        if save is not None:
            save_guaranteed_times(table, save)
        summary = summarise(table, p, e)
        summary |= {"recalled": recalled, "cpu_seconds": round(seconds, 3)}
        if folder is not None:
            write_json(folder / "summary.json", summary)
            save_guarantee_picture(folder / "guarantee.png", table, game.world, p, e)
    written = ("summary.json", "guarantee.png")
    tell(summary, _table(summary), as_json=as_json, written=written, out=out)


def summarise(
    table: GuaranteedTimes, pursuer: np.ndarray, evader: np.ndarray | None
) -> dict[str, object]:
    """The entries of a summary, ready for JSON, but for where it is from and the time; see ROWS.

    Args:
        table: The game, solved.
        pursuer, evader: Positions, shape (2,) [m]; without an evader there are no times.

    Raises:
        InvalidInput: One of the two cannot be there.
    """
    table.nearest_place(pursuer)
    found, seen = None, None
    if evader is not None:
        value = table.time(pursuer, evader)
        found = None if math.isinf(value) else value
        seen = math.hypot(*(evader - pursuer)) <= table.sight_range
        seen = seen and bool(segment_is_clear(table.sight, *pursuer, *evader))
    times: dict[str, float | None] = dict.fromkeys(BOUNDS)
    times[table.bound] = found
    return {
        "bound": table.bound,
        "pursuer": pursuer.tolist(),
        "evader": None if evader is None else evader.tolist(),
        "in_sight": seen,
        "guaranteed_time": found,
        **times,
        "kept_for_ever": table.share_for_ever,
        "speed_ratio": table.evader_speed / table.pursuer_speed,
        "grid": table.pursuer_grid.spacing,
        "evader_grid": table.evader_grid.spacing,
        "step": table.step,
        "horizon": table.horizon,
        "pairs": table.pairs,
        "megabytes": table.nbytes / 1e6,
        "sight_range": None if math.isinf(table.sight_range) else table.sight_range,
    }


def _require_fit(
    table: GuaranteedTimes, game: TrackingGame, path: Path, speed_ratio: float | None
) -> None:
    """Refuse a table of another world, of robots of another size or of another ratio."""
    mine, its = build_edge_index(*game.pursuer_regions).edges, table.pursuer_region.edges
    fits = mine.shape == its.shape and np.allclose(mine, its, atol=game.world.tolerance)
    require(fits, "load", "be of this world and of robots of this size", path)
    ratio = table.evader_speed / table.pursuer_speed
    same = speed_ratio is None or math.isclose(speed_ratio, ratio, rel_tol=1e-9)
    require(same, "speed_ratio", f"be that of the table, which is {ratio:.6g}", speed_ratio)


def _game(name: str, settings: list[str | Setting], world: Path | None) -> TrackingGame:
    """The scenario's game, or one of points in a world of one's own."""
    if world is None:
        path = find_scenario(name)
        scenario = load_scenario(TrackingScenario, path, settings)
        return set_up_game(replace(scenario, world=scenario.world.beside(path.parent)))
    loaded = load_world(world).world
    scenario = TrackingScenario(
        world=WorldSource(file=str(world)),
        pursuers=Pursuers(top_speed=0.3, count=1),
        evaders=Evaders(top_speed=0.09, count=1),
    )
    return set_up_game(scenario, loaded)


def _with(game: TrackingGame, grid: float | None, speed_ratio: float | None) -> TrackingGame:
    """A game with another grid and ratio of speeds, where they are given."""
    scenario = game.scenario
    pursuers, evaders = scenario.pursuers, scenario.evaders
    if grid is not None:
        pursuers = replace(pursuers, grid=grid)
    if speed_ratio is not None:
        require_positive("speed_ratio", speed_ratio)
        evaders = replace(evaders, top_speed=speed_ratio * pursuers.top_speed)
    return replace(game, scenario=replace(scenario, pursuers=pursuers, evaders=evaders))


def _positions(
    game: TrackingGame,
    table: GuaranteedTimes,
    pursuer: tuple[float, float] | None,
    evader: tuple[float, float] | None,
    *,
    placed: bool,
) -> tuple[np.ndarray, np.ndarray | None]:
    """Where the two are: as asked, as in the scenario, or the best place and nobody."""
    if pursuer is not None:
        p = np.array(pursuer)
    elif placed:
        p = game.pursuer_starts[0, :2]
    else:
        p = table.places[int(np.argmax(table.watched))]
    if evader is not None:
        return p, np.array(evader)
    if not placed:
        return p, None
    sight = build_edge_index(game.world)
    seen = [e for e in game.evader_starts[:, :2] if segment_is_clear(sight, *p, *e)]
    return p, seen[0] if seen else game.evader_starts[0, :2]


def _table(summary: dict[str, object]) -> Table:
    shown = {key: value for key, value in summary.items() if key not in BOUNDS}
    if summary["evader"] is not None and summary["guaranteed_time"] is None:
        shown["guaranteed_time"] = "for ever"
    return summary_table("The visibility game", shown, ROWS)


def certify(game: TrackingGame, *, games: int, seed: int, as_json: bool, out: Path | None) -> None:
    """Play games of certified pursuers against every evader; say whether all promises were kept.

    Args:
        game: Whose world, robots and sizes of teams.
        games: Starts, each against every policy.
        seed: Of the starts.
        as_json: Print one JSON object and nothing else.
        out: Folder to leave promises.png and summary.json in.

    Raises:
        InvalidInput: A number is out of its range, or these robots cannot be certified.
        Exit: With code 1, if a promise was broken.
    """
    console = Console(stderr=True)
    with optional_folder(out) as folder:
        with counting_bar(console, "games", shown=not as_json) as progress:
            found = play_certified_games(
                game.scenario, games=games, seed=seed, world=game.world, progress=progress
            )
        summary = summarise_games(found, game, seed)
        if folder is not None:
            write_json(folder / "summary.json", summary)
            save_promises_picture(folder / "promises.png", found, game.scenario.seconds)
    written = ("summary.json", "promises.png")
    tell(summary, _games_table(summary), as_json=as_json, written=written, out=out)
    for each in found:
        if each.promises.breach:
            typer.echo(f"broken: {_game_name(each)}: {each.promises.breach}", err=True)
    if any(each.promises.breach for each in found):
        raise typer.Exit(1)


def summarise_games(games: list[CertifiedGame], game: TrackingGame, seed: int) -> dict[str, Any]:
    """What is said of all games, ready for JSON: infinite and missing times are null.

    Args:
        games: As played.
        game: Whose world, robots and sizes of teams.
        seed: Of the starts.

    Returns:
        pursuers, evaders (sizes), seconds (horizon) [s], seed; policies: of each the games, how
        many kept every promise, how many promised something that stood to the end, how many lost
        sight, least margin [s] and promises withdrawn; broken: policy, number, seed and words of
        each game with a broken promise; games: of each policy, number, seed, tracking_time [s],
        certificate (the one that stood and was tried hardest, null for ever) [s], lasted (sight
        from then on) [s], margin [s], withdrawn, reassignments.
    """
    return {
        "pursuers": game.scenario.pursuers.size,
        "evaders": game.scenario.evaders.size,
        "seconds": game.scenario.seconds,
        "seed": seed,
        "policies": {policy: each._asdict() for policy, each in tally(games).items()},
        "broken": [
            {"policy": g.policy, "game": g.number, "seed": g.seed, "breach": g.promises.breach}
            for g in games
            if g.promises.breach
        ],
        "games": [
            {
                "policy": g.policy,
                "game": g.number,
                "seed": g.seed,
                "tracking_time": g.tracking_time,
                "lost_evader": g.lost_evader,
                "certificate": _or_null(g.promises.claimed),
                "lasted": g.promises.lasted,
                "margin": _or_null(g.promises.margin),
                "withdrawn": g.promises.withdrawn,
                "reassignments": g.reassignments,
            }
            for g in games
        ],
    }


def _or_null(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _game_name(game: CertifiedGame) -> str:
    return f"game {game.number} against {game.policy} (seed {game.seed})"


def _games_table(summary: dict[str, Any]) -> Table:
    sizes = f"{summary['pursuers']} against {summary['evaders']}"
    table = Table(title=f"Certified pursuers, {sizes}, {summary['seconds']:g} s")
    table.add_column("evaders", no_wrap=True)
    for head in ("kept", "of", "certified", "sight lost", "least T - C [s]", "withdrawn"):
        table.add_column(head, justify="right")
    for policy, each in summary["policies"].items():
        margin = "-" if each["margin"] is None else f"{each['margin']:.2f}"
        counts = (each[key] for key in ("kept", "games", "promised", "lost"))
        table.add_row(policy, *map(str, counts), margin, str(each["withdrawn"]))
    return table
