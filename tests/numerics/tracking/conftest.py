"""What the tests of motion share."""

import pytest
import shapely


def least_distance(offset, change):
    """Of two that move straight for a moment: from their offset, and by how much it changes."""
    return shapely.LineString([offset, offset + change]).distance(shapely.Point(0, 0))


@pytest.fixture(scope="session")
def least_distances():
    """A function from positions and steps to the least distances of all pairs, by (i, j)."""

    def distances(positions, steps):
        p, d = positions.reshape(-1, 2), steps.reshape(-1, 2)
        count = range(len(p))
        return {(i, j): least_distance(p[i] - p[j], d[i] - d[j]) for i in count for j in range(i)}

    return distances
