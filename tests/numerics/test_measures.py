"""Units, bounds and refusals, each where it begins and where it ends."""

import math
import sys

import numpy as np
import pytest
from numba import njit
from numba.core import event

from sightfield.systems.numerics import compiled, files
from sightfield.systems.numerics.checked import Duration, Finite, NonNegative, Positive, Speed
from sightfield.systems.numerics.errors import (
    InvalidInput,
    require_chance,
    require_chances,
    require_finite,
    require_non_negative,
    require_one_of,
    require_positive,
    require_sized,
    require_whole,
)
from sightfield.systems.numerics.files import read_yaml
from sightfield.systems.numerics.run_seeds import run_seed
from sightfield.systems.numerics.units import (
    LARGEST,
    SMALLEST,
    TEST_WEIGHTS,
    UNITS,
    Quantity,
    WrongQuantity,
    area_text,
    parse_unit,
    read_quantities,
    read_quantity,
)

# By name: so many of the SI units behind it, as tables of units give them.
IN_SI = {
    "m": (1, "m"),
    "mm": (0.001, "m"),
    "cm": (0.01, "m"),
    "km": (1000, "m"),
    "in": (0.0254, "m"),
    "ft": (0.3048, "m"),
    "yd": (0.9144, "m"),
    "mi": (1609.344, "m"),
    "ha": (10000, "m^2"),
    "ac": (4046.8564224, "m^2"),
    "l": (0.001, "m^3"),
    "hl": (0.1, "m^3"),
    "gal": (0.003785411784, "m^3"),
    "bu": (0.03523907016688, "m^3"),
    "kg": (1, "kg"),
    "g": (0.001, "kg"),
    "t": (1000, "kg"),
    "dt": (100, "kg"),
    "lb": (0.45359237, "kg"),
    "s": (1, "s"),
    "min": (60, "s"),
    "h": (3600, "s"),
    "d": (86400, "s"),
    "w": (1, "kg*m^2/s^3"),
    "kw": (1000, "kg*m^2/s^3"),
    "hp": (745.6998715822702, "kg*m^2/s^3"),
    "km/h": (1 / 3.6, "m/s"),
    "mph": (0.44704, "m/s"),
}
POWERS = {
    "m": (1, 0, 0),
    "m^2": (2, 0, 0),
    "m^3": (3, 0, 0),
    "kg": (0, 1, 0),
    "s": (0, 0, 1),
    "m/s": (1, 0, -1),
    "kg*m^2/s^3": (2, 1, -3),
}
WEIGHTS = dict.fromkeys(["corn", "maize", "flaxseed", "rye", "sorghum"], 56.0)
WEIGHTS |= {"barley": 48.0, "canola": 50.0, "oats": 32.0, "soybeans": 60.0, "wheat": 60.0}


@pytest.mark.parametrize("name", IN_SI)
def test_every_unit_is_what_the_tables_say(name):
    factor, si = IN_SI[name]
    assert UNITS[name].factor == pytest.approx(factor, rel=1e-14)
    assert UNITS[name].powers == POWERS[si]
    assert parse_unit(si) == (1.0, *POWERS[si])
    if "/" in name:
        return
    assert parse_unit(f"{name}^2").factor == pytest.approx(factor**2)
    assert parse_unit(f"1/{name}").powers == tuple(-power for power in POWERS[si])


def test_every_name_stands_for_a_unit_of_the_tables():
    assert {unit for name, unit in UNITS.items() if name in IN_SI} == set(UNITS.values())
    assert TEST_WEIGHTS == WEIGHTS


