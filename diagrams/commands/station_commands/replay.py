"""`sightfield station replay`: a recorded run once more, and whether it gives the same commands."""

import json
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ....systems.numerics.errors import require_non_negative
from ...outputs import output_folder
from ...station.hardware import Operator
from ...station.replay import load_recording, replay_station
from ...station.session import show_on_view
from .options import DEFAULT_PORT, JsonOption, PortOption


def replay(
    log: Annotated[Path, typer.Argument(help="run.log or run.mcap of a run of a station.")],
    out: Annotated[Path | None, typer.Option(help="Folder for summary.json.")] = None,
    as_json: JsonOption = False,
    view: Annotated[bool, typer.Option(help="Show it in the operator's view.")] = False,
    port: PortOption = DEFAULT_PORT,
    realtime: Annotated[
        float | None,
        typer.Option(
            help="Seconds per second, 0: as fast as possible [default: 1 with a view, else 0]."
        ),
    ] = None,
) -> None:
    """Play a recorded run through the diagrams that made it; exit code 1 if commands differ,
    or records are lost."""
    recording = load_recording(log)
    require_non_negative("--realtime", realtime or 0.0)
    rate = realtime if realtime is not None else float(view)
    console = Console(stderr=as_json)
    with ExitStack() as stack:
        scratch = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        link = None
        if view:
            link, url = stack.enter_context(
                show_on_view(
                    recording.scenario,
                    recording.game,
                    title=log.stem,
                    mode=f"replay of {recording.mode}",
                    operator=Operator(),
                    port=port,
                )
            )
            console.print(f"Operator's view: [bold]{url}[/]", soft_wrap=True)
        result = replay_station(recording, scratch / "replay.log", view=link, realtime_rate=rate)
        if link is not None:
            link.end("the end of the log")
    summary = {
        "log": str(log),
        "mode": recording.mode,
        "ticks": result.ticks,
        "complete": recording.log.complete,
        "unread_bytes": recording.log.unread,
        "lost_records": recording.log.lost,
        "missing_ticks": result.missing,
        "identical": result.identical,
        "first_difference": result.first_difference,
        "greatest_difference": result.greatest_difference,
        "differing": list(result.differing),
    }
    if out is not None:
        with output_folder(out) as folder:
            text = json.dumps(summary, indent=2) + "\n"
            (folder / "summary.json").write_text(text, encoding="utf-8")
    if as_json:
        print(json.dumps(summary, indent=2))
    elif result.identical:
        console.print(f"{result.ticks} ticks, and every command is the same, bit for bit.")
    else:
        console.print(
            f"{result.ticks} ticks; commands differ from tick {result.first_difference} on, by "
            f"{result.greatest_difference:.3g} at most; differing: {', '.join(result.differing)}."
        )
    if not recording.log.complete and not as_json:
        console.print(
            f"The run was broken off: its log was not closed, {recording.log.unread} bytes at its "
            "end are no whole record."
        )
    if recording.log.lost and not as_json:
        console.print(
            f"The log is damaged: {recording.log.lost} of its records lost, {result.missing} of "
            "them ticks; what is left was played."
        )
    if not result.identical or recording.log.lost:
        raise typer.Exit(1)
