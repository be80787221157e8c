"""Dataclasses refuse what the rules in their fields' types refuse."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import pytest

from sightfield.systems.numerics.checked import (
    Chance,
    Checked,
    Count,
    Duration,
    Finite,
    NonNegative,
    Positive,
    PositiveSized,
    Speed,
    at_least,
    one_of,
    whole,
)
from sightfield.systems.numerics.errors import InvalidInput, require


@dataclass(frozen=True, kw_only=True)
class Lens(Checked):
    """What has a field of each rule."""

    free: float = float("nan")
    pace: Speed = 1.0
    time: Duration = 1.0
    tilt: Finite = 0.0
    height: Positive = 1.0
    gain: PositiveSized = 1.0
    blur: NonNegative = 0.0
    losses: Chance = 0.0
    seed: Count = 0
    rings: Annotated[int, at_least(2)] = 2
    rows: Annotated[int, whole(3)] = 3
    model: Annotated[str, one_of(("exact", "thesis"))] = "exact"


@dataclass(frozen=True, kw_only=True)
class LongLens(Lens):
    """A lens with a rule on two fields, and one more of its own."""

    length: Positive

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.length >= self.height, "length", "be at least the height", self.length)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("tilt", np.inf, "`tilt` must be a finite number; got inf"),
        ("tilt", -1e300, "`tilt` must be at most 1e+09; got -1e+300"),
        ("height", 1e10, "`height` must be at most 1e+09; got 10000000000.0"),
        ("blur", 1e300, "`blur` must be at most 1e+09; got 1e+300"),
        ("pace", 101.0, "`pace` must be at most 100 m/s; got 101.0"),
        ("time", 1e300, "`time` must be at most 86400 s; got 1e+300"),
        ("time", True, "`time` must be a finite number; got True"),
        ("height", 0.0, "`height` must be positive; got 0.0"),
        ("gain", -1.0, "`gain` must be positive; got -1.0"),
        ("gain", 1e300, "`gain` must be of a size from 1e-18 to 1e+18; got 1e+300"),
        ("blur", -1.0, "`blur` must be zero or positive; got -1.0"),
        ("losses", 1.5, "`losses` must be from 0 to 1; got 1.5"),
        ("seed", -1, "`seed` must be zero or positive; got -1"),
        ("rings", 1, "`rings` must be at least 2; got 1"),
        ("rows", 3.5, "`rows` must be a whole number of at least 3; got 3.5"),
        ("model", "own", "`model` must be one of exact, thesis; got own"),
    ],
)
def test_a_value_against_the_rule_of_its_field_is_refused_by_name(field, value, message):
    with pytest.raises(InvalidInput) as refused:
        replace(Lens(), **{field: value})
    assert str(refused.value) == message


def test_values_within_the_rules_stay_as_they_are():
    lens = Lens(height=2.0, seed=np.int64(7), rings=2, rows=np.int64(4), model="thesis")
    assert (lens.height, lens.seed, lens.rings, lens.model) == (2.0, 7, 2, "thesis")


def test_a_subclass_keeps_the_rules_and_adds_its_own():
    assert LongLens(length=1.0).length == 1.0
    for given in ({"length": -1.0}, {"length": 1.0, "blur": -1.0}, {"length": 0.5}):
        with pytest.raises(InvalidInput):
            LongLens(**given)


def test_what_is_added_to_a_list_later_may_be_chosen():
    lists = {"first": 1}, ["other"]
    rule = one_of(*lists)
    with pytest.raises(InvalidInput, match="one of first, other"):
        rule("way", "own")
    lists[0]["own"] = 2
    rule("way", "own")
    rule("way", "other")
