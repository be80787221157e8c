"""Signed margins of corners: the corner game's own where edges are long, and no jump anywhere."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import build_corner_index
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.corner_game import corner_table, margins, to_corner_frame
from sightfield.systems.numerics.tracking.lookahead import least_threat, signed_margin
from sightfield.systems.numerics.tracking.sight_state import observe, split_sight

RATIO = 0.3
ROOM = [[-9, -9], [9, -9], [9, 9], [-9, 9]]

seeds = st.integers(0, 2**32 - 1)
angles = st.floats(0.3, math.pi - 0.3)


def wedge(alpha, length=100.0, other=None, heading=0.0):
    """An obstacle with one corner at the origin: edge A along the negative x axis, then turned."""
    other = length if other is None else other
    b = [other * math.cos(alpha - math.pi), other * math.sin(alpha - math.pi)]
    c, s = math.cos(heading), math.sin(heading)
    points = np.array([[0.0, 0.0], [-length, 0.0], b]) @ np.array([[c, s], [-s, c]])
    corner = np.array([[0.0, 0.0, heading, alpha, length, other]])
    return shapely.Polygon(points), corner


def free_points(rng, obstacle, count, reach=4.0):
    points = rng.uniform(-reach, reach, (60, 2))
    return points[~shapely.intersects_xy(obstacle, points)][:count]


def plain_margin(p, e, alpha, length, other):
    """The lesser of both edges' margins in the corner's frame, from outlines and by cases."""
    found = []
    for mirrored, far in ((False, length), (True, other)):
        matrix = np.eye(2)
        if mirrored:
            c, s = math.cos(alpha), math.sin(alpha)
            matrix = np.array([[c, s], [s, -c]])
        (x, y), at = matrix @ p, matrix @ e
        to_edge = shapely.LineString([(-far, 0), (0, 0)]).distance(shapely.Point(at))
        # Right of the corner straight up to its edge's line, left of it round the corner.
        if y > 0:
            seen_from = -y if x >= 0 else -math.hypot(x, y)
        else:
            seen_from = -y if x >= 0 else math.hypot(x, y)
        found.append(to_edge - RATIO * seen_from)
    return min(found)


@given(seed=seeds, alpha=angles, heading=st.floats(-math.pi, math.pi))
def test_outside_the_star_region_the_margin_is_the_corner_games(seed, alpha, heading):
    obstacle, corner = wedge(alpha, heading=heading)
    points = free_points(np.random.default_rng(seed), obstacle, 2)
    assume(len(points) == 2)
    p, e = points
    r_p, phi_p, r_e, phi_e, _ = to_corner_frame(*p, *e, 0.0, 0.0, heading, alpha)
    assume(phi_p < -1e-6)
    m1 = margins(r_p, phi_p, r_e, phi_e, alpha, RATIO)[0]
    margin = signed_margin(*p, *e, corner, 0, RATIO)
    assert margin <= m1 + 1e-12
    # An evader that has it nearer to the other edge, which the pursuer sees along, may go there.
    if phi_e >= 0.5 * alpha:
        assert margin == pytest.approx(m1, abs=1e-12)


@given(
    seed=seeds,
    alpha=angles,
    length=st.floats(0.2, 3.0),
    other=st.floats(0.2, 3.0),
    heading=st.floats(-math.pi, math.pi),
)
def test_edges_are_as_long_as_they_are(seed, alpha, length, other, heading):
    obstacle, corner = wedge(alpha, length, other, heading)
    points = free_points(np.random.default_rng(seed), obstacle, 2)
    assume(len(points) == 2)
    c, s = math.cos(heading), math.sin(heading)
    p, e = points @ np.array([[c, -s], [s, c]])
    assert signed_margin(*points[0], *points[1], corner, 0, RATIO) == (
        pytest.approx(plain_margin(p, e, alpha, length, other), abs=1e-12)
    )


@given(seed=seeds, alpha=angles, length=st.floats(0.2, 3.0), step=st.floats(1e-6, 0.5))
def test_the_margin_changes_no_faster_than_robots_walk(seed, alpha, length, step):
    # So it does not jump, at the rim of the star region neither.
    rng = np.random.default_rng(seed)
    # Long on one side: pursuers do not go round the far ends.
    obstacle, corner = wedge(alpha, 100.0, 100.0)
    corner[0, 4:] = length
    points = free_points(rng, obstacle, 2)
    assume(len(points) == 2)
    heading = rng.uniform(-math.pi, math.pi)
    move = step * np.array([math.cos(heading), math.sin(heading)])
    (p, e), before = points, signed_margin(*points[0], *points[1], corner, 0, RATIO)
    if not shapely.LineString([p, p + move]).intersects(obstacle):
        after = signed_margin(*(p + move), *e, corner, 0, RATIO)
        assert abs(after - before) <= RATIO * step + 1e-12
    if not shapely.LineString([e, e + move]).intersects(obstacle):
        after = signed_margin(*p, *(e + move), corner, 0, RATIO)
        assert abs(after - before) <= step + 1e-12


def test_the_margin_is_even_across_the_rim_and_grows_into_the_star_region():
    _, corner = wedge(math.pi / 2)
    e = (-0.5, 1.0)
    below, at, above = (signed_margin(1.0, y, *e, corner, 0, RATIO) for y in (-0.1, 0.0, 0.1))
    assert at == pytest.approx(1.0)
    assert below == pytest.approx(1.0 - 0.1 * RATIO)
    assert above == pytest.approx(1.0 + 0.1 * RATIO)


BOX = [[-1.0, -0.6], [0.8, -0.4], [0.7, 0.9], [-0.9, 0.5]]


@given(
    seed=seeds,
    angle=st.floats(-math.pi, math.pi),
    mirrored=st.booleans(),
    scale=st.sampled_from([1.0, 1.7]),
)
def test_margins_turn_mirror_move_and_rescale_with_the_obstacle(seed, angle, mirrored, scale):
    rng = np.random.default_rng(seed)
    c, s = math.cos(angle), math.sin(angle)
    matrix = scale * np.array([[c, -s], [s, c]]) @ np.diag([1.0, -1.0 if mirrored else 1.0])
    shift = rng.uniform(-5, 5, 2)
    world = make_world(ROOM, [BOX])
    moved = make_world(ROOM @ matrix.T + shift, [BOX @ matrix.T + shift])
    points = rng.uniform(-3, 3, (2, 2))
    corners, after = corner_table(world), corner_table(moved)
    for c in range(len(corners)):
        place = matrix @ corners[c, :2] + shift
        (same,) = np.flatnonzero(np.hypot(*(after[:, :2] - place).T) < 1e-9)
        margin = signed_margin(*points[0], *points[1], corners, c, RATIO)
        carried = points @ matrix.T + shift
        assert signed_margin(*carried[0], *carried[1], after, same, RATIO) == (
            pytest.approx(scale * margin, abs=1e-9)
        )


@given(seed=seeds)
def test_the_least_threat_is_of_the_worst_corner_with_the_best_defender(seed):
    rng = np.random.default_rng(seed)
    world = make_world(ROOM, [BOX])
    index, corners = build_edge_index(world), corner_table(world)
    obstacle = shapely.Polygon(BOX)
    points = free_points(rng, obstacle, 5, 3.0)
    assume(len(points) == 5)
    pursuers, evaders = points[:3], points[3:]
    sight = observe(index, build_corner_index(world, index), pursuers.ravel(), evaders.ravel())
    blocks = split_sight(sight, 3, 2, len(corners))
    seen, by_pursuer, by_evader = (each > 0.5 for each in blocks)
    for j in range(2):
        threats = [
            [
                signed_margin(*pursuers[i], *evaders[j], corners, c, RATIO)
                for i in range(3)
                if seen[i, j] and by_pursuer[i, c]
            ]
            for c in range(len(corners))
            if by_evader[j, c]
        ]
        expected = min((max(each) for each in threats if each), default=math.inf)
        found = least_threat(j, pursuers.ravel(), evaders.ravel(), *blocks, corners, RATIO)
        assert found == pytest.approx(expected)
