"""The pursuit fields round a corner: their rows, their limits, and what `margin` keeps."""

import math

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
    margins,
    region,
)
from sightfield.systems.numerics.tracking.corner_policies import (
    FIELDS,
    corner_field,
    margin_field,
    table_field,
    table_field_up,
)

RIGHT = math.pi / 2
BY_NAME = {"margin": margin_field, "table": table_field, "table_up": table_field_up}
alphas = st.floats(0.1, math.pi - 0.1)
ratios = st.floats(0.05, 0.95)
angle = st.floats(-math.pi, math.pi)


@st.composite
def games(draw, threatened=False):
    """(r_p, phi_p, r_e, phi_e, alpha, a), anywhere or with the pursuer short of the star region."""
    alpha, a = draw(alphas), draw(ratios)
    r_p = draw(st.floats(0.1, 10))
    phi_p = draw(st.floats(alpha - math.pi, -0.01 if threatened else alpha))
    r_e = a * r_p * draw(st.floats(0, 3))
    phi_e = draw(st.floats(alpha - math.pi, math.pi))
    return r_p, phi_p, r_e, phi_e, alpha, a


def from_w(game):
    """|e + a p| relative to a |p|: where it vanishes, every direction is a limit of `margin`."""
    r_p, phi_p, r_e, phi_e, _, a = game
    x = r_e * math.cos(phi_e) + a * r_p * math.cos(phi_p)
    y = r_e * math.sin(phi_e) + a * r_p * math.sin(phi_p)
    return math.hypot(x, y) / (a * r_p)


@given(games(), st.sampled_from(sorted(BY_NAME)))
def test_a_field_is_a_unit_vector_or_nothing(game, name):
    ux, uy, reach = BY_NAME[name](*game)
    if region(*game) == IN_STAR:
        assert (ux, uy, reach) == (0, 0, 0)
    else:
        assert math.hypot(ux, uy) == pytest.approx(1)
        assert reach == margins(*game)[2] > 0


@given(games(threatened=True), st.sampled_from(sorted(BY_NAME)), st.floats(0, 1))
def test_a_step_within_reach_neither_hits_the_obstacle_nor_leaves_the_star_region(
    game, name, share
):
    r_p, phi_p, _, _, alpha, _ = game
    ux, uy, reach = BY_NAME[name](*game)
    x = r_p * math.cos(phi_p) + share * reach * ux
    y = r_p * math.sin(phi_p) + share * reach * uy
    assume(math.hypot(x, y) > 1e-6 * r_p)
    assert alpha - math.pi - 1e-6 <= math.atan2(y, x) <= alpha + 1e-6


# p = (1, -1), a = 1/2, right of a right-angled corner; p = (-0.5, -1.2), left of a sharp one.
T = (math.sqrt(0.5), math.sqrt(0.5))
UP = (0.0, 1.0)
TO_CORNER = (0.5 / 1.3, 1.2 / 1.3)
TURN_LEFT = (1.2 / 1.3, -0.5 / 1.3)
ALONG_B = (math.cos(0.8), math.sin(0.8))


@pytest.mark.parametrize(
    ("p", "e", "alpha", "code", "down", "up"),
    [
        ((1, -1), (0.1, 0.2), RIGHT, REGION_1, T, T),
        ((1, -1), (0.6, 0.1), RIGHT, REGION_2, UP, UP),
        ((1, -1), (0.9, 0.0), RIGHT, REGION_3, T, T),
        ((1, -1), (-0.2, 0.55), RIGHT, REGION_4, UP, UP),
        ((1, -1), (1.3, 0.0), RIGHT, REGION_5, T, T),
        ((1, -1), (-1.0, 0.9), RIGHT, HIDDEN, T, T),
        ((-0.5, -1.2), (0.5, 0.3), 0.8, REGION_1, TO_CORNER, ALONG_B),
        ((-0.5, -1.2), (0.7, 0.3), 0.8, REGION_3, TURN_LEFT, TURN_LEFT),
        ((-0.5, -1.2), (2.5, 0.3), 0.8, REGION_5, TURN_LEFT, TURN_LEFT),
        ((-0.5, -1.2), (0.1, 0.9), 0.8, HIDDEN, TO_CORNER, ALONG_B),
    ],
)
def test_rows_of_table_2_2(p, e, alpha, code, down, up):
    game = (math.hypot(*p), math.atan2(p[1], p[0]), math.hypot(*e), math.atan2(e[1], e[0]))
    assert region(*game, alpha, 0.5) == code
    assert table_field(*game, alpha, 0.5)[:2] == pytest.approx(down)
    assert table_field_up(*game, alpha, 0.5)[:2] == pytest.approx(up)


