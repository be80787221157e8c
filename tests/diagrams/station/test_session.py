"""What stands before a run: robots that answer and are seen, and a view that shows it.

Robots that stand anywhere drive to their starts, and touch nobody on the way.
"""

import contextlib
import json
import os
import signal
import socket
import threading
import time
import urllib.request
from contextlib import contextmanager

import numpy as np
import pytest

from sightfield.diagrams.station.hardware import Devices, Operator
from sightfield.diagrams.station.run import run_station
from sightfield.diagrams.station.session import drive_to_start, open_laboratory, show_on_view
from sightfield.hardware_io.cameras import NoCamera
from sightfield.hardware_io.mocap.pose_receiver import PoseReading
from sightfield.systems.numerics.errors import InvalidInput, SightfieldError


class Radio:
    """A link of whose six robots some answer."""

    def __init__(self, answering):
        self.answering, self.stops = answering, 0

    def arm(self):
        return self.answering

    def stop(self):
        self.stops += 1


class Cameras:
    """A motion capture that sees all bodies but some."""

    def __init__(self, hidden=()):
        self.hidden = list(hidden)

    def read(self):
        stamps = np.full(6, time.monotonic())
        stamps[self.hidden] = -np.inf
        return PoseReading(np.zeros((6, 3)), stamps)

    def close(self):
        """Nothing is held."""


@pytest.fixture
def devices(monkeypatch):
    """A function that puts devices in place of those of the laboratory."""

    def use(radio, cameras):
        @contextmanager
        def opened(scenario, game, *, emulate):
            yield Devices(poses=cameras, radio=radio, camera=NoCamera())

        monkeypatch.setattr("sightfield.diagrams.station.session.open_devices", opened)
        monkeypatch.setattr("sightfield.diagrams.station.session._PATIENCE", 0.1)

    return use


ALL = (1, 2, 3, 4, 5, 6)


def test_a_stop_goes_to_the_robots_at_once(load_laboratory, devices):
    radio, operator = Radio(ALL), Operator()
    devices(radio, Cameras())
    with open_laboratory(*load_laboratory(), "hardware", operator):
        assert radio.stops == 0
        operator.say("stop")
        assert radio.stops == 1


@pytest.mark.parametrize(
    ("radio", "cameras", "message"),
    [
        (
            Radio((1, 2, 4, 6)),
            Cameras(),
            "`radio.robots` must all answer on the radio; silent: 3, 5",
        ),
        (
            Radio(ALL),
            Cameras([1, 5]),
            "`mocap.bodies` must all be seen by the motion capture; not seen: pursuer1, evader2",
        ),
    ],
)
def test_no_run_begins_with_a_robot_missing(load_laboratory, devices, radio, cameras, message):
    devices(radio, cameras)
    with (
        pytest.raises(InvalidInput) as error,
        open_laboratory(*load_laboratory(), "hardware", Operator()),
    ):
        pytest.fail("it began")
    assert str(error.value) == message


def test_the_simulated_laboratory_has_no_devices(load_laboratory):
    with open_laboratory(*load_laboratory(), "simulate", Operator()) as hardware:
        assert hardware is False


def test_a_run_is_shown_on_the_view_to_its_end(load_laboratory, tmp_path):
    scenario, game = load_laboratory("seconds=0.5")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    words = {"title": "a game", "mode": "simulate", "operator": Operator(), "port": port}
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))

    def report():
        with opener.open(f"http://127.0.0.1:{port}/state") as answer:
            return json.loads(answer.read())

    try:
        with show_on_view(scenario, game, **words) as (link, url):
            run_station(scenario, game, log=tmp_path / "run.log", view=link)
            link.end("the horizon")
        deadline = time.monotonic() + 5
        while report()["ended"] != "the horizon" and time.monotonic() < deadline:
            time.sleep(0.05)
        shown = report()
        assert url == f"http://127.0.0.1:{port}/#{link.key}"
        assert shown["ended"] == "the horizon"
        assert shown["scene"]["pursuers"] == ["pursuer 0", "pursuer 1", "pursuer 2"]
        assert len(shown["scene"]["obstacles"]) == 5
        assert shown["state"]["time"] >= 0.4
        assert np.shape(shown["state"]["poses"]) == (6, 3)
        assert shown["state"]["assignment"] != [-1, -1, -1]
    finally:
        with contextlib.suppress(ProcessLookupError, OSError):
            os.kill(report()["pid"], signal.SIGTERM)


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


def test_a_robot_that_is_not_seen_at_first_is_waited_for(laboratory, monkeypatch):
    scenario, game, devices, _ = laboratory
    read, looks = devices.poses.read, []

    def shut_at_first():
        reading = read()
        looks.append(len(looks))
        stamps = reading.stamps if len(looks) > 3 else np.full_like(reading.stamps, -np.inf)
        return PoseReading(reading.poses, stamps)

    monkeypatch.setattr(devices.poses, "read", shut_at_first)
    assert list(drive_to_start(scenario, game, devices)) == []
    assert len(looks) > 3


def test_a_robot_that_does_not_get_on_is_named(laboratory):
    scenario, game, devices, starts = laboratory
    devices.laboratory.place(2, starts[2] - [0.2, 0.0, 0.0])
    threading.Event().wait(0.1)
    devices.laboratory.cut_radio()
    with pytest.raises(SightfieldError, match="pursuer2 does not get on"):
        list(drive_to_start(scenario, game, devices))
