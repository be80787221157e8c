"""Times of a path, against constant accelerations integrated by hand."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.paths.machine_path import MachinePath
from sightfield.systems.numerics.harvest.paths.timed_path import TimedPath

STRAIGHT = MachinePath(
    np.array([[1.0, 2.0, 0.5], [1.0 + 20 * np.cos(0.5), 2.0 + 20 * np.sin(0.5), 0.5]]),
    np.array([1]),
    np.array([True]),
    np.array([0]),
)
# From rest to 2 m/s in 4 s, 6 s at that, to rest in 4 s.
TIMED = TimedPath(
    STRAIGHT,
    np.array([3.0, 7.0, 13.0, 17.0]),
    np.array([0.0, 4.0, 16.0, 20.0]),
    np.array([0.0, 2.0, 2.0, 0.0]),
)


def test_stations_and_speeds_follow_the_accelerations():
    times = [0.0, 3.0, 5.0, 7.0, 10.0, 15.0, 17.0, 40.0]
    assert TIMED.station_at(times) == pytest.approx([0, 0, 1, 4, 10, 19, 20, 20])
    assert TIMED.speed_at(times) == pytest.approx([0, 0, 1, 2, 2, 1, 0, 0])
    assert TIMED.end == 17.0


def test_poses_lie_on_the_path():
    way = TIMED.station_at(9.0)
    expected = [1.0 + way * np.cos(0.5), 2.0 + way * np.sin(0.5), 0.5]
    assert TIMED.pose_at(9.0) == pytest.approx(expected)


def test_what_decreases_is_refused():
    with pytest.raises(InvalidInput, match="stations"):
        TimedPath(STRAIGHT, np.array([0.0, 1.0]), np.array([1.0, 0.0]), np.zeros(2))
    with pytest.raises(InvalidInput, match="times"):
        TimedPath(STRAIGHT, np.array([1.0, 0.0]), np.array([0.0, 1.0]), np.zeros(2))