@given(alphas, ratios, st.floats(0.01, 0.99), st.floats(0.01, 0.99), st.floats(0.01, 0.99))
def test_right_of_the_corner_margin_is_the_optimal_pursuer(alpha, a, turn, spread, share):
    """In Region 1 with phi_e > pi/2 it runs along (-w_y, w_x), whose time is the game's."""
    phi_p = -turn * min(math.pi - alpha, RIGHT)
    phi_e = RIGHT + spread * (RIGHT + phi_p)
    r_e = share * a * -math.sin(phi_p) / math.sin(phi_e)
    game = (1.0, phi_p, r_e, phi_e, alpha, a)
    assert region(*game) == REGION_1
    wx = r_e * math.cos(phi_e) + a * math.cos(phi_p)
    wy = r_e * math.sin(phi_e) + a * math.sin(phi_p)
    length = math.hypot(wx, wy)
    assert margin_field(*game)[:2] == pytest.approx((-wy / length, wx / length), abs=1e-9)


def test_left_of_the_corner_margin_blends_turning_and_making_for_it():
    # |p| = 1.3, |e| = 0.4 and far from the sight ray: M1 = 0.4 - 0.65, M2 = 0.4.
    game = (1.3, math.atan2(-1.2, -0.5), 0.4, -1.0, 0.8, 0.5)
    x, y = (0.25 * t + 0.4 * s for t, s in zip(TURN_LEFT, TO_CORNER, strict=True))
    assert margin_field(*game) == pytest.approx((x / math.hypot(x, y), y / math.hypot(x, y), 1.3))


@st.composite
def borders(draw):
    """Two states 1e-8 apart on either side of a border of the partition, and which border."""
    alpha, a = draw(alphas), draw(ratios)
    kind = draw(st.sampled_from(["sight ray", "barrier", "left", "above", "r_e = a r_p", "g"]))
    phi_p = draw(st.floats(alpha - math.pi, -0.05))
    phi_e = draw(st.floats(alpha - math.pi, math.pi + phi_p))
    r_e = a * draw(st.floats(0.05, 3))
    pair = []
    for side in (-1e-8, 1e-8):
        p, e, r = phi_p, phi_e, r_e
        if kind == "sight ray":
            e = math.pi + phi_p + side
        elif kind == "barrier":
            _, _, d_p, d_e, _ = margins(1.0, phi_p, 1.0, phi_e, alpha, a)
            assume(d_e > 0.01)
            r = a * d_p / d_e * (1 + side)
        elif kind == "left":
            assume(alpha < RIGHT - 0.01)
            p = -RIGHT + side
        elif kind == "above":
            e = RIGHT + side
        elif kind == "r_e = a r_p":
            r = a * (1 + side)
        else:
            e = RIGHT + phi_p + side
        assume(alpha - math.pi <= e <= math.pi)
        pair.append((1.0, p, r, e, alpha, a))
    return kind, pair


@given(borders())
def test_margin_does_not_jump_at_any_border(case):
    _, (one, other) = case
    assume(from_w(one) > 0.02)
    u, v = margin_field(*one), margin_field(*other)
    assert u == pytest.approx(v, abs=1e-5)


