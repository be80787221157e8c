"""What is late is known by the robot's clock, whatever that shows and whenever it was set."""

import math

import pytest

from sightfield.hardware_io.links.robot_clock import RobotClock


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
