"""Calibrations on real pictures of a board in a mirror, and whether their intervals hold.

The pictures and a calibration in OCamCalib's own format are not part of this project: the
environment variable SIGHTFIELD_OMNI names the folder of KaidanOmni*.jpg and ocam_example.txt.
"""

import math
import os
import time
from pathlib import Path

import cv2
import numpy as np
import pytest

from sightfield.systems.numerics.vision.boards.board import Checkerboard, Pose, find_corners
from sightfield.systems.numerics.vision.boards.calibrate import (
    MODELS,
    calibrate_on_board,
    fixed_names,
)
from sightfield.systems.numerics.vision.boards.fit import (
    fit_aspect,
    fit_camera,
    fit_intervals,
    held_out_residuals,
    rms_of,
)
from sightfield.systems.numerics.vision.camera_models.camera_files import (
    forms_of,
    load_camera_model,
    save_camera_model,
)
from sightfield.systems.numerics.vision.camera_models.camera_model import (
    angle_between,
    in_picture,
)
from sightfield.systems.numerics.vision.camera_models.central_cameras import MeiCamera

pytestmark = pytest.mark.benchmarks

OMNI = os.environ.get("SIGHTFIELD_OMNI", "")
needs_pictures = pytest.mark.skipif(not OMNI, reason="SIGHTFIELD_OMNI names no folder")
BOARD = Checkerboard(columns=11, rows=7, square_width=0.03, square_height=0.03)
TRIALS, NOISE = int(os.environ.get("SIGHTFIELD_TRIALS", "300")), 0.3


@needs_pictures
def test_models_on_real_pictures(tmp_path):
    files = sorted(Path(OMNI).glob("KaidanOmni*.jpg"))
    found = [find_corners(cv2.imread(str(file), cv2.IMREAD_GRAYSCALE), BOARD) for file in files]
    corners = [each for each in found if each is not None]
    print(f"\nboard found in {len(corners)} of {len(files)} pictures")
    pixels, rays = np.concatenate(corners), {}
    for model in MODELS:
        began = time.process_time()
        fit = calibrate_on_board(BOARD, corners, width=640, height=480, model=model)
        seconds = time.process_time() - began
        fixed = fixed_names(model)
        held = held_out_residuals(fit.camera, BOARD.points, corners, folds=4, fixed=fixed)
        free = fit_aspect(fit, BOARD.points, corners, fixed=fixed)
        rays[model] = fit.camera.rays(pixels)
        print(
            f"{model}: {fit.rms:.3f} px rms, left out {rms_of(held):.3f} px, converged "
            f"{fit.converged}, aspect {free.aspect:.4f} +- {free.aspect_deviation:.4f}, "
            f"{seconds:.1f} s"
        )
        for form in forms_of(fit.camera):
            save_camera_model(tmp_path / form, fit.camera, form)
            again = load_camera_model(tmp_path / form)
            apart = np.linalg.norm(again.project(rays[model]) - pixels, axis=1)
            print(f"    {form}: there and back {apart.max():.1e} px")
    for model in MODELS[1:]:
        ours, theirs = rays["scaramuzza"], rays[model]
        turn = np.arctan2(ours[:, 1], ours[:, 0]) - np.arctan2(theirs[:, 1], theirs[:, 0])
        bearing = np.degrees(np.abs(np.remainder(turn + math.pi, 2 * math.pi) - math.pi))
        whole = np.degrees(angle_between(ours, theirs))
        print(
            f"scaramuzza and {model}: bearings apart by {bearing.max():.3f} degrees at most, rays "
            f"by {np.sqrt(np.mean(whole**2)):.3f} rms, {np.percentile(whole, 99):.3f} in 99%, "
            f"{whole.max():.3f} at most"
        )


