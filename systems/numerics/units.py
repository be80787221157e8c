"""Quantities with units as farms write them: "9 t", "8 km/h", "180 bu/ac corn". SI inside.

Factors are exact: the international yard and pound of 1959 (0.9144 m, 0.45359237 kg), the gallon of
231 cubic inches, the bushel of 2150.42 cubic inches. An acre is 43,560 square feet of the
international foot.
"""

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from .errors import InvalidInput

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler
    from pydantic_core import CoreSchema

_FOOT, _POUND, _INCH = 0.3048, 0.45359237, 0.0254
_BUSHEL = 2150.42 * _INCH**3


class Unit(NamedTuple):
    """A unit as a factor and powers of the metre, the kilogram and the second.

    Attributes:
        factor: What one of it is in SI units [-].
        metre, kilogram, second: Powers.
    """

    factor: float
    metre: int = 0
    kilogram: int = 0
    second: int = 0

    @property
    def powers(self) -> tuple[int, int, int]:
        """Of metre, kilogram and second; units of equal powers convert into each other."""
        return self.metre, self.kilogram, self.second


def _named(names: str, *unit: float) -> dict[str, Unit]:
    made = Unit(unit[0], *map(int, unit[1:]))
    return dict.fromkeys(names.split(), made)


UNITS: dict[str, Unit] = {
    **_named("m metre metres meter meters", 1.0, 1),
    **_named("mm", 1e-3, 1),
    **_named("cm", 1e-2, 1),
    **_named("km", 1e3, 1),
    **_named("in inch inches", _INCH, 1),
    **_named("ft foot feet", _FOOT, 1),
    **_named("yd yard yards", 3 * _FOOT, 1),
    **_named("mi mile miles", 5280 * _FOOT, 1),
    **_named("ha hectare hectares", 1e4, 2),
    **_named("ac acre acres", 43560 * _FOOT**2, 2),
    **_named("l litre litres liter liters", 1e-3, 3),
    **_named("hl", 0.1, 3),
    **_named("gal", 231 * _INCH**3, 3),
    **_named("bu bushel bushels", _BUSHEL, 3),
    **_named("kg", 1.0, 0, 1),
    **_named("g", 1e-3, 0, 1),
    **_named("t tonne tonnes", 1e3, 0, 1),
    **_named("dt", 100.0, 0, 1),
    **_named("lb lbs pound pounds", _POUND, 0, 1),
    **_named("s sec second seconds", 1.0, 0, 0, 1),
    **_named("min minute minutes", 60.0, 0, 0, 1),
    **_named("h hr hour hours", 3600.0, 0, 0, 1),
    **_named("d day days", 86400.0, 0, 0, 1),
    **_named("w watt watts", 1.0, 2, 1, -3),
    **_named("kw kilowatt kilowatts", 1e3, 2, 1, -3),
    # Of 550 foot-pounds a second, with standard gravity.
    **_named("hp horsepower", 550 * _FOOT * _POUND * 9.80665, 2, 1, -3),
    **_named("km/h kmh kph", 1000.0 / 3600.0, 1, 0, -1),
    **_named("mph", 5280 * _FOOT / 3600.0, 1, 0, -1),
}

# What a bushel of a crop weighs by custom of trade, its test weight [lb] (USDA, Agricultural
# Handbook 697, "Weights, Measures, and Conversion Factors for Agricultural Commodities").
TEST_WEIGHTS = {
    "barley": 48.0,
    "canola": 50.0,
    "corn": 56.0,
    "flaxseed": 56.0,
    "maize": 56.0,
    "oats": 32.0,
    "rye": 56.0,
    "sorghum": 56.0,
    "soybeans": 60.0,
    "wheat": 60.0,
}

# Units that messages offer, by powers: what is asked for first.
_OFFERED = {
    (1, 0, 0): "m, km, ft, mi",
    (2, 0, 0): "m^2, ha, ac",
    (0, 1, 0): "kg, t, lb, bu wheat",
    (0, 0, 1): "s, min, h",
    (1, 0, -1): "m/s, km/h, mph",
    (1, 0, -2): "m/s^2, ft/s^2",
    (-2, 1, 0): "kg/m^2, t/ha, lb/ac, bu/ac wheat",
    (0, 1, -1): "kg/s, t/h, bu/h wheat",
    (0, 0, -1): "1/s, 1/h",
    (2, 1, -3): "W, kW, hp",
}

