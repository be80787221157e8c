"""What links make of orders and reports is as recorded; who is told what, and how often."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.hardware_io.links import reporting_link, robot_link
from sightfield.hardware_io.links.link_record import (
    LinkRecord,
    OdometryCounts,
    Progress,
    RobotClock,
)
from sightfield.hardware_io.links.radio_commander import robot_reports
from sightfield.hardware_io.links.reporting_link import (
    DatagramLink,
    ReportingLink,
    What,
    _host_and_port,
)
from sightfield.hardware_io.links.robot_link import (
    LinkError,
    RobotFlag,
    RobotReport,
    RobotState,
    require_robots,
)
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.station.motion_checks import Chassis


def test_the_record_of_a_link_is_as_recorded(as_recorded):
    record, rng = LinkRecord((1, 2, 5)), np.random.default_rng(4)
    taken, lates, healths = dict.fromkeys((1, 2, 5), 65500), [], []
    for sequence in range(90):
        now = 0.05 * sequence
        robot = (None, 1, 2, 5, 9)[sequence % 5]
        record.note_sent(7, sequence, robot, now)
        for each in (1, 2, 5):
            taken[each] += int(rng.random() < 0.7) * (robot in (None, each))
            if rng.random() < 0.8 and not (each == 5 and sequence > 60):
                answered = sequence - int(rng.integers(0, 3))
                progress = Progress(
                    each, 7, answered, int(rng.integers(0, 60)), taken[each] % 65536
                )
                lates.append(record.note_progress(progress, now + rng.uniform(0.01, 0.2)))
        if sequence % 15 == 14:
            healths.append(record.health(now))
    as_recorded([healths, np.array(lates)])


def test_clocks_and_counts_are_as_recorded(as_recorded):
    rng, found = np.random.default_rng(6), []
    for settable in (False, True):
        clock, came = RobotClock(settable=settable), 0.0
        for k in range(120):
            came += rng.uniform(0.0, 0.4)
            step = 0.0 if k < 60 else -1.3 if k < 90 else 4.0
            found.append(clock.late(came, came - rng.uniform(0, 0.2) + step))
        found.append(clock.behind)
    as_recorded(np.array(found), "lateness")
    counts = OdometryCounts(Chassis(track_width=0.23, counts_per_metre=1234.0))
    poses = np.cumsum(rng.normal(0, [0.1, 0.1, 0.5], (40, 3)), axis=0)
    poses[20:] += [0.6, 0.0, 0.0]
    rows = []
    for k, pose in enumerate(poses.tolist()):
        if k == 30:
            counts.begin_anew()
        rows.append(counts.after(*pose))
    as_recorded(rows, "counts")


def test_a_way_of_half_a_metre_is_none_of_a_wheel():
    for way, counted in ((0.499, 499), (0.501, 0)):
        counts = OdometryCounts(Chassis(counts_per_metre=1000.0))
        counts.after(0.0, 0.0, 0.0)
        assert counts.after(way, 0.0, 0.0) == (counted, counted)


def report(state=RobotState.IDLE, **options):
    return RobotReport(time=3.0, state=state, **options)


def test_reports_fill_the_rows_of_their_robots():
    newest = {
        8: report(
            RobotState.DRIVING,
            flags=RobotFlag.SATURATED,
            counts=(5, -7),
            ranges=(0.1, 0.2, 0.3, 0.4),
            battery=7.2,
        )
    }
    found = robot_reports(newest, (3, 8), 3.25)
    assert found.infrared_ranges.tolist() == [[math.inf] * 4, [0.1, 0.2, 0.3, 0.4]]
    assert found.battery.tolist() == [0.0, 7.2]
    assert found.age.tolist() == [math.inf, 0.25]
    assert found.robot_state.tolist() == [-1.0, 2.0]
    assert found.robot_flags.tolist() == [0.0, 4.0]
    assert found.counts.tolist() == [[0, 0], [5, -7]]
    assert robot_reports(newest, (8,), 2.0).age.tolist() == [0.0]


class Team(ReportingLink):
    """Robots that show what they are told, some only when told so for the third time."""

    def __init__(self, robots=(3, 8), slow=(), deaf=()):
        super().__init__(robots, session=11)
        self.slow, self.deaf, self.told = slow, deaf, []

    def connect(self):
        """Nothing is opened."""

    def close(self):
        """Nothing is held."""

    def transmit(self, robot, order):
        self.told.append((robot, order.what.name, order.sequence, order.speed, order.turn_rate))
        times = sum(each[:2] == (robot, order.what.name) for each in self.told)
        if robot in self.deaf or (robot in self.slow and times < 3):
            return
        shown = {What.ARM: RobotState.IDLE, What.STOP: RobotState.STOPPED}.get(order.what)
        if shown is not None:
            self.heard(robot, report(shown), Progress(robot, 11, order.sequence, 0, times))


@pytest.fixture
def clock(monkeypatch):
    """A clock that goes on a little whenever somebody looks at it."""
    made = SimpleNamespace(now=5.0)

    def monotonic():
        made.now += 1e-4
        return made.now

    for module in (reporting_link, robot_link):
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=monotonic))
    return made


def test_a_team_is_armed_driven_and_stopped_as_recorded(clock, as_recorded):
    link = Team()
    said = []
    link.on_report = lambda: said.append(len(link.told))
    velocities = np.array([[0.3, -0.5], [0.1, 0.2]])
    link.send_commands(velocities)
    assert link.arm() == (3, 8)
    link.send_commands(velocities, np.array([True, False]), age=0.1)
    link.arm_again([8])
    assert link.stop() == (3, 8)
    link.arm_again([3])
    link.send_commands(velocities)
    link.heard(5, report())
    link.heard_nothing_of_use()
    as_recorded([link.told, said], "told")
    health = link.health()
    as_recorded([health.sent, health.acknowledged, health.lost, health.received, health.refused])


def test_who_does_not_answer_is_told_again():
    link = Team(slow=(8,))
    assert link.arm(timeout=60.0) == (3, 8)
    told = [each[0] for each in link.told]
    assert (told.count(3), told.count(8)) == (1, 3)
    health = link.health()
    assert (health.acknowledged, health.lost, health.retried) == (2, 0, 2)


def test_who_never_answers_is_counted_as_lost():
    link = Team(deaf=(5,), robots=(3, 5))
    assert link.stop(timeout=0.0) == (3,)
    health = link.health()
    assert (health.acknowledged, health.lost, health.retried) == (1, 1, 0)


def test_a_stop_is_said_every_20_and_an_arm_every_80_milliseconds_until_the_time_is_over(
    clock, pauses_of
):
    link = Team(deaf=(3, 8))
    link._changed = pauses_of(clock, digits=2)
    assert link.arm(timeout=0.195) == ()
    assert link._changed.pauses == [0.08, 0.08, 0.03]
    assert link.stop(timeout=0.055) == ()
    assert link._changed.pauses[3:] == [0.02, 0.02, 0.01]
    assert (len(link.told), link.health().retried, link.health().lost) == (12, 8, 4)
    with pytest.raises(InvalidInput, match="`timeout`"):
        link.arm(timeout=-0.01)


def test_a_report_from_before_the_order_is_no_answer():
    link = Team(deaf=(3,), robots=(3,))
    link.heard(3, report(RobotState.IDLE))
    assert link.arm(timeout=0.0) == ()

    def late(robot, order):
        # An answer to an earlier order of this session, then one of another session.
        link.heard(robot, report(RobotState.IDLE), Progress(robot, 11, order.sequence - 1, 0, 1))
        link.heard(robot, report(RobotState.IDLE), Progress(robot, 12, order.sequence, 0, 1))

    link.transmit = late
    assert link.arm(timeout=0.0) == ()


@pytest.mark.parametrize("address", ["a:1", "10.0.0.1:65535", "robot.lab:5005"])
def test_hosts_and_ports_are_told_apart(address):
    host, port = address.split(":")
    assert _host_and_port(address) == (host, int(port))


@pytest.mark.parametrize("address", ["a", ":5", "a:", "a:0", "a:65536", "a:-1", "a:x", "a:\u0663"])
def test_what_is_no_address_is_refused(address):
    with pytest.raises(InvalidInput, match=r"be like 192\.168\.1\.21:5005"):
        _host_and_port(address)


class Told(DatagramLink):
    """Sends its order's name, and nothing for a stop."""

    def encode(self, robot, order):
        return b"" if order.what == What.STOP else order.what.name.encode()

    def decode(self, robot, data):
        self.heard(robot, report())


