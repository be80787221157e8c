"""What calibrations of cameras say and draw, and shells found with them, is as recorded."""

import numpy as np
import pytest

from sightfield.diagrams.vision.calibration import (
    save_direction_spread,
    save_error_curves,
    save_found_picture,
    save_residuals,
    summarise_board,
    summarise_calibration,
    summarise_found,
)
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.vision.boards.board import Pose
from sightfield.systems.numerics.vision.boards.fit import BoardFit
from sightfield.systems.numerics.vision.camera_models.central_cameras import KannalaBrandtCamera
from sightfield.systems.numerics.vision.estimation.calibration import Readings, calibrate
from sightfield.systems.numerics.vision.estimation.shell_detection import COLOURS
from sightfield.systems.numerics.vision.estimation.shell_estimate import search_shells
from sightfield.systems.numerics.vision.omni_optics import OmniCamera, make_ray_table, project_omni
from sightfield.systems.numerics.vision.rendering import render
from sightfield.systems.numerics.vision.sensor import Sensor, expose
from sightfield.systems.numerics.vision.surroundings import Surroundings, shell_of

# Pictures are read to about this share, on any machine.
READ = 1e-3


@pytest.fixture(scope="module")
def optics():
    """A small camera whose axis is not in the middle of its pictures."""
    return OmniCamera(width=320, height=260, focal_length=430.0, centre=(151.0, 137.5))


@pytest.fixture(scope="module")
def calibration(optics):
    """By readings that err by a tenth of a pixel."""
    bearing = np.tile(2 * np.pi * np.arange(6) / 6 + 0.1, 5)
    distance = np.repeat([0.3, 0.45, 0.7, 1.0, 1.4], 6)
    at = np.column_stack([np.cos(bearing), np.sin(bearing)]) * distance[:, None]
    pixels, _ = project_omni(optics, np.column_stack([at, np.full(len(at), 0.04)]))
    errors = np.random.default_rng(1).normal(0.0, 0.1, pixels.shape)
    readings = Readings(distance=distance, bearing=bearing, pixels=pixels + errors)
    return calibrate(readings, camera=optics, base=0.04, shell_radius=0.1, shell_top=0.2)


def test_a_calibration_s_summary_and_plots_are_as_recorded(
    calibration, optics, tmp_path, as_recorded, saved_pictures
):
    for name, skipped, truth in (("with truth", ["a.png: cut off"], optics), ("alone", [], None)):
        as_recorded(summarise_calibration(calibration, skipped, truth), name, relative=1e-4)
    save_error_curves(tmp_path / "errors.png", calibration)
    save_direction_spread(tmp_path / "directions.png", calibration)
    as_recorded(saved_pictures, "pictures", relative=1e-4, absolute=1e-4)


def test_shells_found_are_told_and_drawn_as_recorded(
    calibration, optics, tmp_path, as_recorded, saved_pictures
):
    world = make_world([[-2, -1.5], [3, -2], [2.5, 2], [-2, 2.2]], [])
    shells = [shell_of("red"), shell_of("blue")]
    places = np.array([[0.6, 0.9], [1.1, 0.1]])
    scene = Surroundings(world=world)
    light = render(optics, make_ray_table(optics), scene, (0.3, 0.4, 0.5), shells, places)
    picture = expose(Sensor(noise=2.0, seed=1), light, 0)[:, :, :3]
    names = ["red", "blue", "yellow"]
    seen = search_shells(picture, [COLOURS[name] for name in names], calibration)
    found = [(name, *each) for name, each in zip(names, seen, strict=True)]
    told = summarise_found(found, calibration, [0.3, 0.4, 0.5], "exact")
    as_recorded(told, "summary", relative=READ)
    save_found_picture(tmp_path / "found.png", picture, found, calibration)
    as_recorded(saved_pictures, "picture", relative=READ)


@pytest.mark.parametrize(
    ("aspect", "deviation"),
    [(1.0049, 0.0001), (1.0051, 0.0001), (0.9949, 0.0001), (1.0199, 0.005), (1.0201, 0.005)],
)
def test_a_board_s_summary_and_plot_are_as_recorded(
    aspect, deviation, tmp_path, as_recorded, saved_pictures
):
    rng = np.random.default_rng(2)
    camera = KannalaBrandtCamera(
        focal_x=310.0, focal_y=312.0, centre_x=330.0, centre_y=236.0, width=640, height=480, k1=0.02
    )
    size = len(camera.vector)
    fit = BoardFit(
        camera=camera,
        covariance=np.diag(rng.uniform(0.01, 0.04, size)),
        poses=(Pose(np.eye(3), np.zeros(3)),) * 2,
        residuals=rng.normal(0.0, 0.3, (2, 6, 2)),
        aspect=aspect,
        aspect_deviation=deviation,
        rounds=3,
        converged=True,
    )
    ends = np.column_stack([camera.vector - 0.3, camera.vector + 0.4])
    ends[1, 1], ends[2, 0] = np.inf, -np.inf
    held = None if aspect == 1.0201 else rng.normal(0.0, 0.3, (1, 6, 2))
    told = summarise_board(fit, "kannala", ["a", "b"], ["c: none"], held, fit, ends)
    if aspect != 1.0201:
        # Of the others what they say of the ruler is enough.
        told = {key: told[key] for key in ("aspect", "ruler", "left_out_rms")}
    as_recorded(told, "summary")
    if aspect == 1.0201:
        pixels = [rng.uniform(0, 400, (6, 2)) for _ in range(2)]
        save_residuals(tmp_path / "residuals.png", fit, pixels)
        as_recorded(saved_pictures, "picture")
