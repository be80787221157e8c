"""Quantities with units: exact factors, one line for what cannot be."""

import math

import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.units import (
    TEST_WEIGHTS,
    UNITS,
    Quantity,
    area_text,
    parse_unit,
    read_quantities,
    read_quantity,
)

POUND, ACRE = 0.45359237, 4046.8564224


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("12", "m", 12.0),
        ("1e3", "kg", 1000.0),
        ("9 t", "kg", 9000.0),
        ("9t", "kg", 9000.0),
        ("8 km/h", "m/s", 8 / 3.6),
        ("5 MPH", "m/s", 2.2352),
        ("30 ft", "m", 9.144),
        ("8 t/ha", "kg/m^2", 0.8),
        ("90 dt / ha", "kg/m^2", 0.9),
        ("180 bu/ac corn", "kg/m^2", 180 * 56 * POUND / ACRE),
        ("60 bushels per acre of wheat", "kg/m^2", 60 * 60 * POUND / ACRE),
        ("300 bu soybeans", "kg", 300 * 60 * POUND),
        ("72 t/h", "kg/s", 20.0),
        ("5 bu/s oats", "kg/s", 5 * 32 * POUND),
        ("2 m/s²", "m/s^2", 2.0),
        ("1.5 min", "s", 90.0),
        ("90 min", "h", 1.5),
        ("2 ac", "m^2", 2 * ACRE),
        ("-3 in", "m", -0.0762),
    ],
)
def test_units_convert_by_exact_factors(text, unit, value):
    assert read_quantity("x", text, unit) == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize("name", sorted(UNITS))
def test_every_unit_reads_as_itself(name):
    crop = " wheat" if UNITS[name].powers == (3, 0, 0) else ""
    wanted = "kg" if crop else name
    one = 60 * POUND / UNITS["bu"].factor * UNITS[name].factor if crop else 1.0
    assert read_quantity("x", f"1 {name}{crop}", wanted) == pytest.approx(one, rel=1e-14)


@pytest.mark.parametrize("crop", sorted(TEST_WEIGHTS))
def test_a_bushel_weighs_what_the_trade_says(crop):
    pounds = read_quantity("x", f"1 bu {crop}", "lb")
    assert pounds == pytest.approx(TEST_WEIGHTS[crop], rel=1e-14)


@pytest.mark.parametrize(
    ("text", "unit", "says"),
    [
        ("9 kg", "m", "a number in m, or one with a unit such as m, km, ft, mi; got 9 kg"),
        ("9 furlongs", "m", "unit such as"),
        ("9 m/", "m", "unit such as"),
        ("9 m^0", "m", "unit such as"),
        ("9 m m", "m", "unit such as"),
        ("fast", "m/s", "unit such as m/s, km/h, mph"),
        ("", "m", "be a number"),
        ("180 bu/ac", "kg/m^2", "name the crop behind a volume, one of barley"),
        ("9 t wheat", "kg", "name a crop behind volumes only"),
        ("1e306 km", "m", "be a finite number; got 1e306 km"),
        ("1e400", "m", "be a finite number"),
        ("9 bu turnips", "kg", "unit such as"),
    ],
)
def test_wrong_units_are_told_in_one_line(text, unit, says):
    with pytest.raises(InvalidInput, match=f"`load` must .*{says}") as caught:
        read_quantity("load", text, unit)
    assert "\n" not in str(caught.value)


def test_of_several_numbers_the_last_may_name_the_unit_of_all():
    assert read_quantities("x", "12, 6, 12 t", "kg") == (12000.0, 6000.0, 12000.0)
    assert read_quantities("x", "12 t, 6000 kg", "kg") == (12000.0, 6000.0)
    assert read_quantities("x", "12,6", "kg") == (12.0, 6.0)


@pytest.mark.parametrize("text", ["9 t, 8, 7 t", "9 t, 8", "9,,8 t"])
def test_units_behind_some_numbers_only_are_refused(text):
    with pytest.raises(InvalidInput, match=r"unit behind each number|be a number"):
        read_quantities("capacity", text, "kg")


@pytest.mark.parametrize("text", ["0, 60, x", "0, x, 60", "x, 0, 60", "0, x, 60 min", "inf, x"])
def test_a_word_that_is_no_number_is_told_as_it_stands(text):
    with pytest.raises(InvalidInput, match=r"`way` must be a number in s, .*; got x$"):
        read_quantities("way", text.replace(", ", ","), "s")


def test_a_last_word_with_a_wrong_unit_is_told_itself():
    with pytest.raises(InvalidInput, match=r"; got 60 x$"):
        read_quantities("way", "0,30,60 x", "s")


def test_infinities_take_no_unit():
    assert read_quantities("way", "inf, 2 min", "s") == (math.inf, 120.0)
    assert read_quantities("way", "2, inf", "s") == (2.0, math.inf)


@pytest.mark.parametrize("value", [1e308, "1e300 km", -1e9, 1e-300, "1e-300 km"])
def test_what_no_field_holds_is_refused_with_its_bound(value):
    with pytest.raises(InvalidInput, match=r"at most 100000 m|at least 1e-09 m"):
        Quantity("m").read(value)


def test_bounds_are_in_the_unit_of_the_field():
    assert Quantity("h").read(1e5) == 1e5
    with pytest.raises(InvalidInput, match="at most 277778 h"):
        Quantity("h").read(1e6)


def test_units_are_of_equal_powers_or_none():
    assert parse_unit("kg*m/s^2") == parse_unit("kg·m/s²")
    assert parse_unit("parsec") is None


@pytest.mark.parametrize(
    ("area", "text"),
    [
        (112_345.0, "11.2 ha"),
        (1e6, "100 ha"),
        (12_345_678.0, "1235 ha"),
        (2_500.0, "0.250 ha"),
        (35.24, "35.2 m²"),
        (0.0, "0.0 m²"),
    ],
)
def test_areas_read_in_hectares_without_exponents(area, text):
    assert area_text(area) == text
