"""Every corner of every polygon looks the same in the frame of the corner game."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.corner_game import from_corner_frame, to_corner_frame

angle = st.floats(-math.pi, math.pi)
alphas = st.floats(0.05, math.pi - 0.05)
coordinate = st.floats(-5, 5).map(lambda x: round(x, 6))


def frame_point(r, phi, cx, cy, heading):
    """World position of polar coordinates in a corner's frame."""
    return cx + r * math.cos(heading + phi), cy + r * math.sin(heading + phi)


def free_angles(alpha):
    return st.floats(alpha - math.pi + 1e-6, math.pi - 1e-6)


@pytest.mark.parametrize("turn", [0.0, 0.4, 2.0, -2.9])
def test_the_edges_of_a_polygon_are_the_edges_of_the_frame(turn):
    triangle = np.array([[0.0, 0.0], [2.0, 0.3], [0.7, 1.9]])
    spin = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    room = 20 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    world = make_world(room, [triangle @ spin])
    (ring,) = world.obstacles
    corners = world.corners
    assert len(corners) == 3
    for point, alpha, heading in zip(corners.points, corners.angles, corners.headings, strict=True):
        (k,) = np.flatnonzero((ring == point).all(axis=1))
        before, after = ring[k - 1], ring[(k + 1) % 3]
        inside = triangle.mean(axis=0) @ spin
        # The evader half-way along either edge; the pursuer where it sees both sides.
        outwards = 2 * point - inside
        for end, edge in ((before, math.pi), (after, alpha - math.pi)):
            middle = 0.5 * (point + end)
            _, phi_p, r_e, phi_e, mirrored = to_corner_frame(
                *outwards, *middle, *point, heading, alpha
            )
            assert not mirrored
            assert 0 < phi_p < alpha
            assert r_e == pytest.approx(np.hypot(*(middle - point)))
            assert phi_e == pytest.approx(edge)


@given(st.data(), alphas, angle, coordinate, coordinate)
def test_positions_come_back_from_the_frame(data, alpha, heading, cx, cy):
    phi_p, phi_e = data.draw(free_angles(alpha)), data.draw(free_angles(alpha))
    p = frame_point(2.0, phi_p, cx, cy, heading)
    e = frame_point(0.5, phi_e, cx, cy, heading)
    r_p, found_p, r_e, found_e, mirrored = to_corner_frame(*p, *e, cx, cy, heading, alpha)
    assert found_p <= alpha
    assert mirrored == (phi_p > alpha) or phi_p == pytest.approx(alpha)
    for r, phi, place in ((r_p, found_p, p), (r_e, found_e, e)):
        assert alpha - math.pi <= phi <= math.pi
        x, y = from_corner_frame(r * math.cos(phi), r * math.sin(phi), heading, alpha, mirrored)
        assert (cx + x, cy + y) == pytest.approx(place, abs=1e-9)


@given(st.data(), alphas, angle)
def test_states_that_mirror_each_other_are_one_state(data, alpha, heading):
    phi_p, phi_e = data.draw(free_angles(alpha)), data.draw(free_angles(alpha))
    assume(abs(phi_p - alpha / 2) > alpha / 2 + 1e-6)
    states = []
    for reflect in (False, True):
        ours = [alpha - phi if reflect else phi for phi in (phi_p, phi_e)]
        p = frame_point(2.0, ours[0], 1.0, -3.0, heading)
        e = frame_point(0.5, ours[1], 1.0, -3.0, heading)
        states.append(to_corner_frame(*p, *e, 1.0, -3.0, heading, alpha))
    assert states[0][:4] == pytest.approx(states[1][:4], abs=1e-9)
    assert states[0][4] != states[1][4]


@given(alphas, angle, angle)
def test_lengths_survive_the_way_back(alpha, heading, direction):
    for mirrored in (False, True):
        x, y = from_corner_frame(math.cos(direction), math.sin(direction), heading, alpha, mirrored)
        assert math.hypot(x, y) == pytest.approx(1)


@pytest.mark.parametrize("phi_p", [-1.2, -0.3])
def test_an_evader_at_the_corner_is_in_sight_and_on_its_way(phi_p):
    p = frame_point(1.0, phi_p, 3.0, 4.0, 0.0)
    _, phi, r_e, phi_e, _ = to_corner_frame(*p, 3.0, 4.0, 3.0, 4.0, 0.0, math.pi / 2)
    assert r_e == 0
    assert phi_e == min(math.pi + phi, math.pi / 2)


@pytest.mark.parametrize("heading", [0.0, math.pi, -math.pi / 2, 0.7, -2.5])
def test_a_pursuer_at_the_corner_is_in_the_star_region(heading):
    r_p, phi_p, _, _, mirrored = to_corner_frame(1, 2, 5, 6, 1, 2, heading, 1.0)
    assert (r_p, phi_p, mirrored) == (0, 0, False)


@pytest.mark.parametrize(("behind", "edge"), [(1e-13, math.pi), (-1e-13, 1.0 - math.pi)])
def test_a_rounding_error_behind_an_edge_is_on_that_edge(behind, edge):
    x, y = frame_point(1.0, edge + behind, 0.0, 0.0, 0.0)
    _, _, _, phi_e, _ = to_corner_frame(1.0, 0.5, x, y, 0.0, 0.0, 0.0, 1.0)
    assert phi_e == edge


def test_a_negative_zero_is_on_edge_a():
    _, _, _, phi_e, _ = to_corner_frame(1.0, 0.5, -1.0, -0.0, 0.0, 0.0, 0.0, 1.0)
    assert phi_e == math.pi