def test_the_table_jumps_where_margin_does_not():
    p = (math.sqrt(2), -math.pi / 4)
    r_e = 0.5 * (1 - 1e-9), 0.5 * (1 + 1e-9)
    inside, outside = (table_field(*p, r, 0.3, RIGHT, 0.5)[:2] for r in r_e)
    assert (inside, outside) == (pytest.approx(T), pytest.approx(UP))


def test_margin_still_answers_where_both_margins_vanish():
    # e = -a p exactly: the evader grazes the sight ray at the barrier.
    ux, uy, _ = margin_field(1.0, -RIGHT, 0.5, RIGHT, RIGHT, 0.5)
    assert (ux, uy) == pytest.approx((1.0, 0.0))


@given(alphas, ratios, st.floats(0.01, 0.99), st.floats(0.01, 0.99))
def test_a_resting_hidden_evader_is_seen_again_by_the_shortest_way(alpha, a, turn, depth):
    phi_p = -turn * (math.pi - alpha)
    gap = depth * phi_p
    phi_e = math.pi + phi_p - gap
    ux, uy, _ = margin_field(1.0, phi_p, 0.7, phi_e, alpha, a)
    # To the line from the evader through the corner, or to the corner.
    way = math.sin(-gap) if gap > -RIGHT else 1.0
    x, y = math.cos(phi_p) + way * ux, math.sin(phi_p) + way * uy
    assert x * math.sin(phi_e) - y * math.cos(phi_e) == pytest.approx(0, abs=1e-9)
    assert x * math.cos(phi_e) + y * math.sin(phi_e) <= 1e-9


@given(
    games(threatened=True),
    st.sampled_from(sorted(FIELDS)),
    angle,
    angle,
    st.tuples(*[st.floats(-20, 20)] * 2),
    st.floats(0.1, 10),
    st.booleans(),
)
def test_a_field_turns_moves_and_mirrors_with_the_world(
    game, name, heading, turn, shift, scale, mirror
):
    r_p, phi_p, r_e, phi_e, alpha, a = game
    # Rounding may carry a state over a border of the partition, where the table jumps.
    r_p, r_e = round(r_p, 3) + 1e-4, round(r_e, 3) + 1.1e-4
    phi_p, phi_e = 0.999 * phi_p, 0.999 * phi_e
    m1, _, _, _, gap = margins(r_p, phi_p, r_e, phi_e, alpha, a)
    distances = (
        m1,
        gap,
        phi_p + RIGHT,
        phi_e - RIGHT,
        r_e - a * r_p,
        r_e - a * r_p * (1 - phi_p),
        alpha - math.pi - phi_e,
        math.pi - phi_e,
    )
    assume(min(map(abs, distances)) > 1e-6)
    assume(from_w(game) > 1e-3)
    found = []
    for moved in (False, True):
        p, e = phi_p, phi_e
        if moved and mirror:
            p, e = alpha - p, alpha - e
        spin, size = (heading + turn, scale) if moved else (heading, 1.0)
        cx, cy = shift if moved else (0.0, 0.0)
        world = [
            (cx + size * r * math.cos(spin + phi), cy + size * r * math.sin(spin + phi))
            for r, phi in ((r_p, p), (r_e, e))
        ]
        ux, uy, reach = corner_field(FIELDS[name], *world[0], *world[1], cx, cy, spin, alpha, a)
        # Back into the frame, and over the bisector.
        x = math.cos(spin) * ux + math.sin(spin) * uy
        y = math.cos(spin) * uy - math.sin(spin) * ux
        if moved and mirror:
            x, y = (
                math.cos(alpha) * x + math.sin(alpha) * y,
                math.sin(alpha) * x - math.cos(alpha) * y,
            )
        found.append((x, y, reach / size))
    assert found[0] == pytest.approx(found[1], abs=1e-6)
    assert found[0] == pytest.approx(BY_NAME[name](r_p, phi_p, r_e, phi_e, alpha, a), abs=1e-6)
