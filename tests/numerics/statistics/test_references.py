"""Estimates and their intervals are those of a second computation, with no case left out."""

import math

import numpy as np
import pytest
from scipy import stats

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.statistics import (
    holm,
    kaplan_meier,
    paired_difference,
    ratio_of_means,
    require_confidence,
    restricted_mean,
    run_slopes,
    share,
    spread_of_means,
    spread_trend,
)


def censored(seed, count=23, horizon=40.0):
    """Times in whole seconds, so that several are equal, and which of them were losses."""
    rng = np.random.default_rng(seed)
    times = np.ceil(rng.exponential(30.0, count))
    return np.minimum(times, horizon), (times <= horizon) & (rng.random(count) < 0.7)


@pytest.mark.parametrize("confidence", [0.8, 0.95])
@pytest.mark.parametrize(("hits", "count"), [(0, 7), (3, 11), (11, 11), (40, 90)])
def test_wilson_s_interval_is_his_formula(hits, count, confidence):
    found = share(hits, count, confidence)
    z = stats.norm.ppf(0.5 + 0.5 * confidence)
    p = hits / count
    middle = (p + z**2 / (2 * count)) / (1 + z**2 / count)
    half = z / (1 + z**2 / count) * math.sqrt(p * (1 - p) / count + z**2 / (4 * count**2))
    assert (found.low, found.high) == pytest.approx((middle - half, middle + half), abs=1e-12)
    assert (found.value, found.count) == (p, count)
    assert found.standard_error == pytest.approx(math.sqrt(p * (1 - p) / count))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("confidence", [0.7, 0.95])
def test_the_survival_curve_is_the_product_of_its_steps(seed, confidence):
    times, lost = censored(seed)
    curve = kaplan_meier(times, lost, confidence)
    np.testing.assert_array_equal(curve.times, np.unique(times))
    survival, greenwood = 1.0, 0.0
    z = stats.norm.ppf(0.5 + 0.5 * confidence)
    for time, value, low, high in zip(
        curve.times, curve.survival, curve.low, curve.high, strict=True
    ):
        at_risk, losses = (times >= time).sum(), (lost & (times == time)).sum()
        survival *= 1 - losses / at_risk
        assert value == pytest.approx(survival, abs=1e-12)
        if survival in (0.0, 1.0):
            assert (low, high) == (value, value)
            continue
        greenwood += losses / (at_risk * (at_risk - losses))
        # Of log(-log S), the ends of whose interval are powers of S.
        reach = z * math.sqrt(greenwood) / abs(math.log(survival))
        ends = survival ** math.exp(reach), survival ** math.exp(-reach)
        assert (low, high) == pytest.approx(ends, abs=1e-9)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("horizon", "confidence"), [(40.0, 0.95), (23.0, 0.8), (57.0, 0.9)])
def test_the_restricted_mean_is_the_area_under_the_curve(seed, horizon, confidence):
    times, lost = censored(seed)
    found = restricted_mean(times, lost, horizon, confidence)
    fine = np.linspace(0.0, horizon, 200_001)
    curve = kaplan_meier(times, lost)
    at = np.searchsorted(curve.times, fine, side="right") - 1
    survival = np.where(at < 0, 1.0, curve.survival[np.maximum(at, 0)])
    area = np.concatenate([[0.0], np.cumsum(survival[:-1]) * (fine[1] - fine[0])])
    assert found.value == pytest.approx(area[-1], abs=1e-3)
    variance = 0.0
    for time in np.unique(times[lost & (times <= horizon)]):
        at_risk, losses = (times >= time).sum(), (lost & (times == time)).sum()
        right = area[-1] - np.interp(time, fine, area)
        if at_risk > losses:
            variance += right**2 * losses / (at_risk * (at_risk - losses))
    error = math.sqrt(variance * len(times) / (len(times) - 1))
    assert found.standard_error == pytest.approx(error, rel=1e-4)
    reach = stats.t.ppf(0.5 + 0.5 * confidence, len(times) - 1) * found.standard_error
    assert found.low == pytest.approx(max(found.value - reach, 0.0))
    assert found.high == pytest.approx(min(found.value + reach, horizon))
    assert found.count == len(times)


def test_intervals_of_restricted_means_end_within_the_horizon():
    short = restricted_mean([1.0, 99.0, 2.0], [True, True, True], 100.0)
    assert short.low == 0.0
    long = restricted_mean([97.0, 100.0, 100.0, 30.0], [True, False, False, True], 100.0, 0.999)
    assert long.high == 100.0


