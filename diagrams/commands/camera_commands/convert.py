"""`sightfield camera convert`: a camera from the file of one program to that of another."""

from pathlib import Path
from typing import Annotated

import typer

from ....systems.numerics.vision.camera_models.camera_files import (
    FORMS,
    load_camera_model,
    save_camera_model,
)


def convert(
    source: Annotated[
        Path,
        typer.Argument(help="File of OCamCalib, OpenCV (omnidir, fisheye), Kalibr or Sightfield."),
    ],
    target: Annotated[Path, typer.Argument(help="File to write.")],
    form: Annotated[
        str, typer.Option("--format", help=f"Of the file to write: {', '.join(FORMS)}.")
    ] = "sightfield",
) -> None:
    """Read a camera from one program's file and write it as another's.

    A model is never changed for another: a form that has no place for it is refused.
    """
    camera = load_camera_model(source)
    save_camera_model(target, camera, form)
    typer.echo(f"Wrote {type(camera).__name__} to {target}")
