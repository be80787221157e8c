"""The `motioncapture` package, in a process of its own."""

import math
import os
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.hardware_io.mocap.motion_capture import MotionCapture
from sightfield.hardware_io.mocap.tracker_process import frame_line, heading_of
from sightfield.systems.numerics.errors import InvalidInput

# A package of that name that sees one robot drive east, and never the other.
STAND_IN = """
import time
from types import SimpleNamespace as Some
def connect(kind, options):
    assert options == {"hostname": "tracker"}
    if kind == "nokov":
        time.sleep(60)
    if kind == "vrpn":
        raise RuntimeError("no\\nserver")
    return Silent() if kind == "qualisys" else System()
class Silent:
    def waitForNextFrame(self):
        time.sleep(100.0)
class System:
    frames = 0
    def waitForNextFrame(self):
        time.sleep(0.002)
        self.frames += 1
    @property
    def rigidBodies(self):
        turned = Some(x=0.0, y=0.0, z=0.5 ** 0.5, w=0.5 ** 0.5)
        return {"robot": Some(position=[0.01 * self.frames, 2.0, 0.1], rotation=turned)}
"""


@pytest.fixture
def stand_in(tmp_path, monkeypatch):
    """Put the stand-in before the package, for this process's children."""
    (tmp_path / "motioncapture.py").write_text(STAND_IN)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *sys.path]))


@pytest.mark.usefixtures("stand_in")
def test_a_body_moves_and_one_that_is_not_seen_stays_unknown():
    source = MotionCapture("vicon", "tracker", ["ghost", "robot"])
    try:
        readings = []
        deadline = time.monotonic() + 5
        while len(readings) < 3 and time.monotonic() < deadline:
            reading = source.read()
            if np.isfinite(reading.stamps[1]) and (
                not readings or reading.stamps[1] > readings[-1].stamps[1]
            ):
                readings.append(reading)
            time.sleep(0.002)
    finally:
        source.close()
    assert len(readings) == 3
    x = [reading.poses[1, 0] for reading in readings]
    assert x == sorted(set(x))
    assert readings[-1].poses[1, 1:] == pytest.approx([2.0, math.pi / 2])
    assert readings[-1].stamps[0] == -np.inf
    assert 0 <= time.monotonic() - readings[-1].stamps[1] < 5


@pytest.mark.usefixtures("stand_in")
@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("nokov", "silent for 0.5 s"),
        # It connects, to nobody: no frame ever comes.
        ("qualisys", "silent for 0.5 s"),
        ("vrpn", r"\(no server\)"),
    ],
)
def test_a_system_that_does_not_answer_is_refused_in_one_line(kind, words):
    with pytest.raises(InvalidInput, match=f"a {kind} that answers; got tracker.*{words}") as error:
        MotionCapture(kind, "tracker", ["robot"], patience=10.0 if kind == "vrpn" else 0.5)
    assert "\n" not in str(error.value)


def test_the_package_itself_is_spoken_to():
    source = MotionCapture("mock", "nowhere", ["robot"])
    reading = source.read()
    source.close()
    assert reading.stamps[0] == -np.inf


def test_an_unknown_system_is_refused():
    with pytest.raises(InvalidInput, match=r"`mocap\.source` must be one of vicon"):
        MotionCapture("sonar", "nowhere", ["robot"])


@pytest.mark.parametrize("heading", [-3.0, -1.0, 0.0, 0.5, 3.1])
def test_headings_come_out_of_quaternions(heading):
    assert heading_of(0, 0, math.sin(heading / 2), math.cos(heading / 2)) == pytest.approx(heading)


def test_a_frame_is_a_line():
    body = SimpleNamespace(position=[1, 2, 3], rotation=SimpleNamespace(x=0, y=0, z=0, w=1))
    assert frame_line(5.0, {"a": body}) == '{"stamp": 5.0, "bodies": {"a": [1.0, 2.0, 0.0]}}'
