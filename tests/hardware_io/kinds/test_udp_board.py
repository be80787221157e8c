"""A board follows what is newer, in time and of its session, and stops in silence."""

import pytest

from sightfield.hardware_io.emulation.stand_in_laboratory import Sensed
from sightfield.hardware_io.kinds.udp_board import UdpBoard
from sightfield.hardware_io.kinds.udp_link import (
    MODULUS,
    OrderDatagram,
    OrderKind,
    decode_report,
    encode_order,
)
from sightfield.hardware_io.links.robot_link import RobotState

# The clock goes round a tenth of a second after the start.
START = MODULUS - 100
SENSED = Sensed((5, -6), (0.0, 0.0), (0.0, 0.0, 0.0), (0.1, 0.2, 0.3, float("inf")), 7.4)


class Told:
    """A board, and who tells it something: in time unless said otherwise."""

    def __init__(self):
        self.board = UdpBoard(7, 0.2, boot=3, start=START)

    def order(self, kind, sequence, now, *, late=0.0, session=9, robot=7, speed=0.3):
        drives = kind == OrderKind.COMMAND
        timed = drives or kind == OrderKind.ARM
        deadline = round(1000 * (now + 0.1 - late)) + START if timed else 0
        datagram = OrderDatagram(
            kind=kind,
            session=session,
            sequence=sequence % MODULUS,
            deadline=deadline % MODULUS,
            speed=round(1000 * speed) if drives else 0,
            robot=robot,
        )
        self.board.take(encode_order(datagram), now)
        return self.board.targets(now)

    def command(self, *arguments, **options):
        return self.order(OrderKind.COMMAND, *arguments, **options)

    def arm(self, *arguments, **options):
        return self.order(OrderKind.ARM, *arguments, **options)

    def report(self, now):
        return [decode_report(each) for each in self.board.reports(now, SENSED)]


@pytest.fixture
def told():
    return Told()


def test_before_it_is_armed_nothing_moves_it(told):
    assert told.command(1, 0.0) is None
    assert told.board.state == RobotState.DISARMED
    told.arm(2, 0.01)
    assert told.command(3, 0.02, speed=0.25) == (0.25, 0.0)


def test_what_is_repeated_or_overtaken_is_not_followed(told):
    told.arm(10, 0.0)
    assert told.command(12, 0.01, speed=0.1) == (0.1, 0.0)
    assert told.command(12, 0.02, speed=0.2) == (0.1, 0.0)
    assert told.command(11, 0.03, speed=0.2) == (0.1, 0.0)
    assert told.command(13, 0.04, speed=0.2) == (0.2, 0.0)
    # Numbers go round.
    told.arm(MODULUS - 1, 0.05, session=4)
    assert told.command(MODULUS, 0.06, session=4, speed=0.3) == (0.3, 0.0)
    assert told.command(MODULUS - 1, 0.07, session=4, speed=0.1) == (0.3, 0.0)


def test_a_command_that_is_late_only_says_that_the_station_is_there(told):
    told.arm(1, 0.0)
    assert told.command(2, 0.05) == (0.3, 0.0)
    for k in range(1, 20):
        told.command(2 + k, 0.05 + 0.05 * k, late=0.11, speed=0.5)
    assert (told.board.targets(1.0), told.board.state) == (None, RobotState.IDLE)
    # A deadline far ahead is by another clock.
    assert told.command(50, 1.01, late=-1.0) is None
    assert told.command(51, 1.02, late=0.1) == (0.3, 0.0)


def test_in_silence_it_stops_within_the_time_that_it_reports(told):
    told.arm(1, 0.0)
    told.command(2, 0.5)
    assert told.board.targets(0.699) == (0.3, 0.0)
    assert (told.board.targets(0.701), told.board.state) == (None, RobotState.LOST)
    assert told.report(0.701)[0].silence == 200
    assert told.command(3, 0.8) == (0.3, 0.0)


def test_a_stop_holds_whoever_says_it_and_an_old_arm_does_not_undo_it(told):
    told.arm(1, 0.0)
    told.command(5, 0.1)
    assert told.order(OrderKind.STOP, 3, 0.2, session=77) is None
    assert told.board.state == RobotState.STOPPED
    told.arm(4, 0.21, session=77, late=0.2)
    assert told.command(8, 0.22) is None
    told.order(OrderKind.STOP, 9, 0.23)
    told.arm(8, 0.24)
    assert told.board.state == RobotState.STOPPED
    told.arm(10, 0.25)
    assert told.command(11, 0.26) == (0.3, 0.0)


def test_others_robots_sessions_and_noise_are_not_followed_but_counted(told):
    told.arm(1, 0.0)
    told.report(0.0)
    assert told.command(2, 0.01, robot=8) is None
    assert told.command(2, 0.02, session=10) is None
    told.board.take(b"noise", 0.03)
    (report,) = told.report(0.15)
    assert (report.taken, report.refused, report.last_sequence) == (1, 2, 1)


def test_it_reports_twenty_times_a_second_and_at_once_when_asked(told):
    assert [len(told.report(0.01 * k)) for k in range(11)] == [1, *[0] * 4, 1, *[0] * 4, 1]
    told.order(OrderKind.HAIL, 1, 0.12)
    (report,) = told.report(0.13)
    assert report.clock == 30
    assert (report.boot, report.robot, report.counts, report.battery) == (3, 7, (5, -6), 7400)
    assert (report.ranges, report.hold) == ((100, 200, 300, 65535), 65535)
    told.arm(2, 0.14)
    (report,) = told.report(0.16)
    assert (report.session, report.hold, report.state) == (9, 20, RobotState.IDLE)
    assert report.sequence == 5
