"""Readings, colours, pictures' names and tracks are taken up to where they are said to end."""

import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.estimation import labelled_pictures, pictures
from sightfield.systems.numerics.vision.estimation.calibration import (
    INCH,
    THESIS_DISTANCES,
    calibrate,
    error_curve,
    fit_optics,
)
from sightfield.systems.numerics.vision.estimation.labelled_pictures import (
    LabelledPicture,
    read_labels,
    read_pictures,
    simulated_pictures,
)
from sightfield.systems.numerics.vision.estimation.pictures import (
    as_rgb,
    has_contrast,
    load_picture,
    require_size,
)
from sightfield.systems.numerics.vision.estimation.position_filter import (
    GATE,
    correct,
    correct_at,
    limit_speed,
    predict,
    start_track,
)
from sightfield.systems.numerics.vision.estimation.range_models import thesis_range
from sightfield.systems.numerics.vision.estimation.shell_detection import (
    COLOURS,
    Outcome,
    ShellColour,
    colour_mask,
    detect_blobs,
    hue_saturation_value,
)
from sightfield.systems.numerics.vision.omni_optics import OmniCamera
from sightfield.systems.numerics.vision.sensor import Sensor
from sightfield.systems.numerics.vision.surroundings import SHELL_COLOURS, Shell


def painted(*boxes, size=(120, 160), paint=SHELL_COLOURS["red"]):
    """A grey picture with boxes (top, left, height, width) of a shell's colour."""
    picture = np.full((*size, 3), 140, np.uint8)
    picture[::16, ::16] = 200
    for top, left, height, width in boxes:
        picture[top : top + height, left : left + width] = paint
    return picture


def blobs_of(picture):
    (found,) = detect_blobs(picture, [COLOURS["red"]], (80.0, 60.0))
    return found


@pytest.mark.parametrize(("sides", "seen"), [((3, 4), True), ((1, 11), False), ((1, 12), True)])
def test_twelve_pixels_are_a_blob_and_eleven_are_none(sides, seen):
    (found,) = blobs_of(painted((20, 40, *sides)))
    assert (found.outcome != Outcome.NO_BLOB) == seen
    assert found.area == sides[0] * sides[1]


def test_the_six_largest_blobs_are_looked_at():
    boxes = [(8 + 12 * k, 20 + 5 * k, 4, 5 + k) for k in range(8)]
    found = blobs_of(painted(*boxes))
    assert [each.area for each in found] == [48, 44, 40, 36, 32, 28]


@pytest.mark.parametrize(
    ("box", "outcome"),
    [
        ((0, 70, 9, 20), Outcome.CUT_OFF),
        ((20, 0, 9, 20), Outcome.CUT_OFF),
        ((111, 70, 9, 20), Outcome.CUT_OFF),
        ((20, 140, 9, 20), Outcome.CUT_OFF),
        ((1, 70, 9, 20), Outcome.SEEN),
        ((110, 70, 9, 20), Outcome.SEEN),
        ((52, 1, 18, 9), Outcome.SEEN),
        ((52, 150, 18, 9), Outcome.SEEN),
        ((55, 72, 10, 18), Outcome.NO_SHELL_SHAPE),
    ],
)
def test_a_blob_that_touches_the_border_is_cut_off(box, outcome):
    (found,) = blobs_of(painted(box))
    assert found.outcome == outcome
    assert found.area == box[2] * box[3]
    if outcome != Outcome.SEEN:
        return
    top, left, height, width = box
    # Its window is nine pixels wider on each side, where the picture is.
    low, first = max(top - 9, 0), max(left - 9, 0)
    last, end = min(top + height + 9, 120), min(left + width + 9, 160)
    assert found.window.blob.shape == (last - low, end - first)
    assert found.window.axis.tolist() == [80.0 - first, 60.0 - low]
    assert np.count_nonzero(found.window.blob) == found.area


