"""Ratios of means, with intervals from samples drawn again."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.statistics import ratio_of_means


def test_nine_times_in_ten_the_interval_holds_the_true_ratio():
    """Groups of four alike runs, true ratio 1.5; an interval of the runs would be half as wide."""
    rng, groups = np.random.default_rng(5), np.repeat(np.arange(40), 4)
    hits = 0
    for _ in range(200):
        common = rng.uniform(5.0, 35.0, 40)
        second = np.repeat(common, 4) + rng.uniform(0.0, 1.0, 160)
        # As a strategy that is better in half of the arenas only.
        gain = np.repeat(rng.choice([1.0, 2.0], 40), 4)
        found = ratio_of_means(gain * second, second, groups, confidence=0.9)
        assert found.low <= found.value <= found.high
        assert found.count == 160
        hits += found.low <= 1.5 <= found.high
    # Binomial, 180 expected, standard deviation 4.2.
    assert 165 <= hits <= 195


def test_a_ratio_that_is_the_same_in_every_run_is_known():
    second = np.array([3.0, 7.0, 20.0, 1.0, 4.0])
    found = ratio_of_means(2.5 * second, second, [0, 0, 1, 1, 2])
    assert found.value == found.low == found.high == pytest.approx(2.5)


def test_groups_that_are_all_one_tell_nothing_of_others():
    found = ratio_of_means([2.0, 4.0], [1.0, 1.0], [7, 7])
    assert (found.value, found.low, found.high) == (3.0, 0.0, np.inf)


@pytest.mark.parametrize(
    ("first", "second", "groups", "complaint"),
    [
        ([1.0], [1.0, 2.0], [0, 1], "`first` must be as long as `second` and `groups`; got"),
        ([1.0, 2.0], [1.0, 2.0], [0], "`first` must be as long as `second` and `groups`; got"),
        ([], [], [], "`first` must be as long as"),
        ([1.0, 2.0], [0.0, 0.0], [0, 1], "`second` must have a mean above zero; got 0.0"),
    ],
)
def test_samples_that_do_not_fit_are_refused(first, second, groups, complaint):
    with pytest.raises(InvalidInput, match=complaint):
        ratio_of_means(first, second, groups)
