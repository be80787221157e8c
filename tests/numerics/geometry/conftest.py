"""Random worlds for the geometry tests."""

from collections.abc import Callable

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.world import World, make_world

SIZE = 10.0


def _random_obstacles(rng: np.random.Generator, count: int) -> list[np.ndarray]:
    """Star-shaped polygons, convex or not, that keep a small distance from each other."""
    placed: list[shapely.Polygon] = []
    while len(placed) < count:
        vertices = rng.integers(3, 9)
        angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, vertices))
        radii = rng.uniform(0.05, 0.45) * rng.uniform(0.3, 1.0, vertices)
        centre = rng.uniform(0.5, SIZE - 0.5, 2)
        outline = shapely.Polygon(
            centre + np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])
        )
        apart = all(outline.distance(other) > 0.01 for other in placed)
        if outline.is_valid and outline.area > 0.003 and apart:
            placed.append(outline)
    return [np.array(outline.exterior.coords) for outline in placed]


@pytest.fixture
def random_world() -> Callable[[int, int], World]:
    """A function of seed and number of obstacles that makes a 10 m x 10 m world."""

    def make(seed: int, obstacles: int) -> World:
        rng = np.random.default_rng(seed)
        # A notch makes the boundary non-convex.
        boundary = [
            [0, 0],
            [SIZE, 0],
            [SIZE, SIZE],
            [5.2, SIZE],
            [5.0, 9.6],
            [4.8, SIZE],
            [0, SIZE],
        ]
        return make_world(boundary, _random_obstacles(rng, obstacles))

    return make


@pytest.fixture
def free_points() -> Callable[[World, int, int], np.ndarray]:
    """A function of world, seed and number that draws points in the free region."""

    def draw(world: World, seed: int, count: int) -> np.ndarray:
        rng = np.random.default_rng(seed)
        low, high = world.bounds[:2], world.bounds[2:]
        points = rng.uniform(low, high, (20 * count, 2))
        return points[shapely.contains_xy(world.polygon, points)][:count]

    return draw


@pytest.fixture
def moved() -> Callable[..., tuple[World, Callable[[np.ndarray], np.ndarray]]]:
    """A function that rotates, mirrors, scales and translates a world, and maps points along."""

    def move(world: World, angle: float, mirror: bool, scale: float, shift: tuple[float, float]):
        c, s = np.cos(angle), np.sin(angle)
        matrix = scale * np.array([[c, -s], [s, c]]) @ np.diag([1.0, -1.0 if mirror else 1.0])

        def carry(points: np.ndarray) -> np.ndarray:
            return points @ matrix.T + np.asarray(shift)

        rings = [carry(ring) for ring in world.rings]
        # Another first vertex and another order of the obstacles must not matter either.
        rings = [np.roll(ring, 2, axis=0) for ring in rings]
        return make_world(rings[0], rings[:0:-1]), carry

    return move
