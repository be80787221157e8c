"""The outline that is fitted is the one that cameras see, and what is no shell fits it badly."""

import cv2
import numpy as np
import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.vision.estimation.outline_fit import fit_outline
from sightfield.systems.numerics.vision.estimation.range_models import draw_cover, make_outline
from sightfield.systems.numerics.vision.estimation.shell_detection import (
    COLOURS,
    Outcome,
    detect_shells,
)
from sightfield.systems.numerics.vision.estimation.shell_estimate import locate, search_shells
from sightfield.systems.numerics.vision.omni_optics import make_ray_table, project_omni
from sightfield.systems.numerics.vision.rendering import render
from sightfield.systems.numerics.vision.sensor import Sensor, expose
from sightfield.systems.numerics.vision.surroundings import SHELL_COLOURS, Shell, Surroundings

RED = [COLOURS["red"]]
SHELL = Shell()


@pytest.fixture(scope="module")
def light_of(camera):
    """A function of shells at (distance to the near side, bearing): light on the sensor."""
    rays = make_ray_table(camera)
    room = Surroundings(world=make_world([[-3, -3], [3, -3], [3, 3], [-3, 3]], []))

    def light(*places, shell=SHELL):
        at = [(d + shell.radius) * np.array([np.cos(b), np.sin(b)]) for d, b in places]
        return render(camera, rays, room, (0, 0, 0), [shell] * len(at), np.reshape(at, (-1, 2)))

    return light


@pytest.fixture(scope="module")
def block(camera):
    """A function that paints an upright block of the shells' colour into a picture's light."""

    def paint(light, distance, bearing, turn, sides, heights):
        half, heading = 0.5 * np.array(sides), bearing + turn
        middle = distance * np.array([np.cos(bearing), np.sin(bearing)])
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
        axes = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
        corners = middle + corners @ axes
        bottom, top = (np.column_stack([corners, np.full(4, h)]) for h in heights)
        faces = [top, *(np.array([bottom[k], bottom[k - 1], top[k - 1], top[k]]) for k in range(4))]
        for face in faces:
            # Straight lines are curved in the mirror.
            edge = np.concatenate(
                [
                    np.linspace(a, b, 30)
                    for a, b in zip(face, np.roll(face, -1, axis=0), strict=True)
                ]
            )
            pixels, _ = project_omni(camera, edge)
            paint = tuple(value / 255 for value in SHELL_COLOURS["red"])
            cv2.fillPoly(light, [np.rint(16 * pixels).astype(np.int32)], paint, shift=4)
        return light

    return paint


def taken(light, frame=0, **changes):
    return expose(Sensor(**changes), light, frame)[:, :, :3]


@pytest.mark.parametrize("place", [(0.45, 0.7), (0.9, -2.1), (1.5, 2.5)])
def test_a_shell_covers_what_the_camera_shows_of_it(camera, light_of, place):
    outline = make_outline(camera, radius=SHELL.radius, base=SHELL.base, top=SHELL.top)
    rows, columns = np.indices((camera.height, camera.width)).reshape(2, -1)
    right, up = columns - camera.axis_pixel[0], camera.axis_pixel[1] - rows
    images = np.empty((len(rows), 16))
    draw_cover(
        outline, np.arctan2(right, up), np.hypot(right, up), np.array([*place, 0, 0, 0, 0]), images
    )
    light = light_of(place).reshape(-1, 3)
    red = light[:, 0] > 2 * light[:, 1]
    cover = images[:, 0]
    assert cover.max() <= 1 + 1e-12
    assert cover.sum() == pytest.approx(red.sum(), rel=0.02)
    # Only at the edges do they differ, as a pixel of the picture is one or the other.
    assert np.abs(cover - red).max() <= 0.75
    for axis in (columns, rows):
        assert cover @ axis / cover.sum() == pytest.approx(axis[red].mean(), abs=0.1)
    # Light from across and along, by the normal's direction: x^2 + (1 - x^2) = 1.
    inside = cover > 1 - 1e-9
    assert np.all(np.hypot(images[inside, 1], images[inside, 2]) < 1 + 1e-9)


@pytest.fixture
def drawn(camera):
    """A function of a place: images of a shell there, from pixels at and around it."""
    outline = make_outline(camera, radius=SHELL.radius, base=SHELL.base, top=SHELL.top)
    radii, bearings = np.meshgrid(np.arange(120.0, 165.0), np.linspace(0.2, 0.8, 61))

    def draw(place):
        images = np.empty((radii.size, 16))
        draw_cover(outline, bearings.ravel(), radii.ravel(), np.array(place), images)
        return images

    return draw


