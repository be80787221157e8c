"""Robots that follow a velocity meant for a point, and steps of their motion."""

import numpy as np
import pytest

from sightfield.systems.numerics.tracking.mobile_agents import (
    clip_symmetric,
    drive_step,
    heading_command,
    heading_commands,
    limit_speed,
    point_step,
    unicycle_step,
)

# Positions and headings with nothing at zero, and turns both ways, forwards and backwards.
POSES = np.array([[0.5, -1.0, 0.4], [-2.0, 3.0, 2.5], [1.0, 1.0, -1.9], [0.2, 0.1, 5.0]])
COMMANDS = np.array([[0.7, 1.3], [0.4, -2.1], [-0.6, 0.9], [-0.3, -1.6]])


def arc(poses, commands, time):
    """Where unicycles get to on the circles that constant commands drive them along."""
    (x, y, heading), (speed, turn_rate) = poses.T, commands.T
    later, radius = heading + turn_rate * time, speed / turn_rate
    x = x + radius * (np.sin(later) - np.sin(heading))
    y = y - radius * (np.cos(later) - np.cos(heading))
    return np.column_stack([x, y, later])


def directions(angles):
    return np.column_stack([np.cos(angles), np.sin(angles)])


def test_steps_of_a_unicycle_come_to_its_circle_with_the_square_of_the_step():
    errors = []
    for count in (20, 40, 80):
        poses = POSES
        for _ in range(count):
            poses = unicycle_step(poses, COMMANDS, 1.5 / count)
        errors.append(np.abs(poses - arc(POSES, COMMANDS, 1.5))[:, :2].max(axis=1))
    np.testing.assert_allclose(np.log2(errors[:-1] / np.array(errors[1:])), 2.0, atol=0.01)


def test_one_step_leads_along_the_chord_of_the_circle():
    moved = (unicycle_step(POSES, COMMANDS, 0.5) - POSES)[:, :2]
    chord = (arc(POSES, COMMANDS, 0.5) - POSES)[:, :2]
    across = moved[:, 0] * chord[:, 1] - moved[:, 1] * chord[:, 0]
    np.testing.assert_allclose(across, 0.0, atol=1e-15)
    assert (np.sum(moved * chord, axis=1) > 0.0).all()
    # As long as the arc, which is longer than its chord.
    np.testing.assert_allclose(np.hypot(*moved.T), 0.5 * np.abs(COMMANDS[:, 0]))


def test_a_robot_that_goes_straight_goes_as_far_as_its_speed_takes_it():
    straight = COMMANDS * [1.0, 0.0]
    moved = unicycle_step(POSES, straight, 0.5) - POSES
    np.testing.assert_allclose(moved[:, :2], 0.5 * straight[:, :1] * directions(POSES[:, 2]))
    np.testing.assert_array_equal(moved[:, 2], 0.0)


def test_a_drive_asked_for_too_much_gives_its_most_each_way():
    asked = np.array([[3.0, 0.5], [-3.0, -9.0], [0.1, 9.0], [0.2, -0.3]])
    given = np.array([[0.6, 0.5], [-0.6, -2.0], [0.1, 2.0], [0.2, -0.3]])
    moved = drive_step(POSES.ravel(), asked.ravel(), np.array([0.6, 2.0]), 0.1)
    np.testing.assert_allclose(moved, unicycle_step(POSES, given, 0.1).ravel())
    np.testing.assert_allclose(clip_symmetric(asked, np.array([0.6, 2.0])), given)


@pytest.mark.parametrize("speed", [0.01, 0.3, 0.5, 0.7, 40.0])
def test_points_keep_their_direction_and_their_top_speed(speed):
    angles = np.linspace(-3.0, 3.0, 9)
    wanted = speed * directions(angles)
    moving = min(speed, 0.5) * directions(angles)
    np.testing.assert_allclose(limit_speed(wanted, 0.5), moving)
    start = np.arange(18.0)
    np.testing.assert_allclose(
        point_step(start, wanted.ravel(), 0.5, 0.2), start + 0.2 * moving.ravel()
    )


# Angles from heading to velocity: ahead, to either side, and behind.
ERRORS = np.array([0.0, 0.3, 1.2, 2.0, 3.0, -0.3, -1.2, -2.0, -3.0])
# A heading for each, some more than a turn away.
HEADINGS = np.linspace(-7.0, 7.0, len(ERRORS))


def test_a_robot_drives_by_the_part_of_the_velocity_along_it_and_turns_towards_it():
    speed, turn_rate = heading_command(HEADINGS, 0.8 * directions(HEADINGS + ERRORS), 3.0).T
    np.testing.assert_allclose(speed, 0.8 * np.cos(ERRORS))
    np.testing.assert_allclose(turn_rate, 3.0 * ERRORS, atol=1e-12)


def test_a_robot_across_its_velocity_turns_on_the_spot():
    commands = heading_command(HEADINGS, 0.8 * directions(HEADINGS + np.pi / 2), 3.0)
    np.testing.assert_allclose(commands, [[0.0, 1.5 * np.pi]] * len(HEADINGS), atol=1e-12)


def test_commands_of_a_team_are_those_of_its_members():
    poses = np.column_stack([HEADINGS + 1.0, HEADINGS - 2.0, HEADINGS])
    wanted = 0.8 * directions(HEADINGS + ERRORS)
    team = heading_commands(poses.ravel(), wanted.ravel(), 3.0)
    np.testing.assert_array_equal(team, heading_command(HEADINGS, wanted, 3.0).ravel())


def test_the_heading_error_halves_in_the_same_time_wherever_it_starts():
    # omega = gain * error makes the error decay as exp(-gain t), and the robot faces its way.
    poses = np.column_stack([HEADINGS, HEADINGS, HEADINGS])
    wanted = 0.8 * directions(HEADINGS + ERRORS)
    step = 1e-4
    for _ in range(round(np.log(2.0) / 3.0 / step)):
        poses = unicycle_step(poses, heading_command(poses[:, 2], wanted, 3.0), step)
    np.testing.assert_allclose(poses[:, 2], HEADINGS + ERRORS / 2.0, atol=1e-3)
