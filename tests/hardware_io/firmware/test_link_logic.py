"""Whom a robot listens to, what it takes for old, and when it stops."""

import ctypes
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.hardware_io.kinds.xbee_frames import RobotState

ROBOT, SESSION = 3, 500
COMMAND, HEARTBEAT, STOP, ARM = 1, 2, 3, 4
EVERYONE = 255


class CLink(ctypes.Structure):
    """struct link of portable/link.h."""

    _fields_ = (
        ("robot", ctypes.c_uint8),
        ("state", ctypes.c_uint8),
        ("has_session", ctypes.c_bool),
        ("session", ctypes.c_uint16),
        ("sequence", ctypes.c_uint16),
        ("heard_fresh", ctypes.c_bool),
        ("heard", ctypes.c_uint16),
        ("command_fresh", ctypes.c_bool),
        ("commanded", ctypes.c_uint16),
        ("form", ctypes.c_uint8),
        ("first", ctypes.c_int16),
        ("second", ctypes.c_int16),
        ("taken", ctypes.c_uint16),
        ("refused", ctypes.c_uint16),
    )


class Robot:
    """The firmware's link logic with a clock."""

    def __init__(self, library, c_frame, start=0):
        self.library, self.link, self.now = library, CLink(), start
        self.c_frame = c_frame
        library.link_take.restype = ctypes.c_bool
        library.link_reset(ctypes.byref(self.link), ROBOT)

    def take(self, kind, sequence, *, session=SESSION, robot=EVERYONE, **command):
        frame = self.c_frame(kind=kind, session=session, sequence=sequence % 65536, robot=robot)
        frame.form, frame.age = command.get("form", 0), command.get("age", 0)
        rows = command.get("entries", [(ROBOT, 300, 200)])
        frame.count = len(rows)
        for k, row in enumerate(rows):
            frame.entries[k] = row
        clock = ctypes.c_uint16(self.now)
        return self.library.link_take(ctypes.byref(self.link), ctypes.byref(frame), clock)

    def wait(self, milliseconds):
        for _ in range(milliseconds // 10):
            self.now += 10
            self.library.link_tick(ctypes.byref(self.link), ctypes.c_uint16(self.now))

    @property
    def state(self):
        return RobotState(self.link.state)

    @property
    def speeds(self):
        both = (ctypes.c_int16 * 2)()
        self.library.link_wheel_speeds(ctypes.byref(self.link), both)
        return tuple(both)


@pytest.fixture
def new_robot(firmware_library, c_frame):
    return lambda start=0: Robot(firmware_library, c_frame, start)


@pytest.fixture
def robot(new_robot):
    """One that is armed; its last sequence number is 10."""
    armed = new_robot()
    assert armed.take(ARM, 10)
    return armed


def test_a_robot_moves_only_when_it_is_armed(new_robot):
    fresh = new_robot()
    fresh.take(COMMAND, 1)
    assert (fresh.state, fresh.speeds) == (RobotState.DISARMED, (0, 0))
    fresh.take(ARM, 2)
    assert (fresh.state, fresh.speeds) == (RobotState.IDLE, (0, 0))
    fresh.take(COMMAND, 3)
    assert (fresh.state, fresh.speeds) == (RobotState.DRIVING, (300, 200))


@given(ahead=st.integers(-32768, 32767), start=st.integers(0, 65535))
def test_a_command_counts_if_it_is_newer_modulo_65536(ahead, start, firmware_library, c_frame):
    robot = Robot(firmware_library, c_frame)
    robot.take(ARM, start)
    robot.take(COMMAND, start + ahead)
    assert (robot.speeds == (300, 200)) == (ahead > 0)


def test_sequence_numbers_go_round_without_a_stop(robot):
    for sequence in range(11, 140_000, 100):
        robot.take(COMMAND, sequence, entries=[(ROBOT, sequence % 500 + 1, 0)])
        robot.wait(50)
        assert robot.speeds == (sequence % 500 + 1, 0)


def test_a_strangers_command_is_not_followed(robot):
    robot.take(COMMAND, 11, session=SESSION + 1)
    assert robot.speeds == (0, 0)
    assert robot.link.taken == 1


def test_a_command_to_others_keeps_the_link_but_moves_nothing(robot):
    robot.wait(160)
    robot.take(COMMAND, 11, entries=[(4, 300, 300)])
    robot.wait(160)
    assert (robot.state, robot.speeds) == (RobotState.IDLE, (0, 0))


def test_a_command_from_old_poses_is_a_heartbeat(robot):
    robot.take(COMMAND, 11, age=301)
    robot.wait(10)
    assert (robot.state, robot.speeds) == (RobotState.IDLE, (0, 0))
    robot.take(COMMAND, 12, age=300)
    assert robot.speeds == (300, 200)


def test_silence_stops_and_the_next_command_drives_again(robot):
    robot.take(COMMAND, 11)
    robot.wait(160)
    assert robot.state == RobotState.DRIVING
    robot.wait(10)
    assert (robot.state, robot.speeds) == (RobotState.LOST, (0, 0))
    robot.take(COMMAND, 12)
    assert (robot.state, robot.speeds) == (RobotState.DRIVING, (300, 200))


def test_heartbeats_without_commands_stop_too(robot):
    robot.take(COMMAND, 11)
    for sequence in range(12, 20):
        robot.wait(100)
        robot.take(HEARTBEAT, sequence)
    robot.wait(10)
    assert (robot.state, robot.speeds) == (RobotState.IDLE, (0, 0))


def test_a_robot_that_is_lost_stays_so_when_its_clock_goes_round(new_robot):
    robot = new_robot(start=65_000)
    robot.take(ARM, 1)
    robot.take(COMMAND, 2)
    robot.wait(170)
    for _ in range(140):
        robot.wait(1000)
        assert (robot.state, robot.speeds) == (RobotState.LOST, (0, 0))


@pytest.mark.parametrize("session", [SESSION, SESSION + 1])
@pytest.mark.parametrize("sequence", [9, 10, 11, 40_000])
def test_a_stop_holds_however_old_and_from_whomever(robot, session, sequence):
    robot.take(COMMAND, 10 + 1)
    assert robot.take(STOP, sequence, session=session)
    robot.take(COMMAND, 12, session=session)
    robot.wait(100)
    assert (robot.state, robot.speeds) == (RobotState.STOPPED, (0, 0))


def test_a_stop_to_another_robot_stops_nobody_else(robot):
    robot.take(COMMAND, 11)
    assert not robot.take(STOP, 12, robot=4)
    assert robot.state == RobotState.DRIVING


def test_an_arm_that_a_stop_has_overtaken_is_ignored(robot):
    robot.take(STOP, 12)
    assert not robot.take(ARM, 11)
    assert robot.state == RobotState.STOPPED
    assert robot.take(ARM, 13)
    assert robot.state == RobotState.IDLE


def test_a_new_station_takes_over_by_arming(robot):
    robot.take(COMMAND, 11)
    assert robot.take(ARM, 0, session=9)
    assert robot.speeds == (0, 0)
    robot.take(COMMAND, 12)
    assert robot.speeds == (0, 0)
    robot.take(COMMAND, 1, session=9)
    assert robot.speeds == (300, 200)


@given(speed=st.integers(-32768, 32767), turn=st.integers(-32768, 32767))
def test_a_twist_turns_about_the_same_point_at_any_speed(speed, turn, firmware_library, c_frame):
    robot = Robot(firmware_library, c_frame)
    robot.take(ARM, 0)
    robot.take(COMMAND, 1, form=1, entries=[(ROBOT, speed, turn)])
    left, right = robot.speeds
    wished = SimpleNamespace(left=speed - 0.08 * turn, right=speed + 0.08 * turn)
    scale = min(1.0, 600 / max(abs(wished.left), abs(wished.right), 1))
    assert max(abs(left), abs(right)) <= 600
    assert left == pytest.approx(scale * wished.left, abs=2)
    assert right == pytest.approx(scale * wished.right, abs=2)
