"""The procedure of 2.2.4.2 finds the optics that took the pictures.

A calibration file gives back what was saved, and says in one line what is wrong with it.
"""

import json
from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.estimation.calibration import (
    THESIS_DISTANCES,
    Readings,
    calibrate,
    load_calibration,
    save_calibration,
)
from sightfield.systems.numerics.vision.estimation.labelled_pictures import (
    LabelledPicture,
    read_pictures,
    simulated_pictures,
)
from sightfield.systems.numerics.vision.estimation.range_models import (
    exact_pixel_radius,
    implied_k,
)
from sightfield.systems.numerics.vision.estimation.shell_detection import COLOURS
from sightfield.systems.numerics.vision.omni_optics import OmniCamera
from sightfield.systems.numerics.vision.sensor import Sensor
from sightfield.systems.numerics.vision.surroundings import Shell

DISTANCES = np.array(THESIS_DISTANCES)


def test_the_distances_are_the_thesis_s():
    assert pytest.approx(np.arange(15, 61, 5) * 0.0254) == DISTANCES


def test_pictures_give_the_k_and_h_that_the_optics_imply(camera, calibration, shell_sizes):
    # The optics imply h by F = D / 4, and k by the exact path of each ray.
    base = shell_sizes["base"]
    implied = implied_k(camera, base, DISTANCES)
    assert calibration.height == pytest.approx(camera.focus_height - base, abs=2e-3)
    assert calibration.k == pytest.approx(implied.mean(), rel=2e-3)
    assert calibration.k_spread == pytest.approx(implied.std(ddof=1), rel=0.05)
    assert calibration.camera.focal_length == pytest.approx(camera.focal_length, rel=3e-3)
    assert calibration.camera.axis_pixel == pytest.approx(camera.axis_pixel, abs=0.15)


def test_the_exact_model_errs_at_least_five_times_less(calibration):
    thesis, exact = calibration.curves["thesis"], calibration.curves["exact"]
    assert 5 * exact.mean_absolute_error < thesis.mean_absolute_error
    assert 5 * exact.rms.mean() < thesis.rms.mean()


def test_the_thesis_model_errs_most_far_away_as_in_figure_2_11(calibration):
    error = calibration.curves["thesis"].mean_error
    assert error[-1] > 0.1
    assert np.argmax(np.abs(error)) == len(error) - 1
    a, b, c = calibration.parabola
    assert a > 0
    assert a * DISTANCES**2 + b * DISTANCES + c == pytest.approx(error, abs=0.02)


def test_the_spread_over_the_directions_grows_with_the_distance(calibration):
    spread = calibration.curves["exact"].spread
    assert spread[:3].mean() < spread[-3:].mean() < 0.03


@pytest.mark.parametrize("directions", [1, 8])
@pytest.mark.parametrize(("focal", "lift"), [(1.1, 0.03), (0.9, -0.05)])
def test_ideal_readings_give_the_optics_from_a_wrong_start(
    camera, ideal_readings, shell_sizes, directions, focal, lift
):
    start = replace(
        camera,
        focal_length=focal * camera.focal_length,
        pinhole_height=camera.pinhole_height + lift,
    )
    found = calibrate(ideal_readings(directions=directions), camera=start, **shell_sizes)
    assert found.height == pytest.approx(camera.focus_height - shell_sizes["base"], abs=1e-6)
    assert found.camera.focal_length == pytest.approx(camera.focal_length, rel=1e-6)
    assert found.curves["exact"].rms == pytest.approx(np.zeros(10), abs=1e-6)
    assert found.k == pytest.approx(implied_k(camera, shell_sizes["base"], DISTANCES).mean())


def test_an_axis_beside_the_middle_of_the_picture_is_found(camera, ideal_readings, shell_sizes):
    optics = replace(camera, centre=(325.0, 236.0))
    found = calibrate(ideal_readings(optics=optics), camera=camera, **shell_sizes)
    assert found.camera.axis_pixel == pytest.approx([325, 236], abs=1e-4)
    assert found.bearing_rms < 1e-4


def test_one_wrong_label_does_not_bend_the_fit(camera, ideal_readings, shell_sizes):
    readings = ideal_readings()
    distance = readings.distance.copy()
    distance[5] = THESIS_DISTANCES[1]
    wrong = replace(readings, distance=distance)
    found = calibrate(wrong, camera=camera, **shell_sizes)
    assert found.height == pytest.approx(camera.focus_height - shell_sizes["base"], abs=3e-3)


