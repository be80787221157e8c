"""`sightfield camera calibrate --board`: a camera's model from pictures of a checkerboard."""

import json
from contextlib import nullcontext
from pathlib import Path

import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

from ....systems.numerics.errors import InvalidInput, require
from ....systems.numerics.vision.boards.board import Checkerboard, find_corners
from ....systems.numerics.vision.boards.calibrate import calibrate_on_board, fixed_names
from ....systems.numerics.vision.boards.fit import fit_aspect, fit_intervals, held_out_residuals
from ....systems.numerics.vision.camera_models.camera_files import forms_of, save_camera_model
from ....systems.numerics.vision.estimation.pictures import load_picture
from ...outputs import output_folder
from ...vision.calibration.board_report import save_residuals, summarise_board

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
    """Calibrate on every picture of a folder that shows the whole board, and report."""
    board = _board(words, square)
    require(pictures is not None and pictures.is_dir(), "pictures", "be a folder", pictures)
    files = sorted(
        file for file in Path(str(pictures)).iterdir() if file.suffix.lower() in _ENDINGS
    )
    require(len(files) > 0, "pictures", f"hold files {', '.join(_ENDINGS)}", pictures)
    with output_folder(out) if out is not None else nullcontext() as folder:
        found, skipped, size = {}, [], None
        console = Console(stderr=True)
        for file in track(files, "Pictures", console=console, transient=True, disable=as_json):
            picture = load_picture(file)
            shape = picture.shape[:2]
            size = size or shape
            require(shape == size, "pictures", f"all be {size[1]} x {size[0]} pixels", file)
            corners = find_corners(picture, board)
            if corners is None:
                skipped.append(file.name)
            else:
                found[file.name] = corners
        height, width = size or (0, 0)
        seen = list(found.values())
        fit = calibrate_on_board(board, seen, width=width, height=height, model=model)
        fixed, folds = fixed_names(model), min(_FOLDS, len(seen))
        held = None
        # A fold has to leave as many pictures as a calibration takes.
        if len(seen) >= 5:
            held = held_out_residuals(fit.camera, board.points, seen, folds=folds, fixed=fixed)
        free = fit_aspect(fit, board.points, seen, fixed=fixed)
        ends = fit_intervals(fit, board.points, seen, fixed=fixed)
        forms = forms_of(fit.camera)
        summary = summarise_board(fit, model, list(found), skipped, held, free, ends)
        text = json.dumps(summary, indent=2)
        if folder is not None:
            for form in forms:
                save_camera_model(folder / _NAMES[form], fit.camera, form)
            (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
            save_residuals(folder / "residuals.png", fit, seen)
    if as_json:
        typer.echo(text)
        return
    plain = Console()
    for name in skipped:
        plain.print(f"Skipped {name}: the whole board was not found", markup=False)
    table = Table("parameter", "value", "standard deviation", "95% from", "to")
    for name, value, spread, end in zip(
        fit.camera.names, fit.camera.vector, fit.deviations, ends, strict=True
    ):
        kept = f"{spread:.2g}" if spread > 0 else "kept"
        between = [f"{each:.6g}" if spread > 0 else "" for each in end]
        table.add_row(name.replace("[", r"\["), f"{value:.8g}", kept, *between)
    plain.print(table)
    outside = "" if held is None else f", {summary['left_out_rms']:.3f} px on pictures left out"
    plain.print(f"{len(seen)} pictures: {fit.rms:.3f} px rms{outside}", markup=False)
    plain.print(str(summary["ruler"]), markup=False)


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
