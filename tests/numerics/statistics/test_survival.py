"""Times that a horizon cuts off."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.statistics import kaplan_meier, restricted_mean

HORIZON = 100.0


def exponential(count, seed, mean=80.0):
    """Times of loss at a constant rate, cut off at the horizon, and which were losses."""
    times = np.random.default_rng(seed).exponential(mean, count)
    return np.minimum(times, HORIZON), times <= HORIZON


def test_without_censoring_the_curve_is_the_share_of_longer_times():
    times = np.array([3.0, 1.0, 2.0, 4.0])
    curve = kaplan_meier(times, np.ones(4, bool))
    np.testing.assert_array_equal(curve.times, [1.0, 2.0, 3.0, 4.0])
    np.testing.assert_allclose(curve.survival, [0.75, 0.5, 0.25, 0.0], atol=1e-15)


def test_remission_times_of_leukaemia_patients():
    """6-MP arm of Freireich et al. (1963), the textbook example; S(10) = 0.753, S(23) = 0.448."""
    times = [6, 6, 6, 6, 7, 9, 10, 10, 11, 13, 16, 17, 19, 20, 22, 23, 25, 32, 32, 34, 35]
    lost = [1, 1, 1, 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0]
    curve = kaplan_meier(times, lost)
    at = dict(zip(curve.times, curve.survival, strict=True))
    assert at[6] == pytest.approx(0.857, abs=5e-4)
    assert at[10] == pytest.approx(0.753, abs=5e-4)
    assert at[23] == pytest.approx(0.448, abs=5e-4)


def test_the_interval_of_the_curve_holds_the_truth_about_as_often_as_it_says():
    truth, hits = math.exp(-50.0 / 80.0), 0
    for seed in range(300):
        curve = kaplan_meier(*exponential(60, seed))
        k = np.searchsorted(curve.times, 50.0, side="right") - 1
        hits += curve.low[k] <= truth <= curve.high[k]
    assert 0.91 < hits / 300 < 0.99


def test_the_interval_of_the_mean_holds_the_truth_about_as_often_as_it_says():
    truth, hits = 80.0 * (1.0 - math.exp(-HORIZON / 80.0)), 0
    for seed in range(400):
        mean = restricted_mean(*exponential(40, seed), HORIZON)
        hits += mean.low <= truth <= mean.high
    assert 0.92 < hits / 400 < 0.98


@given(st.lists(st.floats(0.0, 150.0), min_size=2, max_size=40))
def test_cut_off_at_one_horizon_the_restricted_mean_is_the_sample_mean(raw):
    times = np.minimum(raw, HORIZON)
    mean = restricted_mean(times, np.array(raw) <= HORIZON, HORIZON)
    assert mean.value == pytest.approx(times.mean(), abs=1e-9)
    error = times.std(ddof=1) / math.sqrt(len(raw))
    assert mean.standard_error == pytest.approx(error, abs=1e-6)
    assert 0.0 <= mean.low <= mean.value + 1e-9
    assert mean.value - 1e-9 <= mean.high <= HORIZON


def test_runs_that_ended_early_count_for_the_time_they_lasted():
    """By hand: S = 2/3 from 10 on, then 0 from 60 on, the run of 30 s having left the risk set."""
    mean = restricted_mean([10.0, 30.0, 60.0], [True, False, True], HORIZON)
    assert mean.value == pytest.approx(10.0 + 50.0 * 2 / 3)
    # Greenwood's single term, (50 * 2/3)^2 * 1 / (3 * 2), times 3/2.
    assert mean.standard_error == pytest.approx(math.sqrt((100 / 3) ** 2 / 6 * 1.5))


def test_losses_after_the_horizon_do_not_count():
    assert restricted_mean([150.0, 20.0], [True, True], HORIZON).value == pytest.approx(60.0)


def test_without_any_loss_the_mean_is_the_horizon_but_not_for_certain():
    few = restricted_mean([HORIZON] * 5, [False] * 5, HORIZON)
    many = restricted_mean([HORIZON] * 500, [False] * 500, HORIZON)
    assert few.value == few.high == many.value == HORIZON
    # Clopper and Pearson: 0.025 = p^n.
    assert few.low == pytest.approx(HORIZON * 0.025 ** (1 / 5))
    assert few.low < many.low < HORIZON


def test_a_single_run_says_nothing_about_the_spread():
    alone = restricted_mean([40.0], [True], HORIZON)
    assert (alone.value, alone.low, alone.high) == (40.0, 0.0, HORIZON)


@pytest.mark.parametrize(
    ("times", "lost", "horizon", "complaint"),
    [
        ([], [], 1.0, "`times` must hold at least one run"),
        ([1.0], [True, False], 1.0, "`times` must match `lost`"),
        ([np.nan], [True], 1.0, "`times` must be finite and not negative"),
        ([-1.0], [True], 1.0, "`times` must be finite and not negative"),
        ([1.0], [True], 0.0, "`horizon` must be positive"),
    ],
)
def test_nonsense_is_refused(times, lost, horizon, complaint):
    with pytest.raises(InvalidInput, match=complaint):
        restricted_mean(times, lost, horizon)