@pytest.mark.parametrize("unknown", range(6))
def test_slopes_are_what_a_small_change_of_the_place_makes(drawn, unknown):
    place = np.array([0.8, 0.5, 0.1, -0.2, 0.15, -0.1])
    step = np.zeros(6)
    step[unknown] = 1e-6
    here = drawn(place)
    change = (drawn(place + step) - drawn(place - step)) / 2e-6
    if unknown >= 2:
        assert change[:, 0].sum() > 1
        assert change[:, 0] == pytest.approx(here[:, 10 + unknown], abs=1e-3)
        return
    slopes = here[:, 4 + 4 * unknown : 8 + 4 * unknown]
    # Light from along the line of sight ends steeply at the sides, where slopes are held down.
    for k, most in enumerate((0.005, 0.005, 0.4, 0.005)):
        size = np.linalg.norm(change[:, k])
        assert size > 1
        assert np.linalg.norm(slopes[:, k] - change[:, k]) < most * size


def test_the_sides_turn_with_the_bearing_alike(drawn):
    # Slopes by differences to one side drew bearings that way, by a quarter of a deviation.
    images = drawn([0.8, 0.5, 0, 0, 0, 0])
    mirrored = images.reshape(61, 45, 16)[::-1].reshape(-1, 16)
    assert images[:, 0] == pytest.approx(mirrored[:, 0], abs=1e-9)
    assert images[:, 8] == pytest.approx(-mirrored[:, 8], abs=1e-6)


def spoiled(light, frame):
    """The same scene by a good sensor and by five that are worse, each in its way."""
    moved = cv2.filter2D(light, -1, np.full((1, 7), 1 / 7, np.float32))
    usual = taken(light, frame)
    _, file = cv2.imencode(".jpg", usual, [cv2.IMWRITE_JPEG_QUALITY, 75])
    return [
        usual,
        taken(light, frame, noise=12.0),
        taken(light, frame, blur=2.0),
        taken(moved, frame),
        cv2.imdecode(file, cv2.IMREAD_COLOR),
        taken(light, frame, exposure=3.0),
    ]


def test_covariances_are_honest_in_pictures_good_and_bad(light_of, calibration):
    generator, squares = np.random.default_rng(6), []
    for frame in range(8):
        distance, bearing = generator.uniform(0.4, 1.5), generator.uniform(-np.pi, np.pi)
        truth = (distance + SHELL.radius) * np.array([np.cos(bearing), np.sin(bearing)])
        for picture in spoiled(light_of((distance, bearing)), frame):
            ((_, estimate),) = search_shells(picture, RED, calibration)
            assert estimate.outcome == Outcome.SEEN
            position, covariance = locate(estimate, np.zeros(3), SHELL.radius)
            off = position - truth
            squares.append(off @ np.linalg.solve(covariance, off))
    # 2 if they are honest; the mean of 48 then is so with a deviation of 0.3.
    assert 1.1 < np.mean(squares) < 2.9
    assert np.max(squares) < 20


def test_worse_pictures_are_less_sure(light_of, calibration):
    usual, noisy, blurred, *_ = spoiled(light_of((1.2, 0.4)), 1)
    spreads = [
        search_shells(picture, RED, calibration)[0][1].covariance
        for picture in (usual, noisy, blurred)
    ]
    assert spreads[1][0, 0] > spreads[0][0, 0]
    assert spreads[2][0, 0] > 1.2 * spreads[0][0, 0]


def test_pictures_that_are_a_little_too_bright_are_as_sure_as_they_are_good(light_of, calibration):
    # Ranges were thrice as unsure as in usual pictures, and erred no more than there.
    for k in range(4):
        light = light_of((0.6 + 0.25 * k, 1.3 * k - 2))
        usual, bright = (
            search_shells(taken(light, k, exposure=e), RED, calibration)[0][1].covariance[0, 0]
            for e in (1.0, 2.0)
        )
        assert bright < 2.5 * usual


def test_blocks_of_compressed_pictures_are_seen_in_remainders(light_of, calibration):
    # Neighbours err alike there, by which bearings err by more than remainders of their size tell.
    light, spreads = light_of((1.2, 0.4)), []
    for quality in (95, 50, 25):
        _, file = cv2.imencode(".jpg", taken(light), [cv2.IMWRITE_JPEG_QUALITY, quality])
        picture = cv2.imdecode(file, cv2.IMREAD_COLOR)
        ((_, estimate),) = search_shells(picture, RED, calibration)
        spreads.append(estimate.covariance[1, 1] ** 0.5)
    assert spreads[1] > 1.5 * spreads[0]
    assert spreads[2] > 2.5 * spreads[0]


