"""What a check of a laboratory finds, with devices that a test sets, is as recorded."""

from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.diagrams.station import check
from sightfield.diagrams.station.check import Finding, all_found, check_laboratory
from sightfield.diagrams.station.scenario import Mocap, OmniCameraDevice
from sightfield.systems.numerics.errors import InvalidInput


@pytest.fixture
def there(monkeypatch):
    """The devices, and a clock that goes on while somebody sleeps."""
    made = SimpleNamespace(
        now=10.0, hails=0, heard_after=3, hidden=(), unseen_until=0.0, picture_at=10.2, closed=0
    )
    made.gone, made.ports, made.view = [], ["/dev/ttyA", "/dev/ttyUSB0"], None
    made.lag = 0.0

    def sleep(duration):
        made.now += duration

    monkeypatch.setattr(check, "time", SimpleNamespace(monotonic=lambda: made.now, sleep=sleep))

    class Link:
        """Robots that report after some hails."""

        def heartbeat(self):
            made.hails += 1

        def telemetry(self):
            return dict.fromkeys(
                each
                for each in range(1, 7)
                if made.hails >= made.heard_after and each not in made.hidden
            )

    @contextmanager
    def open_radio(scenario):
        yield Link()

    class Source:
        """Cameras of both kinds."""

        def read(self):
            if made.kind == "mocap":
                seen = made.now >= 10.0 + made.unseen_until
                return SimpleNamespace(stamps=np.full(6, made.now - made.lag if seen else -np.inf))
            picture = SimpleNamespace(picture=np.zeros((48, 64, 4)))
            return picture if made.now >= made.picture_at else None

        def close(self):
            made.closed += 1

    def opened(kind):
        def open_it(*_):
            made.kind = kind
            return Source()

        return open_it

    monkeypatch.setattr(check, "open_radio", open_radio)
    monkeypatch.setattr(check, "open_poses", opened("mocap"))
    monkeypatch.setattr(check, "open_camera", opened("camera"))
    monkeypatch.setattr(check, "serial_ports", lambda: made.ports)
    monkeypatch.setattr(check, "find_view", lambda port: made.view)
    monkeypatch.setattr(
        check, "missing_modules", lambda names: [n for n in names if n in made.gone]
    )
    monkeypatch.setattr(check, "build_emulator", lambda: "the firmware is built")
    return made


def told(scenario, port=7010):
    return [[each.thing, each.found, each.words] for each in check_laboratory(scenario, port)]


@pytest.fixture
def scenario(load_laboratory):
    found, _ = load_laboratory()
    return replace(found, mocap=Mocap(source="lcm"))


def test_a_laboratory_in_which_all_is_there_is_as_recorded(there, scenario, as_recorded):
    there.view = SimpleNamespace(url="http://127.0.0.1:7010/")
    camera = OmniCameraDevice(source="folder", place="pictures")
    as_recorded(told(replace(scenario, omni_camera=camera)))
    # Robots are hailed until all are heard, and no longer.
    assert (there.hails, there.closed) == (3, 2)
    assert there.now == pytest.approx(10.0 + 3 * 0.05 + 0.06)


def test_a_laboratory_in_which_much_is_missing_is_as_recorded(there, scenario, as_recorded):
    there.hidden, there.unseen_until, there.picture_at = (2, 5), 9.0, 99.0
    there.gone, there.ports = ["digi.xbee", "motioncapture"], ["/dev/ttyA"]
    camera = OmniCameraDevice(source="folder", place="pictures")
    as_recorded(told(replace(scenario, omni_camera=camera)), "xbee")
    # Each of three is waited for for a second and a half.
    assert there.now == pytest.approx(14.5, abs=0.2)
    there.ports, there.gone = [], []
    as_recorded(told(scenario), "no port")
    udp = replace(scenario, radio=replace(scenario.radio, kind="udp"))
    as_recorded(told(udp), "udp")


def test_poses_count_as_seen_while_they_are_fresh(there, scenario):
    limit = scenario.mocap.stale_after
    for lag, found in ((limit - 0.001, True), (limit + 0.001, False)):
        there.lag = lag
        assert {t: f for t, f, _ in told(scenario)}["motion capture"] is found


def test_what_cannot_be_opened_is_told(there, scenario, monkeypatch):
    def refuse(*_):
        raise InvalidInput("`radio.port` must be one that is there; got none")

    monkeypatch.setattr(check, "open_radio", refuse)
    (found,) = (each for each in check_laboratory(scenario, 7010) if "robots" in each.thing)
    assert not found.found
    assert found.words.startswith("`radio.port` must")


def test_without_an_emulation_a_laboratory_is_complete():
    good, bad = Finding("serial port", True, ""), Finding("serial port", False, "")
    emulation = Finding("emulated laboratory", False, "")
    assert all_found([good, emulation])
    assert not all_found([good, bad])
