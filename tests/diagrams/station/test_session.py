"""What stands before a run: robots that answer and are seen, and a view that shows it."""

import contextlib
import json
import os
import signal
import socket
import time
import urllib.request
from contextlib import contextmanager

import numpy as np
import pytest

from sightfield.diagrams.station.hardware import Devices, Operator
from sightfield.diagrams.station.run import run_station
from sightfield.diagrams.station.session import open_laboratory, show_on_view
from sightfield.hardware_io.cameras.frame_source import NoCamera
from sightfield.hardware_io.mocap.pose_source import PoseReading
from sightfield.systems.numerics.errors import InvalidInput


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
