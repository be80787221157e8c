"""Shells in pictures of many kinds are found, fitted and judged as they were recorded."""

from dataclasses import asdict

import cv2
import numpy as np
import pytest

from sightfield.systems.numerics.vision.estimation.calibration import Readings, calibrate
from sightfield.systems.numerics.vision.estimation.edge_errors import (
    raster_covariance,
    remainder_covariance,
)
from sightfield.systems.numerics.vision.estimation.expected_picture import (
    draw_shell,
    expect_picture,
    read_scene,
    show_behind,
)
from sightfield.systems.numerics.vision.estimation.labelled_pictures import (
    read_pictures,
    simulated_pictures,
)
from sightfield.systems.numerics.vision.estimation.outline_fit import fit_outline
from sightfield.systems.numerics.vision.estimation.range_models import (
    ROUND,
    draw_cover,
    fill_round,
    make_outline,
    radii_at,
)
from sightfield.systems.numerics.vision.estimation.shell_detection import COLOURS, detect_shells
from sightfield.systems.numerics.vision.estimation.shell_estimate import locate, search_shells
from sightfield.systems.numerics.vision.omni_optics import OmniCamera
from sightfield.systems.numerics.vision.sensor import Sensor
from sightfield.systems.numerics.vision.surroundings import Shell, shell_of

RED, GREEN = shell_of("red"), shell_of("green")
# Fits end when another step gains little: their last digits are nobody's.
FITTED = 2e-4


@pytest.fixture(scope="module")
def known(camera, ideal_readings, shell_sizes):
    """A calibration by readings that err a little."""
    ideal = ideal_readings(directions=7)
    errors = np.random.default_rng(0).normal(0.0, 0.15, ideal.pixels.shape)
    readings = Readings(
        distance=ideal.distance, bearing=ideal.bearing, pixels=ideal.pixels + errors
    )
    return calibrate(readings, camera=camera, **shell_sizes)


