"""Maps of the corner game say at each point what the game says there."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.tracking.corner_game import HIDDEN, IN_STAR, REGION_1, REGION_NAMES
from sightfield.systems.numerics.tracking.corner_policies import (
    BLOCKED,
    FIELDS,
    MARGIN,
    corner_field,
    field_grid,
    inside_obstacle,
    partition,
    pursuer_partition,
)

RIGHT = math.pi / 2
SQUARE = np.stack(np.meshgrid(np.linspace(-2, 2, 41), np.linspace(-2, 2, 41)), axis=-1)


@given(st.floats(0.05, math.pi - 0.05), st.floats(0.01, 10))
def test_edges_are_free_and_the_wedge_is_not(alpha, r):
    def at(phi):
        return [r * math.cos(phi), r * math.sin(phi)]

    free = [at(math.pi), [-r, -0.0], at(alpha - math.pi), at(alpha / 2), [0.0, 0.0]]
    blocked = [at(math.pi + 0.01), at(math.pi + alpha / 2), at(math.pi + alpha - 0.01)]
    assert inside_obstacle(free, alpha).tolist() == [False] * 5
    assert inside_obstacle(blocked, alpha).tolist() == [True] * 3


def test_a_partition_covers_the_plane():
    codes = partition((0.8, -0.6), SQUARE, RIGHT, 0.6)
    assert codes.shape == SQUARE.shape[:2]
    assert ((codes == BLOCKED) == inside_obstacle(SQUARE, RIGHT)).all()
    assert set(np.unique(codes)) == {BLOCKED, *REGION_NAMES} - {IN_STAR}
    # The evader wins within a D_p of the corner, and above edge A as high as that.
    x, y = np.moveaxis(SQUARE, -1, 0)
    seen = (codes != BLOCKED) & (codes != HIDDEN)
    wins = np.where(x > -1e-9, np.hypot(x, y), y) < 0.6 * 0.6
    assert ((codes == REGION_1) == (seen & wins)).all()
    # In sight is what lies on the pursuer's side of the ray through the corner.
    shadow = (0.8 * y + 0.6 * x < 0) & (y >= 0)
    assert ((codes == HIDDEN) == shadow).all()


def test_the_two_partitions_are_one_map_read_both_ways():
    random = np.random.default_rng(0)
    for alpha in (0.7, RIGHT, 2.5):
        players = random.uniform(-2, 2, (400, 2, 2))
        players = players[~inside_obstacle(players, alpha).any(axis=1)]
        for pursuer, evader in players[:40]:
            there = partition(pursuer, evader, alpha, 0.5)
            assert there.shape == ()
            assert there == pursuer_partition(evader, pursuer, alpha, 0.5)


@pytest.mark.parametrize("alpha", [0.7, RIGHT, 2.5])
def test_the_obstacles_bisector_is_a_mirror(alpha):
    spin = np.array([[math.cos(alpha), math.sin(alpha)], [math.sin(alpha), -math.cos(alpha)]])
    random = np.random.default_rng(1)
    points = random.uniform(-2, 2, (500, 2))
    points = points[~inside_obstacle(points, alpha)]
    evader = points[0]
    codes = pursuer_partition(evader, points, alpha, 0.5)
    assert (codes == pursuer_partition(evader @ spin, points @ spin, alpha, 0.5)).all()
    field = field_grid("margin", evader, points, alpha, 0.5)
    mirrored = field_grid("margin", evader @ spin, points @ spin, alpha, 0.5)
    assert field[:, :2] @ spin == pytest.approx(mirrored[:, :2], abs=1e-9)
    assert field[:, 2] == pytest.approx(mirrored[:, 2])


@pytest.mark.parametrize("name", FIELDS)
def test_a_field_is_drawn_where_there_is_a_threat(name):
    field = field_grid(name, (-0.2, 0.6), SQUARE, RIGHT, 0.5)
    codes = pursuer_partition((-0.2, 0.6), SQUARE, RIGHT, 0.5)
    idle = (codes == IN_STAR) | (codes == BLOCKED)
    assert (field[idle] == 0).all()
    assert np.hypot(*field[~idle][:, :2].T) == pytest.approx(1)
    assert (field[~idle][:, 2] > 0).all()
    one = corner_field(FIELDS[name], 1.0, -1.5, -0.2, 0.6, 0.0, 0.0, 0.0, RIGHT, 0.5)
    assert field_grid(name, (-0.2, 0.6), (1.0, -1.5), RIGHT, 0.5) == pytest.approx(one)


def test_an_unknown_kind_of_field_is_the_margin_field():
    state = (1.0, -1.5, -0.2, 0.6, 0.0, 0.0, 0.0, RIGHT, 0.5)
    assert corner_field(99, *state) == corner_field(MARGIN, *state)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"alpha": math.pi}, "`alpha` must lie between 0 and pi"),
        ({"alpha": math.nan}, "`alpha` must be a finite number"),
        ({"a": 1.0}, "`a` must lie strictly between 0 and 1"),
        ({"pursuer": (-1.0, -1.0)}, "`pursuer` must not be inside the obstacle"),
        ({"pursuer": SQUARE}, "`pursuer` must be one position"),
        ({"points": [1.0, 2.0, 3.0]}, "`points` must be positions"),
        ({"points": "here"}, "`points` must be positions"),
        ({"points": [math.inf, 0.0]}, "`points` must be finite"),
    ],
)
def test_a_partition_that_cannot_be_is_refused(change, message):
    arguments = {"pursuer": (1.0, -1.0), "points": SQUARE, "alpha": RIGHT, "a": 0.5, **change}
    with pytest.raises(InvalidInput, match=message):
        partition(**arguments)


def test_a_field_of_another_name_is_refused():
    with pytest.raises(InvalidInput, match="`field` must be one of table, margin, table_up"):
        field_grid("best", (0.0, 1.0), SQUARE, RIGHT, 0.5)
