"""What tracking on pictures says, draws and shows is as it was recorded."""

import json

import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatParams

from sightfield.diagrams.vision.make_picture_tracking import modified_field_of
from sightfield.diagrams.vision.picture_scene import cells_shape, mirror_square
from sightfield.diagrams.vision.report import (
    WeightSweep,
    picture_log_arrays,
    summarise_picture_tracking,
    sweep_weights,
    write_picture_report,
    write_sweep,
)
from sightfield.diagrams.vision.run import run_picture_tracking
from sightfield.systems.numerics.vision.omni_optics import OmniCamera
from sightfield.systems.numerics.vision.whereabouts.reachable_set import make_place_grid

# Pictures are read to about this share, on any machine.
READ = 1e-3


def page():
    return Meshcat(MeshcatParams(port=0, show_stats_plot=False))


def numbers_of(run):
    """A run's summary and log, without how long it took."""
    summary = summarise_picture_tracking(run, "small")
    timeless = {key: value for key, value in summary.items() if "wall" not in key}
    return {key: value for key, value in timeless.items() if "real" not in key}


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        (
            "omni_2v2",
            "seconds=0.55 seed=2 vision.quality.drop_share=0.2 vision.weight=0.3 vision.fade=0.3",
        ),
        ("omni_1v1", "seconds=0.3 vision.senses=truth vision.targets=[0] vision.stand_off=0.6"),
    ],
)
def test_a_game_on_pictures_is_as_recorded(
    name, settings, picture_game, tmp_path, as_recorded, saved_pictures, meshcat_calls
):
    run = run_picture_tracking(picture_game(name, *settings.split()), page(), recording=True)
    numbers = numbers_of(run)
    as_recorded(numbers, "summary", relative=READ)
    as_recorded(picture_log_arrays(run), "log", relative=READ, absolute=1e-6)
    write_picture_report(run, numbers, tmp_path)
    as_recorded(saved_pictures, "pictures", relative=READ, absolute=1e-4)
    shown = {key: each for key, each in meshcat_calls.items() if "pictures" in key}
    assert bool(shown) == (name == "omni_2v2")
    as_recorded(shown, "scene", relative=READ, absolute=1e-4)
    as_recorded(json.loads((tmp_path / "log_units.json").read_text()), "units")


def test_a_live_game_shows_one_path_for_each_thing_as_recorded(
    picture_game, as_recorded, meshcat_calls
):
    told = []
    game = picture_game("omni_1v1", "seconds=0.55")
    run_picture_tracking(game, page(), progress=told.append)
    shown = {key: each for key, each in meshcat_calls.items() if "pictures" in key}
    as_recorded(shown, "scene", relative=READ, absolute=1e-4)
    as_recorded(told, "progress")


def test_a_short_sweep_of_weights_is_as_recorded(loaded, as_recorded):
    scenario = loaded("omni_1v1", "seconds=0.4", "vision.senses=truth")
    sweep = sweep_weights(scenario, [0.2, 0.9], [1, 5])
    as_recorded(sweep, relative=1e-5)
    as_recorded(sweep.table(), "table", relative=1e-5)


def test_a_sweep_is_drawn_as_recorded(as_recorded, saved_pictures, tmp_path):
    rng = np.random.default_rng(0)
    values = {
        name: size * rng.uniform(0.1, 1.0, (3, 4))
        for name, size in (
            ("tracking_time", 60.0),
            ("estimation_error_rms", 0.02),
            ("estimated_share", 1.0),
            ("mean_distance", 1.5),
        )
    }
    values["estimation_error_rms"][1] = np.nan
    values["mean_distance"][2, 1] = np.nan
    for censored in (rng.random((3, 4)) < 0.4, np.zeros((3, 4), bool)):
        sweep = WeightSweep(np.array([0.1, 0.4, 0.8]), np.arange(4), values, censored)
        write_sweep(sweep, tmp_path)
        name = "some" if censored.any() else "none"
        as_recorded(saved_pictures.pop("weights.png"), f"{name} picture")
        as_recorded(json.loads((tmp_path / "weights.json").read_text()), f"{name} table")


def test_the_modified_field_is_as_recorded(picture_game, as_recorded):
    field = modified_field_of(picture_game("omni_2v2", "vision.weight=0.7", "vision.fade=0.4"))
    points = np.random.default_rng(3).uniform(0.3, 1.4, (30, 2))
    evaders = np.array([[2.9, 1.7], [1.2, 0.6]])
    for pursuer, assignment in ((0, [1, 0]), (1, [1, 1])):
        as_recorded(field(pursuer, points, evaders, np.array(assignment)), f"{pursuer}")


@pytest.mark.parametrize("centre", [(3.0, 20.0), (60.0, 45.0), (94.4, 77.6)])
def test_what_is_cut_out_around_the_mirror_is_as_recorded(centre, as_recorded):
    camera = OmniCamera(width=96, height=80, focal_length=70.0, centre=centre)
    image = np.random.default_rng(4).integers(0, 256, (80, 96, 4), dtype=np.uint8)
    as_recorded(mirror_square(image, camera))


def test_cells_of_a_set_are_drawn_where_they_are(picture_game):
    grid = make_place_grid(picture_game("omni_1v1").evader_regions, 400)
    cells = np.zeros(len(grid.usable), bool)
    cells[[3, grid.columns + 5, 4 * grid.columns + 2]] = True
    shape = cells_shape(grid, cells)
    assert shape.area == pytest.approx(3 * grid.area)
    x, y = grid.corner + grid.cell * np.array([2, 4])
    assert shape.bounds[:2] == pytest.approx((x, grid.corner[1]))
    assert shape.bounds[3] == pytest.approx(y + grid.cell)
    assert shape.bounds[2] == pytest.approx(grid.corner[0] + 6 * grid.cell)


@pytest.mark.parametrize("name", ["omni_1v1", "omni_2v2"])
def test_how_pursuers_see_is_as_recorded(name, loaded, as_recorded):
    vision = loaded(name).vision
    as_recorded([vision, vision.evader_shells, vision.pursuer_shell])


def test_practice_is_as_recorded(practised, as_recorded):
    as_recorded([practised.camera, practised.k, practised.height], relative=READ)
    readings = practised.readings
    as_recorded([readings.distances, readings.bearing], "places")
