"""Combines that would meet give way to the one whose loop is begun first."""

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.field.combine_path import CombinePath
from sightfield.systems.numerics.harvest.field.pace.right_of_way import find_crossings
from sightfield.systems.numerics.harvest.field.pace.timeline import run_timeline

HEADER, LENGTH, STEP = 9.0, 8.0, 2.0


def straight(begin, heading, loop):
    """A path of 200 m on a loop, of which the first half leads to it if it is not the first."""
    stations = np.linspace(0.0, 200.0, 101)
    course = np.array([np.cos(heading), np.sin(heading)])
    loops = np.full(100, loop)
    loops[:50] = loop if loop == 0 else -1
    return CombinePath(
        stations,
        np.array(begin) + stations[:, None] * course,
        np.full(101, heading),
        np.ones(100, dtype=int),
        np.zeros(100),
        loops,
        0.0,
    )


def least_apart(paths, timeline):
    """Least distance of the middles of two combines' headers over time."""
    one, other = (path.pose_at(timeline.progress[:, n]) for n, path in enumerate(paths))
    return np.hypot(*(one - other)[:, :2].T).min()


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_of_two_that_would_meet_the_one_with_the_later_loop_waits(order):
    paths = [straight((-100.0, 0.0), 0.0, order[0]), straight((0.0, -100.0), np.pi / 2, order[1])]
    lengths, delays = [200.0, 200.0], np.zeros(2)
    blind = run_timeline(lengths, delays, (), STEP)
    assert least_apart(paths, blind) < STEP
    holds = find_crossings(paths, blind, HEADER, LENGTH)
    assert {hold.waiting for hold in holds} == {order.index(1)}
    careful = run_timeline(lengths, delays, holds, STEP)
    assert least_apart(paths, careful) > HEADER / 2
    assert careful.waits[order.index(0)] == 0.0
    assert careful.waits[order.index(1)] > 0.0


def test_who_passes_long_before_is_not_waited_for():
    paths = [straight((-20.0, 0.0), 0.0, 0), straight((0.0, -190.0), np.pi / 2, 1)]
    timeline = run_timeline([200.0, 200.0], np.zeros(2), (), STEP)
    assert find_crossings(paths, timeline, HEADER, LENGTH) == ()
