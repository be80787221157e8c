"""Arenas drawn at random."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.random_arena import Arena, draw_arena


@pytest.mark.parametrize("seed", range(20))
def test_obstacles_are_rectangles_that_keep_their_distance(seed):
    arena = Arena()
    world = draw_arena(arena, seed)
    boxes = [shapely.Polygon(ring) for ring in world.obstacles]
    assert len(boxes) == arena.obstacles
    wall = shapely.box(0, 0, arena.side, arena.side).exterior
    for k, box in enumerate(boxes):
        assert box.area == pytest.approx(box.envelope.area)
        x_min, y_min, x_max, y_max = box.bounds
        for side in (x_max - x_min, y_max - y_min):
            assert arena.shortest <= side <= arena.longest
        assert box.distance(wall) >= arena.gap - 1e-12
        assert all(box.distance(other) >= arena.gap - 1e-12 for other in boxes[:k])


def test_the_same_seed_gives_the_same_arena_and_another_seed_another():
    first, again, other = (draw_arena(Arena(), seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(np.concatenate(first.rings), np.concatenate(again.rings))
    assert not np.array_equal(np.concatenate(first.rings), np.concatenate(other.rings))


def test_an_arena_may_be_empty():
    assert draw_arena(Arena(obstacles=0), 0).obstacles == ()


def test_obstacles_without_room_are_refused():
    with pytest.raises(InvalidInput, match=r"`arena.obstacles` must find room.*got 60 with"):
        draw_arena(Arena(obstacles=60), 0)


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"side": 0.0}, "`arena.side` must be positive"),
        ({"shortest": 1.0}, "`arena.longest` must be at least `arena.shortest`"),
        ({"longest": 3.9}, "`arena.longest` must fit between walls"),
        ({"obstacles": -1}, "`arena.obstacles` must be zero or positive"),
        ({"gap": -0.1}, "`arena.gap` must be zero or positive"),
    ],
)
def test_impossible_arenas_are_refused(settings, complaint):
    with pytest.raises(InvalidInput, match=complaint):
        Arena(**settings)
