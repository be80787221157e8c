"""Which cells are walls that simplification must not thin away."""

import cv2
import numpy as np
import pytest

from sightfield.systems.numerics.geometry.maps.thin_walls import wall_guards

SIZE = 40


@pytest.fixture
def room():
    """Free cells with a frame of others."""
    cells = np.zeros((SIZE, SIZE), dtype=bool)
    cells[1:-1, 1:-1] = True
    return cells


def guarded(inside: np.ndarray, tolerance: float) -> set[tuple[int, int]]:
    """Row and column of the cells with guards."""
    points = wall_guards(inside, tolerance)
    return {(int(row), int(column)) for column, row in np.floor(points)}


def test_an_empty_room_has_no_guards(room):
    assert guarded(room, 1.0) == set()


@pytest.mark.parametrize("step", [(0, 1), (1, 0), (1, 1), (-1, 1)])
def test_every_cell_of_a_wall_one_cell_thick_is_guarded(room, step):
    wall = {(20 + k * step[0], 20 + k * step[1]) for k in range(10)}
    room[tuple(np.array(sorted(wall)).T)] = False
    assert guarded(room, 1.0) == wall


def test_guards_surround_the_middle_of_a_cell(room):
    room[20, 10:30] = False
    around = wall_guards(room, 1.0)[:4] - [10.5, 20.5]
    assert sorted(map(tuple, around)) == [(-0.25, 0.0), (0.0, -0.25), (0.0, 0.25), (0.25, 0.0)]


def test_what_is_thicker_than_two_tolerances_needs_no_guard(room):
    room[20:23, 10:30] = False
    assert guarded(room, 1.0) == set()
    assert guarded(room, 1.5) != set()


def test_a_bump_is_no_wall_and_a_wall_on_something_thick_is(room):
    room[10:20, 10:20] = False
    room[20, 15] = False
    assert guarded(room, 1.0) == set()
    room[20:23, 15] = False
    assert guarded(room, 1.0) == {(20, 15), (21, 15), (22, 15)}


def test_a_bump_on_a_thin_obstacle_is_no_wall_either(room):
    room[10:16, 10:16] = False
    room[16, 12] = False
    assert (16, 12) not in guarded(room, 4.0)
    assert guarded(room, 4.0) != set()


def test_a_stub_of_the_border_counts_from_the_border(room):
    room[1, 20] = False
    assert guarded(room, 1.0) == set()
    room[1:6, 20] = False
    assert {(row, 20) for row in range(1, 6)} == guarded(room, 1.0)


def test_a_region_that_is_thin_everywhere_is_guarded_itself():
    corridor = np.zeros((10, SIZE), dtype=bool)
    corridor[5, 3:-3] = True
    assert guarded(corridor, 1.0) == {(5, column) for column in range(3, SIZE - 3)}


def test_every_thin_obstacle_keeps_a_guard(room):
    rng = np.random.default_rng(3)
    room[5:35, 5:35] &= rng.random((30, 30)) > 0.2
    points = wall_guards(room, 50.0)
    assert len(points) > 0
    # With a tolerance larger than the room, every obstacle is thin.
    _, parts = cv2.connectedComponents((~room).astype(np.uint8), connectivity=8)
    kept = {int(parts[int(y), int(x)]) for x, y in points}
    assert kept >= set(range(1, parts.max() + 1)) - {int(parts[0, 0])}