# What is asked for, by powers, and what the largest of it is.
@pytest.mark.parametrize(
    ("unit", "most"),
    [
        ("m", 1e5),
        ("kg", 1e9),
        ("s", 1e9),
        ("m/s", 100.0),
        ("m/s^2", 100.0),
        ("kg/m^2", 1000.0),
        ("kg/s", 1e6),
        ("w", 1e8),
        ("h", 1e9 / 3600),
        ("t", 1e6),
    ],
)
def test_the_largest_of_everything_is_allowed_and_more_is_not(unit, most):
    quantity = Quantity(unit)
    factor = parse_unit(unit).factor
    assert quantity.read(most) == most
    assert quantity.read(-most) == -most
    assert quantity.read(f"{most!r} {unit}") == pytest.approx(most)
    for value in (1.0001 * most, -1.0001 * most):
        with pytest.raises(WrongQuantity, match="`value` must be at most"):
            quantity.read(value)
    least = SMALLEST
    assert quantity.read(least) == least
    assert quantity.read(0.0) == 0.0
    with pytest.raises(WrongQuantity, match="`value` must be 0 or at least"):
        quantity.read(0.999 * least)
    assert most * factor == pytest.approx(LARGEST[parse_unit(unit).powers])


def test_what_has_no_bound_is_not_bounded():
    assert Quantity("1/h").read(1e12) == 1e12
    assert Quantity("m").read(math.inf) == math.inf
    assert Quantity("m").read(None) is None
    assert SMALLEST == 1e-9


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("7 m*m", "m^2", 7.0),
        ("7 kg per s per m", "kg/s/m", 7.0),
        ("6 1/min", "1/s", 0.1),
        ("3 gal/ac corn", "kg/m^2", 3 * 231 / 2150.42 * 56 * 0.45359237 / 4046.8564224),
        ("4 hl of wheat", "t", 0.4 / 0.03523907016688 * 60 * 0.45359237 / 1000),
        (".5 ft/s^2", "m/s^2", 0.1524),
        ("+2.5e-1 h", "min", 15.0),
        ("-inf", "m", -math.inf),
        (" .inf ", "m", math.inf),
        ("4", "1", 4.0),
    ],
)
def test_texts_with_units_are_read(text, unit, value):
    assert read_quantity("x", text, unit) == pytest.approx(value, rel=1e-13)


def test_no_number_is_read_as_none():
    assert math.isnan(read_quantity("x", "nan", "m"))
    with pytest.raises(WrongQuantity) as refused:
        read_quantity("x", "2 m^2", "m")
    assert refused.value.got == "2 m^2"
    assert refused.value.requirement.startswith("be a number in m")
    for text in ("3 bu corn wheat", "2 h", "1 m^2 wheat"):
        with pytest.raises(WrongQuantity):
            read_quantity("x", text, "kg")
    for unit in ("m^0", "m^10", "m//s", "", "m s", "/s", "2"):
        assert parse_unit(unit) is None


@pytest.mark.parametrize("powers", [each for each in LARGEST if each != (1, 0, -2)])
def test_messages_offer_units_that_can_be_read(powers):
    unit = next(
        text
        for text in ("m", "kg", "s", "m/s", "kg/m^2", "kg/s", "w")
        if parse_unit(text).powers == powers
    )
    with pytest.raises(WrongQuantity) as refused:
        read_quantity("x", "much", unit)
    offered = refused.value.requirement.partition("such as ")[2].split(", ")
    assert len(offered) >= 3
    for each in offered:
        name, _, crop = each.partition(" ")
        assert read_quantity("x", f"1 {name} {crop}", unit) > 0


def test_lists_of_numbers_share_the_last_one_s_unit_only_where_no_other_has_one():
    assert read_quantities("x", "3", "m") == (3.0,)
    assert read_quantities("x", "3 km", "m") == (3000.0,)
    assert read_quantities("x", "1, inf, 2 km", "m") == (1000.0, math.inf, 2000.0)
    assert read_quantities("x", "1 km, 2 m", "m") == (1000.0, 2.0)
    for text in ("1 km, 2", "1, 2 km, 3 km", "", "inf x", ","):
        with pytest.raises(WrongQuantity):
            read_quantities("x", text, "m")


