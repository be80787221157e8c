"""Scenarios are read from YAML, and every mistake is named by its key."""

import re
from dataclasses import dataclass, field

import pytest

from sightfield.diagrams.harvest.scenario import HarvestScenario
from sightfield.diagrams.scenario_files import (
    Setting,
    build,
    builtin_scenarios,
    find_scenario,
    load_scenario,
)
from sightfield.diagrams.social.scenario import SocialScenario
from sightfield.diagrams.tracking.scenario import TrackingScenario
from sightfield.diagrams.vision.scenario import PictureTrackingScenario
from sightfield.systems.numerics.checked import Checked, Duration
from sightfield.systems.numerics.errors import InvalidInput, require_positive
from sightfield.systems.numerics.files import read_yaml


@dataclass(frozen=True, kw_only=True)
class Part:
    """A part of a scenario."""

    speed: float
    points: list[list[float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        require_positive("speed", self.speed)


@dataclass(frozen=True, kw_only=True)
class Whole:
    """A scenario."""

    part: Part
    count: int = 3


@pytest.fixture
def file(tmp_path):
    """A function that writes text to a file."""

    def write(text):
        path = tmp_path / "scenario.yaml"
        path.write_text(text)
        return path

    return write


def test_values_and_defaults(file):
    whole = load_scenario(Whole, file("part: {speed: 2, points: [[1, 2.5]]}"))
    assert whole == Whole(part=Part(speed=2.0, points=[[1.0, 2.5]]), count=3)


def test_settings_override_the_file(file):
    path = file("part: {speed: 2, points: [[1, 2], [3, 4]]}")
    whole = load_scenario(
        Whole, path, ["count=7", "part.speed=1e-1", "part.points.1=[5, 6]", "part.points.0.0=9"]
    )
    assert whole == Whole(part=Part(speed=0.1, points=[[9.0, 2.0], [5.0, 6.0]]), count=7)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("part: {speed: -1.0}", "`part.speed` must be positive; got -1.0"),
        ("part: {speed: .nan}", "`part.speed` must be a finite number; got nan"),
        ("part: {speed: fast}", "`part.speed` must be a valid number.*got 'fast'"),
        (
            "part: {speed: 1, sped: 2}",
            r"`part.sped` must be a key of the scenario; got 2 \(there are speed",
        ),
        (
            "part: {speed: 1}\nx: 1",
            r"`x` must be a key of the scenario; got 1 \(there are .*part",
        ),
        ("part: 3", "`part` must be a dictionary.*got 3"),
        ("part: {speed: 1, points: [[1, a]]}", r"`part.points.0.1` must be a valid number"),
        ("count: 2", "`part` must be given; got nothing$"),
        ("count: 2.5\npart: {speed: 1}", "`count` must be a valid integer.*got 2.5"),
        ("- 1", "`scenario` must be a YAML mapping"),
        ("", "`scenario` must be a YAML mapping"),
        ("part: [", "`scenario` must be readable YAML"),
        ("\x00", "`scenario` must be readable YAML"),
        ("part: " + "[" * 10_000, "`scenario` must be readable YAML.*nested too deep"),
        ("count: 2024-99-99", "`scenario` must be readable YAML.*month must be in"),
        ("count: " + "1" * 5000, "`scenario` must be readable YAML"),
        ("count: !!bool x", "`scenario` must be readable YAML"),
    ],
)
def test_mistakes_are_named_in_one_line(file, text, message):
    with pytest.raises(InvalidInput, match=message) as caught:
        load_scenario(Whole, file(text))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("count", "`--set` must have the form key=value; got count"),
        ("=3", "form key=value"),
        ("part.points.5=[1, 2]", "below 0 in part.points.5; got 5"),
        ("part.speed.deep=1", "must name a key of the scenario; got part.speed.deep"),
        ("count=[", "must give `count` a YAML value"),
        ("count=" + "[" * 10_000, "must give `count` a YAML value"),
        ("count=2024-99-99", "must give `count` a YAML value; got 2024-99-99"),
        ("cuont=1", "`cuont` must be a key of the scenario; got 1"),
    ],
)
def test_bad_settings_are_named(file, setting, message):
    with pytest.raises(InvalidInput, match=message):
        load_scenario(Whole, file("part: {speed: 1, points: []}"), [setting])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["count=1", "count=2"], "`count` must be set once; got --set count=1 and --set count=2"),
        (["count=1", "count=1"], "`count` must be set once"),
        (["part.speed=2", "part={speed: 3}"], "`part.speed` must be set once; got --set part.spe"),
        (["part={speed: 3}", "part.speed=2"], "`part.speed` must be set once; got --set part={"),
        (["count=1", Setting("count", "2", "--count")], "got --set count=1 and --count"),
        (["part.speed=2", Setting("part", None, "--part")], "got --set part.speed=2 and --part"),
    ],
)
def test_what_is_set_twice_is_refused_with_both_places(file, settings, message):
    with pytest.raises(InvalidInput, match=re.escape(message)):
        load_scenario(Whole, file("part: {speed: 1}"), settings)


