"""A log in MCAP is ours to the bit, two other libraries read it, and damage loses one chunk."""

import os
import random
import signal
import subprocess
import sys

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from sightfield.hardware_io.recording.mcap_log import McapRunWriter
from sightfield.hardware_io.recording.run_log import read_run_log
from sightfield.systems.numerics.errors import InvalidInput

PORTS = {"a.pose": 3, "a_pose": 1, "2.Nothing": 0, "b": 1}
TICKS = 95
ROBOT = "robot"


class Frame:
    """A robot for other tools."""

    def begin(self, bag):
        bag.twist("/begun", 0.0, ROBOT, 1.0, 0.0, 0.0)

    def tick(self, bag, time, samples):
        bag.transforms(time, {ROBOT: samples["a.pose"][[0, 2, 2]]})


def row(tick):
    """What a tick holds: numbers with all their bits, and some that are none."""
    return np.array([tick / 7.0, np.nan if tick % 2 else -np.inf, -0.0, 1e-310 * tick, tick])


def write(path, ticks=TICKS):
    """A log of nearly five seconds, with pictures of odd sizes and names."""
    writer = McapRunWriter(
        path,
        ports=PORTS,
        pictures=("eye", "left.eye"),
        memory={"/a/Big": 2},
        about={"seed": 7},
        beside=Frame(),
    )
    with writer:
        for tick in range(ticks):
            time = 0.05 * tick + 1e-4
            writer.samples(time, row(tick))
            if tick % 9 == 0:
                writer.picture(time, "left.eye", bytes(range(tick % 8)) + b"picture")
            writer.memory(0.05 * tick, np.array([tick, 0.1 * tick]))


@pytest.fixture(scope="module")
def log_path(tmp_path_factory):
    path = tmp_path_factory.mktemp("mcap") / "run.mcap"
    write(path)
    return path


def check(log, ticks):
    """Of the samples that a log has none is another than was written."""
    assert log.about == {"seed": 7}
    for name, samples in log.samples.items():
        column = {"a.pose": slice(3), "a_pose": [3], "2.Nothing": [], "b": [4]}[name]
        assert samples.tobytes() == np.array([row(tick)[column] for tick in ticks]).tobytes()
    for time, png in log.pictures["left.eye"]:
        tick = round(time / 0.05)
        assert png == bytes(range(tick % 8)) + b"picture"
    for time, kept in log.memory:
        tick = round(time / 0.05)
        assert (time, kept["/a/Big"].tolist()) == (0.05 * tick, [tick, 0.1 * tick])


def test_what_is_written_is_read_bit_for_bit(log_path):
    log = read_run_log(log_path)
    check(log, range(TICKS))
    assert log.times.tolist() == [0.05 * tick + 1e-4 for tick in range(TICKS)]
    # The times of pictures are those of their ticks, which nanoseconds would round.
    assert [time for time, _ in log.pictures["left.eye"]] == log.times[::9].tolist()
    assert (len(log.memory), log.pictures["eye"]) == (TICKS, [])
    assert (log.complete, log.unread, log.lost) == (True, 0, 0)
    assert log_path.stat().st_mode & 0o777 == 0o600


def test_mcap_and_rosbags_read_every_message(log_path):
    with log_path.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        told = summary.statistics.message_count
        assert len(list(reader.iter_messages())) == told == 3 + 3 * TICKS + 11
    fields, places = [], []
    with AnyReader([log_path]) as reader:
        for connection, _, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            told -= 1
            if connection.topic == "/log/samples":
                fields.append([message.time, message.a_pose[0], message.a_pose_2[0], message.b[0]])
            if connection.topic == "/tf":
                places.append(message.transforms[0].transform.translation.x)
    assert told == 0
    wanted = [[0.05 * k + 1e-4, *row(k)[[0, 3, 4]]] for k in range(TICKS)]
    assert np.array(fields).tobytes() == np.array(wanted).tobytes()
    assert places == [tick / 7.0 for tick in range(TICKS)]


def test_of_200_flips_and_cuts_no_sample_is_wrong_and_a_flip_loses_one_chunk(log_path, tmp_path):
    data, dice = log_path.read_bytes(), random.Random(3)
    for _ in range(200):
        broken, at = bytearray(data), dice.randrange(len(data))
        flipped = dice.random() < 0.6
        if flipped:
            broken[at] ^= 1 << dice.randrange(8)
        else:
            del broken[at:]
        (tmp_path / "run.mcap").write_bytes(broken)
        try:
            log = read_run_log(tmp_path / "run.mcap")
        except InvalidInput:
            assert not flipped
            continue
        ticks = np.rint((log.times - 1e-4) / 0.05).astype(int).tolist()
        check(log, ticks)
        if flipped:
            assert len(ticks) >= TICKS - 20
            assert log.lost >= max(TICKS - len(ticks) - 20, 1) or not log.complete
            assert log.lost > 0 or log.unread > 0
        else:
            assert ticks == [*range(len(ticks))]
            assert (log.complete, log.lost) == (False, 0)