@pytest.mark.parametrize(
    ("hue", "tolerance", "inside"),
    [
        (120.0, 22.0, [98.5, 141.5]),
        (10.0, 22.0, [349.5, 0.0, 31.0]),
        (355.0, 22.0, [334.0, 0.0, 16.0]),
        (240.0, 5.0, [236.0, 244.0]),
    ],
)
def test_hues_of_a_colour_go_round_the_circle(hue, tolerance, inside):
    colour = ShellColour(name="any", hue=hue, hue_tolerance=tolerance)
    steps = np.arange(256)
    hsv = np.stack([steps, np.full(256, 200), np.full(256, 200)], axis=1).astype(np.uint8)[None]
    mask = colour_mask(hsv, colour)[0]
    off = np.abs((steps * 360 / 256 - hue + 180) % 360 - 180)
    assert (mask[off < tolerance - 1] == 255).all()
    assert not mask[off > tolerance + 1].any()
    assert all(mask[round(each / 360 * 256) % 256] for each in inside)


def test_saturation_and_value_of_a_colour_begin_where_they_say():
    colour = ShellColour(name="any", hue=120.0, min_saturation=0.4, min_value=0.2)
    for saturation, value, light, found in (
        (102, 51, 1.0, True),
        (101, 51, 1.0, False),
        (102, 50, 1.0, False),
        (102, 26, 0.5, True),
        (102, 25, 0.5, False),
    ):
        hsv = np.array([[[85, saturation, value]]], np.uint8)
        assert bool(colour_mask(hsv, colour, light)[0, 0]) == found
    usual = ShellColour(name="any", hue=0.0)
    numbers = usual.hue_tolerance, usual.min_saturation, usual.min_value
    assert numbers == (22.0, 0.4, 0.18)
    for wrong in ({"hue": 360.0}, {"hue": -0.1}, {"hue_tolerance": 0.0}, {"hue_tolerance": 180.0}):
        with pytest.raises(InvalidInput):
            replace(usual, **wrong)
    for wrong in ({"min_saturation": 0.0}, {"min_value": 0.0}, {"min_value": 1.0}):
        with pytest.raises(InvalidInput):
            replace(usual, **wrong)
    replace(usual, hue=359.9, hue_tolerance=179.9)


@pytest.mark.parametrize("name", SHELL_COLOURS)
def test_a_colour_s_hue_is_that_of_its_paint(name):
    paint = np.array([[SHELL_COLOURS[name]]], np.uint8)
    hue = float(hue_saturation_value(paint)[0, 0, 0]) * 360 / 256
    assert abs((hue - COLOURS[name].hue + 180) % 360 - 180) < 1.5


def test_in_a_dark_picture_shells_may_be_darker():
    dim = painted((20, 60, 10, 30), paint=(24, 2, 3))
    assert blobs_of(dim)[0].outcome == Outcome.NO_BLOB
    assert blobs_of((0.45 * painted((20, 60, 10, 30))).astype(np.uint8))[0].area == 300
    # Of a hundred parts one may be brighter.
    darker = (dim * 0.5).astype(np.uint8)
    darker[20:30, 60:90] = (24, 2, 3)
    assert blobs_of(darker)[0].area == 300


def test_what_is_a_picture_and_what_is_none():
    picture = painted((20, 60, 10, 30))
    alpha = np.dstack([picture, np.full(picture.shape[:2], 7, np.uint8)])
    np.testing.assert_array_equal(as_rgb(alpha), picture)
    for wrong in (picture.astype(float), picture[:, :, 0], picture[:, :, :2], picture[:0]):
        with pytest.raises(InvalidInput):
            as_rgb(wrong)
    require_size(picture, 160, 120)
    for width, height in ((161, 120), (160, 121), (120, 160)):
        with pytest.raises(InvalidInput, match=f"be {width} x {height} pixels; got 160 x 120"):
            require_size(picture, width, height)
    plain = np.full((40, 50, 3), 9, np.uint8)
    assert not has_contrast(plain)
    for at in ((0, 1), (16, 32), (39, 49)):
        speck = plain.copy()
        speck[(*at, 2)] = 10
        assert has_contrast(speck)


