"""A link in a process of its own outlives neither its controller nor its robots' trust."""

import os
import pickle
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from sightfield.hardware_io.device_process.process_link import ProcessLink
from sightfield.hardware_io.device_process.urgency import LATENCY_FILE
from sightfield.hardware_io.kinds.known_kinds import find_kind
from sightfield.hardware_io.kinds.robot_kind import RobotFleet, Surroundings
from sightfield.hardware_io.links.robot_link import LinkError, RobotState
from sightfield.systems.numerics.errors import InvalidInput

ROBOTS = (1, 2)
STARTS = np.array([[0.0, 0.0, 0.0], [0.0, 2.0, 1.0]])
DRIVE = np.array([[0.3, 0.0], [0.2, 1.0]])
# Patience with a busy machine [s].
PATIENCE = 60.0

# Drives robots until it is stopped from outside.
CONTROLLER = """
import pickle, sys, time
import numpy as np
from sightfield.hardware_io.device_process.process_link import ProcessLink
kind, fleet = pickle.load(sys.stdin.buffer)
with ProcessLink(kind, fleet) as link:
    assert link.arm(timeout=5.0) == fleet.robots
    while True:
        link.send_commands(np.array([[0.3, 0.0], [0.2, 1.0]]))
        time.sleep(0.025)
"""


@contextmanager
def standing_in(kind="udp"):
    """Robots of a kind that stand in, and how they are reached."""
    made = find_kind(kind)
    around = Surroundings(starts=STARTS, silence=made.stops_after)
    with made.open_stand_in(RobotFleet(robots=ROBOTS), around) as opened:
        yield opened


def wait_until(condition):
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


def drives(laboratory):
    return bool((np.abs(laboratory.wheel_speeds()).max(axis=1) > 0.1).all())


def drive(link, laboratory):
    """Command until all robots drive."""

    def told():
        link.send_commands(DRIVE)
        return drives(laboratory)

    wait_until(told)


def test_its_process_keeps_cpus_awake_where_it_may():
    with standing_in() as (_, fleet), ProcessLink("udp", fleet) as link:
        files = Path(f"/proc/{host_of(link)}/fd").iterdir()
        has_it_open = LATENCY_FILE in [os.readlink(each) for each in files]
        assert has_it_open == os.access(LATENCY_FILE, os.W_OK)


def test_robots_are_armed_driven_heard_and_stopped_from_another_process():
    with standing_in() as (laboratory, fleet), ProcessLink("udp", fleet) as link:
        assert link.arm(timeout=PATIENCE) == ROBOTS
        drive(link, laboratory)

        def have_counted():
            link.send_commands(DRIVE)
            return all(link.telemetry()[each].counts[0] > 100 for each in ROBOTS)

        wait_until(have_counted)
        assert link.health().received > 2
        before = time.monotonic()
        assert link.stop(timeout=PATIENCE) == ROBOTS
        wait_until(lambda: not np.abs(laboratory.wheel_speeds()).any())
        report = link.telemetry()[1]
        assert report.state == RobotState.STOPPED
        # By a clock that both processes have.
        assert before < report.time <= time.monotonic()
        # After a stop nothing moves until it is armed.
        link.send_commands(DRIVE)
        time.sleep(0.2)
        assert not np.abs(laboratory.wheel_speeds()).any()


@contextmanager
def controlled(kind):
    """Robots, and a controller in a process of its own that drives them."""
    with standing_in(kind) as (laboratory, fleet):
        controller = subprocess.Popen(
            [sys.executable, "-c", CONTROLLER], stdin=subprocess.PIPE, start_new_session=True
        )
        try:
            controller.stdin.write(pickle.dumps((kind, fleet)))
            controller.stdin.close()
            wait_until(lambda: drives(laboratory))
            yield laboratory, controller
        finally:
            controller.kill()
            controller.wait()


