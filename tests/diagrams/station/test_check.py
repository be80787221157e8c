"""Robots that turn in place show whether their bodies bear the right names."""

import sys
from dataclasses import replace

import pytest

from sightfield.diagrams.station.check import (
    Identity,
    check_laboratory,
    identify,
    require_identity,
)
from sightfield.diagrams.station.hardware import Devices, FaultyPoses, Operator, swapped
from sightfield.diagrams.station.scenario import Mocap
from sightfield.diagrams.station.session import open_laboratory
from sightfield.systems.numerics.errors import SightfieldError


@pytest.fixture(scope="module")
def found(load_laboratory, require_tool):
    """What robots of an emulated laboratory were, of which two bodies are swapped."""
    require_tool("avr-gcc", "gcc-avr avr-libc libsimavr-dev")
    scenario, game = load_laboratory()
    with open_laboratory(scenario, game, "emulate", Operator()) as devices:
        assert isinstance(devices, Devices)
        poses = FaultyPoses(devices.poses)
        poses.spoil(swapped(1, 4))
        return list(identify(scenario, replace(devices, poses=poses)))


def test_robots_whose_bodies_are_swapped_are_told(found):
    assert [each.robot for each in found] == [1, 2, 3, 4, 5, 6]
    assert [each.right for each in found] == [True, False, True, True, False, True]
    assert found[1] == Identity(2, "pursuer1", ("evader1",), ())
    assert found[4].words == "robot 5 was told to turn, which is evader1; pursuer1 turned"


@pytest.mark.parametrize(
    ("turned", "gone", "words"),
    [
        (("a",), (), "robot 7 turned as a"),
        ((), (), "robot 7 was told to turn, which is a; nothing turned"),
        (("a", "b"), (), "robot 7 was told to turn, which is a; a and b turned"),
        (("a",), ("a",), "robot 7 was told to turn, which is a; a turned, and a went elsewhere"),
    ],
)
def test_what_is_seen_is_said(turned, gone, words):
    assert Identity(7, "a", turned, gone).words == words


def test_nothing_begins_with_a_robot_that_is_another(load_laboratory, monkeypatch):
    wrong = Identity(2, "pursuer1", ("evader1",), ())
    monkeypatch.setattr(
        "sightfield.diagrams.station.check.identify", lambda scenario, devices: iter([wrong])
    )
    with pytest.raises(SightfieldError, match=r"must be the same: robot 2 was told to turn"):
        require_identity(load_laboratory()[0], None)


def finding(scenario, thing):
    return next(each for each in check_laboratory(scenario, 7010) if each.thing == thing)


def test_an_emulated_laboratory_is_there_only_with_the_extra_that_its_links_need(
    load_laboratory, monkeypatch
):
    scenario, _ = load_laboratory()
    scenario = replace(scenario, mocap=Mocap(source="lcm"))
    monkeypatch.setitem(sys.modules, "digi", None)
    found = finding(scenario, "emulated laboratory")
    assert not found.found
    assert "pip install '.[hardware]'" in found.words
    # What robots of other kinds do not need is not asked for.
    others = replace(scenario, radio=replace(scenario.radio, kind="udp"))
    assert finding(others, "emulated laboratory").found