def test_a_label_so_wrong_that_farther_shells_are_farther_in_is_refused(
    camera, ideal_readings, shell_sizes
):
    readings = ideal_readings()
    distance = readings.distance.copy()
    distance[5] = THESIS_DISTANCES[-1]
    with pytest.raises(InvalidInput, match="`readings` must show farther shells farther out"):
        calibrate(replace(readings, distance=distance), camera=camera, **shell_sizes)


def test_a_measured_height_is_kept(camera, ideal_readings, shell_sizes):
    found = calibrate(ideal_readings(), camera=camera, height=0.3, **shell_sizes)
    assert found.height == 0.3
    assert found.k == pytest.approx(
        np.mean(found.curves["thesis"].pixel_radius / np.arctan(DISTANCES / 0.3))
    )


def test_pictures_without_a_shell_are_skipped_and_named(camera, shell_sizes):
    shell = Shell()
    pictures = list(
        simulated_pictures(camera, Sensor(), shell, distances=[0.4, 0.6, 0.8, 1.0], directions=1)
    )
    away = next(
        simulated_pictures(
            camera, Sensor(), Shell(colour=(30, 165, 60)), distances=[0.9], directions=1
        )
    )
    readings, skipped = read_pictures([*pictures, away], camera, COLOURS["red"], **shell_sizes)
    assert len(readings.distance) == 4
    assert skipped == [f"{away.name}: no blob"]
    with pytest.raises(InvalidInput, match=r"`pictures` must show blue shells; got .*: no blob"):
        read_pictures(pictures, camera, COLOURS["blue"], **shell_sizes)


@pytest.mark.parametrize(("ruler", "how"), [(1.08, "wider"), (0.92, "narrower")])
def test_a_wrong_ruler_is_noticed_by_the_widths_of_the_shells(camera, shell_sizes, ruler, how):
    pictures = [
        each._replace(distance=ruler * each.distance)
        for each in simulated_pictures(
            camera, Sensor(), Shell(), distances=[0.4, 0.6, 0.8, 1.0], directions=2
        )
    ]
    with pytest.raises(InvalidInput, match=rf"`pictures` must show .* that are \d% {how}$"):
        read_pictures(pictures, camera, COLOURS["red"], **shell_sizes)


def test_bases_of_far_shells_are_not_read_too_far_out(camera, calibration, shell_sizes):
    # Read by the half of their colour alone, they lay 0.05 px too far out at 1.5 m.
    true, found = (
        exact_pixel_radius(DISTANCES, camera=each, base=shell_sizes["base"])
        for each in (camera, calibration.camera)
    )
    assert found == pytest.approx(true, abs=0.025)


@pytest.mark.parametrize(
    ("picture", "message"),
    [
        (np.zeros((480, 640, 3), np.uint8), r"`a.png` must show something; got one colour"),
        (np.zeros((10, 20, 3), np.uint8), "`a.png` must be 640 x 480 pixels; got 20 x 10"),
    ],
)
def test_nonsense_pictures_are_named(camera, shell_sizes, picture, message):
    with pytest.raises(InvalidInput, match=message):
        read_pictures(
            [LabelledPicture("a.png", 0.5, 0.0, picture)], camera, COLOURS["red"], **shell_sizes
        )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"distance": np.full(80, 0.5)}, "`readings` must hold at least 4 different distances"),
        ({"distance": np.full(80, np.nan)}, "`readings.distance` must be finite"),
        ({"distance": np.linspace(-1, 1, 80)}, "`readings.distance` must be positive"),
        ({"bearing": np.zeros(3)}, "`readings` must hold a distance, a bearing and a pixel"),
    ],
)
def test_readings_that_make_no_sense_are_refused(ideal_readings, change, message):
    with pytest.raises(InvalidInput, match=message):
        replace(ideal_readings(), **change)


def test_readings_of_no_such_mirror_are_refused(camera, ideal_readings, shell_sizes):
    readings = ideal_readings()
    mirrored = Readings(
        distance=readings.distance[::-1].copy(), bearing=readings.bearing, pixels=readings.pixels
    )
    with pytest.raises(InvalidInput, match="`readings` must fit the mirror to 3 pixels"):
        calibrate(mirrored, camera=camera, **shell_sizes)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"base": -0.1}, "`base`"),
        ({"shell_radius": 0.0}, "`shell_radius` must be positive"),
        ({"shell_top": 0.01}, "`shell_top` must be above the base"),
        ({"height": -1.0}, "`height` must be positive"),
    ],
)
def test_sizes_out_of_range_are_refused(camera, ideal_readings, shell_sizes, change, message):
    with pytest.raises(InvalidInput, match=message):
        calibrate(ideal_readings(), camera=camera, **(shell_sizes | change))


