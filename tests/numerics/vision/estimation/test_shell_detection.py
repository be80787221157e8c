"""Shells are found where they are drawn, and nothing is found where there is doubt."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.estimation.shell_detection import (
    COLOURS,
    Outcome,
    ShellColour,
    chosen_colours,
    colour_mask,
    detect_shells,
    hue_saturation_value,
)
from sightfield.systems.numerics.vision.surroundings import SHELL_COLOURS

AXIS = np.array([120.0, 90.0])
RED = [COLOURS["red"]]
GREY, PAINT = 150, SHELL_COLOURS["red"]


def drawn(sectors, axis=AXIS, size=(180, 240), paint=PAINT, turn=0.0):
    """A grey picture with ring sectors (radii, bearing, width), each pixel averaged over 8 x 8."""
    fine = (np.arange(8) - 3.5) / 8
    rows = np.arange(size[0])[:, None, None, None] + fine[:, None]
    columns = np.arange(size[1])[:, None, None] + fine
    right, up = columns - axis[0], axis[1] - rows
    radius, bearing = np.hypot(right, up), np.arctan2(right, up)
    share = np.zeros(size)
    for inner, outer, middle, width in sectors:
        off = np.abs((bearing - middle - turn + np.pi) % (2 * np.pi) - np.pi)
        share += ((radius >= inner) & (radius < outer) & (off < width / 2)).mean(axis=(2, 3))
    picture = GREY + share[:, :, None] * (np.array(paint) - GREY)
    return np.round(picture).astype(np.uint8)


def detect(picture, axis=AXIS):
    return detect_shells(picture, RED, axis)[0]


@pytest.mark.parametrize("bearing", np.linspace(-3.0, 3.0, 13))
@pytest.mark.parametrize("inner", [40.0, 40.3, 55.77])
def test_a_drawn_sector_is_measured_to_a_fraction_of_a_pixel(bearing, inner):
    found = detect(drawn([(inner, inner + 14, bearing, 0.6)]))
    assert found.outcome == Outcome.SEEN
    assert found.pixel_radius == pytest.approx(inner, abs=0.15)
    assert found.bearing == pytest.approx(bearing, abs=0.01)
    assert found.width == pytest.approx(0.6, rel=0.04)
    right, down = np.array(found.pixel) - AXIS
    assert np.hypot(right, down) == pytest.approx(found.pixel_radius)
    assert np.arctan2(right, -down) == pytest.approx(found.bearing)


def test_a_shell_behind_the_robot_is_one_shell():
    found = detect(drawn([(40, 55, np.pi, 0.6)]))
    assert abs(found.bearing) == pytest.approx(np.pi, abs=0.01)
    assert found.width == pytest.approx(0.6, rel=0.04)


def test_a_band_of_two_pixels_is_found():
    found = detect(drawn([(60.2, 62.4, 1.0, 0.3)]))
    assert found.outcome == Outcome.SEEN
    assert found.pixel_radius == pytest.approx(60.2, abs=0.4)


def test_the_picture_turns_with_the_shell():
    one, other = (detect(drawn([(45, 60, 0.4, 0.5)], turn=turn)) for turn in (0.0, np.pi / 2))
    assert other.pixel_radius == pytest.approx(one.pixel_radius, abs=0.05)
    assert other.bearing - one.bearing == pytest.approx(np.pi / 2, abs=0.005)


def test_a_dark_rim_below_the_shell_does_not_move_its_edge():
    picture = drawn([(50, 60, 0.7, 0.5)]).astype(float)
    rim = drawn([(47, 50, 0.7, 0.5)], paint=(42, 43, 46)).astype(float)
    both = np.clip(picture + rim - GREY, 0, 255).astype(np.uint8)
    assert detect(both).pixel_radius == pytest.approx(50, abs=0.2)


def test_noise_does_not_move_the_edge_far_and_makes_no_blobs():
    generator = np.random.default_rng(3)
    clean = drawn([(45, 58, -0.8, 0.5)])
    for _ in range(5):
        noisy = np.clip(clean + generator.normal(0, 8, clean.shape), 0, 255).astype(np.uint8)
        found = detect(noisy)
        assert found.outcome == Outcome.SEEN
        assert found.pixel_radius == pytest.approx(45, abs=0.4)


def test_specks_are_no_shells():
    picture = drawn([(45, 58, -0.8, 0.5)])
    picture[20:22, 30:33] = PAINT
    assert detect(picture).outcome == Outcome.SEEN
    alone = drawn([])
    alone[20:22, 30:33] = PAINT
    assert detect(alone).outcome == Outcome.NO_BLOB


@pytest.mark.parametrize(
    ("sectors", "outcome"),
    [
        ([], Outcome.NO_BLOB),
        ([(40, 55, 0.0, 0.4), (40, 55, 1.0, 0.4)], Outcome.TWO_BLOBS),
        ([(40, 55, 0.0, 0.6), (70, 73, 1.0, 0.1)], Outcome.TWO_BLOBS),
        ([(80, 110, 0.0, 0.4)], Outcome.CUT_OFF),
        ([(40, 55, 0.0, 7.0)], Outcome.NO_SHELL_SHAPE),
        ([(0, 30, 0.0, 7.0)], Outcome.NO_SHELL_SHAPE),
        ([(40, 55, 0.0, 4.0)], Outcome.NO_SHELL_SHAPE),
    ],
)
def test_what_is_no_single_whole_shell_gives_no_numbers(sectors, outcome):
    found = detect(drawn(sectors))
    assert found.outcome == outcome
    assert not outcome.has_estimate
    assert np.isnan([*found.pixel, found.pixel_radius, found.bearing, found.width]).all()


@pytest.mark.parametrize("level", [(0, 0, 0), (255, 255, 255), (205, 30, 35)])
def test_one_colour_all_over_is_no_shell(level):
    picture = np.full((180, 240, 3), level, np.uint8)
    assert not detect(picture).outcome.has_estimate


def test_several_colours_are_found_at_once_and_told_apart():
    picture = np.full((180, 240, 3), GREY, np.uint8).astype(int)
    bearings = dict(zip(SHELL_COLOURS, np.linspace(-2.4, 2.4, len(SHELL_COLOURS)), strict=True))
    for name, bearing in bearings.items():
        picture += drawn([(40, 55, bearing, 0.5)], paint=SHELL_COLOURS[name]).astype(int) - GREY
    found = detect_shells(picture.astype(np.uint8), list(COLOURS.values()), AXIS)
    assert [each.outcome for each in found] == [Outcome.SEEN] * len(COLOURS)
    assert [each.bearing for each in found] == pytest.approx(list(bearings.values()), abs=0.02)


@pytest.mark.parametrize("light", [0.35, 0.6, 1.0])
def test_a_colour_keeps_its_name_in_the_shadow(light):
    for name, paint in SHELL_COLOURS.items():
        patch = np.full((4, 4, 3), np.round(light * np.array(paint)), np.uint8)
        hsv = hue_saturation_value(patch)
        names = [each for each, colour in COLOURS.items() if colour_mask(hsv, colour).all()]
        assert names == [name]


def test_grey_has_no_colour():
    for level in (0, 60, 150, 255):
        hsv = hue_saturation_value(np.full((4, 4, 3), level, np.uint8))
        assert not any(colour_mask(hsv, colour).any() for colour in COLOURS.values())


@pytest.mark.parametrize(
    ("picture", "message"),
    [
        (np.zeros((4, 5, 3)), "`picture` must hold 8-bit values .uint8.; got float64"),
        (np.zeros((4, 5), np.uint8), r"`picture` must have the shape .*; got \(4, 5\)"),
        (np.zeros((4, 5, 2), np.uint8), r"`picture` must have the shape .*; got \(4, 5, 2\)"),
        (np.zeros((0, 5, 3), np.uint8), r"`picture` must have the shape .*; got \(0, 5, 3\)"),
    ],
)
def test_what_is_no_picture_is_refused(picture, message):
    with pytest.raises(InvalidInput, match=message):
        detect_shells(picture, RED, AXIS)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["mauve"], "`colour` must be one of red, green, blue, yellow, magenta; got mauve"),
        ([], "`colours` must name at least one colour"),
        (["red", "red"], "`colours` must differ from each other; got red, red"),
    ],
)
def test_colours_that_no_shell_has_are_refused(names, message):
    with pytest.raises(InvalidInput, match=message):
        chosen_colours(names)


@pytest.mark.parametrize(
    "wrong",
    [{"hue": 360}, {"hue_tolerance": 0}, {"min_saturation": 0}, {"min_value": 1.5}],
)
def test_a_colour_out_of_its_range_is_refused(wrong):
    with pytest.raises(InvalidInput):
        ShellColour(**({"name": "odd", "hue": 10.0} | wrong))
