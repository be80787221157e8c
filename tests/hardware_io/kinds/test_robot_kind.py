"""A kind of robots says after what silence they stop, or is refused; it is found by name."""

import sys

import pytest

from sightfield.hardware_io.kinds.known_kinds import KINDS, find_kind
from sightfield.hardware_io.kinds.robot_kind import RobotFleet, RobotKind, Surroundings
from sightfield.systems.numerics.errors import InvalidInput


def kind(**changes):
    values = {"name": "toy", "silence": 0.3, "link": str, "stand_in": str} | changes
    return RobotKind(**values)


@pytest.mark.parametrize("silence", [None, 0.0, -1.0, float("inf"), float("nan")])
def test_a_kind_that_does_not_say_when_its_robots_stop_by_themselves_is_refused(silence):
    with pytest.raises(InvalidInput, match="`silence`"):
        kind(silence=silence)
    assert kind(silence=0.25).stops_after == 0.25


def test_what_robots_cannot_recognise_is_refused():
    with pytest.raises(InvalidInput, match="`recognises` must be of"):
        kind(recognises=frozenset({"late", "lost"}))


def test_a_missing_extra_is_named_in_one_line_and_nothing_is_opened():
    needy = kind(extra="hovercraft", needs=("math", "no_such_module"), link=pytest.fail)
    fleet = RobotFleet(robots=(1,))
    words = r"toy must come with the extra \[hovercraft\]: .*; not installed: no_such_module$"
    with pytest.raises(InvalidInput, match=words) as refusal:
        needy.open_link(fleet)
    assert "\n" not in str(refusal.value)
    with pytest.raises(InvalidInput, match=words):
        needy.open_stand_in(fleet, Surroundings(starts=None, silence=0.3))


def test_kinds_are_found_by_name_and_one_s_own_by_its_module(tmp_path, monkeypatch):
    assert all(find_kind(name) is each for name, each in KINDS.items())
    (tmp_path / "own_robots.py").write_text(
        "from sightfield.hardware_io.kinds.robot_kind import RobotKind\n"
        "OWN = RobotKind(name='own', silence=0.4, link=str, stand_in=str)\n"
        "OTHER = 3\n"
    )
    monkeypatch.chdir(tmp_path)
    before = list(sys.path)
    assert find_kind("own_robots:OWN").silence == 0.4
    for name in ("own_robots:OTHER", "own_robots:NONE", "no_robots:OWN", ":OWN", "carrier pigeon"):
        with pytest.raises(InvalidInput, match=r"`radio\.kind` must") as refusal:
            find_kind(name)
        assert "\n" not in str(refusal.value)
    assert sys.path == before


def test_an_option_that_a_kind_does_not_have_is_refused():
    def link(fleet):
        return fleet.option("depth", 3), fleet.option("rate", 5.0)

    with pytest.raises(InvalidInput) as refusal:
        kind(link=link).open_link(RobotFleet(robots=(1,), options={"depth": 4, "rat": 2.0}))
    words = "`radio.options.rat` must be one that kind toy has (depth, rate); got 2.0"
    assert str(refusal.value) == words
    fleet = RobotFleet(robots=(1,), options={"depth": 4})
    assert kind(link=link).open_link(fleet) == (4, 5.0)


def test_a_key_that_is_misspelt_does_not_leave_messages_unsigned():
    options = {"keyfile": "lab.key"}
    fleet = RobotFleet(robots=(1,), addresses=("127.0.0.1:14550",), options=options)
    with pytest.raises(InvalidInput, match=r"options.keyfile` must be one .* \(key_file\)"):
        find_kind("mavlink").open_link(fleet)


def test_options_of_a_kind_have_their_type():
    fleet = RobotFleet(robots=(1,), options={"rate": 20, "name": "a", "fast": True})
    assert fleet.option("rate", 5.0) == 20.0
    assert fleet.option("name", "b") == "a"
    assert fleet.option("depth", 3) == 3
    for name, default in (("name", 1), ("fast", 1), ("rate", "20"), ("fast", 2.0)):
        with pytest.raises(InvalidInput, match=f"`radio.options.{name}` must be of type"):
            fleet.option(name, default)
