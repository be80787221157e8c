"""`sightfield camera calibrate`: k, h, the exact optics, and how well each does.

With `--board`, a camera's model from pictures of a checkerboard.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Annotated, TypeVar

import numpy as np
import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from ...systems.numerics.errors import InvalidInput, require, require_positive, require_sized
from ...systems.numerics.vision.boards.board import Checkerboard, copied, find_corners
from ...systems.numerics.vision.boards.calibrate import MODELS as BOARD_MODELS
from ...systems.numerics.vision.boards.calibrate import calibrate_on_board, fixed_names
from ...systems.numerics.vision.boards.fit import fit_aspect, fit_intervals, held_out_residuals
from ...systems.numerics.vision.camera_models.camera_files import forms_of, save_camera_model
from ...systems.numerics.vision.estimation.calibration import THESIS_DISTANCES, save_calibration
from ...systems.numerics.vision.estimation.calibration import calibrate as calibrate_readings
from ...systems.numerics.vision.estimation.labelled_pictures import (
    load_pictures,
    read_labels,
    read_pictures,
    simulated_pictures,
)
from ...systems.numerics.vision.estimation.pictures import load_picture
from ...systems.numerics.vision.estimation.range_models import MODELS
from ...systems.numerics.vision.estimation.shell_detection import chosen_colours
from ...systems.numerics.vision.sensor import Sensor
from ...systems.numerics.vision.surroundings import shell_of
from ..outputs import optional_folder, write_json
from ..vision.calibration import (
    load_camera,
    save_direction_spread,
    save_error_curves,
    save_residuals,
    summarise_board,
    summarise_calibration,
)
from .camera_pictures import (
    COLOUR_HELP,
    QUALITY,
    SHELL,
    BaseOption,
    CameraOption,
    NoiseOption,
    RadiusOption,
    SeedOption,
    TopOption,
)
from .shared import JsonOption, given_options, progress_bar, refuse_unused, tell

Thing = TypeVar("Thing")

_ENDINGS = (".png", ".jpg", ".jpeg")
_NAMES = {
    "sightfield": "camera.json",
    "ocamcalib": "calib_results.txt",
    "opencv": "opencv.yaml",
    "kalibr": "camchain.yaml",
}
_FOLDS = 4


def calibrate_board(
    pictures: Path | None, words: str, square: str, model: str, out: Path | None, as_json: bool
) -> None:
    """Calibrate on the pictures of a folder that show the whole board, each once, and report."""
    board, fixed = _board(words, square), fixed_names(model)
    require(pictures is not None and pictures.is_dir(), "pictures", "be a folder", pictures)
    files = sorted(
        file for file in Path(str(pictures)).iterdir() if file.suffix.lower() in _ENDINGS
    )
    require(len(files) > 0, "pictures", f"hold files {', '.join(_ENDINGS)}", pictures)
    with optional_folder(out) as folder:
        found: dict[str, np.ndarray] = {}
        skipped: dict[str, str] = {}
        size = None
        for file in _counted(files, len(files), shown=not as_json):
            picture = load_picture(file)
            shape = picture.shape[:2]
            size = size or shape
            require(shape == size, "pictures", f"all be {size[1]} x {size[0]} pixels", file)
            corners = find_corners(picture, board)
            if corners is None:
                skipped[file.name] = "the whole board was not found"
            elif copied(corners, found.values()):
                skipped[file.name] = "it is a copy of another picture"
            else:
                found[file.name] = corners
        height, width = size or (0, 0)
        seen = list(found.values())
        fit = calibrate_on_board(board, seen, width=width, height=height, model=model)
        folds = min(_FOLDS, len(seen))
        held = None
        # A fold has to leave as many pictures as a calibration takes.
        if len(seen) >= 5:
            held = held_out_residuals(fit.camera, board.points, seen, folds=folds, fixed=fixed)
        free = fit_aspect(fit, board.points, seen, fixed=fixed)
        ends = fit_intervals(fit, board.points, seen, fixed=fixed)
        forms = forms_of(fit.camera)
        summary = summarise_board(fit, model, list(found), list(skipped), held, free, ends)
        if folder is not None:
            for form in forms:
                save_camera_model(folder / _NAMES[form], fit.camera, form)
            write_json(folder / "summary.json", summary)
            save_residuals(folder / "residuals.png", fit, seen)
    remarks = [Text(f"Skipped {name}: {reason}") for name, reason in skipped.items()]
    table = Table("parameter", "value", "standard deviation", "95% from", "to")
    for name, value, spread, end in zip(
        fit.camera.names, fit.camera.vector, fit.deviations, ends, strict=True
    ):
        kept = f"{spread:.2g}" if spread > 0 else "kept"
        between = [f"{each:.6g}" if spread > 0 else "" for each in end]
        table.add_row(name.replace("[", r"\["), f"{value:.8g}", kept, *between)
    outside = "" if held is None else f", {summary['left_out_rms']:.3f} px on pictures left out"
    fitted = Text(f"{len(seen)} pictures: {fit.rms:.3f} px rms{outside}")
    ruler = Text(str(summary["ruler"]))
    written = (*(_NAMES[form] for form in forms), "summary.json", "residuals.png")
    tell(summary, *remarks, table, fitted, ruler, as_json=as_json, written=written, out=out)


def _counted(things: Iterable[Thing], count: int, *, shown: bool) -> Iterator[Thing]:
    """The same things, with a bar that shows how many of them have been taken."""
    # On standard error, so that the report alone can be redirected.
    with progress_bar(Console(stderr=True), shown) as bar:
        yield from bar.track(things, count, description="Pictures")


def _board(words: str, square: str) -> Checkerboard:
    """The board of COLUMNSxROWS inner corners and squares of SIZE or WIDTHxHEIGHT [m]."""
    try:
        columns, rows = (int(word) for word in words.split("x"))
    except ValueError:
        raise InvalidInput(f"`--board` must have the form 11x7; got {words}") from None
    try:
        sides = [float(word) for word in square.split("x")]
        width, height = sides if len(sides) == 2 else sides * 2
    except ValueError:
        raise InvalidInput(f"`--square` must be 0.03 or 0.03x0.031; got {square}") from None
    return Checkerboard(columns=columns, rows=rows, square_width=width, square_height=height)


# What only a shell in simulated pictures has, only a shell, and only a board.
OF_SIMULATED = ("directions", "noise", "seed")
OF_SHELLS = ("camera", "colour", "base", "top", "radius", "height", *OF_SIMULATED)
OF_BOARDS = ("square", "model")


def calibrate(
    context: typer.Context,
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
    own = {"board": OF_SHELLS, "pictures": OF_SIMULATED}
    refuse_unused(given_options(context), beside=own, without={"board": OF_BOARDS})
    if board is not None:
        calibrate_board(pictures, board, square, model, out, as_json)
        return
    optics, (shade,) = load_camera(camera), chosen_colours([colour])
    shell = shell_of(colour, radius=radius, base=base, top=top)
    if height is not None:
        require_positive("height", height)
        require_sized("height", height)
    if pictures is None:
        sensor = Sensor(noise=noise, seed=seed)
        taken = simulated_pictures(
            optics, sensor, shell, distances=THESIS_DISTANCES, directions=directions
        )
        count = len(THESIS_DISTANCES) * directions
    else:
        labels = read_labels(pictures)
        taken, count = load_pictures(labels), len(labels)
    with optional_folder(out) as folder:
        sizes = {"base": base, "shell_radius": radius, "shell_top": top}
        shown = _counted(taken, count, shown=not as_json)
        readings, skipped = read_pictures(shown, optics, shade, **sizes)
        found = calibrate_readings(readings, camera=optics, height=height, **sizes)
        summary = summarise_calibration(found, skipped, optics if pictures is None else None)
        if folder is not None:
            save_calibration(folder / "calibration.json", found)
            write_json(folder / "summary.json", summary)
            save_error_curves(folder / "error_curves.png", found)
            save_direction_spread(folder / "direction_spread.png", found)
    words = (
        f"k = {found.k:.3f} ± {found.k_spread:.3f} px/rad, h = {found.height:.4f} m, "
        f"{len(readings.distance)} pictures, {len(skipped)} skipped"
    )
    remarks = [Text(f"Skipped {line}") for line in skipped]
    table = Table("model", *(escape(f"{name} [mm]") for name in ("mean error", "spread", "worst")))
    for model in MODELS:
        curve = found.curves[model]
        values = (curve.mean_absolute_error, curve.spread.mean(), np.abs(curve.mean_error).max())
        table.add_row(model, *(f"{1000 * value:.2f}" for value in values))
    written = ("calibration.json", "summary.json", "error_curves.png", "direction_spread.png")
    tell(summary, Text(words), *remarks, table, as_json=as_json, written=written, out=out)