@pytest.mark.parametrize(
    ("area", "text"),
    [
        (999.94, "999.9 m²"),
        (1000.0, "0.100 ha"),
        (-1000.0, "-0.100 ha"),
        (9999.0, "1.000 ha"),
        (10_000.0, "1.00 ha"),
        (99_990.0, "10.00 ha"),
        (100_000.0, "10.0 ha"),
        (1_000_000.0, "100 ha"),
        (-34_567.0, "-3.46 ha"),
        (math.inf, "inf ha"),
    ],
)
def test_areas_have_three_digits(area, text):
    assert area_text(area) == text


# Rules on numbers: what each allows and what it does not, next to each other.
@pytest.mark.parametrize(
    ("rule", "allowed", "refused"),
    [
        (require_finite, [0, -1e308, np.float64(2)], [math.nan, -math.inf, True, "1", None]),
        (require_positive, [5e-324, 1], [0, 0.0, -1e-300, math.inf]),
        (require_non_negative, [0.0, 0, 3], [-5e-324, math.nan]),
        (require_sized, [0, 1e-18, -1e-18, 1e18, -1e18], [9e-19, -9e-19, 1.1e18, -1.1e18]),
        (require_chance, [0, 1, 0.5], [-1e-9, 1 + 1e-9, math.nan]),
        (lambda name, value: require_whole(name, value, 2), [2, 3, np.int32(2)], [1, 2.0, True]),
        (lambda name, value: require_one_of(name, value, ("a", "b")), ["a", "b"], ["c", None]),
        (lambda name, value: require_chances(name, value), [[], [0, 1]], [[0, 2], [math.nan]]),
        *(
            (lambda name, value, kind=kind: [r(name, value) for r in kind.__metadata__], *both)
            for kind, *both in (
                (Speed, [100.0, 1e-9], [0.0, 100.1]),
                (Duration, [86_400.0, 1e-9], [0.0, 86_401.0]),
                (Finite, [1e9, -1e9, 0], [1.1e9, -1.1e9]),
                (Positive, [1e9], [0, 1.1e9]),
                (NonNegative, [0, 1e9], [-1e-9, 1.1e9]),
            )
        ),
    ],
)
def test_rules_end_where_they_say(rule, allowed, refused):
    for value in allowed:
        rule("x", value)
    for value in refused:
        with pytest.raises(InvalidInput, match=r"^`x(\[\d\])?` must "):
            rule("x", value)


def test_the_one_of_several_chances_that_is_none_is_named():
    with pytest.raises(InvalidInput, match=r"`x\[1\]` must be from 0 to 1; got 2"):
        require_chances("x", [0.5, 2])


def test_seeds_begin_at_zero():
    assert run_seed(0, 0) >= 0
    with pytest.raises(InvalidInput, match="`seed` must be zero or positive; got -1"):
        run_seed(-1, 0)
    assert run_seed(3, 2) < 2**53 < 2 * max(run_seed(3, run) for run in range(20))


def test_no_input_is_larger_than_a_hundred_megabytes():
    assert files.MOST_BYTES == 100_000_000


def test_lines_of_a_key_that_comes_twice_count_from_one():
    with pytest.raises(Exception, match="line 2 and line 4 both say `b`"):
        read_yaml("a:\n  b: 1\n  c: 2\n  b: 3\n")
    assert read_yaml("1: a\n'1': b") == {1: "a", "1": "b"}


def test_a_tenth_function_that_is_compiled_is_announced(caplog):
    announcer = compiled._Announcer()
    start = event.Event("numba:compile", event.EventStatus.START)
    with caplog.at_level("INFO", logger=compiled.__name__):
        for number in range(1, 13):
            announcer.on_start(start)
            announcer.on_end(start)
            assert len(caplog.messages) == (number >= 10)
    assert "compiling for this machine, once" in caplog.text
    assert sys.modules["numba"].njit is njit
