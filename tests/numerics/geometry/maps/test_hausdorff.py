"""The Hausdorff distance is that of the outlines, not of their vertices."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.geometry.maps.hausdorff import hausdorff_distance

SQUARE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])


def test_equal_outlines_are_at_no_distance():
    assert hausdorff_distance([SQUARE], [np.roll(SQUARE, 1, axis=0)], 1e-6) == 0.0


def test_a_shifted_square_is_as_far_as_it_was_shifted():
    assert hausdorff_distance([SQUARE], [SQUARE + np.array([1.0, 0.0])], 1e-6) == pytest.approx(1.0)


def test_a_larger_square_is_farthest_at_its_corners():
    larger = 1.5 * (SQUARE - 2.0) + 2.0
    assert hausdorff_distance([SQUARE], [larger], 1e-6) == pytest.approx(np.sqrt(2.0))


def test_the_farthest_point_may_lie_inside_an_edge():
    left = np.array([[0.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])
    right = np.array([[10.0, 0.0], [11.0, 0.0], [10.0, 1.0]])
    joined = np.array([[-1.0, 0.0], [11.0, 0.0], [10.0, 1.0], [0.0, 1.0]])
    # The upper edge runs from one tip to the other, 10 apart, the lower as far below.
    assert hausdorff_distance([left, right], [joined], 1e-6) == pytest.approx(5.0, abs=1e-5)


def test_the_order_does_not_matter():
    inner = SQUARE[:3] / 8.0
    assert hausdorff_distance([SQUARE], [inner], 1e-9) == pytest.approx(
        hausdorff_distance([inner], [SQUARE], 1e-9)
    )


@given(seed=st.integers(0, 2**32 - 1))
def test_it_agrees_with_dense_samples(seed):
    rng = np.random.default_rng(seed)
    one, other = ([rng.uniform(0, 5, (rng.integers(3, 7), 2))] for _ in range(2))

    def line(rings):
        return shapely.MultiLineString([np.vstack([ring, ring[:1]]) for ring in rings])

    fine = 0.02
    sampled = [shapely.segmentize(line(rings), fine) for rings in (one, other)]
    expected = max(
        shapely.distance(shapely.points(shapely.get_coordinates(a)), b).max()
        for a, b in [(sampled[0], line(other)), (sampled[1], line(one))]
    )
    # Between samples the distance grows by at most half their spacing.
    assert -1e-9 <= hausdorff_distance(one, other, 1e-9) - expected <= fine / 2
