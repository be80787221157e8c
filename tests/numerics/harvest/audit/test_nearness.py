"""Least distances between samples: closed forms, and Shapely at many instants."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm, logm

from sightfield.systems.numerics.harvest.audit.crop import edges_of
from sightfield.systems.numerics.harvest.audit.motion import (
    moving_outline,
    polygons_at,
    poses_between,
)
from sightfield.systems.numerics.harvest.audit.nearness import (
    TOLERANCE,
    nearness,
    nearness_to_edges,
)


def box(length, width, ahead=0.0):
    """Corners of a box whose middle is ahead of its pose."""
    x, y = length / 2, width / 2
    return np.array([[ahead - x, -y], [ahead + x, -y], [ahead + x, y], [ahead - x, y]])


def moving(points, *poses):
    return moving_outline("it", points, np.array(poses, dtype=float))


def standing(points, *pose, samples=2):
    return moving(points, *[pose] * samples)


def test_boxes_that_pass_between_two_samples_are_seen_where_they_are_nearest():
    one = moving(box(4, 2, 0.7), (-30, 0, 0), (30, 0, 0))
    # Half a width of each and 0.4 m between; it meets the other's corners from 1/6 on.
    other = standing(box(3, 1.6), 5, 2.2, 0)
    found = nearness(one, other, 0.5)
    assert found.least == pytest.approx([0.4], abs=TOLERANCE)
    passing = (-30 + 60 * found.share[0] + 0.7) - 5
    assert abs(passing) <= 3.5 + 0.1
    # Farther apart than asked for, it is only known that they are not nearer.
    assert nearness(one, other, 0.3, best=0.3).least[0] >= 0.3


def test_boxes_that_pass_through_each_other_between_two_samples_overlap():
    one = moving(box(4, 2), (-300, 0.3, 0), (300, -0.2, 0))
    other = standing(box(0.05, 0.05), 11, 0, 0.5)
    assert nearness(one, other, 0.3).least == pytest.approx([0.0])


def test_a_corner_of_a_turning_header_comes_as_near_as_its_radius_says():
    header = box(2, 10)
    corner, angle = math.hypot(1, 5), math.atan2(5, 1)
    # A square that points at the header's middle, off the corner's circle, between both samples.
    direction = angle + 0.6
    gap = 0.27
    at = (corner + gap + math.sqrt(0.5)) * np.array([math.cos(direction), math.sin(direction)])
    square = standing(box(1, 1), *at, direction + math.pi / 4)
    turning = moving(header, (0, 0, 0.1), (0, 0, 1.2))
    assert nearness(turning, square, 1.0).least == pytest.approx([gap], abs=TOLERANCE)
    # At both samples it is farther away.
    ends = polygons_at(turning, np.array([0, 0]), np.array([0.0, 1.0]))
    there = polygons_at(square, np.array([0]), np.array([0.0]))[0]
    assert shapely.distance(ends, there).min() > gap + 0.3


def test_headings_turn_the_shorter_way_round():
    # From 170 to -170 degrees the box's nose sweeps by x = -6; the longer way it would be x = 6.
    nose = box(2, 0.5, 5.0)
    turning = moving(nose, (0, 0, math.radians(170)), (0, 0, math.radians(-170)))
    assert nearness(turning, standing(box(0.5, 0.5), -6.4, 0, 0), 1).least[0] < 0.16
    assert nearness(turning, standing(box(0.5, 0.5), 6.4, 0, 0), 1).least[0] > 1


def test_machines_on_one_circle_keep_their_distance_to_the_digit():
    def around(radius, angle):
        return radius * math.cos(angle), radius * math.sin(angle), angle + math.pi / 2

    samples = np.linspace(0.3, 2.4, 4)
    one = moving(box(5, 2, -1), *[around(20, a) for a in samples])
    other = moving(box(4, 3, 1), *[around(24, a) for a in samples])
    rest = shapely.distance(
        *(polygons_at(o, np.array([0]), np.array([0.0]))[0] for o in (one, other))
    )
    assert 0.5 < rest < 3
    assert nearness(one, other, 5.0).least == pytest.approx([rest] * 3, abs=1e-9)


def test_a_box_within_another_overlaps_it():
    inner = moving(box(1, 1), (0.5, 0, 0.1), (0.6, 0, 0.4))
    outer = standing(box(9, 8), 0, 0.3, 0.2)
    assert nearness(inner, outer, 0.3).least == pytest.approx([0.0])
    assert nearness(outer, inner, 0.3).least == pytest.approx([0.0])


def test_what_stands_in_the_notch_of_an_outline_is_as_far_as_its_sides():
    notched = np.array(
        [[0, 0], [6, 0], [6, 4], [4, 4], [4, 2], [2, 2], [2, 4], [0, 4]], dtype=float
    )
    small = standing(box(0.5, 0.5), 3 - 3, 3.2 - 2, 0)
    # The notch is 2 m wide; its bottom is at y = 2, its middle at x = 3.
    shifted = standing(notched - [3, 2], 0, 0, 0)
    assert nearness(shifted, small, 1.0).least == pytest.approx([0.75], abs=1e-9)


coordinate = st.floats(-9, 9)
heading = st.floats(-math.pi, math.pi)
pose = st.tuples(coordinate, coordinate, heading)
shape = st.tuples(st.floats(0.5, 8), st.floats(0.5, 6), st.floats(-4, 4))
SHARES = np.linspace(0, 1, 401)


@given(pose, pose, pose, pose, shape, shape)
def test_no_instant_is_nearer_than_what_is_found(a0, a1, b0, b1, one, other):
    a, b = moving(box(*one), a0, a1), moving(box(*other), b0, b1)
    found = nearness(a, b, 100.0)
    number = np.zeros(len(SHARES), dtype=int)
    brute = shapely.distance(polygons_at(a, number, SHARES), polygons_at(b, number, SHARES))
    assert found.least[0] <= brute.min() + TOLERANCE + 1e-9
    at = found.share[:1]
    there = shapely.distance(polygons_at(a, number[:1], at), polygons_at(b, number[:1], at))
    assert found.least[0] == pytest.approx(there[0], abs=1e-9)
    assert found.nearest == pytest.approx(min(brute.min(), found.least[0]), abs=TOLERANCE + 1e-9)


@given(pose, pose, st.floats(0.05, 0.95))
def test_poses_between_are_the_exponential_of_the_twist(begin, end, share):
    def matrix(x, y, theta):
        c, s = math.cos(theta), math.sin(theta)
        return np.array([[c, -s, x], [s, c, y], [0, 0, 1]])

    turn = (end[2] - begin[2] + math.pi) % (2 * math.pi) - math.pi
    if abs(abs(turn) - math.pi) < 0.01:
        # Both ways round are as short.
        return
    step = logm(np.linalg.inv(matrix(*begin)) @ matrix(*end)).real
    expected = matrix(*begin) @ expm(share * step)
    poses = np.array([begin, (*end[:2], begin[2] + turn)])
    found = poses_between(poses, np.array([0]), np.array([share]))[0]
    assert matrix(*found) == pytest.approx(expected, abs=1e-6)


# A pond with a bay.
POND = shapely.Polygon([(0, 0), (8, 0), (8, 6), (5, 6), (4, 2), (3, 6), (0, 6)])
FIELD = shapely.Polygon([(-12, -12), (12, -12), (12, 12), (2, 12), (0, 9), (-2, 12), (-12, 12)])


@given(pose, pose, shape)
def test_no_instant_is_nearer_to_an_obstacle_than_what_is_found(begin, end, size):
    one = moving(box(*size), begin, end)
    found = nearness_to_edges(one, edges_of(POND), inside=True, asked=50.0)
    brute = shapely.distance(polygons_at(one, np.zeros(len(SHARES), dtype=int), SHARES), POND)
    assert found.least[0] <= brute.min() + TOLERANCE + 1e-9
    there = polygons_at(one, np.array([0]), found.share[:1])[0]
    assert found.least[0] == pytest.approx(shapely.distance(there, POND), abs=1e-9)


def test_a_log_that_jumps_over_a_pond_says_for_one_interval_that_it_was_there():
    # Where it lands afterwards no edge is near.
    one = moving(box(0.3, 0.2), (-40, 3, 0), (1.5, 3, 0), (60, 3, 0), (61, 3, 0), (62, 3, 0))
    found = nearness_to_edges(one, edges_of(POND), inside=True, asked=5.0)
    assert (found.least == 0.0).tolist() == [True, True, False, False]


@given(pose, pose, shape)
def test_whoever_leaves_the_field_at_some_instant_is_seen(begin, end, size):
    one = moving(box(*size), begin, end)
    found = nearness_to_edges(one, edges_of(FIELD), inside=False, asked=50.0)
    polygons = polygons_at(one, np.zeros(len(SHARES), dtype=int), SHARES)
    outside = ~shapely.contains_properly(FIELD, polygons)
    brute = np.where(outside, 0.0, shapely.distance(polygons, FIELD.exterior))
    assert found.least[0] <= brute.min() + TOLERANCE + 1e-9
    if found.least[0] > TOLERANCE:
        assert not outside.any()
    else:
        there = polygons_at(one, np.array([0]), found.share[:1])[0]
        assert not shapely.contains_properly(FIELD.buffer(-2 * TOLERANCE), there)


def test_a_pole_under_a_machine_is_touched():
    pole = shapely.box(2.0, 0.1, 2.1, 0.2)
    over = moving(box(9, 4), (0, 0, 0), (0.3, 0, 0.2))
    assert nearness_to_edges(over, edges_of(pole), inside=True).least == pytest.approx([0.0])


def test_a_machine_that_stays_outside_is_outside_all_the_time():
    far = moving(box(4, 2), (40, 0, 0), (41, 0, 0), (42, 0.1, 0), (43, 0, 0))
    found = nearness_to_edges(far, edges_of(FIELD), inside=False, best=0.0)
    assert found.least == pytest.approx([0.0] * 3)
