"""Starts lie in their regions, apart from one another, and every evader is seen."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.random_starts import SPACING, draw_starts

# Two rooms with a wall between them that leaves a gap at the top.
ROOMS = make_world([[0, 0], [6, 0], [6, 4], [0, 4]], [[[2.9, 0], [3.1, 0], [3.1, 3], [2.9, 3]]])
LEFT = make_world([[0.5, 0.5], [2.5, 0.5], [2.5, 3.5], [0.5, 3.5]], [])
WHOLE = make_world([[0.5, 0.5], [5.5, 0.5], [5.5, 3.5], [0.5, 3.5]], [])
RADII = {"pursuer_radius": 0.3, "evader_radius": 0.2}


@pytest.mark.parametrize("seed", range(8))
def test_teams_start_apart_in_their_regions_and_evaders_in_sight(seed):
    pursuers, evaders = draw_starts(ROOMS, LEFT, WHOLE, **RADII, pursuers=3, evaders=4, seed=seed)
    assert (pursuers.shape, evaders.shape) == ((3, 2), (4, 2))
    assert all(LEFT.polygon.contains(shapely.Point(each)) for each in pursuers)
    assert all(WHOLE.polygon.contains(shapely.Point(each)) for each in evaders)
    for evader in evaders:
        rays = [shapely.LineString([evader, each]) for each in pursuers]
        assert any(ROOMS.polygon.covers(ray) for ray in rays)
    points, radii = np.vstack([pursuers, evaders]), np.repeat([0.3, 0.2], [3, 4])
    gaps = np.hypot(*(points[:, None] - points).T) + 10 * np.eye(7)
    assert (gaps > SPACING * (radii[:, None] + radii)).all()


def test_the_seed_decides_and_evaders_use_all_that_is_seen():
    def draw(seed):
        return np.vstack(draw_starts(ROOMS, LEFT, WHOLE, **RADII, pursuers=2, evaders=3, seed=seed))

    assert (draw(1) == draw(1)).all()
    assert (draw(1) != draw(2)).any()
    # The gap shows some of the other room.
    assert max(draw(seed)[2:, 0].max() for seed in range(20)) > 3.1


@pytest.mark.parametrize(
    ("pursuers", "evaders", "says"),
    [
        (60, 1, "`pursuers` must fit into the world; no room for number"),
        (1, 300, "`evaders` must fit where a pursuer sees them; no room for number"),
    ],
)
def test_teams_that_do_not_fit_are_refused(pursuers, evaders, says):
    with pytest.raises(InvalidInput, match=says):
        draw_starts(ROOMS, LEFT, WHOLE, **RADII, pursuers=pursuers, evaders=evaders, seed=0)
