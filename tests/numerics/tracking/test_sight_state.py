"""One vector holds all that two teams see."""

import numpy as np

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import are_clear, build_corner_index
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.sight_state import observe, sight_size, split_sight


def test_the_blocks_are_sight_along_each_line():
    world = make_world([[0, 0], [4, 0], [4, 4], [0, 4]], [[[1, 1], [2, 1], [2, 2], [1, 2]]])
    index = build_edge_index(world)
    rng = np.random.default_rng(0)
    pursuers, evaders = rng.uniform(2, 4, (2, 2)), rng.uniform(0, 1, (3, 2))
    corners = build_corner_index(world, index)
    sight = observe(index, corners, pursuers.ravel(), evaders.ravel())
    assert len(sight) == sight_size(2, 3, 4) == 2 * 3 + 2 * 4 + 3 * 4
    blocks = split_sight(sight, 2, 3, 4)
    pairs = ((pursuers, evaders), (pursuers, corners.points), (evaders, corners.points))
    for block, (a, b) in zip(blocks, pairs, strict=True):
        clear = are_clear(index, np.repeat(a, len(b), axis=0), np.tile(b, (len(a), 1)))
        np.testing.assert_array_equal(block, clear.reshape(len(a), len(b)))