# Nothing in a field is larger than this, in SI units, by powers: more is a slip, and overflows.
LARGEST = {
    (1, 0, 0): 1e5,
    (0, 1, 0): 1e9,
    (0, 0, 1): 1e9,
    (1, 0, -1): 100.0,
    (1, 0, -2): 100.0,
    (-2, 1, 0): 1e3,
    (0, 1, -1): 1e6,
    (2, 1, -3): 1e8,
}
# And nothing but zero is smaller [SI units].
SMALLEST = 1e-9

_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*")
# As YAML and Python write what is no finite number.
_SPECIAL = {
    **dict.fromkeys(("inf", "+inf", ".inf", "infinity"), math.inf),
    **dict.fromkeys(("-inf", "-.inf"), -math.inf),
    **dict.fromkeys(("nan", ".nan"), math.nan),
}
_FACTOR = re.compile(r"([a-z]+|1)(?:\^?([1-9]))?")


class WrongQuantity(InvalidInput):
    """A text is no number, or its unit is unknown or measures something else.

    Attributes:
        requirement: What it must do, for a message that names it.
        got: What came.
    """

    def __init__(self, name: str, requirement: str, got: object) -> None:
        super().__init__(f"`{name}` must {requirement}; got {got}")
        self.requirement = requirement
        self.got = got


def parse_unit(text: str) -> Unit | None:
    """A unit from its name, as "t/ha" or "m/s^2"; None if there is no such unit.

    Args:
        text: Names with `*`, `/` or `per` between and powers after them; case does not matter.
    """
    plain = text.replace("²", "^2").replace("³", "^3").replace("·", "*").casefold()
    plain = re.sub(r"\s*([*/])\s*|\s+(per)\s+", lambda found: found[1] or "/", plain.strip())
    if plain in UNITS:
        return UNITS[plain]
    factor, powers, sign = 1.0, [0, 0, 0], 1
    for part in re.split(r"([*/])", plain):
        if part in ("*", "/"):
            sign = 1 if part == "*" else -1
            continue
        found = _FACTOR.fullmatch(part)
        unit = Unit(1.0) if part == "1" else found and UNITS.get(found[1])
        if not found or unit is None:
            return None
        power = sign * int(found[2] or 1)
        factor *= unit.factor**power
        powers = [have + power * each for have, each in zip(powers, unit.powers, strict=True)]
    return Unit(factor, *powers)


def read_quantity(name: str, text: str, unit: str) -> float:
    """A number from a text such as "8 km/h" or "12".

    Volumes of a crop that is named at the end, as in "180 bu/ac corn", are masses by its test
    weight.

    Args:
        name: Of what is read, for the message.
        text: A number, and a unit or none; without one it is in `unit`.
        unit: What is asked for, "1" for a number without one.

    Returns:
        In `unit`.

    Raises:
        WrongQuantity: The text is no number with a unit that converts to `unit`.
    """
    wanted = parse_unit(unit)
    assert wanted is not None
    offered = _OFFERED.get(wanted.powers, unit)
    number = _NUMBER.match(text)
    what = f"be a number in {unit}, or one with a unit such as {offered}"
    if number is None:
        if text.strip() in _SPECIAL:
            return _SPECIAL[text.strip()]
        raise WrongQuantity(name, what, text)
    value, rest = float(number[1]), text[number.end() :].strip()
    if not rest:
        return _finite(name, value, text)
    *words, last = re.split(r"\s+(?:of\s+)?(?=[^\s]+$)", rest)
    crop = last.casefold() if words and last.casefold() in TEST_WEIGHTS else ""
    given = parse_unit(" ".join(words) if crop else rest)
    if given is None:
        raise WrongQuantity(name, what, text)
    as_mass = (given.metre - 3, given.kilogram + 1, given.second)
    if given.powers != wanted.powers and as_mass == wanted.powers:
        if not crop:
            crops = ", ".join(sorted(TEST_WEIGHTS))
            raise WrongQuantity(name, f"name the crop behind a volume, one of {crops}", text)
        weight = TEST_WEIGHTS[crop] * _POUND / _BUSHEL
        given = Unit(given.factor * weight, *as_mass)
    elif crop:
        raise WrongQuantity(name, "name a crop behind volumes only", text)
    if given.powers != wanted.powers:
        raise WrongQuantity(name, what, text)
    return _finite(name, value * given.factor / wanted.factor, text)