@pytest.mark.parametrize("suffix", ["png", "jpg"])
def test_pictures_have_as_many_pixels_as_they_may(tmp_path, monkeypatch, suffix):
    path = tmp_path / f"a.{suffix}"
    cv2.imwrite(str(path), painted((20, 60, 10, 30)))
    assert pictures.MOST_PIXELS == 50_000_000
    monkeypatch.setattr(pictures, "MOST_PIXELS", 160 * 120)
    assert load_picture(path).shape == (120, 160, 3)
    monkeypatch.setattr(pictures, "MOST_PIXELS", 160 * 120 - 1)
    with pytest.raises(InvalidInput, match=r"have at most 19,199 pixels; .*160 x 120"):
        load_picture(path)


@pytest.mark.parametrize(
    ("name", "distance", "bearing"),
    [
        ("15in_90deg.png", 0.381, 0.5 * math.pi),
        ("red_0.381m_-1.57rad.jpg", 0.381, -1.57),
        ("381mm_270deg_second_try.jpeg", 0.381, -0.5 * math.pi),
        ("38.1cm_+180deg.PNG", 0.381, math.pi),
    ],
)
def test_names_of_pictures_are_places(tmp_path, name, distance, bearing):
    (tmp_path / name).touch()
    (label,) = read_labels(tmp_path)
    assert label[1:] == pytest.approx((distance, bearing), rel=1e-12)
    assert label.file == tmp_path / name


def test_distances_of_labels_are_positive_and_bearings_finite(tmp_path):
    (tmp_path / "a.png").touch()
    for row, fine in (
        ("1e-9,0", True),
        ("0,0", False),
        ("-1,0", False),
        ("inf,0", False),
        ("1,inf", False),
        ("1,x", False),
    ):
        (tmp_path / "shells.csv").write_text(f"file,distance_in,bearing_deg\na.png,{row}\n")
        if fine:
            (label,) = read_labels(tmp_path)
            assert label.distance == pytest.approx(INCH * 1e-9)
            continue
        with pytest.raises(InvalidInput, match=r"shells\.csv, line 2"):
            read_labels(tmp_path)
    for columns in ("distance_m,distance_in,bearing_deg", "bearing_deg", "distance_m"):
        (tmp_path / "shells.csv").write_text(f"file,{columns}\n")
        with pytest.raises(InvalidInput, match="have one column of"):
            read_labels(tmp_path)


def test_simulated_pictures_are_asked_for_within_reason(camera):
    usual = {"distances": [0.5], "directions": 3}
    for wrong in (
        {"directions": 0},
        {"directions": 1081},
        {"distances": [0.5, 0.0]},
    ):
        with pytest.raises(InvalidInput):
            simulated_pictures(camera, Sensor(), Shell(), **{**usual, **wrong})
    simulated_pictures(camera, Sensor(), Shell(), distances=[0.5], directions=1080)
    simulated_pictures(camera, Sensor(), Shell(), distances=[0.5], directions=1)


@pytest.mark.parametrize(
    ("stretch", "fine"), [(1.0, True), (1.025, True), (0.975, True), (1.1, False), (0.9, False)]
)
def test_shells_as_wide_as_their_distances_say_to_three_parts_in_a_hundred(
    camera, shell_sizes, monkeypatch, stretch, fine
):
    (picture,) = simulated_pictures(
        camera, Sensor(noise=0.0), Shell(), distances=[0.5], directions=1
    )
    told = []
    # What comes of the readings does not matter here.
    monkeypatch.setattr(labelled_pictures, "Readings", lambda **numbers: told.append(numbers))
    monkeypatch.setattr(labelled_pictures, "_PASSES", 0)
    width = 2 * math.asin(0.1 / 0.6)
    wrong = 0.1 / math.sin(0.5 * stretch * width) - 0.1
    labelled = [LabelledPicture("a", wrong, 0.0, picture.picture)]
    if fine:
        read_pictures(labelled, camera, COLOURS["red"], **shell_sizes)
        assert told[0]["distance"].tolist() == [wrong]
        return
    with pytest.raises(InvalidInput, match="wider" if stretch < 1 else "narrower"):
        read_pictures(labelled, camera, COLOURS["red"], **shell_sizes)


