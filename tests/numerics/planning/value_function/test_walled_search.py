"""Paths searched from a table: clear of walls, into the box, or not at all."""

import pytest

from sightfield.systems.numerics.planning.planners.from_table import grid_within
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.obstacles import with_spare
from sightfield.systems.numerics.planning.value_function.solve import solve_value_function
from sightfield.systems.numerics.planning.value_function.walled_search import search_path

CART = Trailer()


@pytest.fixture(scope="module")
def rows(standing_rows):
    """A coarse table, and the walls with a little to spare."""
    world, _, goal = standing_rows
    value = solve_value_function(CART, goal, grid_within(world, CART, goal, 0.3), obstacles=world)
    return value, with_spare(value.walls, 2e-3)


@pytest.mark.parametrize(
    "start", [(6.0, 2.6, 0.0, 0.0), (2.0, 1.0, 0.3, -0.5), (2.5, 2.0, 2.0, 0.4), (9.0, 4.0, 1.5, 0)]
)
def test_a_searched_path_arrives_clear_of_walls(rows, standing_rows, depth_in_walls, start):
    value, walls = rows
    path = search_path(value, walls, start, value.goal).path
    assert tuple(path.states[0]) == start
    assert max(value.goal.miss(path.states[-1])) < 1e-9
    # Even a coarse table leads to a path not much longer than it promises.
    assert path.times[-1] < 1.2 * value.time_to_go(start)
    assert depth_in_walls(standing_rows[0], path) < 0


def test_from_a_dead_end_there_is_no_path(rows):
    value, walls = rows
    search = search_path(value, walls, (0.5, 2.0, 3.14, 0.0), value.goal)
    assert search.path is None
    assert search.steps < 100
