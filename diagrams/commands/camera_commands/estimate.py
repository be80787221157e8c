"""`sightfield camera estimate`: where the shells in a picture are."""

import json
import math
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from ....systems.numerics.errors import require
from ....systems.numerics.vision.estimation.calibration_files import (
    load_calibration,
)
from ....systems.numerics.vision.estimation.pictures import (
    load_picture,
    require_contrast,
)
from ....systems.numerics.vision.estimation.range_models import MODELS
from ....systems.numerics.vision.estimation.shell_colours import chosen_colours
from ....systems.numerics.vision.estimation.shell_search import search_shells
from ...outputs import output_folder
from ...vision.calibration.found_shells import save_found_picture, summarise_found
from .options import (
    COLOUR_HELP,
    JsonOption,
    PoseOption,
)


def estimate(
    picture: Annotated[Path, typer.Argument(help="PNG or JPEG file.")],
    calibration: Annotated[Path, typer.Option(help="File of `sightfield camera calibrate`.")],
    colour: Annotated[
        list[str] | None,
        typer.Option(help=f"Look for this shell; again for more. {COLOUR_HELP} [default: red]."),
    ] = None,
    model: Annotated[str, typer.Option(help=f"Of ranges: {' or '.join(MODELS)}.")] = "exact",
    pose: PoseOption = (0.0, 0.0, 0.0),
    out: Annotated[
        Path | None, typer.Option(help="Folder for estimate.png and summary.json.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Say where the shells in a picture are, and how surely, or why there is no telling."""
    names = colour or ["red"]
    known, colours = load_calibration(calibration), chosen_colours(names)
    for value in pose:
        require(math.isfinite(value), "pose", "be finite", pose)
    pixels = load_picture(picture)
    require_contrast(pixels)
    pairs = search_shells(pixels, colours, known, model)
    found = [(name, *pair) for name, pair in zip(names, pairs, strict=True)]
    summary = summarise_found(found, known, pose, model)
    text = json.dumps(summary, indent=2)
    if out is not None:
        with output_folder(out) as folder:
            (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
            save_found_picture(folder / "estimate.png", pixels, found, known)
    if as_json:
        typer.echo(text)
        return
    table = Table("shell", "outcome", escape("range [m]"), escape("bearing [rad]"))
    for name, _, each in found:
        spread = np.sqrt(np.diag(each.covariance))
        numbers = ["no estimate", ""]
        if each.outcome.has_estimate:
            numbers = [
                f"{each.range:.4f} ± {spread[0]:.4f}",
                f"{each.bearing:.4f} ± {spread[1]:.4f}",
            ]
        table.add_row(name, each.outcome.words, *numbers)
    Console().print(table)
