"""`sightfield station rosbag`: a recorded run as a ROS 2 bag."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ...outputs import output_folder
from ...rosbag.bag import BAG, require_rosbags
from ...station.replay import load_recording
from ...station.rosbag import write_station_rosbag


def rosbag(
    log: Annotated[Path, typer.Argument(help="run.log of a run of a station, in any mode.")],
    out: Annotated[Path, typer.Option(help="Folder that gets rosbag/.")],
) -> None:
    """Write a recorded run as a ROS 2 bag (MCAP); exit code 1 if records of the log are lost."""
    require_rosbags()
    recording = load_recording(log)
    with output_folder(out) as folder:
        write_station_rosbag(recording, folder / BAG)
    console = Console()
    console.print(f"Wrote {BAG} to [bold]{out}[/]")
    if recording.log.lost:
        console.print(f"The log is damaged: {recording.log.lost} of its records are not in it.")
        raise typer.Exit(1)
