"""`sightfield camera`: calibrate an omni-directional camera, take pictures, and read them."""

import typer

from .camera_calibrate import calibrate
from .camera_estimate import estimate
from .camera_render import render
from .camera_track import track_on_pictures

camera = typer.Typer(
    help="Calibrate an omni-directional camera, take pictures with it, and read them.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
camera.command()(calibrate)
camera.command()(render)
camera.command()(estimate)
camera.command("track")(track_on_pictures)
