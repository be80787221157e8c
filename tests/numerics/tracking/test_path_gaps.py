"""Gaps on a path against what a dense simulation finds."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.tracking.collision_stop import (
    SAMPLES,
    gap_to_paths,
    gap_to_runners,
)


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def test_a_runner_that_goes_for_the_path_is_met_where_the_gap_is_negative(rng):
    for _ in range(200):
        start, end = rng.uniform(-1, 1, (2, 2))
        runners, contacts = rng.uniform(-1, 1, (3, 2)), rng.uniform(0.05, 0.2, 3)
        seconds, speed = (0.3, 1.4), 0.2
        found = gap_to_runners(start, end, seconds, runners, contacts, speed)
        # Each runs straight for where the robot will be at some moment of its way.
        least = np.inf
        for part in np.linspace(0, 1, 401):
            place, time = start + part * (end - start), 0.3 + 1.1 * part
            apart = np.hypot(*(runners - place).T)
            least = min(least, (apart - contacts - speed * time).min())
        assert least - 1e-9 <= found + 1e-9
        assert found - least <= np.hypot(*(end - start)) / (SAMPLES - 1)


def test_robots_that_stand_and_paths_of_teammates(rng):
    for _ in range(200):
        start, end = rng.uniform(-1, 1, (2, 2))
        spots, contacts = rng.uniform(-1, 1, (4, 2)), rng.uniform(0.05, 0.2, 4)
        way = shapely.LineString([start, end])
        standing = gap_to_runners(start, end, (0.0, 1.0), spots, contacts, 0.0)
        exact = (shapely.distance(way, shapely.points(spots)) - contacts).min()
        slack = np.hypot(*(end - start)) / (2 * SAMPLES - 2)
        assert exact - 1e-12 <= standing <= exact + slack + 1e-12
        ends = rng.uniform(-1, 1, (4, 2))
        others = shapely.linestrings(np.stack([spots, ends], axis=1))
        exact = (shapely.distance(way, others) - contacts).min()
        found = gap_to_paths(start, end, np.hstack([spots, ends]), contacts)
        assert exact - 1e-12 <= found <= exact + slack + 1e-12


def test_nobody_is_in_nobodys_way():
    none = np.zeros((0, 2)), np.zeros(0)
    assert gap_to_runners(np.zeros(2), np.ones(2), (0.0, 1.0), *none, 0.2) == np.inf
    assert gap_to_paths(np.zeros(2), np.ones(2), np.zeros((0, 4)), none[1]) == np.inf