def test_a_camera_of_another_kind_is_calibrated_as_well(ideal_readings, shell_sizes):
    optics = OmniCamera(mirror_radius=0.04, mirror_distance=0.1, focal_length=700.0)
    found = calibrate(ideal_readings(optics=optics), camera=optics, **shell_sizes)
    implied = implied_k(optics, shell_sizes["base"], DISTANCES)
    assert found.k == pytest.approx(implied.mean(), rel=1e-6)


@pytest.fixture
def saved(calibration, tmp_path):
    """A calibration file."""
    path = tmp_path / "calibration.json"
    save_calibration(path, calibration)
    return path


def edited(path, keys, value):
    """Set, or with `value` None delete, an entry of a file."""
    tree = json.loads(path.read_text())
    *parents, last = keys
    node = tree
    for key in parents:
        node = node[key]
    if value is None:
        del node[last]
    else:
        node[last] = value
    path.write_text(json.dumps(tree))


def test_what_was_saved_comes_back(saved, calibration):
    again = load_calibration(saved)
    for name in ("k", "height", "k_spread", "parabola", "base", "shell_radius", "shell_top"):
        assert getattr(again, name) == getattr(calibration, name)
    assert again.camera == calibration.camera
    p = np.linspace(90, 155, 20)
    for model in ("thesis", "exact"):
        assert np.array_equal(again.range_of(model, p), calibration.range_of(model, p))
        assert np.array_equal(again.curves[model].rms, calibration.curves[model].rms)


KEYS = [
    ("k",),
    ("height",),
    ("camera",),
    ("parabola",),
    ("readings",),
    ("shell_top",),
    ("camera", "focal_length"),
    ("camera", "centre"),
    ("parabola", "b"),
    ("readings", "pixels"),
]


@pytest.mark.parametrize("keys", KEYS, ids=".".join)
def test_a_missing_key_is_named(saved, keys):
    edited(saved, keys, None)
    with pytest.raises(InvalidInput, match=f"got no {keys[-1]}$"):
        load_calibration(saved)


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (["version"], 2, "`calibration.version` must be 1; got 2"),
        (["format"], "other", "`calibration` must be a file of the format"),
        (["extra"], 1, "got also extra"),
        (["k"], "many", "`calibration.k` must be a finite number; got many"),
        (["k"], float("nan"), "`calibration.k` must be a finite number; got nan"),
        (["k"], True, "`calibration.k` must be a finite number; got True"),
        (["k"], -3.0, "`k` must be positive; got -3.0"),
        (["camera"], 3, "`calibration.camera` must be a mapping; got 3"),
        (["camera", "width"], 1.5, "`width` must be a positive whole number; got 1.5"),
        (["camera", "focal_length"], [], "`calibration.camera.focal_length` must be a finite"),
        (["camera", "centre"], [1], r"`centre` must be \(column, row\)"),
        (["camera", "centre"], ["a", 1], "`calibration.camera.centre` must be a list of numbers"),
        (["parabola", "a"], "x", "`calibration.parabola.a` must be a finite number; got x"),
        (["readings", "distance"], [1, 2], "`readings` must hold a distance, a bearing and a"),
        (["readings", "distance"], 1, "`calibration.readings.distance` must be a list of 1"),
        (["readings", "pixels"], [[1], [1, 2]], "`calibration.readings.pixels` must be a list"),
        (["shell_top"], 0.0, "`shell_top` must be above the base"),
    ],
)
def test_nonsense_is_named(saved, keys, value, message):
    edited(saved, keys, value)
    with pytest.raises(InvalidInput, match=message) as caught:
        load_calibration(saved)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "{", "[1, 2]", "3", "\x00", '{"version": 1}'])
def test_what_is_no_calibration_is_refused(tmp_path, text):
    path = tmp_path / "other.json"
    path.write_text(text)
    with pytest.raises(InvalidInput, match="`calibration` must be"):
        load_calibration(path)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InvalidInput, match=r"got .*nowhere.json"):
        load_calibration(tmp_path / "nowhere.json")
