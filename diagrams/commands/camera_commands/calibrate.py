"""`sightfield camera calibrate`: k, h, the exact optics, and how well each does."""

import json
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import track
from rich.table import Table

from ....systems.numerics.errors import require_positive
from ....systems.numerics.vision.boards.calibrate import MODELS as BOARD_MODELS
from ....systems.numerics.vision.estimation.calibration import calibrate as calibrate_readings
from ....systems.numerics.vision.estimation.calibration_files import (
    save_calibration,
)
from ....systems.numerics.vision.estimation.labelled_pictures import (
    read_pictures,
    simulated_pictures,
)
from ....systems.numerics.vision.estimation.picture_folders import (
    load_pictures,
    read_labels,
)
from ....systems.numerics.vision.estimation.range_models import MODELS
from ....systems.numerics.vision.estimation.readings import THESIS_DISTANCES
from ....systems.numerics.vision.estimation.shell_colours import chosen_colours
from ....systems.numerics.vision.sensor import Sensor
from ....systems.numerics.vision.shells import shell_of
from ...outputs import output_folder
from ...vision.calibration.camera_file import load_camera
from ...vision.calibration.plots import save_direction_spread, save_error_curves
from ...vision.calibration.summary import summarise_calibration
from .board import calibrate_board
from .options import (
    COLOUR_HELP,
    QUALITY,
    SHELL,
    BaseOption,
    CameraOption,
    JsonOption,
    NoiseOption,
    RadiusOption,
    SeedOption,
    TopOption,
)


def calibrate(
    pictures: Annotated[
        Path | None,
        typer.Option(
            help="Folder of real pictures; a table shells.csv (file, distance_m or distance_in, "
            "bearing_rad or bearing_deg) or names as 15in_90deg.png say where the shell stands: "
            "distance from the mirror's axis to the shell's near side, bearing counter-clockwise "
            "from the front [default: simulated pictures, 15 to 60 inches]."
        ),
    ] = None,
    camera: CameraOption = None,
    colour: Annotated[str, typer.Option(help=f"Of the shell. {COLOUR_HELP}.")] = "red",
    base: BaseOption = SHELL.base,
    top: TopOption = SHELL.top,
    radius: RadiusOption = SHELL.radius,
    board: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMNSxROWS",
            help="Calibrate on pictures of a checkerboard instead, with so many inner corners.",
        ),
    ] = None,
    square: Annotated[
        str, typer.Option(help="With --board: of its squares, as 0.03 or 0.03x0.031 [m].")
    ] = "0.03",
    model: Annotated[
        str, typer.Option(help=f"With --board: one of {', '.join(BOARD_MODELS)}.")
    ] = "scaramuzza",
    height: Annotated[
        float | None,
        typer.Option(help="h, if measured: of the mirror's focus above the bottom edge [m]."),
    ] = None,
    directions: Annotated[int, typer.Option(help="Simulated: bearings at each distance.")] = 24,
    noise: NoiseOption = QUALITY.noise,
    seed: SeedOption = 0,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for calibration.json, summary.json, plots."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compute k and h, fit the exact optics, and compare both on the same pictures (2.2.4.2).

    The radius of the mirror and its distance from the pinhole are taken from the optics; all else
    is fitted, starting there. With --board a camera of any central model is fitted to the corners
    of a checkerboard, and written for OCamCalib, OpenCV and Kalibr.
    """
    if board is not None:
        calibrate_board(pictures, board, square, model, out, as_json)
        return
    optics, (shade,) = load_camera(camera), chosen_colours([colour])
    shell = shell_of(colour, radius=radius, base=base, top=top)
    if height is not None:
        require_positive("height", height)
    if pictures is None:
        sensor = Sensor(noise=noise, seed=seed)
        taken = simulated_pictures(
            optics, sensor, shell, distances=THESIS_DISTANCES, directions=directions
        )
        count = len(THESIS_DISTANCES) * directions
    else:
        labels = read_labels(pictures)
        taken, count = load_pictures(labels), len(labels)
    with output_folder(out) if out is not None else nullcontext() as folder:
        # To standard error, so that the report alone can be redirected.
        shown = track(
            taken,
            "Pictures",
            count,
            console=Console(stderr=True),
            transient=True,
            disable=as_json,
        )
        readings, skipped = read_pictures(shown, optics, shade)
        found = calibrate_readings(
            readings, camera=optics, base=base, shell_radius=radius, shell_top=top, height=height
        )
        summary = summarise_calibration(found, skipped, optics if pictures is None else None)
        text = json.dumps(summary, indent=2)
        if folder is not None:
            save_calibration(folder / "calibration.json", found)
            (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
            save_error_curves(folder / "error_curves.png", found)
            save_direction_spread(folder / "direction_spread.png", found)
    if as_json:
        typer.echo(text)
        return
    console = Console()
    console.print(
        f"k = {found.k:.3f} ± {found.k_spread:.3f} px/rad, h = {found.height:.4f} m, "
        f"{len(readings.distance)} pictures, {len(skipped)} skipped",
        markup=False,
        highlight=False,
    )
    for line in skipped:
        console.print(f"Skipped {line}", markup=False)
    table = Table("model", *(escape(f"{name} [mm]") for name in ("mean error", "spread", "worst")))
    for model in MODELS:
        curve = found.curves[model]
        values = (curve.mean_absolute_error, curve.spread.mean(), np.abs(curve.mean_error).max())
        table.add_row(model, *(f"{1000 * value:.2f}" for value in values))
    console.print(table)
