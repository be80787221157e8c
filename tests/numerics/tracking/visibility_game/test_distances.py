"""How far an evader is from being lost: against SciPy's distance transform of whole planes."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from sightfield.systems.numerics.geometry.random_arena import Arena, draw_arena
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.visibility_game.board import distances_to_losing
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.planes import TILE, tile_of

ROOMS = {
    "arena": draw_arena(Arena(), 2),
    # Two rooms, of which one is seen through a door alone.
    "door": make_world(
        [*[(0, 0), (4, 0), (4, 2.4), (2.6, 2.4), (2.6, 1.3), (2, 1.3), (2, 2.4), (0, 2.4)]]
    ),
    # Nothing is ever lost.
    "square": make_world([(0, 0), (2, 0), (2, 2), (0, 2)]),
}


@pytest.mark.parametrize("name", ROOMS)
@pytest.mark.parametrize("sight_range", [np.inf, 1.6])
def test_distances_are_those_of_the_distance_transform(name, sight_range):
    table = solve_visibility_game(
        ROOMS[name], pursuer_speed=1.0, evader_speed=0.3, grid=0.25, sight_range=sight_range
    )
    distances = distances_to_losing(table.planes, table.rules)
    positive = 0
    for p, place in enumerate(table.places):
        times = table.times_from(place)
        kept = np.isinf(times) | np.isnan(times)
        expected = distance_transform_edt(kept) if not kept.all() else np.full(kept.shape, 255.0)
        for row, column in np.argwhere(np.isinf(times)):
            t = tile_of(table.planes, p, row // TILE, column // TILE)
            found = distances[t, row % TILE * TILE + column % TILE]
            assert found == min(int(expected[row, column]), 255)
            positive += found > 0
    assert positive > 1000