@pytest.mark.parametrize("confidence", [0.9, 0.95])
def test_without_a_loss_the_lower_end_is_clopper_s_and_pearson_s(confidence):
    found = restricted_mean([60.0, 61.0, 90.0], [False, False, False], 60.0, confidence)
    low = stats.binomtest(3, 3).proportion_ci(confidence, method="exact").low
    assert (found.value, found.high, found.standard_error) == (60.0, 60.0, 0.0)
    assert found.low == pytest.approx(60.0 * low)
    # A run that was cut off early says nothing of the rest.
    assert restricted_mean([60.0, 59.0], [False, False], 60.0).low == 0.0


def test_a_loss_at_the_horizon_counts_and_one_behind_it_does_not():
    at = restricted_mean([10.0, 40.0, 40.0], [True, True, False], 40.0)
    assert at.value == pytest.approx(30.0)
    assert restricted_mean([40.0, 40.0], [True, False], 40.0).standard_error == 0.0
    behind = restricted_mean([40.1, 45.0], [True, True], 40.0)
    assert (behind.value, behind.standard_error) == (40.0, 0.0)
    assert behind.low == pytest.approx(40.0 * 0.025**0.5)


def test_a_run_lost_at_once_lasted_no_time():
    assert restricted_mean([0.0, 10.0], [True, True], 20.0).value == pytest.approx(5.0)
    assert kaplan_meier([0.0, 1.0], [True, True]).survival.tolist() == [0.5, 0.0]
    alone = restricted_mean([4.0], [True], 20.0)
    assert (alone.value, alone.low, alone.high) == (4.0, 0.0, 20.0)
    assert (alone.standard_error, alone.count) == (math.inf, 1)


@pytest.mark.parametrize("confidence", [0.8, 0.99])
def test_paired_differences_are_those_of_scipy(confidence):
    rng = np.random.default_rng(3)
    first, second = np.round(rng.exponential(9.0, (2, 31)))
    second[:5] = first[:5]
    found = paired_difference(first, second, confidence)
    test = stats.ttest_rel(first, second)
    interval = test.confidence_interval(confidence)
    assert (found.low, found.high) == pytest.approx((interval.low, interval.high))
    assert found.p_value == pytest.approx(test.pvalue)
    off = first - second
    assert found.mean == pytest.approx(off.mean())
    assert found.effect == pytest.approx(off.mean() / off.std(ddof=1))
    ups, downs, ties = (off > 0).sum(), (off < 0).sum(), (off == 0).sum()
    assert ties >= 5
    assert found.superiority == pytest.approx((ups + 0.5 * ties) / 31)
    assert found.sign_p == pytest.approx(stats.binomtest(ups, ups + downs).pvalue)
    ranks = stats.wilcoxon(off, zero_method="pratt", method="asymptotic")
    assert found.wilcoxon_p == pytest.approx(ranks.pvalue)
    assert found.count == 31


@pytest.mark.parametrize("shift", [-2.0, 1.0])
def test_a_shift_of_one_size_in_all_runs_is_sure(shift):
    found = paired_difference([5.0 + shift, 7.0 + shift, 9.0 + shift], [5.0, 7.0, 9.0])
    assert found.mean == found.low == found.high == shift
    assert (found.p_value, found.effect, found.count) == (0.0, 0.0, 3)
    assert found.sign_p == found.wilcoxon_p == pytest.approx(0.25)
    assert found.superiority == (1.0 if shift > 0 else 0.0)
    assert paired_difference([5.0, 6.0], [5.0, 6.5]).count == 2


def test_ratios_are_drawn_by_group():
    rng = np.random.default_rng(4)
    groups = np.array(["b", "a", "c", "a", "b", "d", "d", "d"])
    first, second = rng.uniform(1.0, 9.0, (2, 8))
    found = ratio_of_means(first, second, groups, confidence=0.8)
    assert found.value == pytest.approx(first.sum() / second.sum())
    # Every way of drawing four groups of four, each as likely.
    sums = np.array([[x[groups == g].sum() for g in "abcd"] for x in (first, second)])
    ways = np.stack(np.meshgrid(*[range(4)] * 4), axis=-1).reshape(-1, 4)
    ratios = sums[0][ways].sum(axis=1) / sums[1][ways].sum(axis=1)
    low, high = np.quantile(ratios, [0.1, 0.9])
    assert (found.low, found.high) == pytest.approx((low, high), rel=0.01)
    assert found.standard_error == pytest.approx(ratios.std(), rel=0.03)
    assert found.count == 8
    alone = ratio_of_means(first, second, np.zeros(8))
    assert (alone.low, alone.high, alone.standard_error, alone.count) == (0, np.inf, np.inf, 8)


