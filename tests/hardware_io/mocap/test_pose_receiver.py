"""Poses in a diagram: held, aged, and invalid when they are stale."""

import time
from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.hardware_io.mocap.pose_receiver import NewestPoses, PoseReading, PoseReceiver
from sightfield.hardware_io.mocap.stand_in_poses import EmulatedPoses, RecordedPoses
from sightfield.hardware_io.recording.run_log import RunLog
from sightfield.systems.numerics.errors import InvalidInput

STARTS = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])


class Clock:
    """A clock that a test sets."""

    now = 100.0

    def __call__(self):
        return self.now


def outputs(receiver, simulator):
    return {
        name: receiver.GetOutputPort(name).Eval(simulator.get_context()).tolist()
        for name in ("poses", "valid", "age", "stamp")
    }


def test_a_robot_is_invalid_until_it_is_seen_and_again_when_it_is_stale():
    clock, newest = Clock(), NewestPoses(["a", "b"])
    receiver = PoseReceiver(newest, STARTS, period=0.05, stale_after=0.1, clock=clock)
    simulator = Simulator(receiver)
    simulator.AdvanceTo(0.02)
    assert outputs(receiver, simulator) == {
        "poses": STARTS.ravel().tolist(),
        "valid": [0, 0],
        "age": [np.inf, np.inf],
        "stamp": [-np.inf, -np.inf],
    }
    newest.see("b", [7.0, 8.0, 9.0], clock.now)
    clock.now += 0.04
    simulator.AdvanceTo(0.07)
    seen = outputs(receiver, simulator)
    assert seen["poses"] == [1, 2, 3, 7, 8, 9]
    assert seen["valid"] == [0, 1]
    assert seen["age"][1] == pytest.approx(0.04)
    # It was seen at the first tick; that the next came 0.01 s early does not change it.
    assert seen["stamp"][1] == 0.0
    clock.now += 0.07
    simulator.AdvanceTo(0.12)
    stale = outputs(receiver, simulator)
    assert stale["valid"] == [0, 0]
    # It is where it was last seen.
    assert stale["poses"] == seen["poses"]


def test_between_ticks_nothing_changes():
    clock, newest = Clock(), NewestPoses(["a", "b"])
    receiver = PoseReceiver(newest, STARTS, period=0.05, stale_after=0.1, clock=clock)
    simulator = Simulator(receiver)
    simulator.AdvanceTo(0.01)
    before = outputs(receiver, simulator)
    newest.see("a", [7.0, 8.0, 9.0], clock.now)
    simulator.AdvanceTo(0.04)
    assert outputs(receiver, simulator) == before


def test_a_source_of_other_bodies_is_refused():
    with pytest.raises(InvalidInput, match=r"`starts` must have shape \(3, 3\); got \(2, 3\)"):
        PoseReceiver(NewestPoses(["a", "b", "c"]), STARTS, period=0.05, stale_after=0.1)


@pytest.mark.parametrize("bodies", [[], ["a", "a"]])
def test_bodies_need_names_of_their_own(bodies):
    with pytest.raises(InvalidInput, match="`bodies` must"):
        NewestPoses(bodies)


def test_a_recording_is_played_at_its_own_pace_and_then_grows_old():
    clock = Clock()
    rows = np.arange(6.0).reshape(2, 3)
    log = RunLog(
        about={},
        times=np.array([0.0, 0.5]),
        samples={"pursuer.poses": rows, "pursuer.age": np.array([[0.01], [0.02]])},
        pictures={},
        complete=True,
        unread=0,
    )
    source = RecordedPoses(log, ("pursuer",), clock=clock)
    first = source.read()
    clock.now += 0.6
    second = source.read()
    assert first.poses.tolist() == [[0, 1, 2]]
    assert second.poses.tolist() == [[3, 4, 5]]
    assert first.stamps == pytest.approx([99.99])
    # Recorded 0.5 s after the start, when it was 0.02 s old.
    assert second.stamps == pytest.approx([100.48])
    clock.now += 100
    assert source.read().stamps == pytest.approx([100.48])
    with pytest.raises(InvalidInput, match=r"have evader\.poses"):
        RecordedPoses(log)


def test_an_emulated_camera_system_can_be_unplugged():
    class Laboratory:
        """Robots that are where the clock says."""

        def snapshot(self):
            now = time.monotonic()
            return SimpleNamespace(moment=now, poses=np.full((2, 3), now))

    source = EmulatedPoses(Laboratory(), rate=500.0)

    def newer_than(reading: PoseReading) -> bool:
        deadline = time.monotonic() + 2
        while time.monotonic() < deadline:
            if source.read().stamps[0] > reading.stamps[0]:
                return True
            time.sleep(0.002)
        return False

    try:
        first = source.read()
        assert newer_than(first)
        source.freeze()
        time.sleep(0.05)
        frozen = source.read()
        time.sleep(0.05)
        assert source.read() is frozen
        source.thaw()
        assert newer_than(frozen)
    finally:
        source.close()
