"""What `sightfield guarantee --certify` plays, prints and leaves behind."""

import json
import math
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import typer
from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from ..outputs import output_folder
from ..tracking.certified_games import CertifiedGame, play_certified_games, tally
from ..tracking.game import TrackingGame
from ..tracking.promises_picture import save_promises_picture


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
    columns = (
        *Progress.get_default_columns()[:-1],
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    quiet = as_json or not console.is_terminal
    with output_folder(out) if out is not None else nullcontext() as folder:
        with Progress(*columns, console=console, transient=True, disable=quiet) as bar:
            task = bar.add_task("games", total=None)
            found = play_certified_games(
                game.scenario,
                games=games,
                seed=seed,
                world=game.world,
                progress=lambda done, total: bar.update(task, completed=done, total=total),
            )
        summary = summarise_games(found, game, seed)
        text = json.dumps(summary, indent=2)
        if folder is not None:
            (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
            save_promises_picture(folder / "promises.png", found, game.scenario.seconds)
    if as_json:
        typer.echo(text)
    else:
        Console().print(_table(summary))
    for each in found:
        if each.promises.breach:
            typer.echo(f"broken: {_name(each)}: {each.promises.breach}", err=True)
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
                "certificate": _finite(g.promises.claimed),
                "lasted": g.promises.lasted,
                "margin": _finite(g.promises.margin),
                "withdrawn": g.promises.withdrawn,
                "reassignments": g.reassignments,
            }
            for g in games
        ],
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _name(game: CertifiedGame) -> str:
    return f"game {game.number} against {game.policy} (seed {game.seed})"


def _table(summary: dict[str, Any]) -> Table:
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
