"""`sightfield station`: run a game in the laboratory, look what is connected and who is
who, try a kind of robots, play a log again or write it as a ROS 2 bag, open the view."""

from typing import Any

import typer

from .run_by_default import RunByDefault
from .station_commands.check import check
from .station_commands.convert import convert
from .station_commands.identify import identify_robots
from .station_commands.kind_check import kind_check
from .station_commands.replay import replay
from .station_commands.run import run
from .station_commands.view import view

station: Any = typer.Typer(
    cls=RunByDefault,
    help=(
        "Run a tracking game in the laboratory: simulated, emulated, or real. Without a command: "
        "run, whose options `sightfield station run --help` lists."
    ),
    rich_markup_mode=None,
)
station.command()(run)
station.command()(check)
station.command()(convert)
station.command("identify")(identify_robots)
station.command("kind-check")(kind_check)
station.command()(replay)
station.command()(view)