def test_posters_and_boxes_as_large_as_a_shell_are_refused(light_of, block, calibration):
    # They were taken for shells with a side hidden, by which many an outline can be explained.
    for distance, turn, sides, heights in (
        (1.0, 0.07, (0.002, 0.18), (0.01, 0.19)),
        (1.27, 1.47, (0.23, 0.21), (0.0, 0.13)),
        (1.3, 0.44, (0.17, 0.14), (0.0, 0.14)),
    ):
        light = block(light_of(), distance, 0.7, turn, sides, heights)
        ((_, estimate),) = search_shells(taken(light), RED, calibration)
        assert not estimate.outcome.has_estimate, (distance, estimate)


@pytest.mark.parametrize(
    ("sides", "heights"),
    [((0.2, 0.2), (0.0, 0.2)), ((0.3, 0.3), (0.0, 0.003)), ((0.002, 0.25), (0.1, 0.3))],
    ids=["box", "mat", "poster"],
)
def test_what_is_red_but_no_shell_is_refused(light_of, block, calibration, sides, heights):
    for k in range(5):
        place = 0.6 + 0.2 * k, 1.1 * k - 2, 0.3 * k - 0.6
        light = block(light_of(), *place, sides, heights)
        ((_, estimate),) = search_shells(taken(light, k), RED, calibration)
        assert not estimate.outcome.has_estimate, (place, estimate)


def test_a_decoy_beside_a_shell_does_not_hide_it(light_of, block, calibration):
    light = block(light_of((0.8, 0.5)), 0.7, -1.5, 0.3, (0.3, 0.3), (0.0, 0.003))
    ((_, estimate),) = search_shells(taken(light), RED, calibration)
    assert estimate.outcome == Outcome.SEEN
    assert estimate.range == pytest.approx(0.8, abs=0.01)
    assert estimate.bearing == pytest.approx(0.5, abs=0.005)


def test_two_identical_shells_are_measured_where_two_are_looked_for(light_of, calibration):
    places = [(0.6, 0.5), (1.2, -2.0)]
    picture = taken(light_of(*places))
    found = search_shells(picture, [*RED, *RED], calibration)
    nearest = sorted((each.range, each.bearing) for _, each in found)
    assert np.array(nearest) == pytest.approx(np.array(places), abs=0.01)
    # One that is looked for could be either.
    ((_, alone),) = search_shells(picture, RED, calibration)
    assert alone.outcome == Outcome.TWO_BLOBS
    (_, one), (_, other) = search_shells(taken(light_of(places[0])), [*RED, *RED], calibration)
    assert one.outcome == Outcome.SEEN
    assert other.outcome == Outcome.NOT_ANOTHER


def test_a_wall_behind_a_blurred_shell_does_not_draw_it_outwards(light_of, calibration):
    # The wall is a little of the shell's colour; taken for floor it drew shells by 15 to 30 mm.
    errors = []
    for k in range(8):
        distance, bearing = 1.2 + 0.03 * k, 0.8 * k + 0.3
        picture = taken(light_of((distance, bearing)), k, blur=3.0)
        ((_, estimate),) = search_shells(picture, RED, calibration)
        errors.append(estimate.range - distance)
    assert abs(np.mean(errors)) < 0.005
    assert np.max(np.abs(errors)) < 0.015


def test_a_fit_that_finds_no_shell_near_its_start_does_not_fail(light_of, calibration):
    picture = taken(light_of((0.9, 0.4)))
    (seen,) = detect_shells(picture, RED, calibration.camera.axis_pixel)
    assert seen.window is not None
    for start in ((0.9, 2.4), (30.0, 0.4), (0.03, 0.4)):
        fit = fit_outline(seen.window, calibration.outline, start)
        assert fit is None or fit.misfit > 1


def test_a_dark_picture_is_read_too(light_of, calibration):
    picture = taken(light_of((0.9, 2.0)), exposure=0.2)
    ((_, estimate),) = search_shells(picture, RED, calibration)
    assert estimate.outcome == Outcome.SEEN
    assert estimate.range == pytest.approx(0.9, abs=4 * estimate.covariance[0, 0] ** 0.5)


def test_a_picture_that_is_blurred_beyond_a_shell_s_height_is_refused(light_of, calibration):
    ((_, estimate),) = search_shells(taken(light_of((1.2, 2.0)), blur=6.0), RED, calibration)
    assert not estimate.outcome.has_estimate