def test_readings_end_where_they_say(ideal_readings):
    readings = ideal_readings(distances=(0.4, 0.6, 0.9, 1.4), directions=2)
    assert readings.distances.tolist() == [0.4, 0.6, 0.9, 1.4]
    for wrong in (
        {"distance": np.where(readings.distance == 1.4, 0.9, readings.distance)},
        {"distance": np.where(readings.distance == 0.4, 0.0, readings.distance)},
        {"pixels": readings.pixels * 1e18},
        {"bearing": readings.bearing + np.inf},
        {"pixels": readings.pixels[:, :1]},
    ):
        with pytest.raises(InvalidInput):
            replace(readings, **wrong)
    assert pytest.approx([k * INCH for k in range(15, 61, 5)]) == THESIS_DISTANCES
    assert INCH == 0.0254


def test_an_error_curve_is_the_mean_and_the_spread_at_each_distance(ideal_readings):
    readings = ideal_readings(distances=(0.4, 0.6, 0.9, 1.4), directions=3)
    off = np.random.default_rng(0).normal(0.01, 0.02, 12)
    radius = np.arange(12.0)
    curve = error_curve(readings, radius, readings.distance - off)
    rows = off.reshape(4, 3)
    assert curve.mean_error == pytest.approx(rows.mean(axis=1))
    assert curve.spread == pytest.approx(rows.std(axis=1))
    assert curve.rms == pytest.approx(np.sqrt((rows**2).mean(axis=1)))
    assert curve.pixel_radius == pytest.approx(radius.reshape(4, 3).mean(axis=1))
    assert curve.mean_absolute_error == pytest.approx(np.abs(rows.mean(axis=1)).mean())


@pytest.mark.parametrize(
    ("bearings", "tells"),
    [
        ([0.0, 2.1, 4.2], True),
        ([0.0, 1.0, 3.1], False),
        ([0.0, 3.1], False),
        ([0.2, 1.5, 3.3, 4.0], True),
    ],
)
def test_directions_on_more_than_half_the_circle_tell_the_axis(
    camera, ideal_readings, bearings, tells
):
    off = OmniCamera(centre=(322.5, 237.0))
    readings = ideal_readings(distances=(0.4, 0.6, 0.9, 1.4), directions=len(bearings), optics=off)
    turned = np.tile(bearings, 4)
    radius = np.linalg.norm(readings.pixels - off.axis_pixel, axis=1)
    ways = np.column_stack([np.sin(turned), -np.cos(turned)])
    pixels = off.axis_pixel + radius[:, None] * ways
    readings = replace(readings, bearing=turned, pixels=pixels)
    start = camera if tells else off
    fitted = fit_optics(readings, start, 0.04)
    assert fitted.axis_pixel == pytest.approx([322.5, 237.0], abs=1e-3)
    assert fitted.focal_length == pytest.approx(off.focal_length, rel=1e-3)
    known = calibrate(readings, camera=start, base=0.04, shell_radius=0.1, shell_top=0.2)
    assert (np.diag(known.optics_covariance)[2:] > 0).all() == tells


