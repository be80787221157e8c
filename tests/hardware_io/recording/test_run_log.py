"""A log is whole up to the moment of a crash, and nothing in it that is damaged is believed."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantValueSource, ConstantVectorSource
from pydrake.systems.sensors import ImageRgba8U

from sightfield.hardware_io.recording.log_records import (
    ABOUT,
    MAGIC,
    SAMPLES,
    RunWriter,
    lost_records,
    records,
)
from sightfield.hardware_io.recording.run_log import PortRecorder, read_run_log
from sightfield.systems.numerics.errors import InvalidInput

PORTS = {"a.pose": 3, "b": 1}


def write(path, ticks=4):
    """A log of some ticks."""
    with RunWriter(path, ports=PORTS, pictures=("eye",), about={"seed": 7}) as writer:
        for tick in range(ticks):
            writer.samples(0.1 * tick, np.array([tick, np.nan, -0.0, np.inf]))
            if tick == 2:
                writer.picture(0.2, "eye", b"a picture")


@pytest.fixture(scope="module")
def log_bytes(tmp_path_factory):
    """A whole log."""
    path = tmp_path_factory.mktemp("log") / "run.log"
    write(path)
    return path.read_bytes()


def test_what_is_written_is_read_bit_for_bit(tmp_path):
    write(tmp_path / "run.log")
    log = read_run_log(tmp_path / "run.log")
    assert log.about == {"seed": 7}
    assert log.times.tolist() == [0.0, 0.1, 0.2, 0.1 * 3]
    assert log.samples["b"].tolist() == [[np.inf]] * 4
    pose = np.array([[tick, np.nan, -0.0] for tick in range(4)], dtype=float)
    assert log.samples["a.pose"].tobytes() == pose.tobytes()
    assert log.pictures == {"eye": [(0.2, b"a picture")]}
    assert (log.complete, log.unread) == (True, 0)


def test_a_log_is_never_written_over(tmp_path):
    write(tmp_path / "run.log")
    with pytest.raises(InvalidInput, match="`log` must be a new file; got"):
        RunWriter(tmp_path / "run.log", ports=PORTS)


@given(cut=st.integers(0, 10_000))
def test_a_log_that_is_cut_off_is_read_up_to_there(log_bytes, cut):
    cut %= len(log_bytes)
    whole, part = list(records(log_bytes)), list(records(log_bytes[:cut]))
    assert part == [each for each in whole if each.end <= cut]


@given(at=st.integers(0, 10_000), bit=st.integers(0, 7))
def test_a_flipped_bit_loses_the_record_that_it_is_in(log_bytes, at, bit):
    at %= len(log_bytes)
    damaged = bytearray(log_bytes)
    damaged[at] ^= 1 << bit
    whole, part = list(records(log_bytes)), list(records(bytes(damaged)))
    assert part == [each for each in whole if not each.start <= at < each.end]
    sizes = {ABOUT: len(whole[0].body), SAMPLES: 8 * sum(PORTS.values())}
    assert lost_records(log_bytes, whole, sizes) == (0, 0)
    assert lost_records(bytes(damaged), part, sizes) == (1, 0)


@given(start=st.integers(0, 10_000), size=st.integers(1, 400), fill=st.binary(max_size=400))
def test_bytes_that_are_others_or_gone_lose_what_they_were_part_of(log_bytes, start, size, fill):
    start %= len(log_bytes)
    damaged = log_bytes[:start] + fill + log_bytes[start + size :]
    whole, part = list(records(log_bytes)), list(records(damaged))
    kept = [each for each in whole if each.end <= start or each.start >= start + size]
    # Without a word on what it is nothing can be read; that stands there twice.
    if not any(each.kind == ABOUT for each in kept):
        kept = []
    read = [(each.kind, each.time, each.body) for each in part]
    assert [each for each in read if each not in [(k.kind, k.time, k.body) for k in whole]] == []
    assert [k for k in kept if (k.kind, k.time, k.body) not in read] == []


@given(st.binary(max_size=300))
def test_other_bytes_are_no_log(data):
    assert list(records(data)) == []
    assert list(records(MAGIC + data)) == []


def test_a_file_that_is_no_log_is_refused(tmp_path):
    (tmp_path / "other").write_text("hello")
    with pytest.raises(InvalidInput, match="`log` must be a log of a run; got"):
        read_run_log(tmp_path / "other")
    with pytest.raises(InvalidInput, match="No such file"):
        read_run_log(tmp_path / "nothing")
    # It has no end.
    with pytest.raises(InvalidInput, match="`log` must be a readable file; got /dev/zero"):
        read_run_log(Path("/dev/zero"))


def test_the_log_of_a_run_that_failed_has_no_end(tmp_path):
    def fail():
        with RunWriter(tmp_path / "run.log", ports={"b": 1}) as writer:
            writer.samples(0.0, np.zeros(1))
            raise RuntimeError("the radio is gone")

    with pytest.raises(RuntimeError):
        fail()
    log = read_run_log(tmp_path / "run.log")
    assert (len(log.times), log.complete, log.unread) == (1, False, 0)


CRASH = """
import sys, time
from pathlib import Path
import numpy as np
from sightfield.hardware_io.recording.log_records import RunWriter
writer = RunWriter(Path(sys.argv[1]), ports={"x": 1})
for tick in range(100000):
    writer.samples(float(tick), np.array([float(tick)]))
    print(tick, flush=True)
    time.sleep(0.001)
"""


def test_a_process_that_is_killed_loses_no_tick(tmp_path):
    path = tmp_path / "run.log"
    process = subprocess.Popen(
        [sys.executable, "-c", CRASH, path], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    for _ in range(50):
        process.stdout.readline()
    os.kill(process.pid, signal.SIGKILL)
    written = 50 + len(process.stdout.read().split())
    process.wait()
    log = read_run_log(path)
    assert len(log.times) >= written
    assert log.samples["x"].ravel().tolist() == list(range(len(log.times)))
    assert not log.complete


def test_a_recorder_writes_every_tick_and_each_picture_once(tmp_path):
    image = ImageRgba8U(3, 2)
    image.mutable_data[:] = np.arange(24, dtype=np.uint8).reshape(2, 3, 4)
    ports = {"pursuer.poses": 3}
    with RunWriter(tmp_path / "run.log", ports=ports, pictures=("eye.image",)) as writer:
        builder = DiagramBuilder()
        poses = builder.AddSystem(ConstantVectorSource([1.0, 2.0, 3.0]))
        eye = builder.AddSystem(ConstantValueSource(AbstractValue.Make(image)))
        recorder = builder.AddSystem(PortRecorder(writer, period=0.1, offset=0.01))
        builder.Connect(poses.get_output_port(), recorder.GetInputPort("pursuer_poses"))
        builder.Connect(eye.get_output_port(), recorder.GetInputPort("eye_image"))
        Simulator(builder.Build()).AdvanceTo(0.35)
    log = read_run_log(tmp_path / "run.log")
    assert log.times == pytest.approx([0.01, 0.11, 0.21, 0.31])
    assert log.samples["pursuer.poses"].tolist() == [[1, 2, 3]] * 4
    ((at, png),) = log.pictures["eye.image"]
    assert at == pytest.approx(0.01)
    picture = cv2.imdecode(np.frombuffer(png, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    assert picture is not None
    assert np.array_equal(cv2.cvtColor(picture, cv2.COLOR_BGRA2RGBA), image.data)