@pytest.mark.parametrize("part", ["length", "body", "checksum", "compression"])
def test_a_damaged_chunk_is_lost_and_the_others_are_not(log_path, tmp_path, part):
    with log_path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    chunk = summary.chunk_indexes[4]
    within = {"length": 3, "body": 300, "checksum": 9 + 24, "compression": 9 + 32}[part]
    data = bytearray(log_path.read_bytes())
    data[chunk.chunk_start_offset + within] ^= 2
    (tmp_path / "run.mcap").write_bytes(data)
    log = read_run_log(tmp_path / "run.mcap")
    check(log, [*range(40), *range(60, TICKS)])
    assert (log.lost, log.complete) == (20, True)


def test_damage_that_only_other_tools_would_see_is_told_too(log_path, tmp_path):
    data = bytearray(log_path.read_bytes())
    # Of the summary, and of the file's first words.
    for at in (len(data) - 60, 20):
        broken = bytearray(data)
        broken[at] ^= 1
        (tmp_path / "run.mcap").write_bytes(broken)
        log = read_run_log(tmp_path / "run.mcap")
        check(log, range(TICKS))
        assert log.lost == 1


def test_a_run_that_failed_has_no_end(tmp_path):
    def fail():
        with McapRunWriter(tmp_path / "run.mcap", ports={"b": 1}) as writer:
            writer.samples(0.0, np.zeros(1))
            raise RuntimeError("the radio is gone")

    with pytest.raises(RuntimeError):
        fail()
    log = read_run_log(tmp_path / "run.mcap")
    assert (len(log.times), log.complete, log.lost, log.unread) == (1, False, 0, 0)


CRASH = """
import sys
from pathlib import Path
import numpy as np
from sightfield.hardware_io.recording.mcap_log import McapRunWriter
writer = McapRunWriter(Path(sys.argv[1]), ports={"x": 1})
for tick in range(70):
    writer.samples(0.05 * tick, np.array([float(tick)]))
print("done", flush=True)
sys.stdin.read()
"""


def test_a_process_that_is_killed_loses_a_second_at_most(tmp_path):
    path = tmp_path / "run.mcap"
    process = subprocess.Popen(
        [sys.executable, "-c", CRASH, path], stdout=subprocess.PIPE, stdin=subprocess.PIPE
    )
    assert process.stdout is not None
    process.stdout.readline()
    os.kill(process.pid, signal.SIGKILL)
    process.communicate()
    log = read_run_log(path)
    assert log.samples["x"].ravel().tolist() == list(range(60))
    assert (log.complete, log.lost, log.unread) == (False, 0, 0)


def test_a_log_is_never_written_over_and_a_full_disk_is_told(tmp_path):
    write(tmp_path / "run.mcap", 1)
    with pytest.raises(InvalidInput, match="`log` must be a new file; got"):
        McapRunWriter(tmp_path / "run.mcap", ports=PORTS)
    writer = McapRunWriter(tmp_path / "other.mcap", ports={"x": 1})
    with open("/dev/full", "r+b", buffering=0) as full:
        os.dup2(full.fileno(), writer._bag._file.fileno())
        writer.samples(0.0, np.zeros(1))
        with pytest.raises(InvalidInput, match="must be on a disk with room"):
            writer.samples(1.0, np.zeros(1))


def test_other_files_are_no_logs(tmp_path, log_path):
    for data in (b"\x89MCAP0\r\n", b"\x89MCAP0\r\nand more", log_path.read_bytes()[:60]):
        (tmp_path / "other").write_bytes(data)
        with pytest.raises(InvalidInput, match="`log` must be a log of a run; got"):
            read_run_log(tmp_path / "other")


def test_without_the_extra_one_line_says_what_to_install(monkeypatch, log_path, tmp_path):
    monkeypatch.setitem(sys.modules, "mcap", None)
    for what in (lambda: read_run_log(log_path), lambda: write(tmp_path / "run.mcap")):
        with pytest.raises(InvalidInput, match=r"extra \[mcap\]: pip .*; not installed: mcap$"):
            what()
