"""Timing in pairs, and worlds to time in. Run by `make bench`; nothing here asserts a time."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.world import World, make_world


@dataclass(frozen=True)
class Pair:
    """Two timings of the same work.

    Attributes:
        ours, peer: Median wall time of a call [s].
        ratio: Median over the rounds of peer / ours.
    """

    ours: float
    peer: float
    ratio: float


@pytest.fixture(scope="session")
def time_pair() -> Callable[..., Pair]:
    """A function that calls two functions in turn, so that a drift of the machine hits both."""

    def measure(ours: Callable, peer: Callable, rounds: int = 15) -> Pair:
        ours(), peer()  # compile, fill caches
        times = np.empty((rounds, 2))
        for row in times:
            for k, function in enumerate((ours, peer)):
                began = time.perf_counter()
                function()
                row[k] = time.perf_counter() - began
        median = np.median(times, axis=0)
        return Pair(median[0], median[1], float(np.median(times[:, 1] / times[:, 0])))

    return measure


@pytest.fixture(scope="session")
def polygon_world() -> Callable[[int], World]:
    """A function of a number of edges: a 10 m square full of random convex and other polygons."""

    def make(edges: int) -> World:
        rng = np.random.default_rng(edges)
        radius = 2.6 / np.sqrt(edges / 5.0)
        placed: list[shapely.Polygon] = []
        left = edges - 4
        while left >= 3:
            count = left if left < 9 else int(rng.integers(3, 7))
            angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
            radii = radius * rng.uniform(0.5, 1.0, count)
            ring = rng.uniform(radius, 10 - radius, 2) + np.column_stack(
                [radii * np.cos(angles), radii * np.sin(angles)]
            )
            outline = shapely.Polygon(ring)
            apart = all(outline.distance(other) > 0.02 for other in placed)
            if outline.is_valid and outline.area > 0.1 * radius**2 and apart:
                placed.append(outline)
                left -= count
        boundary = [[0, 0], [10, 0], [10, 10], [0, 10]]
        return make_world(boundary, [np.array(each.exterior.coords) for each in placed])

    return make