def test_keys_that_begin_alike_are_set_apart(file):
    path = file("part: {speed: 1, points: [[1, 2]]}")
    ones = load_scenario(Whole, path, ["part.points.0.0=3", "part.points.0.1=4", "part.speed=5"])
    assert ones.part == Part(speed=5.0, points=[[3.0, 4.0]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("part: {speed: 1}\ncount: 1\ncount: 2", "line 2 and line 3 both say `count`"),
        ("part: {speed: 1, speed: 1}", "line 1 and line 1 both say `speed`"),
    ],
)
def test_a_file_says_each_key_once(file, text, message):
    with pytest.raises(InvalidInput, match=message) as caught:
        load_scenario(Whole, file(text))
    assert "\n" not in str(caught.value)


@dataclass(frozen=True, kw_only=True)
class Switches(Checked):
    """A scenario with truth values and numbers."""

    lit: bool = False
    period: Duration = 1.0
    count: int = 1
    pairs: tuple[tuple[float, float], ...] = ()
    part: Part | None = None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("period: true", "`period` must be a number; got true"),
        ("count: no", "`count` must be a number; got false"),
        ("pairs: [[1, 2], [3, yes]]", "`pairs.1.1` must be a number; got true"),
        ("part: {speed: true}", "`part.speed` must be a number; got true"),
    ],
)
def test_true_is_no_number(file, text, message):
    assert load_scenario(Switches, file("lit: true")).lit is True
    with pytest.raises(InvalidInput, match=message):
        load_scenario(Switches, file(text))


def test_a_mapping_may_change_what_it_takes_from_another(file):
    text = "- &usual {speed: 1, points: []}\n- {<<: *usual, speed: 2}\n- {<<: *usual, speed: 3}"
    parts = [{"speed": speed, "points": []} for speed in (1, 2, 3)]
    assert read_yaml(text) == parts


def test_python_gets_the_same_rules():
    with pytest.raises(InvalidInput, match="`speed` must be positive"):
        Part(speed=0.0)
    with pytest.raises(InvalidInput, match=r"`part\.speed`"):
        build(Whole, {"part": {"speed": 0}})


def test_built_in_scenarios_are_found_by_name():
    expected = {"thesis_3v4", "thesis_3v3", "thesis_4v3", "thesis_borda_4v3", "corner_1v1"}
    assert expected | {"risk_vectors"} <= set(builtin_scenarios())
    assert find_scenario("corner_1v1").is_file()
    with pytest.raises(InvalidInput, match=r"or one of corner_1v1.*got nowhere"):
        find_scenario("nowhere")


@pytest.mark.parametrize(
    ("schema", "name"),
    [
        (TrackingScenario, "thesis_3v4"),
        (PictureTrackingScenario, "omni_2v2"),
        (SocialScenario, "thesis_maze"),
        (HarvestScenario, "season"),
    ],
)
def test_a_built_in_scenario_is_that_of_its_dataclass_story(schema, name):
    scenario = load_scenario(schema, name, ["seed=12"])
    assert isinstance(scenario, schema)
    assert scenario.seed == 12


def test_a_name_that_is_none_lists_those_of_the_story():
    with pytest.raises(InvalidInput, match=r"one of choosy_crowd, thesis_maze; got thesis_3v4$"):
        load_scenario(SocialScenario, "thesis_3v4")


def test_a_dataclass_of_ones_own_is_read_from_the_file_that_a_word_names(file):
    path = file("part: {speed: 2}")
    assert load_scenario(Whole, str(path)) == load_scenario(Whole, path)
