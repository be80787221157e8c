"""Who wins round a corner, how long sight holds, and that the two bounds on it meet."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sightfield.systems.numerics.tracking.corner_game import (
    HIDDEN,
    IN_STAR,
    REGION_1,
    REGION_2,
    REGION_3,
    REGION_4,
    REGION_5,
    REGION_NAMES,
    escape_time,
    margins,
    region,
)

RIGHT = math.pi / 2


@st.composite
def games(draw, alpha=None):
    """(r_p, phi_p, r_e, phi_e, alpha, a) with the pursuer short of the star region."""
    if alpha is None:
        alpha = draw(st.floats(0.1, math.pi - 0.1))
    a = draw(st.floats(0.05, 0.95))
    r_p = draw(st.floats(0.1, 10))
    phi_p = draw(st.floats(alpha - math.pi, -1e-6))
    r_e = a * r_p * draw(st.floats(0, 3))
    phi_e = draw(st.floats(alpha - math.pi, math.pi))
    return r_p, phi_p, r_e, phi_e, alpha, a


def weighted_sum(r_p, phi_p, r_e, phi_e, a):
    """w = e + a p."""
    return (
        r_e * math.cos(phi_e) + a * r_p * math.cos(phi_p),
        r_e * math.sin(phi_e) + a * r_p * math.sin(phi_p),
    )


@given(games())
def test_a_region_says_who_wins(game):
    r_e, a = game[2], game[5]
    assume(r_e > 0)
    m1, _, d_p, d_e, gap = margins(*game)
    assert m1 == pytest.approx(d_e - a * d_p)
    code = region(*game)
    assert code in REGION_NAMES
    assert (code == HIDDEN) == (gap < 0)
    assert (code == REGION_1) == (gap >= 0 and m1 < 0)
    assert (escape_time(*game, 1.0) == math.inf) == (code not in (HIDDEN, REGION_1))


@given(games())
def test_running_straight_up_is_for_the_right_of_the_corner(game):
    r_p, phi_p, r_e, _, _, a = game
    if region(*game) in (REGION_2, REGION_4):
        assert phi_p > -RIGHT
        assert r_e < a * r_p
    elif region(*game) in (REGION_3, REGION_5):
        # The mirror policy and turning are for a pursuer that turns sight fast enough.
        assert r_e >= a * r_p


@given(games())
def test_lengths_are_distances(game):
    """D_p, D_e and M2 against the nearest of many points of the star region, edge A, the ray."""
    r_p, phi_p, r_e, phi_e, alpha, _ = game
    _, m2, d_p, d_e, gap = margins(*game)
    assume(r_e > 0 and gap >= 0)
    far = np.linspace(0, 4 * (r_p + r_e), 4001)

    def distance(r, phi, ray):
        # More than half a turn away, the obstacle is between: by way of the corner.
        if abs(phi - ray) > math.pi:
            return r
        x, y = r * math.cos(phi), r * math.sin(phi)
        return np.hypot(x - far * math.cos(ray), y - far * math.sin(ray)).min()

    sides = [distance(r_p, phi_p, ray) for ray in (0.0, alpha)]
    assert d_p == pytest.approx(min(sides), abs=2 * far[1])
    assert d_e == pytest.approx(distance(r_e, phi_e, math.pi), abs=2 * far[1])
    assert m2 == pytest.approx(distance(r_e, phi_e, math.pi + phi_p), abs=2 * far[1])


@given(games(), st.floats(0.01, 100), st.floats(0.05, 0.95))
def test_neither_scale_nor_the_speed_ratio_alone_matters(game, scale, other):
    r_p, phi_p, r_e, phi_e, alpha, a = game
    assume(abs(margins(*game)[0]) > 1e-9 * r_p)
    code = region(*game)
    assume(abs(r_e - a * r_p) > 1e-9 * r_p)
    assume(abs(r_e - a * r_p * (1 - phi_p)) > 1e-9 * r_p)
    assert region(scale * r_p, phi_p, scale * r_e, phi_e, alpha, a) == code
    assert region(r_p, phi_p, r_e / a * other, phi_e, alpha, other) == code
    time = escape_time(*game, 1.0)
    assert escape_time(scale * r_p, phi_p, scale * r_e, phi_e, alpha, a, scale) == pytest.approx(
        time
    )
    assert escape_time(*game[:2], r_e / a * other, phi_e, alpha, other, 2.0) == pytest.approx(
        time / 2
    )


@pytest.mark.parametrize("phi_p", [0.0, 0.3, RIGHT])
def test_in_the_star_region_nothing_is_lost(phi_p):
    for phi_e in (-RIGHT, 0.0, 2.0, math.pi):
        assert region(1.0, phi_p, 0.1, phi_e, RIGHT, 0.9) == IN_STAR
        assert escape_time(1.0, phi_p, 0.1, phi_e, RIGHT, 0.9, 1.0) == math.inf


def test_a_pursuer_at_the_corner_sees_everything():
    assert region(0.0, -1.0, 1.0, math.pi, RIGHT, 0.5) == IN_STAR


def test_an_evader_at_the_corner_is_as_good_as_gone():
    for phi_e in (-RIGHT, 1.0, math.pi):
        assert region(1.0, -0.5, 0.0, phi_e, RIGHT, 0.5) == REGION_1
        assert escape_time(1.0, -0.5, 0.0, phi_e, RIGHT, 0.5, 1.0) == 0


def test_grazing_is_seeing():
    phi_p = -0.75
    assert region(1.0, phi_p, 9.0, math.pi + phi_p, RIGHT, 0.5) == REGION_5
    assert region(1.0, phi_p, 9.0, math.pi + phi_p + 1e-9, RIGHT, 0.5) == HIDDEN
    assert escape_time(1.0, phi_p, 9.0, math.pi + phi_p + 1e-9, RIGHT, 0.5, 1.0) == 0


# p = (1, -1), a = 1/2: D_p = 1, a r_p = 0.707, a r_p (1 + |phi_p|) = 1.262.
@pytest.mark.parametrize(
    ("e", "code"),
    [
        ((0.1, 0.2), REGION_1),
        ((-0.2, 0.45), REGION_1),
        ((-0.2, 0.55), REGION_4),
        ((0.6, 0.1), REGION_2),
        ((0.7, 0.0), REGION_2),
        ((0.71, 0.0), REGION_3),
        ((0.9, 0.0), REGION_3),
        ((-0.5, 0.9), REGION_3),
        ((1.3, 0.0), REGION_5),
        ((-1.0, 0.9), HIDDEN),
    ],
)
def test_regions_of_a_right_angled_corner(e, code):
    r_e, phi_e = math.hypot(*e), math.atan2(e[1], e[0])
    assert region(math.sqrt(2), -math.pi / 4, r_e, phi_e, RIGHT, 0.5) == code


def test_left_of_a_sharp_corner_the_corner_is_the_goal():
    # p = (-1, -2): D_p = |p|, and the evader behind edge B is as near to edge A as to O.
    r_p, phi_p = math.hypot(1, 2), math.atan2(-2, -1)
    m1, _, d_p, d_e, _ = margins(r_p, phi_p, 1.0, 0.3, 0.8, 0.5)
    assert (d_p, d_e) == (pytest.approx(math.sqrt(5)), pytest.approx(1.0))
    assert m1 == pytest.approx(1 - 0.5 * math.sqrt(5))
    assert region(r_p, phi_p, 1.0, 0.3, 0.8, 0.5) == REGION_1


def test_an_evader_that_makes_for_the_corner_takes_its_distance():
    assert escape_time(3.0, -1.2, 0.6, -0.4, RIGHT, 0.5, 2.0) == pytest.approx(0.6)


@given(games(), st.floats(1e-3, RIGHT - 1e-3), st.floats(1e-3, 0.999))
def test_sight_is_lost_when_both_have_run_at_right_angles_to_w(game, gap, share):
    r_p, phi_p, _, _, alpha, a = game
    # Inside the circle whose diameter joins O and -a p.
    r_e, phi_e = share * a * r_p * math.cos(gap), math.pi + phi_p - gap
    assume(region(r_p, phi_p, r_e, phi_e, alpha, a) == REGION_1)
    time = escape_time(r_p, phi_p, r_e, phi_e, alpha, a, 1.0)
    wx, wy = weighted_sum(r_p, phi_p, r_e, phi_e, a)
    ux, uy = -wy / math.hypot(wx, wy), wx / math.hypot(wx, wy)
    px, py = r_p * math.cos(phi_p) + time * ux, r_p * math.sin(phi_p) + time * uy
    ex, ey = r_e * math.cos(phi_e) - a * time * ux, r_e * math.sin(phi_e) - a * time * uy
    # In line with the corner, on opposite sides of it, neither in the obstacle nor in the star.
    assert px * ey - py * ex == pytest.approx(0, abs=1e-9 * r_p**2)
    assert px * ex + py * ey <= 1e-9 * r_p**2
    assert py <= 1e-9 * r_p
    assert ey >= -1e-9 * r_p


@given(games(), st.floats(0.01, RIGHT - 0.01), st.floats(-1, 1))
def test_the_time_does_not_jump_where_the_evader_changes_its_mind(game, gap, side):
    """Inside and outside the circle on O and -a p, T* is given by different formulas."""
    r_p, phi_p, _, _, alpha, a = game
    phi_e, on_circle = math.pi + phi_p - gap, a * r_p * math.cos(gap)
    near = (r_p, phi_p, on_circle * (1 + 1e-7 * side), phi_e, alpha, a)
    assume(margins(*near)[0] < 0)
    assert escape_time(*near, 1.0) == pytest.approx(on_circle / a, rel=1e-5)


@given(games(), st.floats(0.05, 1))
def test_at_the_barrier_the_race_is_even(game, share):
    """Where M1 vanishes the evader needs as long as the pursuer does."""
    r_p, phi_p, _, _, alpha, a = game
    phi_p = min(phi_p, -0.05)
    gap = share * (2 * math.pi - alpha + phi_p)
    phi_e = math.pi + phi_p - gap
    _, _, d_p, d_e, _ = margins(r_p, phi_p, 1.0, phi_e, alpha, a)
    r_e = a * d_p / d_e
    wx, wy = weighted_sum(r_p, phi_p, r_e, phi_e, a)
    assume(math.hypot(wx, wy) > 0.01 * r_p)
    time = escape_time(r_p, phi_p, r_e * (1 - 1e-9), phi_e, alpha, a, 1.0)
    assert time == pytest.approx(d_p, rel=1e-5)
