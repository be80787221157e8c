"""`sightfield station convert`: a recorded run as MCAP, or back."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ....systems.numerics.errors import require
from ...outputs import output_folder
from ...station.convert import convert_recording
from ...station.replay import load_recording


def convert(
    log: Annotated[Path, typer.Argument(help="run.log or run.mcap of a run of a station.")],
    out: Annotated[Path, typer.Argument(help="New file: NAME.mcap, or NAME.log.")],
) -> None:
    """Write a recorded run down anew, the same to the last bit; exit code 1 if records are lost."""
    require(out.suffix in (".mcap", ".log"), "out", "end in .mcap or .log", out)
    require(not out.exists(), "out", "be a new file", out)
    recording = load_recording(log)
    with output_folder(out.parent) as folder:
        convert_recording(recording, folder / out.name)
    console = Console()
    console.print(f"Wrote [bold]{out}[/]", soft_wrap=True)
    if recording.log.lost:
        console.print(f"The log is damaged: {recording.log.lost} of its records are not in it.")
        raise typer.Exit(1)
