"""The motion capture of an emulation that has failed says so."""

import time

import numpy as np
import pytest

from sightfield.hardware_io.mocap.emulated_poses import EmulatedPoses
from sightfield.systems.numerics.errors import SightfieldError


class Laboratory:
    """One robot, until the emulator dies."""

    dead = False

    def poses(self):
        if self.dead:
            raise SightfieldError("the emulator has ended")
        return np.zeros((1, 3))


def read_for(poses, seconds):
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        poses.read()
        time.sleep(0.001)


def test_a_laboratory_that_fails_is_an_error_for_who_reads_poses():
    laboratory = Laboratory()
    poses = EmulatedPoses(laboratory, rate=1000.0)
    try:
        assert poses.read().poses.tolist() == [[0, 0, 0]]
        laboratory.dead = True
        with pytest.raises(SightfieldError, match="the emulator has ended"):
            read_for(poses, 10.0)
    finally:
        poses.close()
