"""Paths of constant twists, against arcs in closed form."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.paths.machine_path import (
    TRANSIT,
    MachinePath,
    join_paths,
)


def arc_path(start, radius, turn, gear, pieces):
    """Along a circle, in a few pieces; a turn is to the left where it is positive."""
    share = np.linspace(0.0, 1.0, pieces + 1)
    theta = start[2] + turn * share
    side = np.sign(turn) * gear
    # The centre is to the left of the heading when the turn and the gear agree.
    centre = np.array(start[:2]) + side * radius * np.array([-np.sin(start[2]), np.cos(start[2])])
    points = centre + side * radius * np.column_stack([np.sin(theta), -np.cos(theta)])
    return MachinePath(
        np.column_stack([points, theta]),
        np.full(pieces, gear),
        np.ones(pieces, dtype=bool),
        np.full(pieces, 3),
    )


@pytest.mark.parametrize("gear", [1, -1])
@pytest.mark.parametrize("turn", [2.3, -1.1])
def test_a_few_poses_tell_the_whole_arc(gear, turn):
    start, radius = (3.0, -2.0, 0.7), 6.5
    coarse = arc_path(start, radius, turn, gear, 3)
    fine = arc_path(start, radius, turn, gear, 300)
    assert coarse.length == pytest.approx(radius * abs(turn), abs=1e-9)
    assert coarse.pose_at(np.linspace(0, coarse.length, 301)) == pytest.approx(fine.poses, abs=1e-9)
    assert np.abs(coarse.curvatures) == pytest.approx(1 / radius)


def test_stations_beyond_the_ends_are_clipped():
    path = arc_path((0.0, 0.0, 0.4), 4.0, 1.0, 1, 2)
    assert path.pose_at([-1.0, 99.0]) == pytest.approx(path.poses[[0, -1]])


def test_a_joined_path_turns_on_and_has_a_cusp_where_the_gear_changes():
    first = arc_path((0.0, 0.0, 0.4), 4.0, 1.0, 1, 2)
    x, y, theta = first.poses[-1]
    second = arc_path((x, y, theta + 2 * np.pi), 4.0, -0.5, -1, 2)
    both = join_paths([first, second])
    assert both.length == pytest.approx(first.length + second.length)
    assert both.cusps == pytest.approx([first.length])
    assert np.abs(np.diff(both.poses[:, 2])).max() < 0.6
    with pytest.raises(InvalidInput, match="begin where"):
        join_paths([second, second])


def test_a_single_pose_is_a_path_of_no_length():
    none = np.zeros(0, dtype=int)
    path = MachinePath(np.array([[1.0, 2.0, 0.3]]), none, none.astype(bool), none + TRANSIT)
    assert path.length == 0
    assert path.pose_at([0.0, 5.0]) == pytest.approx(np.array([[1.0, 2.0, 0.3]] * 2))


def test_paths_are_joined_across_a_single_pose():
    first = arc_path((0.0, 0.0, 0.0), 5.0, 1.0, 1, 3)
    end = first.poses[-1]
    none = np.zeros(0, dtype=int)
    stands = MachinePath(end[None], none, none.astype(bool), none)
    second = arc_path(end, 5.0, 1.0, 1, 3)
    joined = join_paths([first, stands, second])
    assert joined.length == pytest.approx(first.length + second.length)
    np.testing.assert_allclose(joined.poses[-1], second.poses[-1])


def test_evenly_spaced_stations_reach_both_ends():
    path = arc_path((0.0, 0.0, 0.4), 4.0, 1.3, 1, 2)
    at = path.stations_every(1.0)
    assert at[[0, -1]] == pytest.approx([0.0, path.length])
    assert np.diff(at).max() <= 1.0