def test_datagrams_go_to_their_robots_and_a_dead_way_is_told():
    link, sent = Told([3, 8], ["127.0.0.1:5001", "127.0.0.1:5002"]), []
    link._addresses = {3: ("127.0.0.1", 5001), 8: ("127.0.0.1", 5002)}
    link._socket = SimpleNamespace(sendto=lambda *words: sent.append(words))
    link.heartbeat()
    assert sent == [(b"HAIL", ("127.0.0.1", 5001)), (b"HAIL", ("127.0.0.1", 5002))]

    def refuse(error):
        def sendto(*_):
            raise OSError(error, "why")

        link._socket = SimpleNamespace(sendto=sendto)

    for busy in (11, 105, 4):
        refuse(busy)
        link.heartbeat()
    refuse(101)
    with pytest.raises(LinkError, match=r"no way to 127\.0\.0\.1:5001: why"):
        link.heartbeat()


@pytest.mark.parametrize(
    ("robots", "good"),
    [
        ([0, 254], True),
        ([255], False),
        ([-1], False),
        ([True], False),
        ([], False),
        ([4, 4], False),
    ],
)
def test_numbers_of_robots_have_these_limits(robots, good):
    if good:
        assert require_robots(robots) == tuple(robots)
    else:
        with pytest.raises(InvalidInput, match="`robots`"):
            require_robots(robots)