def test_a_calibration_s_numbers_end_where_they_say(camera, ideal_readings, shell_sizes):
    readings = ideal_readings(directions=2)
    known = calibrate(readings, camera=camera, **shell_sizes)
    for height, words in (
        (1e-3, "put all shells below the horizon"),
        (0.0, "be positive"),
        (1e19, "be of a size"),
    ):
        with pytest.raises(InvalidInput, match=f"`height` must {words}"):
            calibrate(readings, camera=camera, height=height, **shell_sizes)
    calibrate(readings, camera=camera, height=0.5 * known.height, **shell_sizes)
    nearer = readings.pixels + 0.3 * (readings.distance[:, None] > 1.5) * (
        camera.axis_pixel - readings.pixels
    )
    for wrong in (
        {"parabola": (1.0, 2.0)},
        {"parabola": (1.0, 2.0, math.nan)},
        {"shell_top": known.base},
        {"readings": replace(readings, pixels=nearer)},
        {"k_spread": -1.0},
    ):
        with pytest.raises(InvalidInput):
            replace(known, **wrong)


def test_the_thesis_model_ends_at_its_horizon():
    k, height = 107.0, 0.3
    below = 107.0 * (0.5 * math.pi - 1e-9)
    assert np.isfinite(thesis_range(below, k=k, height=height))
    assert np.isinf(thesis_range(107.0 * 0.5 * math.pi, k=k, height=height))
    assert thesis_range(0.0, k=k, height=height) == 0.0


def test_late_measurements_are_of_where_a_point_was():
    track = start_track(np.array([1.0, 2.0]), np.diag([0.02, 0.05]), 0.3)
    track = track._replace(mean=np.array([1.0, 2.0, 0.4, -0.2]))
    noise = np.array([[0.03, 0.01], [0.01, 0.02]])
    seen = np.array([0.9, 2.1])
    for passed, density in ((-0.3, 0.2), (0.4, 0.2), (0.0, 0.2)):
        found = correct_at(track, passed, seen, noise, density)
        now = predict(track, max(passed, 0.0), density)
        # The unknowns' information, and that of what was seen of where it was then.
        look = np.hstack([np.eye(2), min(passed, 0.0) * np.eye(2)])
        wide = noise + density * max(-passed, 0.0) ** 3 / 3 * np.eye(2)
        known = np.linalg.inv(now.covariance)
        total = known + look.T @ np.linalg.solve(wide, look)
        mean = np.linalg.solve(total, known @ now.mean + look.T @ np.linalg.solve(wide, seen))
        assert found.mean == pytest.approx(mean)
        assert found.covariance == pytest.approx(np.linalg.inv(total))


def test_noise_that_changes_a_velocity_spreads_places_with_the_cube_of_time():
    track = start_track(np.zeros(2), np.zeros((2, 2)), 0.0)
    wide = predict(track, 0.6, 0.5).covariance
    along = 0.5 * np.array([[0.6**3 / 3, 0.6**2 / 2], [0.6**2 / 2, 0.6]])
    assert wide == pytest.approx(np.kron(along, np.eye(2)))


def test_the_gate_is_where_it_is_said_to_be():
    track = start_track(np.zeros(2), 0.01 * np.eye(2), 0.1)
    edge = math.sqrt(GATE * 0.02)
    for share, inside in ((0.9999, True), (1.0001, False)):
        found = correct(track, np.array([0.0, share * edge]), 0.01 * np.eye(2))
        assert (found is not None) == inside
    # Of 10,000 true ones one is refused, or ten.
    assert math.exp(-0.5 * GATE) == pytest.approx(1e-3, rel=0.2)


def test_no_point_is_faster_than_it_can_be():
    track = start_track(np.array([1.0, 2.0]), 0.01 * np.eye(2), 0.1)
    track = track._replace(mean=np.array([1.0, 2.0, 0.3, -0.4]))
    assert limit_speed(track, 0.5) is track
    slow = limit_speed(track, 0.25)
    assert slow.mean == pytest.approx([1.0, 2.0, 0.15, -0.2])
    assert track.mean[2] == 0.3


def test_nothing_is_read_where_there_is_nothing(tmp_path: Path):
    with pytest.raises(InvalidInput, match="`pictures` must be a folder"):
        read_labels(tmp_path / "none")
    with pytest.raises(InvalidInput, match=r"`pictures` must hold \.png, \.jpg, \.jpeg files"):
        read_labels(tmp_path)
