"""`sightfield camera`: calibrate an omni-directional camera, take pictures, and read them."""

import typer

from .camera_commands.calibrate import calibrate
from .camera_commands.convert import convert
from .camera_commands.estimate import estimate
from .camera_commands.render import render
from .camera_commands.track import track_on_pictures

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
