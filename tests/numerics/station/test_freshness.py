"""How old is too old."""

import numpy as np

from sightfield.systems.numerics.station.freshness import freshness


def test_valid_up_to_the_limit_and_not_beyond():
    valid, ages = freshness(10.0, np.array([9.95, 9.9, 9.89]), 0.1)
    assert valid.tolist() == [1, 1, 0]
    assert np.allclose(ages, [0.05, 0.1, 0.11])


def test_what_was_never_seen_is_infinitely_old():
    valid, ages = freshness(10.0, np.array([-np.inf]), 1e9)
    assert (valid[0], ages[0]) == (0, np.inf)


def test_a_stamp_of_the_future_is_new():
    valid, ages = freshness(1.0, np.array([1.5]), 0.1)
    assert (valid[0], ages[0]) == (1, 0)