@needs_pictures
def test_a_calibration_of_ocamcalib(tmp_path):
    file = Path(OMNI) / "ocam_example.txt"
    camera = load_camera_model(file)
    save_camera_model(tmp_path / "again.txt", camera, "ocamcalib")
    grid = np.stack(np.meshgrid(np.arange(0, 748, 11.0), np.arange(0, 480, 11.0)), -1)
    pixels = grid.reshape(-1, 2)
    pixels = pixels[np.isfinite(camera.rays(pixels)).all(axis=1)]
    rays = camera.rays(pixels)
    radius = np.linalg.norm(pixels - [camera.centre_x, camera.centre_y], axis=1)
    inside = radius < 240
    print()
    for name in (file, tmp_path / "again.txt"):
        apart = np.linalg.norm(_world2cam(name, rays) - pixels, axis=1)
        print(
            f"{name.name}: OCamCalib's second polynomial against the first: {apart.max():.3f} px "
            f"at most, {apart[inside].max():.3f} px within 240 px of the centre"
        )
    apart = np.linalg.norm(load_camera_model(tmp_path / "again.txt").project(rays) - pixels, axis=1)
    print(f"there and back: {apart.max():.1e} px")


def test_intervals_of_simulated_calibrations():
    camera = MeiCamera(
        xi=0.95,
        focal_x=170.0,
        focal_y=171.0,
        centre_x=331.0,
        centre_y=229.0,
        k1=-0.04,
        k2=0.006,
        width=640,
        height=480,
    )
    board = Checkerboard(columns=7, rows=5, square_width=0.04, square_height=0.03)
    fixed = fixed_names("mei")
    rng = np.random.default_rng(2024)
    covered, converged = [], 0
    for _ in range(TRIALS):
        pictures = _pictures(camera, board, 8, rng)
        start = camera.with_vector(camera.vector * 1.005)
        fit = fit_camera(start, board.points, pictures, fixed=fixed)
        low, high = fit_intervals(fit, board.points, pictures, fixed=fixed).T
        free = fit.deviations > 0
        covered.append(((low <= camera.vector) & (camera.vector <= high))[free])
        converged += fit.converged
    share = np.mean(covered, axis=0)
    names = [name for name, kept in zip(camera.names, free, strict=True) if kept]
    print(f"\n{TRIALS} calibrations, {converged} converged; 95% intervals cover the truth in")
    print(f"{np.mean(covered):.1%} of all; " + ", ".join(map("{} {:.1%}".format, names, share)))


def _pictures(
    camera: MeiCamera, board: Checkerboard, count: int, rng: np.random.Generator
) -> list[np.ndarray]:
    """Corners of boards all round the axis, new ones each time, with normal errors."""
    pictures: list[np.ndarray] = []
    while len(pictures) < count:
        angle, azimuth = rng.uniform(0.5, 1.7), 2.4 * len(pictures) + rng.uniform(-0.3, 0.3)
        across = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
        place = math.sin(angle) * across + [0, 0, math.cos(angle)]
        right = np.cross([0, 0, 1], across)
        facing = np.column_stack([right, np.cross(place, right), place])
        rotation = cv2.Rodrigues(rng.uniform(-0.5, 0.5, 3))[0] @ facing
        middle = rng.uniform(0.15, 0.35) * place
        pose = Pose(rotation, middle - rotation[:, :2] @ board.points.mean(axis=0))
        pixels = camera.project(pose.place(board.points))
        if in_picture(camera, pixels).all():
            pictures.append(pixels + NOISE * rng.standard_normal(pixels.shape))
    return pictures


def _world2cam(file: Path, rays: np.ndarray) -> np.ndarray:
    """Pixels (column, row) of rays in our frame, as OCamCalib's own code computes them."""
    text = file.read_text(encoding="utf-8")
    lines = [line.split() for line in text.splitlines() if line.strip() and line[0] != "#"]
    inverse = [float(word) for word in lines[1]][1:]
    (row, column), (c, d, e) = ([float(word) for word in line] for line in lines[2:4])
    x, y, z = rays[:, 1], rays[:, 0], -rays[:, 2]
    across = np.hypot(x, y)
    rho = np.polynomial.polynomial.polyval(np.arctan2(z, across), inverse)
    x, y = x / across * rho, y / across * rho
    return np.column_stack([x * e + y + column, x * c + y * d + row])
