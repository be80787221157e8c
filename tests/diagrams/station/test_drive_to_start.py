"""Robots that stand anywhere drive to their starts, and touch nobody on the way."""

import threading

import numpy as np
import pytest

from sightfield.diagrams.station.drive_to_start import drive_to_start
from sightfield.diagrams.station.hardware import Operator
from sightfield.diagrams.station.session import open_laboratory
from sightfield.systems.numerics.errors import SightfieldError

# Beside the rims of robots 0.1 m in radius.
TOUCHES = 0.2


@pytest.fixture
def laboratory(load_laboratory):
    scenario, game = load_laboratory("radio.kind=udp")
    starts = np.concatenate([game.pursuer_starts, game.evader_starts])
    with open_laboratory(scenario, game, "emulate", Operator()) as devices:
        yield scenario, game, devices, starts


def watch(devices, ended, seen):
    while not ended.wait(0.02):
        seen.append(devices.laboratory.poses()[:, :2])


def test_two_that_stand_in_one_anothers_places_change_them_and_one_goes_aside(laboratory):
    scenario, game, devices, starts = laboratory
    devices.laboratory.place(0, np.array([*starts[3, :2], 1.0]))
    devices.laboratory.place(3, np.array([*starts[0, :2], 0.0]))
    devices.laboratory.place(4, starts[4] - [0.1, 0.0, 0.3])
    ended, seen = threading.Event(), []
    threading.Event().wait(0.1)
    thread = threading.Thread(target=watch, args=(devices, ended, seen))
    thread.start()
    try:
        driven = list(drive_to_start(scenario, game, devices))
    finally:
        ended.set()
        thread.join()
    poses = devices.laboratory.poses()
    assert np.hypot(*(poses - starts)[:, :2].T).max() < 0.05
    turned = np.angle(np.exp(1j * (poses - starts)[:, 2]))
    assert np.abs(turned).max() < 0.15
    assert [each.name for each in driven if not each.aside].count("pursuer0") == 1
    assert {each.name for each in driven} == {"pursuer0", "evader0", "evader1"}
    assert sum(each.aside for each in driven) == 1
    places = np.array(seen)
    gaps = np.hypot(*(places[:, :, np.newaxis] - places[:, np.newaxis]).transpose(3, 0, 1, 2))
    gaps[:, range(6), range(6)] = np.inf
    assert gaps.min() > TOUCHES


def test_a_robot_that_does_not_get_on_is_named(laboratory):
    scenario, game, devices, starts = laboratory
    devices.laboratory.place(2, starts[2] - [0.2, 0.0, 0.0])
    threading.Event().wait(0.1)
    devices.laboratory.cut_radio()
    with pytest.raises(SightfieldError, match="pursuer2 does not get on"):
        list(drive_to_start(scenario, game, devices))