def in_blocks(picture):
    """The picture with an error in each block of 8 pixels, as a compressed one has."""
    rows, columns = (size // 8 for size in picture.shape[:2])
    errors = np.random.default_rng(3).normal(0.0, 6.0, (rows, columns, 3))
    return (
        np.clip(picture[:, :, :3] + np.kron(errors, np.ones((8, 8, 1))), 0, 255)
        .round()
        .astype(np.uint8)
    )


def dragged(picture):
    """The picture of a camera that moved by 7 pixels while it looked."""
    return cv2.blur(picture, (7, 1))


def brightened(share):
    """A function that makes a picture brighter than it can tell."""
    return lambda picture: np.clip(picture * share, 0, 255).round().astype(np.uint8)


def as_it_is(picture):
    """The picture."""
    return picture


# By name: the shells of a picture, what stands in the way, and what becomes of the picture.
WALL = [[0.55, 0.1], [0.7, 0.1], [0.7, 0.34], [0.55, 0.34]]
PICTURES = {
    "usual": ([(RED, 0.83, 0.7)], [], as_it_is),
    "near": ([(RED, 0.3, -2.1)], [], as_it_is),
    "far": ([(RED, 1.7, 2.6)], [], as_it_is),
    "dragged": ([(RED, 0.9, 1.2)], [], dragged),
    "blocks": ([(RED, 1.1, -0.4)], [], in_blocks),
    "bright": ([(RED, 0.8, 0.2)], [], brightened(2.5)),
    "white": ([(RED, 0.7, -1.3)], [], brightened(4.0)),
    "dark": ([(RED, 0.9, 2.0)], [], brightened(0.2)),
    "left side hidden": ([(RED, 1.1, 0.1)], [WALL], as_it_is),
    "right side hidden": ([(RED, 1.1, 0.57)], [WALL], as_it_is),
    "behind another": ([(RED, 1.3, -1.0), (GREEN, 0.6, -1.16)], [], as_it_is),
    "beside another": ([(RED, 0.9, -1.0), (GREEN, 0.9, -1.21)], [], as_it_is),
    "two": ([(RED, 0.6, -1.0), (RED, 1.2, 2.2)], [], as_it_is),
    "two in one": ([(RED, 0.8, 0.1), (RED, 0.8, -0.08)], [], as_it_is),
    "out of range": ([(RED, 3.4, 0.1)], [], as_it_is),
    "nothing": ([], [], as_it_is),
}


@pytest.mark.parametrize("name", PICTURES)
def test_what_is_seen_of_shells_is_as_recorded(name, photograph, known, as_recorded):
    shells, blocks, spoil = PICTURES[name]
    picture = spoil(photograph(shells, blocks, seed=len(name)))
    chosen = [COLOURS["red"], COLOURS["green"]]
    for model in ("exact", "thesis"):
        found = search_shells(picture, chosen, known, model)
        told = []
        for detection, estimate in found:
            window = detection.window
            seen = asdict(detection) | {"window": None if window is None else window.blob.shape}
            told.append((seen, estimate, locate(estimate, np.array([1.0, -2.0, 0.6]), 0.1)))
        as_recorded(told, model, relative=FITTED)
    # Two of one colour are looked for together.
    pairs = [estimate for _, estimate in search_shells(picture, [chosen[0]] * 2, known)]
    as_recorded(pairs, "pairs", relative=FITTED)


@pytest.fixture(scope="module")
def window(photograph, known):
    """A function of a named picture: its first detection's window, range and bearing."""

    def look(name):
        shells, blocks, spoil = PICTURES[name]
        picture = spoil(photograph(shells, blocks, seed=1))
        (seen,) = detect_shells(picture, [COLOURS["red"]], known.camera.axis_pixel)
        return seen.window, shells[0][1:]

    return look


@pytest.mark.parametrize("hidden", [(0.0, 0.0), (2.5, 0.0), (0.0, 1.5)])
@pytest.mark.parametrize("name", ["usual", "near", "dragged", "white", "right side hidden"])
def test_a_fit_is_as_recorded(name, hidden, window, known, as_recorded):
    seen, (distance, bearing) = window(name)
    fit = fit_outline(seen, known.outline, (1.02 * distance, bearing + 0.004), hidden)
    as_recorded(fit, relative=10 * FITTED, absolute=1e-7)


@pytest.mark.parametrize("name", ["near", "white"])
def test_what_a_picture_should_show_is_as_recorded(name, window, known, as_recorded):
    seen, (distance, bearing) = window(name)
    scene = read_scene(seen, known.outline)
    numbers = {key: value for key, value in vars(scene).items() if key != "outline"}
    as_recorded(numbers, "scene")
    rng = np.random.default_rng(2)
    colours = rng.normal(0.0, 0.1, scene.points.shape[1])
    values = np.array(
        [
            *(1.01 * distance, bearing + 0.01, 0.3, -0.2, 0.25, -0.15, 0.8, 0.2, 0.6),
            *(0.95, 0.11, -0.17, 0.2, -0.07, *colours),
        ]
    )
    cover = draw_shell(scene, values)
    behind = show_behind(scene, values, cover)
    shown, slopes = expect_picture(scene, values, cover, behind)
    as_recorded(cover, "cover")
    # Smoothed in single precision.
    as_recorded(behind, "behind", relative=1e-5, absolute=1e-6)
    as_recorded([shown, slopes], "shown", relative=1e-5, absolute=1e-6)
    gains = slopes @ np.linalg.inv(slopes.T @ slopes + np.eye(len(values)))
    as_recorded(raster_covariance(scene, values, gains[:, :2]), "raster", relative=1e-4)
    left = scene.left(shown)
    raster = np.abs(slopes[:, 2]) * 0.2
    rest = remainder_covariance(scene, left, slopes, gains, raster, values[6:9])
    as_recorded(rest, "rest", relative=1e-3)


def test_the_outline_of_a_shell_is_as_recorded(as_recorded):
    camera = OmniCamera(pinhole_height=0.3, mirror_radius=0.06, centre=(300.0, 260.0))
    outline = make_outline(camera, radius=0.13, base=0.05, top=0.24)
    as_recorded(outline, "tables")
    edges = np.empty((ROUND, 3))
    fill_round(outline, 0.77, edges)
    as_recorded(edges, "edges")
    place = np.array([0.77, 3.05, 0.4, -0.3, 0.6, -0.2])
    as_recorded([radii_at(edges, along, place) for along in (0.0, 0.013, 0.41, 0.99, 1.0)], "radii")
    # Across the seam of bearings, out to where nothing is covered.
    low, high = edges[:, 0].min() - 4, edges.max() + 4
    radii, turns = np.meshgrid(np.linspace(low, high, 40), np.linspace(2.8, 3.4, 50))
    images = np.empty((radii.size, 16))
    bearings = (turns.ravel() + np.pi) % (2 * np.pi) - np.pi
    draw_cover(outline, bearings, radii.ravel(), place, images)
    assert (images[:, 0] == 0).any()
    assert ((images[:, 0] > 0) & (images[:, 0] < 0.99)).any()
    as_recorded({f"{k}": images[:, k] for k in range(16)}, "cover")


def test_a_calibration_is_as_recorded(known, as_recorded):
    told = {
        "camera": asdict(known.camera),
        "parabola": known.parabola,
        **{key: getattr(known, key) for key in ("height", "k", "k_spread", "bearing_rms")},
        "curves": known.curves,
        "errors": [each.mean_absolute_error for each in known.curves.values()],
        "doubt": [known.optics_doubt(d, p) for d, p in ((0.4, 80.0), (1.1, 140.0), (1.6, 152.0))],
        "bearing error": known.bearing_error,
    }
    as_recorded(told, relative=1e-4)
    as_recorded(known.optics_covariance, "covariance", relative=1e-3, absolute=1e-12)


@pytest.mark.parametrize("directions", [2, 5])
def test_readings_of_pictures_are_as_recorded(as_recorded, directions):
    camera = OmniCamera(width=400, height=320, focal_length=560.0)
    shell = Shell(radius=0.12, base=0.03, top=0.21)
    pictures = list(
        simulated_pictures(
            camera,
            Sensor(noise=4.0, seed=3),
            shell,
            distances=[0.35, 0.5, 0.65, 0.8, 1.0],
            directions=directions,
        )
    )
    as_recorded([picture[:3] for picture in pictures], "places")
    as_recorded(np.array([picture[3] for picture in pictures]), "pictures", relative=1e-4)
    ruler = OmniCamera(
        width=400, height=320, focal_length=575.0, pinhole_height=0.23, centre=(198.0, 160.5)
    )
    sizes = {"base": shell.base, "shell_radius": shell.radius, "shell_top": shell.top}
    readings, skipped = read_pictures(pictures, ruler, COLOURS["red"], **sizes)
    as_recorded([readings, skipped], "readings", relative=FITTED)
    fitted = calibrate(readings, camera=ruler, **sizes)
    as_recorded(asdict(fitted.camera), "camera", relative=5e-4)
