"""Slopes over a level, and the variance between means without the noise of the means."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.statistics import run_slopes, spread_of_means, spread_trend


@given(seed=st.integers(0, 1000), runs=st.integers(1, 5), levels=st.integers(2, 6))
def test_slopes_are_those_of_least_squares(seed, runs, levels):
    rng = np.random.default_rng(seed)
    values, at = rng.normal(size=(runs, levels)), np.sort(rng.uniform(0, 9, levels))
    fitted = [np.polyfit(at, row, 1)[0] for row in values]
    np.testing.assert_allclose(run_slopes(values, at), fitted, rtol=1e-6, atol=1e-8)


def test_the_spread_of_means_is_unbiased():
    rng = np.random.default_rng(0)
    truth = np.array([1.0, 2.0, 4.0])
    # Runs have a level of their own, which no difference between treatments sees.
    samples = truth + rng.normal(size=(4000, 6, 3)) + 5 * rng.normal(size=(4000, 6, 1))
    found = spread_of_means(samples)
    error = found.std() / np.sqrt(len(found))
    assert abs(found.mean() - truth.var(ddof=1)) < 4 * error
    # Without taking off the noise it would be off by far more than that.
    assert abs(samples.mean(axis=1).var(axis=1, ddof=1).mean() - truth.var(ddof=1)) > 8 * error


@pytest.mark.parametrize("sign", [-1, 1])
def test_a_spread_that_grows_or_shrinks_is_seen(sign):
    rng = np.random.default_rng(1)
    levels = np.arange(1.0, 7.0)
    size = levels if sign > 0 else 7 - levels
    samples = size[:, None, None] * np.array([-1.0, 0.0, 1.0]) + rng.normal(size=(6, 200, 3))
    found = spread_trend(samples, levels)
    assert found.low < found.value < found.high
    assert found.low > 0 if sign > 0 else found.high < 0


def test_a_spread_that_stays_is_within_its_interval():
    rng = np.random.default_rng(2)
    levels = np.arange(1.0, 7.0)
    hits = 0
    for seed in range(8):
        samples = np.array([-1.0, 0.0, 1.0]) + rng.normal(size=(6, 60, 3))
        found = spread_trend(samples, levels, seed=seed)
        hits += found.low <= 0.0 <= found.high
    # Fewer than 5 of 8 intervals of 95% hold the truth once in 3000 times.
    assert hits >= 5


@pytest.mark.parametrize(
    ("shape", "levels", "message"),
    [
        ((3, 4), [1, 2], "`values` must have a column for each level"),
        ((3, 2), [1, 1], "`levels` must not be all the same"),
    ],
)
def test_slopes_over_nothing_are_refused(shape, levels, message):
    with pytest.raises(InvalidInput, match=message):
        run_slopes(np.zeros(shape), levels)


def test_a_single_run_has_no_trend_to_show():
    with pytest.raises(InvalidInput, match="`samples` must hold two runs of two treatments"):
        spread_trend(np.zeros((3, 1, 3)), [1, 2, 3])
