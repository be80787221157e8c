"""A search in the arena of the built-in games."""

from collections.abc import Callable

import pytest

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.world import World, make_world
from sightfield.systems.numerics.vision.whereabouts.evader_tracks import Search
from sightfield.systems.numerics.vision.whereabouts.reachable_set import make_place_grid


@pytest.fixture(scope="session")
def block() -> World:
    """A room of 4 m x 3 m with a block in it."""
    return make_world([[0, 0], [4, 0], [4, 3], [0, 3]], [[[1.5, 1], [2.5, 1], [2.5, 2], [1.5, 2]]])


@pytest.fixture(scope="session")
def search_of(block) -> Callable[..., Search]:
    """A search for evaders of some colours in that room."""

    def search(*colours: int) -> Search:
        speed = 0.09
        return Search(
            grid=make_place_grid([block], 3000),
            walls=build_edge_index(block),
            colours=colours,
            speed=speed,
            density=speed**2 / 0.15,
            shell_radius=0.1,
            certain_range=(0.3, 5.0),
            body_radius=0.1,
        )

    return search
