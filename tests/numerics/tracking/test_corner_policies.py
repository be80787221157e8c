"""The players' policies do what Table 2.1 promises, whatever the other player does."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sightfield.systems.numerics.tracking.corner_game import (
    REGION_1,
    REGION_2,
    REGION_3,
    REGION_4,
    REGION_5,
    escape_time,
    margins,
    region,
)
from sightfield.systems.numerics.tracking.corner_policies import (
    evader_policy,
    margin_field,
    pursuer_policy,
    table_evader_policy,
)

RIGHT = math.pi / 2
angle = st.floats(-math.pi, math.pi)

# A short time, in units of r_p / v_p, and what its square may do to a derivative.
MOMENT = 1e-6
SLACK = 1e-3


@st.composite
def games(draw):
    """(r_p, phi_p, r_e, phi_e, alpha, a) with r_p = 1, short of the star region, in sight."""
    alpha, a = draw(st.floats(0.1, math.pi - 0.1)), draw(st.floats(0.05, 0.95))
    phi_p = draw(st.floats(alpha - math.pi, -1e-3))
    phi_e = draw(st.floats(alpha - math.pi, math.pi + phi_p))
    return 1.0, phi_p, a * draw(st.floats(0.01, 2.5)), phi_e, alpha, a


@st.composite
def lost_games(draw, right=False):
    """Games in Region 1, away from w = 0, where T* has no derivative; or with phi_e > pi/2."""
    alpha, a = draw(st.floats(0.1, math.pi - 0.2)), draw(st.floats(0.2, 0.95))
    if right:
        phi_p = draw(st.floats(max(alpha - math.pi, 0.02 - RIGHT), -0.1))
        phi_e = draw(st.floats(RIGHT + 1e-3, math.pi + phi_p - 1e-3))
    else:
        phi_p = draw(st.floats(alpha - math.pi, -0.1))
        phi_e = draw(st.floats(alpha - math.pi + 1e-3, math.pi + phi_p - 1e-2))
    _, _, d_p, d_e, _ = margins(1.0, phi_p, 1.0, phi_e, alpha, a)
    r_e = draw(st.floats(0.1, 0.97)) * a * d_p / d_e
    x = r_e * math.cos(phi_e) + a * math.cos(phi_p)
    y = r_e * math.sin(phi_e) + a * math.sin(phi_p)
    assume(math.hypot(x, y) > 0.1 * a)
    game = (1.0, phi_p, r_e, phi_e, alpha, a)
    assert region(*game) == REGION_1
    return game


def moved(game, u, v, time):
    """State after both have moved for a time, velocities in units of v_p."""
    r_p, phi_p, r_e, phi_e, alpha, a = game
    px, py = r_p * math.cos(phi_p) + time * u[0], r_p * math.sin(phi_p) + time * u[1]
    ex, ey = r_e * math.cos(phi_e) + time * v[0], r_e * math.sin(phi_e) + time * v[1]
    return math.hypot(px, py), math.atan2(py, px), math.hypot(ex, ey), math.atan2(ey, ex), alpha, a


def towards(direction):
    return math.cos(direction), math.sin(direction)


@given(lost_games(), angle)
def test_no_pursuer_holds_the_best_evader_longer_than_the_game_says(game, direction):
    v = game[5] * np.array(evader_policy(*game))
    after = moved(game, towards(direction), v, MOMENT)
    assume(-math.pi + game[4] < after[1] and after[3] > game[4] - math.pi)
    time = escape_time(*game, 1.0)
    assert escape_time(*after, 1.0) <= time - MOMENT * (1 - SLACK)


@given(lost_games(right=True), angle, st.floats(0, 1))
def test_no_evader_gets_away_from_margin_sooner_than_the_game_says(game, direction, speed):
    u = margin_field(*game)[:2]
    v = speed * game[5] * np.array(towards(direction))
    assert escape_time(*moved(game, u, v, MOMENT), 1.0) >= escape_time(*game, 1.0) - MOMENT * (
        1 + SLACK
    )


@given(games(), st.floats(0.01, 0.99), angle)
def test_straight_up_never_loses_ground(game, share, direction):
    _, phi_p, _, phi_e, alpha, a = game
    phi_p = max(phi_p, -RIGHT)
    _, _, d_p, d_e, _ = margins(1.0, phi_p, 1.0, phi_e, alpha, a)
    # Between the barrier and the circle of radius a r_p.
    r_e = a * (share + (1 - share) * d_p / max(d_e, d_p))
    game = (1.0, phi_p, r_e, phi_e, alpha, a)
    assume(region(*game) in (REGION_2, REGION_4))
    v = game[5] * np.array(towards(direction))
    u = pursuer_policy(*game, *v)
    assert u == (0, 1)
    after = moved(game, u, v, MOMENT)
    assume(after[3] > game[4] - math.pi and after[1] < 0)
    assert margins(*after)[0] >= margins(*game)[0] - MOMENT * SLACK


@given(games(), st.floats(0, 1), angle, st.floats(0, 1))
def test_the_mirror_lets_neither_the_gap_nor_the_ratio_shrink(game, share, direction, speed):
    _, phi_p, _, phi_e, alpha, a = game
    r_e = a * (1 - 0.999 * share * phi_p)
    game = (1.0, phi_p, r_e, phi_e, alpha, a)
    assume(region(*game) == REGION_3)
    vx, vy = speed * a * np.array(towards(direction))
    ux, uy = pursuer_policy(*game, vx, vy)
    assert math.hypot(ux, uy) <= 1 + 1e-9
    u_r = ux * math.cos(phi_p) + uy * math.sin(phi_p)
    u_t = uy * math.cos(phi_p) - ux * math.sin(phi_p)
    v_r = vx * math.cos(phi_e) + vy * math.sin(phi_e)
    v_t = vy * math.cos(phi_e) - vx * math.sin(phi_e)
    # Table 2.1, row C, r_p being 1.
    assert (u_t, u_r) == pytest.approx((abs(v_t) / r_e, -abs(v_r) / r_e), abs=1e-9)
    # Rates of the gap and of log(r_e / r_p).
    assert u_t - v_t / r_e >= -1e-9
    assert v_r / r_e - u_r >= -1e-9


@given(games(), st.floats(0, 1), angle)
def test_turning_reaches_the_star_region_in_open_loop(game, share, direction):
    _, phi_p, _, phi_e, alpha, a = game
    r_e = a * (1 - phi_p) * (1 + share)
    assert region(1.0, phi_p, r_e, phi_e, alpha, a) == REGION_5
    assert pursuer_policy(1.0, phi_p, r_e, phi_e, alpha, a, 0, 0) == pytest.approx(
        (-math.sin(phi_p), math.cos(phi_p))
    )
    vx, vy = a * np.array(towards(direction))
    for time in np.linspace(0, -phi_p, 20):
        x, y = r_e * math.cos(phi_e) + time * vx, r_e * math.sin(phi_e) + time * vy
        turned = math.remainder(math.atan2(y, x) - phi_e, 2 * math.pi)
        # The pursuer has turned by `time`, the evader by `turned`.
        assert math.pi + phi_p + time - phi_e - turned >= -1e-9


@given(games(), st.floats(0, 1))
def test_an_evader_always_runs(game, share):
    r_p, phi_p, r_e, phi_e, alpha, a = game
    for phi in (phi_e, math.pi + share * phi_p, math.pi):
        for r in (0.0, r_e):
            for policy in (evader_policy, table_evader_policy):
                for pursuer in (phi_p, 0.5 * alpha):
                    assert math.hypot(*policy(r_p, pursuer, r, phi, alpha, a)) == pytest.approx(1)


@given(games())
def test_the_tables_evader_takes_the_shortest_way_to_edge_a(game):
    v = game[5] * np.array(table_evader_policy(*game))
    assume(game[3] < math.pi - 1e-3)
    before, after = margins(*game)[3], margins(*moved(game, (0, 0), v, MOMENT))[3]
    assert after == pytest.approx(before - game[5] * MOMENT, abs=1e-11)


def test_a_hidden_evader_makes_for_edge_a_and_on_along_it():
    assert evader_policy(1.0, -1.0, 0.8, 2.5, RIGHT, 0.5) == (0, -1)
    assert evader_policy(1.0, -1.0, 0.8, math.pi, RIGHT, 0.5) == (-1, 0)


def test_before_a_pursuer_in_the_star_region_the_evader_makes_for_the_corner():
    for phi_e in (-1.0, 0.4, 2.8):
        x, y = evader_policy(1.0, 0.3, 0.8, phi_e, RIGHT, 0.5)
        assert (x, y) == pytest.approx((-math.cos(phi_e), -math.sin(phi_e)))
        assert pursuer_policy(1.0, 0.3, 0.8, phi_e, RIGHT, 0.5, 0.1, 0.2) == (0, 0)


def test_the_pursuer_plays_margin_where_the_table_is_silent():
    for r_e, phi_e in ((0.1, 1.0), (0.8, 2.5)):
        game = (1.0, -1.0, r_e, phi_e, RIGHT, 0.5)
        assert pursuer_policy(*game, 0.1, 0.2) == margin_field(*game)[:2]
