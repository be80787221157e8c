"""Threads that receive get their turns as long as devices are open."""

import sys
from contextlib import suppress

import pytest

from sightfield.hardware_io.links.robot_link import brisk_threads


def test_threads_take_short_turns_until_the_devices_are_closed():
    before = sys.getswitchinterval()
    # An error closes them too.
    with suppress(OSError), brisk_threads():
        assert sys.getswitchinterval() == pytest.approx(1e-4)
        raise OSError
    assert sys.getswitchinterval() == before