def test_draws_without_a_second_time_have_no_ratio():
    found = ratio_of_means([2.0, 3.0], [0.0, 1.5], [0, 1])
    assert np.isfinite([found.low, found.high]).all()
    # Of the three kinds of draws that have one: (3 + 2) / 1.5 and (3 + 3) / 3.
    assert (found.low, found.high) == pytest.approx((2.0, 5.0 / 1.5))


def test_statistics_of_drawn_samples_are_as_recorded(as_recorded):
    rng = np.random.default_rng(5)
    samples = rng.normal(size=(4, 9, 3)) + np.arange(3) * np.arange(1, 5)[:, None, None]
    as_recorded(spread_trend(samples, [0.5, 1.0, 2.5, 3.0], confidence=0.8, seed=3), "trend")
    groups = rng.integers(0, 5, 20)
    first, second = rng.uniform(0.0, 9.0, (2, 20))
    as_recorded(ratio_of_means(first, second, groups, confidence=0.9), "ratio")


def test_the_spread_of_means_is_the_variance_less_that_of_the_noise():
    samples = np.random.default_rng(6).normal(size=(2, 7, 4)) * [[[1.0]], [[3.0]]]
    for each, found in zip(samples, spread_of_means(samples), strict=True):
        means = each.mean(axis=0)
        centred = each - means
        # Within runs, over runs times treatments less those of both.
        within = centred - centred.mean(axis=1, keepdims=True)
        error = (within**2).sum() / (6 * 3)
        assert found == pytest.approx(means.var(ddof=1) - error / 7)
    spread_trend(samples[:, :2, :2], [1.0, 2.0])
    with pytest.raises(InvalidInput, match="`samples` must hold two runs of two treatments"):
        spread_trend(samples[:, :, :1], [1.0, 2.0])


@pytest.mark.parametrize("confidence", [0.0, 1.0, -0.5, math.nan])
def test_a_level_that_is_none_is_refused_everywhere(confidence):
    times, lost = [1.0, 2.0], [True, False]
    for call in (
        lambda: require_confidence(confidence),
        lambda: share(1, 2, confidence),
        lambda: ratio_of_means(times, times, [0, 1], confidence),
        lambda: paired_difference(times, [2.0, 1.5], confidence),
        lambda: kaplan_meier(times, lost, confidence),
        lambda: restricted_mean(times, lost, 2.0, confidence),
        lambda: spread_trend(np.ones((2, 2, 2)), [1, 2], confidence),
    ):
        with pytest.raises(InvalidInput, match="`confidence` must lie strictly between 0 and 1"):
            call()


def test_samples_of_other_shapes_are_refused():
    square = np.ones((2, 2))
    for call, name in (
        (lambda: share(0, 0), "count"),
        (lambda: share(-1, 3), "hits"),
        (lambda: share(4, 3), "hits"),
        (lambda: ratio_of_means(square, square, square), "first"),
        (lambda: paired_difference(square, square), "first"),
        (lambda: kaplan_meier(square, square > 0), "times"),
        (lambda: kaplan_meier([1.0], [True, False]), "times"),
        (lambda: kaplan_meier([], []), "times"),
        (lambda: run_slopes(np.ones(2), [1.0, 2.0]), "values"),
        (lambda: spread_trend(square, [1.0, 2.0]), "samples"),
        (lambda: holm(square * 0.1), "p_values"),
        (lambda: holm([0.5, -0.1]), "p_values"),
        (lambda: holm([0.5, 1.1]), "p_values"),
    ):
        with pytest.raises(InvalidInput, match=f"`{name}` must"):
            call()


def test_equal_and_extreme_probabilities_are_adjusted_as_holm_says():
    assert holm([0.02, 0.0, 1.0, 0.02]) == pytest.approx([0.06, 0.0, 1.0, 0.06])
    assert holm([]).shape == (0,)
