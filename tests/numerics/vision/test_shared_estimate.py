"""One estimate of each evader from all pictures."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.vision.shared_estimate import (
    Tracks,
    Whereabouts,
    correct,
    no_tracks,
    predict,
)

WORLD = make_world([[0, 0], [4, 0], [4, 3], [0, 3]], [[[1, 1], [2, 1], [2, 2], [1, 2]]])
YES = np.array([True])


def measured(*spots, spread=0.1):
    positions = np.array(spots, dtype=float)
    return positions, np.tile(spread**2 * np.eye(2), (len(spots), 1, 1))


def test_nothing_is_known_before_the_first_picture_and_then_what_it_says():
    tracks = no_tracks(2)
    assert not tracks.known.any()
    positions, covariances = measured([1, 2], [3, 1])
    tracks = correct(tracks, np.array([False, True]), positions, covariances)
    np.testing.assert_array_equal(tracks.known, [False, True])
    np.testing.assert_array_equal(tracks.positions[1], [3, 1])


@given(st.integers(1, 20))
def test_equal_measurements_of_a_still_evader_average(count):
    rng = np.random.default_rng(count)
    spots = 2 + 0.1 * rng.standard_normal((count, 2))
    tracks = no_tracks(1)
    for spot in spots:
        tracks = correct(tracks, YES, *measured(spot))
    np.testing.assert_allclose(tracks.positions[0], spots.mean(axis=0), atol=1e-12)
    np.testing.assert_allclose(tracks.covariances[0], 0.01 / count * np.eye(2), atol=1e-14)


def test_cameras_that_see_different_directions_well_complete_each_other():
    across, along = np.diag([1e-4, 1.0])[None], np.diag([1.0, 1e-4])[None]
    tracks = correct(no_tracks(1), YES, np.array([[1.0, 5.0]]), across)
    tracks = correct(tracks, YES, np.array([[1.5, 4.0]]), along)
    np.testing.assert_allclose(tracks.positions[0], [1, 4], atol=1e-3)
    assert np.trace(tracks.covariances[0]) < 3e-4


def test_the_order_of_cameras_does_not_matter():
    first, second = measured([1, 2], spread=0.3), measured([1.2, 1.9], spread=0.1)
    start = correct(no_tracks(1), YES, *measured([1.1, 2.1], spread=0.2))
    one = correct(correct(start, YES, *first), YES, *second)
    other = correct(correct(start, YES, *second), YES, *first)
    np.testing.assert_allclose(one.positions, other.positions, atol=1e-12)
    np.testing.assert_allclose(one.covariances, other.covariances, atol=1e-12)


def test_out_of_sight_the_estimate_stays_and_grows_less_certain():
    tracks = correct(no_tracks(1), YES, *measured([1, 2]))
    later = predict(tracks, 0.09, 0.1)
    np.testing.assert_array_equal(later.positions, tracks.positions)
    growth = later.covariances[0] - tracks.covariances[0]
    np.testing.assert_allclose(growth, 4 * 0.009**2 * np.eye(2))


def test_a_mistake_is_left_out_but_repeated_it_is_believed_in_the_end():
    tracks = correct(no_tracks(1), YES, *measured([1, 2], spread=0.02))
    once = correct(predict(tracks, 0.09, 0.1), YES, *measured([2, 2], spread=0.02))
    np.testing.assert_array_equal(once.positions, tracks.positions)
    steps = 0
    while tracks.positions[0, 0] < 1.9:
        tracks = correct(predict(tracks, 0.09, 0.1), YES, *measured([2, 2], spread=0.02))
        steps += 1
        assert steps < 1000
    assert steps > 10


@pytest.mark.parametrize(
    ("spot", "place"),
    [([3, 1], [3, 1]), ([1.4, 1.1], [1.4, 1.0]), ([-1, 1.5], [0, 1.5]), ([2, 1.5], [2, 1.5])],
)
def test_an_estimate_in_a_wall_is_moved_to_the_nearest_free_place(spot, place):
    tracks = Tracks(np.array([spot], dtype=float), np.zeros((1, 2, 2)))
    np.testing.assert_allclose(Whereabouts([WORLD]).places(tracks), [place], atol=1e-12)


def test_an_evader_never_seen_is_put_outside_the_world():
    x, y = Whereabouts([WORLD]).places(no_tracks(1))[0]
    assert x < -1
    assert y < -1
