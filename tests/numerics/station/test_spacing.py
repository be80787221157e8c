"""Robots keep a distance from one another."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.station.spacing import spaced_commands
from sightfield.systems.numerics.tracking.mobile_agents import drive_step

SPACING, HORIZON = 0.3, 0.4
numbers = st.floats(-1, 1)


def test_two_that_drive_at_each_other_share_what_is_left():
    poses = np.array([[0.0, 0.0, 0.0], [0.38, 0.0, np.pi]])
    commands = np.array([[0.3, 1.0], [0.3, -1.0]])
    slowed = spaced_commands(commands, poses, SPACING, HORIZON)
    # 0.08 m in 0.4 s, half each; turn rates stay.
    assert slowed == pytest.approx(np.array([[0.1, 1.0], [0.1, -1.0]]))


def test_who_reverses_into_another_is_slowed_too():
    poses = np.array([[0.0, 0.0, np.pi], [0.38, 0.0, 0.0]])
    slowed = spaced_commands(np.array([[-0.3, 0.0], [0.3, 0.0]]), poses, SPACING, HORIZON)
    assert slowed[:, 0] == pytest.approx([-0.1, 0.3])


def test_robots_that_are_too_near_come_apart_and_no_nearer():
    poses = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0]])
    slowed = spaced_commands(np.array([[0.3, 0.0], [0.3, 0.0]]), poses, SPACING, HORIZON)
    assert slowed[:, 0].tolist() == [0.0, 0.3]


def test_who_passes_beside_is_free():
    poses = np.array([[0.0, 0.0, np.pi / 2], [0.31, 0.0, -np.pi / 2]])
    commands = np.array([[0.3, 0.0], [0.3, 0.0]])
    assert spaced_commands(commands, poses, SPACING, HORIZON) == pytest.approx(commands)


def test_two_on_one_spot_are_free():
    commands = np.array([[0.3, 0.0], [0.2, 0.0]])
    assert spaced_commands(commands, np.zeros((2, 3)), SPACING, HORIZON).tolist() == (
        commands.tolist()
    )


@given(st.lists(st.tuples(numbers, numbers, numbers, numbers), min_size=2, max_size=5))
def test_speeds_only_shrink_and_the_spacing_is_kept_step_by_step(robots):
    table = np.array(robots)
    count = len(table)
    # Apart at the start, in a row of neighbours 0.35 m from each other.
    poses = np.column_stack([0.35 * np.arange(count), 0.02 * table[:, 0], 3.14 * table[:, 1]])
    wished = np.column_stack([0.6 * table[:, 2], 3.0 * table[:, 3]])
    limits, period = np.array([0.6, 3.0]), 0.05
    for _ in range(20):
        slowed = spaced_commands(wished, poses, SPACING, HORIZON)
        assert (np.abs(slowed[:, 0]) <= np.abs(wished[:, 0]) + 1e-12).all()
        assert np.array_equal(slowed[:, 1], wished[:, 1])
        poses = drive_step(poses.ravel(), slowed.ravel(), limits, period).reshape(-1, 3)
        distances = np.hypot(*(poses[:, None, :2] - poses[None, :, :2]).transpose(2, 0, 1))
        # Of a curve within a step, the first order is looked at.
        assert distances[~np.eye(count, dtype=bool)].min() > SPACING - 0.02
