"""The motion capture of an emulation tells where robots were when, and says if it has failed."""

import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.hardware_io.mocap.stand_in_poses import EmulatedPoses
from sightfield.systems.numerics.errors import SightfieldError


class Laboratory:
    """One robot at x = its moment, until the emulator dies; it may be behind the clock."""

    def __init__(self):
        self.dead, self.moment = False, time.monotonic()

    def snapshot(self):
        if self.dead:
            raise SightfieldError("the emulator has ended")
        return SimpleNamespace(moment=self.moment, poses=np.array([[self.moment, 0.0, 0.0]]))


def test_a_laboratory_that_fails_is_an_error_for_who_reads_poses():
    laboratory = Laboratory()
    poses = EmulatedPoses(laboratory, rate=1000.0)
    assert poses.read().poses.shape == (1, 3)
    laboratory.dead = True
    with pytest.raises(SightfieldError, match="the emulator has ended"):
        poses.read()


def test_a_laboratory_that_is_behind_is_waited_for_and_its_poses_have_the_stamp_of_their_moment():
    laboratory = Laboratory()
    poses = EmulatedPoses(laboratory)
    begun = laboratory.moment
    time.sleep(0.05)
    late = poses.read()
    # It never came: the pose is as old as it is.
    assert late.stamps[0] == late.poses[0, 0] == begun
    waits = threading.Timer(0.02, lambda: setattr(laboratory, "moment", time.monotonic() + 1e3))
    waits.start()
    caught_up = poses.read()
    waits.join()
    assert caught_up.stamps[0] == caught_up.poses[0, 0] > begun + 1e3


def test_frames_do_not_come_faster_than_the_rate():
    laboratory = Laboratory()
    poses = EmulatedPoses(laboratory, rate=10.0)
    first = poses.read()
    laboratory.moment += 0.09
    assert poses.read() is first
    laboratory.moment += 0.02
    assert poses.read() is not first