def _finite(name: str, value: float, text: str) -> float:
    if not math.isfinite(value):
        raise WrongQuantity(name, "be a finite number", text)
    return value


def read_quantities(name: str, text: str, unit: str) -> tuple[float, ...]:
    """Numbers from a text such as "9 t" or "12, 6, 12 t"; one unit at the end is that of all.

    Args:
        name: Of what is read, for the message.
        text: Numbers with commas between, of which all have a unit, none, or the last only.
        unit: What is asked for.

    Returns:
        In `unit`.

    Raises:
        WrongQuantity: See `read_quantity`; or some of several numbers have units, some not.
    """
    words = text.split(",")
    special = [word.strip() in _SPECIAL for word in words]
    numbers = [None if special[n] else _NUMBER.match(word) for n, word in enumerate(words)]
    if not any(special) and not any(numbers):
        raise WrongQuantity(name, "be numbers with commas between", text)
    # Units of the words that are finite numbers. One that is none is told as it stands.
    units = {
        place: words[place][number.end() :].strip()
        for place, number in enumerate(numbers)
        if number
    }
    for place, word in enumerate(words):
        if place not in units:
            read_quantity(name, word, unit)
    given = [bool(each) for each in units.values()]
    if len(given) > 1 and given[-1] and not any(given[:-1]):
        *bare, last = units
        read_quantity(name, words[last], unit)
        for place in bare:
            words[place] += f" {units[last]}"
    elif any(given) and not all(given):
        raise WrongQuantity(name, "have a unit behind each number, none, or the last only", text)
    return tuple(read_quantity(name, word, unit) for word in words)


@dataclass(frozen=True)
class Quantity:
    """What the type of a dataclass's field says of its unit, so that pydantic reads units.

    Attributes:
        unit: In which the field is.
    """

    unit: str

    def read(self, value: object) -> object:
        """A value as it came, texts with units in this unit.

        Raises:
            WrongQuantity: See `read_quantity`; or the value is larger than anything in a field.
        """
        number = read_quantity("value", value, self.unit) if isinstance(value, str) else value
        unit = parse_unit(self.unit)
        assert unit is not None
        most = LARGEST.get(unit.powers, math.inf) / unit.factor
        if isinstance(number, int | float) and math.isfinite(number):
            if abs(number) > most:
                raise WrongQuantity("value", f"be at most {most:g} {self.unit}", value)
            if 0 < abs(number) < SMALLEST:
                raise WrongQuantity("value", f"be 0 or at least {SMALLEST:g} {self.unit}", value)
        return number

    def __get_pydantic_core_schema__(
        self, source: Any, handler: "GetCoreSchemaHandler"
    ) -> "CoreSchema":
        """What pydantic asks of the annotation of a type."""
        # Numerics do without pydantic unless it asks.
        from pydantic_core import core_schema

        return core_schema.no_info_before_validator_function(self.read, handler(source))


Metres = Annotated[float, Quantity("m")]
MetresPerSecond = Annotated[float, Quantity("m/s")]
MetresPerSecondSquared = Annotated[float, Quantity("m/s^2")]
Kilograms = Annotated[float, Quantity("kg")]
KilogramsPerSecond = Annotated[float, Quantity("kg/s")]
KilogramsPerSquareMetre = Annotated[float, Quantity("kg/m^2")]
Seconds = Annotated[float, Quantity("s")]
Hours = Annotated[float, Quantity("h")]
Watts = Annotated[float, Quantity("W")]
PerHour = Annotated[float, Quantity("1/h")]


def area_text(area: float) -> str:
    """An area to read, as "11.2 ha", and "35.0 m²" below a tenth of a hectare; no exponents.

    Args:
        area: [m^2].
    """
    if abs(area) < 1000.0:
        return f"{area:.1f} m²"
    hectares = area / 1e4
    digits = max(0, 2 - math.floor(math.log10(abs(hectares)))) if math.isfinite(area) else 0
    return f"{hectares:.{min(digits, 3)}f} ha"
