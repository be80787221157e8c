"""Work station, digi-xbee, pty, emulated air, UART, firmware and wheels in one closed loop."""

import time
from contextlib import contextmanager

import numpy as np
import pytest

from sightfield.hardware_io.emulation.laboratory import EmulatedLaboratory
from sightfield.hardware_io.kinds.xbee_link import RadioLink
from sightfield.hardware_io.links.robot_link import RobotState
from sightfield.systems.numerics.errors import InvalidInput, SightfieldError
from sightfield.systems.numerics.geometry.world import make_world

pytestmark = pytest.mark.usefixtures("emulator")

ROBOTS = (4, 7)


@contextmanager
def laboratory(robots=ROBOTS, unicast=False, **options):
    """A laboratory and a link to its robots, which are armed."""
    starts = np.column_stack([np.zeros(len(robots)), np.arange(len(robots)), np.zeros(len(robots))])
    with (
        EmulatedLaboratory(robots, starts, **options) as lab,
        RadioLink(lab.radio_port, robots, unicast=unicast) as link,
    ):
        assert link.arm(timeout=10) == robots
        yield lab, link


def keep_sending(link, velocities, until, patience=20.0):
    """Send at 20 Hz until a condition holds."""
    end = time.monotonic() + patience
    while not until():
        assert time.monotonic() < end, "it did not happen"
        link.send_commands(velocities() if callable(velocities) else np.asarray(velocities))
        time.sleep(0.05)


def wait_for(condition, patience=20.0):
    end = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.01)


@pytest.mark.parametrize("unicast", [False, True])
def test_robots_do_what_they_are_told_and_report_it(unicast):
    with laboratory(unicast=unicast) as (lab, link):
        keep_sending(link, [[0.3, 0.0], [0.0, 2.0]], lambda: lab.poses()[1, 2] > 1.5)
        poses = lab.poses()
        assert poses[0, 0] > 0.1
        assert poses[0, 2] == pytest.approx(0, abs=0.02)
        assert poses[1, :2] == pytest.approx([0, 1], abs=0.02)
        reports = link.telemetry()
        assert set(reports) == set(ROBOTS)
        assert reports[4].state == RobotState.DRIVING
        statistics = link.health()
        assert statistics.rssi == -48
        assert statistics.refused == 0
        assert statistics.round_trip is not None


def test_with_a_tenth_lost_and_50_ms_of_delay_robots_are_still_steered_to_a_place():
    places = np.array([[0.5, 0.3], [-0.3, 0.9]])

    with laboratory(frame_loss=0.1, delay=0.05, jitter=0.01, seed=1) as (lab, link):

        def to_place():
            poses = lab.poses()
            to_go = places - poses[:, :2]
            error = np.arctan2(to_go[:, 1], to_go[:, 0]) - poses[:, 2]
            error = np.arctan2(np.sin(error), np.cos(error))
            distance = np.hypot(*to_go.T)
            return np.column_stack([0.3 * np.cos(error).clip(0) * (distance > 0.03), 2 * error])

        def there():
            return (np.hypot(*(places - lab.poses()[:, :2]).T) < 0.05).all()

        keep_sending(link, to_place, there)


def test_when_the_radio_is_cut_every_robot_stands_within_300_ms():
    with laboratory((1, 2, 3, 4)) as (lab, link):
        speeds = [[0.3, 0.0], [0.5, 0.5], [-0.3, 0.0], [0.0, 3.0]]
        keep_sending(link, speeds, lambda: (np.abs(lab.wheel_speeds()).max(axis=1) > 0.15).all())
        cut = lab.cut_radio()
        # The station goes on; nobody hears it.
        keep_sending(link, speeds, lambda: np.isfinite(lab.snapshot().still_since).all())
        still = lab.snapshot().still_since - cut
        assert (still < 0.3).all()
        assert (still > 0).all()

        lab.restore_radio()
        keep_sending(link, speeds, lambda: (np.abs(lab.wheel_speeds()).max(axis=1) > 0.15).all())


def test_an_emergency_stop_holds_against_commands_until_the_robots_are_armed():
    with laboratory() as (lab, link):
        ahead = np.array([[0.3, 0.0], [0.3, 0.0]])
        keep_sending(link, ahead, lambda: (lab.wheel_speeds() > 0.2).all())
        assert link.stop(timeout=10) == ROBOTS
        stopped = lab.time()
        keep_sending(link, ahead, lambda: lab.time() > stopped + 0.6)
        assert (lab.snapshot().still_since < stopped + 0.3).all()
        assert link.arm(timeout=10) == ROBOTS
        keep_sending(link, ahead, lambda: (lab.wheel_speeds() > 0.2).all())


def test_a_robot_whose_command_is_not_valid_stands_still():
    with laboratory() as (lab, link):
        velocities, valid = np.array([[0.3, 0.0], [np.nan, 0.0]]), np.array([True, False])

        def driven():
            link.send_commands(velocities, valid)
            time.sleep(0.04)
            return lab.poses()[0, 0] > 0.2

        wait_for(driven)
        assert (lab.poses()[1] == [0, 1, 0]).all()


def test_leaving_the_link_stops_the_robots():
    starts = np.zeros((1, 3))
    with EmulatedLaboratory([1], starts) as lab:
        with RadioLink(lab.radio_port, [1]) as link:
            assert link.arm(timeout=10) == (1,)
            keep_sending(link, [[0.3, 0.0]], lambda: (lab.wheel_speeds() > 0.2).all())
        wait_for(lambda: np.isfinite(lab.snapshot().still_since).all())
        # A second station takes over.
        with RadioLink(lab.radio_port, [1]) as link:
            assert link.arm(timeout=10) == (1,)
            keep_sending(link, [[0.3, 0.0]], lambda: (lab.wheel_speeds() > 0.2).all())


def test_walls_are_felt_by_the_sensors():
    room = make_world([[-1, -1], [0.3, -1], [0.3, 2], [-1, 2]], [])
    with laboratory((4,), world=room) as (_, link):

        def ranges():
            report = link.telemetry().get(4)
            return None if report is None else np.array(report.ranges)

        # The two in front feel the wall straight ahead, those at the sides where their cones,
        # from 50 degrees on, begin to see it; all from the rim.
        side = 0.3 / np.cos(np.radians(50)) - 0.1
        felt = pytest.approx([side, 0.2, 0.2, side], abs=0.02)
        wait_for(lambda: ranges() is not None and ranges() == felt)


def test_ranges_can_be_set_where_there_are_no_walls():
    with laboratory((4,)) as (lab, link):
        lab.set_infrared(np.array([[0.1, 0.2, 0.3, 0.05]]))
        wait_for(
            lambda: (
                4 in link.telemetry()
                and link.telemetry()[4].ranges == pytest.approx((0.1, 0.2, 0.3, 0.05), abs=0.01)
            )
        )
        with pytest.raises(InvalidInput, match=r"`ranges` must have shape \(1, 4\)"):
            lab.set_infrared(np.zeros((2, 4)))


def test_a_laboratory_that_is_closed_says_so():
    lab = EmulatedLaboratory([1], np.zeros((1, 3)))
    with pytest.raises(SightfieldError, match="closed"):
        lab.snapshot()
