"""What a link makes of reports: how long frames take, and how many arrive.

What is late is known by the robot's clock, whatever that shows and whenever it was set.
"""

import math

import numpy as np
import pytest

from sightfield.hardware_io.links.link_record import (
    LinkRecord,
    OdometryCounts,
    Progress,
    RobotClock,
)
from sightfield.systems.numerics.station.motion_checks import Chassis, wheel_ways


def report(robot: int, sequence: int, taken: int, hold: int = 0, session: int = 1) -> Progress:
    return Progress(robot, session, sequence, hold, taken % 65536)


def test_a_link_without_reports_has_no_quality():
    statistics = LinkRecord((1, 2)).health(0.0)
    assert statistics.quality == (0.0, 0.0)
    assert statistics.round_trip is None


def test_quality_is_the_part_of_the_frames_that_were_taken():
    record = LinkRecord((1, 2))
    taken = 65_530
    for sequence in range(1, 101):
        time = 0.05 * sequence
        record.note_sent(1, sequence, None, time)
        # Robot 1 takes three of four; its count goes round meanwhile. Robot 2 is never heard.
        taken += sequence % 4 > 0
        if sequence % 4 == 0:
            record.note_progress(report(1, sequence, taken), time)
    assert record.health(5.0).quality == (0.75, 0.0)


def test_frames_to_one_robot_do_not_count_against_another():
    record = LinkRecord((1, 2))
    for sequence in range(1, 41):
        record.note_sent(1, sequence, 1 + sequence % 2, 0.01 * sequence)
        record.note_progress(report(1 + sequence % 2, sequence, sequence // 2), 0.01 * sequence)
    assert record.health(0.4).quality == pytest.approx((1.0, 1.0), abs=0.06)


def test_a_link_that_falls_silent_has_no_quality():
    record = LinkRecord((1,))
    for sequence in range(1, 21):
        record.note_sent(1, sequence, None, 0.05 * sequence)
        record.note_progress(report(1, sequence, sequence), 0.05 * sequence)
    assert record.health(1.9).quality == (1.0,)
    assert record.health(2.1).quality == (0.0,)


def test_the_time_that_a_robot_holds_an_answer_is_no_part_of_the_round_trip():
    record = LinkRecord((1,))
    record.note_sent(1, 7, None, 10.0)
    record.note_progress(report(1, 7, 1, hold=120), 10.15)
    assert record.health(10.2).round_trip == pytest.approx(0.03)


def test_reports_of_other_sessions_and_robots_tell_nothing():
    record = LinkRecord((1,))
    record.note_sent(1, 7, None, 10.0)
    record.note_progress(report(1, 7, 1, session=2), 10.1)
    record.note_progress(report(5, 7, 1), 10.1)
    assert record.health(10.2).round_trip is None


def test_only_the_latest_sendings_are_remembered():
    record = LinkRecord((1,))
    for sequence in range(2000):
        record.note_sent(1, sequence, None, 0.0)
    record.note_progress(report(1, 100, 1), 1.0)
    assert record.health(1.0).round_trip is None
    record.note_progress(report(1, 1999, 1), 1.0)
    assert record.health(1.0).round_trip == 1.0


def test_a_report_that_waited_is_as_late_as_its_round_trip_is_longer_than_usual():
    record = LinkRecord((1,))
    lates = []
    for sequence in range(1, 41):
        sent = 0.05 * sequence
        record.note_sent(1, sequence, None, sent)
        # The robot held it for 20 ms; trips take 60 ms, and once 180 ms.
        trip = 0.18 if sequence == 30 else 0.06
        lates.append(
            record.note_progress(report(1, sequence, sequence, hold=20), sent + 0.02 + trip)
        )
    assert lates[29] == pytest.approx(0.12 - 0.01)
    assert max(lates[:29] + lates[30:]) == 0.0
    # Of a frame that is unknown nothing can be said.
    assert record.note_progress(report(1, 999, 41), 9.0) == 0.0


def test_a_report_is_late_by_what_it_took_longer_than_the_fastest():
    clock = RobotClock()
    # Its clock is 1000 s ahead and a little fast; a message takes 20 ms at least.
    late = []
    for k in range(400):
        made, extra = 0.1 * k, 0.15 if k % 7 == 3 else 0.0
        late.append(clock.late(made + 0.02 + extra, 1000 + made * (1 + 2e-5)))
    # Over the window of 10 s the crystal gains 0.2 ms.
    assert late == pytest.approx([0.15 if k % 7 == 3 else 0.0 for k in range(400)], abs=3e-4)
    assert clock.behind == pytest.approx(-999.98, abs=2e-3)


def test_the_fastest_of_the_last_ten_seconds_counts_and_no_older_one():
    clock, rng = RobotClock(), np.random.default_rng(7)
    came = np.cumsum(rng.exponential(0.4, 300))
    behind = rng.exponential(0.1, 300) + 1e-3 * came
    for k in range(300):
        recent = behind[: k + 1][came[: k + 1] >= came[k] - 10.0]
        late = clock.late(came[k], came[k] - behind[k])
        assert late == pytest.approx(behind[k] - recent.min(), abs=1e-9)


def test_counts_are_those_of_the_wheels_ways():
    rng, chassis = np.random.default_rng(8), Chassis()
    steps = rng.normal(0.0, [0.03, 0.03, 0.4], (200, 3))
    # One that no wheels can have gone counts nothing, and neither does what is around the world.
    steps[50], steps[120] = (3.0, 0.0, 0.0), (0.01, 0.0, 2 * np.pi - 0.1)
    poses = np.cumsum(steps, axis=0)
    ways = wheel_ways(chassis, poses[:-1], poses[1:])
    ways = np.vstack([np.zeros(2), np.cumsum(np.where(np.abs(ways) < 0.5, ways, 0.0), axis=0)])
    counts = OdometryCounts(chassis)
    found = [counts.after(*pose) for pose in poses.tolist()]
    assert np.abs(np.array(found) - chassis.counts_per_metre * ways).max() <= 0.5 + 1e-6
    assert np.abs(ways).max() > 0.3


@pytest.mark.parametrize("step", [-3600.0, -2.0, 5.0])
def test_a_clock_that_is_set_begins_anew(step):
    clock = RobotClock(settable=True)
    for k in range(50):
        assert clock.late(0.1 * k, 0.1 * k) == pytest.approx(0.0, abs=1e-9)
    for k in range(50, 300):
        assert clock.late(0.1 * k, step + 0.1 * k) == pytest.approx(0.0, abs=1e-9)
    assert clock.late(30.3, step + 30.0) == pytest.approx(0.3)


def test_one_that_cannot_be_set_was_late_for_as_long_as_it_says():
    clock = RobotClock()
    clock.late(0.0, 0.0)
    assert clock.late(5.0, 2.0) == 3.0


def test_a_stamp_that_is_no_number_tells_nothing():
    clock = RobotClock()
    assert clock.late(1.0, math.nan) == 0.0
    assert clock.late(1.0, 0.5) == 0.0
