"""Poses that are played again or spoilt, headings of turns, and bodies that are seen."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sightfield.hardware_io.mocap import stand_in_poses
from sightfield.hardware_io.mocap.lcm_poses import FINGERPRINT, PosesMessage, decode, encode
from sightfield.hardware_io.mocap.pose_receiver import NewestPoses, PoseReading
from sightfield.hardware_io.mocap.stand_in_poses import (
    EmulatedPoses,
    FaultyPoses,
    RecordedPoses,
    displaced,
    frozen,
    stuck,
    swapped,
)
from sightfield.hardware_io.mocap.tracker_process import frame_line, heading_of
from sightfield.systems.numerics.errors import InvalidInput


def log_of(times, **samples):
    return SimpleNamespace(times=np.array(times), samples=samples)


@pytest.fixture
def log():
    rng = np.random.default_rng(1)
    return log_of(
        [2.0, 2.1, 2.2, 2.5],
        **{
            "pursuer.poses": rng.normal(size=(4, 6)),
            "pursuer.age": rng.random((4, 2)),
            "evader.poses": rng.normal(size=(4, 3)),
            "evader.age": rng.random((4, 1)),
        },
    )


def test_recorded_poses_come_when_they_came(log):
    clock = SimpleNamespace(now=70.0)
    poses = RecordedPoses(log, clock=lambda: clock.now)
    for elapsed, row in ((0.0, 0), (0.0999, 0), (0.1, 1), (0.25, 2), (0.5, 3), (9.0, 3)):
        clock.now = 70.0 + elapsed
        found = poses.read()
        expected = [*log.samples["pursuer.poses"][row], *log.samples["evader.poses"][row]]
        assert found.poses.ravel().tolist() == expected
        ages = np.array([*log.samples["pursuer.age"][row], *log.samples["evader.age"][row]])
        np.testing.assert_allclose(found.stamps, 70.0 + log.times[row] - 2.0 - ages)


@pytest.mark.parametrize("what", ["no samples", "no poses", "no ages", "too few ages"])
def test_a_log_that_lacks_poses_is_refused(log, what):
    match what:
        case "no samples":
            log.times = log.times[:0]
        case "no poses":
            del log.samples["evader.poses"]
        case "no ages":
            del log.samples["evader.age"]
        case "too few ages":
            log.samples["pursuer.age"] = log.samples["pursuer.age"][:, :1]
    with pytest.raises(InvalidInput, match="`log` must have"):
        RecordedPoses(log)


def test_spoilt_poses_are_spoilt_until_they_are_mended():
    poses = np.arange(12.0).reshape(4, 3)
    true = PoseReading(poses, np.arange(4.0))
    source = FaultyPoses(SimpleNamespace(read=lambda: true, close=lambda: None))
    assert source.read() is true
    source.spoil(swapped(1, 3))
    assert source.read().poses.tolist() == poses[[0, 3, 2, 1]].tolist()
    assert source.read().stamps.tolist() == [0, 3, 2, 1]
    source.spoil(displaced(2, (0.5, -0.25, 1.0)))
    assert (source.read().poses - poses)[2].tolist() == [0.5, -0.25, 1.0]
    assert np.count_nonzero(source.read().poses - poses) == 3
    source.spoil(stuck(1, np.array([9.0, 8.0, 7.0])))
    assert source.read().poses[1].tolist() == [9.0, 8.0, 7.0]
    last = PoseReading(poses + 1, np.zeros(4))
    source.spoil(frozen(last))
    assert source.read() is last
    source.mend()
    assert source.read() is true


def test_emulated_poses_wait_for_what_is_not_older_than_20_milliseconds(monkeypatch):
    clock = SimpleNamespace(now=5.0, slept=0)

    def sleep(duration):
        clock.now += duration
        clock.slept += 1

    monkeypatch.setattr(
        stand_in_poses, "time", SimpleNamespace(monotonic=lambda: clock.now, sleep=sleep)
    )
    seen = SimpleNamespace(moment=4.9801, poses=np.zeros((2, 3)))
    poses = EmulatedPoses(SimpleNamespace(snapshot=lambda: seen), rate=50.0)
    assert clock.slept == 0
    seen.moment = clock.now - 0.0201
    poses.read()
    # For a tenth of a second.
    assert clock.slept in (100, 101)
    # At 50 frames in a second another comes 20 ms after the last.
    seen.moment = clock.now
    first = poses.read()
    for later, new in ((0.019, False), (0.0201, True)):
        seen.moment = first.stamps[0] + later
        clock.now = seen.moment
        assert (poses.read() is not first) is new
    poses.freeze()
    last = poses.read()
    seen.moment = clock.now = clock.now + 1.0
    assert poses.read() is last
    poses.thaw()
    assert poses.read() is not last
    usual = EmulatedPoses(SimpleNamespace(snapshot=lambda: seen))
    first = usual.read()
    for later, new in ((0.0099, False), (0.0101, True)):
        seen.moment = clock.now = first.stamps[0] + later
        assert (usual.read() is not first) is new


def test_headings_are_those_of_turns_about_the_vertical():
    rng = np.random.default_rng(3)
    for heading in rng.uniform(-3.1, 3.1, 20):
        tilt = rng.normal(0, 0.2, 2)
        x, y, z, w = Rotation.from_euler("ZYX", [heading, *tilt]).as_quat()
        assert heading_of(x, y, z, w) == pytest.approx(heading)


def test_a_line_tells_of_all_bodies_where_they_are():
    def body(x, y, heading):
        turn = SimpleNamespace(x=0.0, y=0.0, z=math.sin(heading / 2), w=math.cos(heading / 2))
        return SimpleNamespace(position=np.array([x, y, 9.0]), rotation=turn)

    told = json.loads(frame_line(2.5, {"a": body(0.5, -1.5, 0.7), "b": body(3.0, 4.0, -2.0)}))
    assert told["stamp"] == 2.5
    assert told["bodies"]["a"] == pytest.approx([0.5, -1.5, 0.7])
    assert told["bodies"]["b"] == pytest.approx([3.0, 4.0, -2.0])


def test_bodies_are_seen_with_three_finite_numbers_and_others_are_not():
    newest = NewestPoses(["a", "b"])
    for body, pose in (("c", [1, 2, 3]), ("a", [1, 2]), ("a", [1, 2, math.nan]), ("b", [4, 5, 6])):
        newest.see(body, pose, 7.5)
    found = newest.read()
    assert found.poses.tolist() == [[0, 0, 0], [4, 5, 6]]
    assert found.stamps.tolist() == [-math.inf, 7.5]
    newest.see("b", [0, 0, 0], 8.0)
    assert found.stamps.tolist() == [-math.inf, 7.5]


def test_messages_of_no_body_and_of_damaged_fields():
    nobody = PosesMessage(5, (), (), ())
    assert decode(encode(nobody)) == nobody
    one = PosesMessage(5, ("a",), ((0.5, 1.5, 2.5),), (True,))
    data = encode(one)
    assert decode(data) == one
    wrong = {
        "another type": data[:3] + b"?" + data[4:],
        "too long": data + b"\0",
        "too short": data[:-1],
        "a negative number of bodies": data[:16] + b"\xff" * 4 + data[20:],
        "too many bodies": data[:16] + b"\0\0\0\x7f" + data[20:],
        "an empty name": FINGERPRINT + data[8:20] + b"\0\0\0\0" + data[26:],
        "a name without an end": data[:25] + b"x" + data[26:],
    }
    for spoilt in wrong.values():
        with pytest.raises(InvalidInput, match="`message` must"):
            decode(spoilt)
    with pytest.raises(InvalidInput, match="have 1 poses and validities"):
        encode(PosesMessage(5, ("a",), (), (True,)))