@pytest.mark.parametrize("sign", [signal.SIGKILL, signal.SIGSTOP])
def test_robots_that_would_go_on_for_seconds_stand_soon_after_their_controller(sign):
    """Rovers with ArduPilot go on for 3 s in silence."""
    with controlled("mavlink") as (laboratory, controller):
        at = laboratory.time()
        os.kill(controller.pid, sign)
        wait_until(lambda: np.isfinite(laboratory.snapshot().still_since).all())
        # In the benchmark some 0.3 s; a busy machine passes too.
        assert laboratory.snapshot().still_since.max() - at < 1.5


def test_a_controller_that_wakes_up_goes_on():
    with controlled("udp") as (laboratory, controller):
        os.kill(controller.pid, signal.SIGSTOP)
        wait_until(lambda: np.isfinite(laboratory.snapshot().still_since).all())
        time.sleep(1.5)
        os.kill(controller.pid, signal.SIGCONT)
        wait_until(lambda: drives(laboratory))
        assert controller.poll() is None


def host_of(link):
    return link._process.pid


def test_a_process_that_was_killed_is_an_error_and_robots_stop_by_themselves():
    with standing_in() as (laboratory, fleet):
        link = ProcessLink("udp", fleet)
        link.connect()
        link.arm(timeout=PATIENCE)
        drive(link, laboratory)
        os.kill(host_of(link), signal.SIGKILL)
        with pytest.raises(LinkError, match="has ended"):
            drive_for(link, PATIENCE)
        with pytest.raises(LinkError, match="has ended"):
            link.stop()
        wait_until(lambda: not np.abs(laboratory.wheel_speeds()).any())
        link.close()
        # What robots said last is known yet.
        assert set(link.telemetry()) == set(ROBOTS)


def drive_for(link, seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        link.send_commands(DRIVE)
        time.sleep(0.02)


@pytest.mark.timeout(120)
def test_a_process_that_hangs_holds_nobody_up():
    with standing_in() as (laboratory, fleet):
        link = ProcessLink("udp", fleet)
        link.connect()
        link.arm(timeout=PATIENCE)
        drive(link, laboratory)
        os.kill(host_of(link), signal.SIGSTOP)
        # Its buffer is full soon: nothing waits for room in it.
        with pytest.raises(LinkError, match="has said nothing for 1"):
            drive_for(link, PATIENCE)
        assert link.stop(timeout=0.1) == ()
        wait_until(lambda: not np.abs(laboratory.wheel_speeds()).any())
        link.close()


def test_a_controller_that_slept_does_not_give_its_process_up():
    with standing_in() as (_, fleet), ProcessLink("udp", fleet) as link:
        link.arm(timeout=PATIENCE)
        link.send_commands(DRIVE)
        os.kill(host_of(link), signal.SIGSTOP)
        time.sleep(1.5)
        link.send_commands(DRIVE)
        os.kill(host_of(link), signal.SIGCONT)
        drive_for(link, 0.3)


def test_what_a_kind_refuses_is_refused_here():
    with pytest.raises(InvalidInput, match=r"`radio\.addresses` must name 2 robots"):
        ProcessLink("udp", RobotFleet(robots=ROBOTS)).connect()
    with pytest.raises(InvalidInput, match=r"`radio\.kind` must"):
        ProcessLink("carrier pigeon", RobotFleet(robots=ROBOTS)).connect()
    addresses = ("no.such.robot.invalid:5005", "127.0.0.1:5006")
    with pytest.raises(LinkError, match=r"no robot 1 at no\.such\.robot\.invalid:5005"):
        ProcessLink("udp", RobotFleet(robots=ROBOTS, addresses=addresses)).connect()


def test_without_being_entered_it_says_so_in_one_line():
    link = ProcessLink("udp", RobotFleet(robots=ROBOTS))
    with pytest.raises(LinkError, match="not open"):
        link.heartbeat()
    assert (link.telemetry(), link.health().sent) == ({}, 0)
    link.close()
