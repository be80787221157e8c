"""Steps are cut short before robots and walls: closed forms, and wheels that get along a wall."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.world import make_world, shrink_world
from sightfield.systems.numerics.tracking.collision_stop import (
    clear_parts,
    half_gap_part,
    stop_at_robots,
    stop_at_walls,
)
from sightfield.systems.numerics.tracking.mobile_agents import drive_step, heading_commands

PERIOD = 0.05

# Gaps are kept by a little more than nothing: a part of the radii's sum.
NEARLY = 1e-5


def flat(values):
    return np.ravel(np.array(values, dtype=float))


def parts_of(positions, steps, radii, others=(), other_radii=(), first=None, rank=0, near=0.0):
    first = np.zeros(len(radii), dtype=bool) if first is None else np.array(first, dtype=bool)
    return clear_parts(
        flat(positions),
        flat(steps),
        flat(radii),
        flat(others),
        flat(other_radii),
        first,
        rank,
        near,
    ).tolist()


class TestHalfOfAGap:
    def test_two_that_drive_at_each_other_share_the_gap(self):
        # 1 m apart, bodies of 0.15 and 0.25 m: 0.3 m each of the 0.8 m that they want.
        parts = parts_of([[0, 0], [1, 0]], [[0.8, 0], [-0.8, 0]], [0.15, 0.25])
        assert parts == pytest.approx([0.375, 0.375], rel=NEARLY)

    def test_one_that_drives_at_a_stranger_uses_half_of_the_gap_whatever_the_stranger_does(self):
        parts = parts_of([[0, 0]], [[0.8, 0]], [0.15], [[1, 0]], [0.25])
        assert parts == pytest.approx([0.375], rel=NEARLY)

    def test_only_what_leads_nearer_counts(self):
        # Of a step at 60 degrees to the line between the two, half leads nearer.
        step = [0.8 * math.cos(math.pi / 3), 0.8 * math.sin(math.pi / 3)]
        assert parts_of([[0, 0], [1, 0]], [step, [0, 0]], [0.2, 0.2]) == (
            pytest.approx([0.75, 1.0], rel=NEARLY)
        )

    def test_one_that_passes_beside_is_free(self):
        assert parts_of([[0, 0], [0.41, 0]], [[0, 5], [0, -5]], [0.2, 0.2]) == [1.0, 1.0]

    def test_one_that_leaves_is_free(self):
        assert parts_of([[0, 0], [0.41, 0]], [[-5, 1], [5, 1]], [0.2, 0.2]) == [1.0, 1.0]

    def test_robots_that_overlap_come_apart_and_no_nearer(self):
        both_east = parts_of([[0, 0], [0.3, 0]], [[0.1, 0], [0.1, 0]], [0.2, 0.2])
        assert both_east == [0.0, 1.0]

    def test_two_on_one_spot_are_free(self):
        assert parts_of([[1, 1], [1, 1]], [[0.3, 0], [0.1, 0.1]], [0.2, 0.2]) == [1.0, 1.0]

    def test_in_a_small_gap_who_has_the_right_of_way_uses_all_of_it_and_who_yields_none(self):
        # Gaps of 0.2 m.
        spots, steps, radii = [[0, 0], [1.2, 0]], [[0.5, 0], [-0.5, 0]], [0.5, 0.5]
        ranked = {"first": [True, False], "near": 0.3}
        assert parts_of(spots, steps, radii, **ranked) == pytest.approx([0.4, 0.0], abs=1e-5)
        assert parts_of(spots, steps, radii, first=[True, False], near=0.1) == pytest.approx(
            [0.2, 0.2], abs=1e-5
        )
        assert parts_of(spots, steps, radii, first=[True, True], near=0.3) == pytest.approx(
            [0.2, 0.2], abs=1e-5
        )
        alone = spots[:1], steps[:1], radii[:1], spots[1:], radii[1:]
        for rank, part in ((1, 0.4), (0, 0.2), (-1, 0.0)):
            assert parts_of(*alone, rank=rank, near=0.3) == pytest.approx([part], abs=1e-5)

    def test_points_without_bodies_are_free(self):
        assert parts_of([[0, 0], [0.1, 0]], [[1, 0], [-1, 0]], [0.0, 0.0]) == [1.0, 1.0]
        assert half_gap_part(0.0, 0.0, 1.0, 0.0, 0.1, 0.0, 0.0, 0, 0.0) == 1.0

    def test_the_nearest_in_the_way_decides(self):
        three = [[0, 0], [3, 0], [2, 0]]
        parts = parts_of(three, [[4, 0], [0, 0], [0, 0]], [0.1, 0.1, 0.1], [[0, 1]], [0.1])
        assert parts == pytest.approx([0.9 / 4, 1.0, 1.0], rel=NEARLY)


SPACING, HORIZON = 0.3, 0.4
LIMITS = np.array([0.6, 3.0])


def slowed(poses, commands, others=(), other_radii=(), radii=None):
    poses = np.array(poses, dtype=float)
    radii = np.full(len(poses), 0.5 * SPACING) if radii is None else flat(radii)
    return stop_at_robots(
        poses.ravel(),
        flat(commands),
        LIMITS,
        PERIOD,
        HORIZON,
        radii,
        flat(others),
        flat(other_radii),
        np.zeros(len(poses), dtype=bool),
        0,
        0.0,
    ).reshape(-1, 2)


class TestUnicycles:
    def test_two_that_drive_at_each_other_share_what_is_left(self):
        poses = [[0.0, 0.0, 0.0], [0.38, 0.0, np.pi]]
        # 0.08 m in 0.4 s, half each, along the mean heading of the step; turn rates stay.
        speed = 0.1 / math.cos(0.5 * PERIOD)
        assert slowed(poses, [[0.3, 1.0], [0.3, -1.0]]) == (
            pytest.approx(np.array([[speed, 1.0], [speed, -1.0]]), rel=NEARLY)
        )

    def test_who_reverses_into_another_is_slowed_too(self):
        poses = [[0.0, 0.0, np.pi], [0.38, 0.0, 0.0]]
        assert slowed(poses, [[-0.3, 0.0], [0.3, 0.0]])[:, 0] == (
            pytest.approx([-0.1, 0.3], rel=NEARLY)
        )

    def test_robots_of_other_teams_count_with_their_own_radii(self):
        alone = slowed([[0, 0, 0]], [[0.3, 0.0]], [[0.38, 0.0]], [0.10])
        assert alone[0, 0] == pytest.approx(0.5 * (0.38 - 0.25) / HORIZON, rel=NEARLY)

    def test_robots_that_are_too_near_come_apart_and_no_nearer(self):
        poses = [[0.0, 0.0, 0.0], [0.2, 0.0, 0.0]]
        assert slowed(poses, [[0.3, 0.0], [0.3, 0.0]])[:, 0] == pytest.approx([0.0, 0.3])

    def test_who_passes_beside_is_free(self):
        poses = [[0.0, 0.0, np.pi / 2], [0.31, 0.0, -np.pi / 2]]
        commands = np.array([[0.3, 0.0], [0.3, 0.0]])
        assert slowed(poses, commands) == pytest.approx(commands)

    def test_two_on_one_spot_are_free(self):
        commands = [[0.3, 0.0], [0.2, 0.0]]
        assert slowed(np.zeros((2, 3)), commands) == pytest.approx(np.array(commands))

    @given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 5), strangers=st.integers(0, 2))
    def test_speeds_only_shrink_and_bodies_stay_apart_between_samples_too(
        self, least_distances, seed, count, strangers
    ):
        rng = np.random.default_rng(seed)
        radii, other_radii = rng.uniform(0.0, 0.16, count), rng.uniform(0.0, 0.16, strangers)
        # Apart at the start, in a row of neighbours 0.35 m from each other.
        row = np.column_stack([0.35 * np.arange(8), rng.uniform(-0.02, 0.02, 8)])
        rng.shuffle(row)
        poses = np.column_stack([row[:count], rng.uniform(-np.pi, np.pi, count)])
        others = row[count : count + strangers]
        all_radii = np.concatenate([radii, other_radii])
        for _ in range(20):
            wished = rng.uniform(-1, 1, (count, 2)) * [1.2, 6.0]
            safe = slowed(poses, wished, others, other_radii, radii)
            assert (np.abs(safe[:, 0]) <= np.minimum(np.abs(wished[:, 0]), LIMITS[0]) + 1e-15).all()
            assert safe[:, 1] == pytest.approx(np.clip(wished[:, 1], -LIMITS[1], LIMITS[1]))
            after = drive_step(poses.ravel(), safe.ravel(), LIMITS, PERIOD).reshape(-1, 3)
            spots = np.concatenate([poses[:, :2], others])
            steps = np.concatenate([after[:, :2] - poses[:, :2], np.zeros((strangers, 2))])
            for (i, j), distance in least_distances(spots, steps).items():
                assert distance >= all_radii[i] + all_radii[j]
            poses = after

    def test_a_robot_stops_before_a_wall_and_may_turn(self):
        world = make_world([[0, 0], [4, 0], [4, 4], [0, 4]])
        index = build_edge_index(*shrink_world(world, 0.2))
        poses = flat([[0.201, 2.0, np.pi], [2.0, 2.0, 0.0]])
        safe = stop_at_walls(*index, poses, flat([[0.6, 1.0], [0.6, 1.0]]), LIMITS, PERIOD)
        assert safe[0] == pytest.approx(0.001 / PERIOD, rel=0.01)
        assert safe[1:].tolist() == [1.0, 0.6, 1.0]


ROOM = shrink_world(make_world([[0, 0], [4, 0], [4, 4], [0, 4]]), 0.2)

# Where the skin of the wall y = 0 begins, and the turn rates of robots that are on it.
ON_THE_WALL, GAIN = 0.2 + 1e-7, 4.0


def stopped(poses, commands):
    index = build_edge_index(*ROOM)
    return stop_at_walls(*index, flat(poses), flat(commands), LIMITS, PERIOD).reshape(-1, 2)


class TestUnicyclesAtAWall:
    @pytest.mark.parametrize("error", [1e-8, 1e-3, 0.05])
    @pytest.mark.parametrize("speed", [0.3, -0.3])
    @pytest.mark.parametrize("left", [1.0, -1.0])
    def test_one_that_is_nearly_along_the_wall_turns_as_far_and_goes_on(self, error, speed, left):
        # The wall is below; the robot heads or reverses towards it, and turns away from it.
        along = 0.0 if left > 0.0 else np.pi
        heading = along - left * error * np.sign(speed)
        pose = np.array([2.0, ON_THE_WALL, heading])
        rate = left * np.sign(speed) * GAIN * error
        safe = stopped(pose, [speed, rate])[0]
        assert safe[0] == pytest.approx(speed)
        after = drive_step(pose, safe, LIMITS, PERIOD)
        assert after[1] == pytest.approx(pose[1], abs=1e-12)

    def test_one_that_turns_towards_the_wall_stops_before_it_and_keeps_its_turn_rate(self):
        assert stopped([2.0, ON_THE_WALL, -0.01], [0.3, -1.0])[0] == pytest.approx(
            [0.0, -1.0], abs=1e-4
        )

    def test_one_that_cannot_turn_so_far_in_a_step_stops_and_keeps_its_turn_rate(self):
        # At 3 rad/s the mean heading of a step of 0.05 s is 0.075 rad on.
        assert stopped([2.0, ON_THE_WALL, -0.08], [0.3, 0.32])[0] == pytest.approx(
            [0.0, 0.32], abs=1e-4
        )

    @pytest.mark.parametrize("mirrored", [1.0, -1.0])
    def test_one_that_faces_the_wall_and_is_to_follow_it_does_so_within_a_second(self, mirrored):
        pose = np.array([2.0, ON_THE_WALL, -0.5 * np.pi + mirrored])
        velocity = np.array([0.3 * mirrored, 0.0])
        for _ in range(round(2.0 / PERIOD)):
            command = heading_commands(pose, velocity, GAIN)
            pose = drive_step(pose, stopped(pose, command).ravel(), LIMITS, PERIOD)
            assert pose[1] >= 0.2
        # It stands for a second at most, and has drifted off the wall by a little.
        assert (pose[0] - 2.0) * mirrored > 0.3
        assert pose[1] < 0.21
