"""A process that drives robots asks to be first, and that CPUs stay awake."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from sightfield.hardware_io.device_process.urgency import go_first, keep_awake


def has_open(file):
    """Whether this process has a file open."""
    files = Path("/proc/self/fd").iterdir()
    return str(file) in [os.readlink(each) for each in files if each.exists()]


def test_cpus_stay_awake_as_long_as_the_file_is_open_and_no_longer(tmp_path):
    file = tmp_path / "latency"
    with keep_awake(str(file)) as may:
        assert may
        # None of them may take longer than 0 us to wake: a number of four bytes.
        assert file.read_bytes() == bytes(4)
        assert has_open(file)
    assert not has_open(file)


def test_what_fails_meanwhile_is_not_taken_for_a_refusal(tmp_path):
    file = tmp_path / "latency"
    with pytest.raises(OSError, match="of the link"), keep_awake(str(file)):
        raise OSError("of the link")
    assert not has_open(file)


def test_who_may_not_keep_them_awake_goes_on(tmp_path):
    with keep_awake(str(tmp_path / "none" / "latency")) as may:
        assert not may


def test_a_process_goes_first_where_the_system_lets_it():
    code = "import sys; sys.stdin.read()"
    other = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE)
    with other:
        may = go_first(other.pid)
        expected = os.SCHED_RR if may else os.SCHED_OTHER
        assert os.sched_getscheduler(other.pid) == expected
        other.kill()
