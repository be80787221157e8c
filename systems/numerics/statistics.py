"""Statistics of runs that a horizon may cut off: estimates, comparisons and trends.

A run that ends at the horizon without a loss says that its time is at least that long, not that it
is that long (right-censored). Plain averages of such times measure the horizon; survival curves and
restricted means do not. Strategies are compared on the same runs, in pairs; what has no formula of
its own gets its interval by drawing samples again; and several tests at once are corrected
together, so that the chance of any false alarm stays below the level.
"""

import math
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from .errors import require, require_positive


@dataclass(frozen=True)
class Estimate:
    """An estimate and its confidence interval, all in the unit of what is estimated.

    Attributes:
        value: The estimate [-].
        low, high: Confidence interval.
        standard_error: Of the value [-]; 0 where the sample has no spread.
        count: Size of the sample.
    """

    value: float
    low: float
    high: float
    standard_error: float
    count: int


def require_confidence(confidence: float) -> None:
    """Refuse a level outside (0, 1).

    Args:
        confidence: The level, between 0 and 1.
    """
    require(0.0 < confidence < 1.0, "confidence", "lie strictly between 0 and 1", confidence)


def share(hits: int, count: int, confidence: float = 0.95) -> Estimate:
    """How often something happens, with Wilson's interval.

    Args:
        hits: How often it did.
        count: Out of how many.
        confidence: Of the interval, between 0 and 1.

    Raises:
        InvalidInput: There is no sample, or not 0 <= hits <= count.

    Source: Wilson, JASA 22 (1927).
    """
    require_confidence(confidence)
    require(count > 0, "count", "be positive", count)
    require(0 <= hits <= count, "hits", f"lie between 0 and {count}", hits)
    interval = stats.binomtest(hits, count).proportion_ci(confidence, method="wilson")
    value = hits / count
    error = (value * (1.0 - value) / count) ** 0.5
    return Estimate(value, float(interval.low), float(interval.high), error, count)


# Samples drawn again, and the seed of the draws: the same data give the same interval.
DRAWS, SEED = 10_000, 0


def ratio_of_means(
    first: ArrayLike, second: ArrayLike, groups: ArrayLike, confidence: float = 0.95
) -> Estimate:
    """Mean of one strategy's times over the mean of another's on the same runs.

    Whole groups of runs are drawn again, as runs of a group are alike: those that share a world.
    The interval is between quantiles of the ratios that come out.

    Args:
        first, second: Times of the same runs in the same order, shape (n,) [s].
        groups: To which group each run belongs, shape (n,), int.
        confidence: Of the interval, between 0 and 1.

    Returns:
        The ratio [-]; with a single group an interval from zero to infinity.

    Raises:
        InvalidInput: The samples differ in length, are empty, or the second has no mean above 0.

    Source: Davison and Hinkley, Bootstrap Methods and their Application (1997), 2.4 and 3.8.
    """
    require_confidence(confidence)
    first, second = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    groups = np.asarray(groups)
    alike = first.ndim == 1 and first.shape == second.shape == groups.shape and len(first) > 0
    require(alike, "first", "be as long as `second` and `groups`", first.shape)
    require(second.mean() > 0.0, "second", "have a mean above zero", float(second.mean()))
    value = float(first.mean() / second.mean())
    _, numbers = np.unique(groups, return_inverse=True)
    count = int(numbers.max()) + 1
    if count == 1:
        return Estimate(value, 0.0, np.inf, np.inf, len(first))
    drawn = np.random.default_rng(SEED).integers(0, count, (DRAWS, count))
    sums = [np.bincount(numbers, each)[drawn].sum(axis=1) for each in (first, second)]
    some = sums[1] > 0.0
    ratios = sums[0][some] / sums[1][some]
    tail = 0.5 * (1.0 - confidence)
    low, high = np.quantile(ratios, (tail, 1.0 - tail))
    return Estimate(value, float(low), float(high), float(ratios.std()), len(first))


@dataclass(frozen=True)
class PairedDifference:
    """How times of one strategy differ from those of another on the same runs.

    Attributes:
        mean: Of first - second [s].
        low, high: Student's confidence interval of the mean [s].
        p_value: Chance of a mean of zero, two-sided (paired t test).
        wilcoxon_p: Chance of differences symmetric about zero
            (Wilcoxon's signed ranks, Pratt's zeros,
            normal approximation).
        sign_p: Chance of as many positive as negative differences (sign test, ties left out).
        effect: Ratio of mean to standard deviation of the differences (Cohen's
            d_z); 0 without spread.
        superiority: Share of runs in which the first is longer, ties counted half.
        count: Number of pairs.
    """

    mean: float
    low: float
    high: float
    p_value: float
    wilcoxon_p: float
    sign_p: float
    effect: float
    superiority: float
    count: int


def paired_difference(
    first: ArrayLike, second: ArrayLike, confidence: float = 0.95
) -> PairedDifference:
    """Compare two samples pair by pair.

    For times cut off at one horizon the mean is the difference of the two restricted means.

    Args:
        first, second: Times of the same runs in the same order, shape (n,) [s].
        confidence: Of the interval, between 0 and 1.

    Raises:
        InvalidInput: The samples differ in length, have fewer than two pairs or are not finite.
    """
    require_confidence(confidence)
    first, second = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    require(
        first.ndim == 1 and first.shape == second.shape and len(first) > 1,
        "first",
        "have two pairs or more, as many as `second`",
        f"{first.shape} and {second.shape}",
    )
    differences = first - second
    require(bool(np.isfinite(differences).all()), "first", "be finite, as `second`", "NaN or inf")
    count, mean = len(differences), float(differences.mean())
    spread = float(differences.std(ddof=1))
    superiority = float(np.mean(differences > 0.0) + 0.5 * np.mean(differences == 0.0))
    ups, downs = int((differences > 0.0).sum()), int((differences < 0.0).sum())
    sign_p = float(stats.binomtest(ups, ups + downs).pvalue) if ups + downs else 1.0
    if spread == 0.0:
        # Nothing but ties, or a shift of the same size in every run.
        p = 1.0 if mean == 0.0 else 0.0
        ranks_p = sign_p if mean else 1.0
        return PairedDifference(mean, mean, mean, p, ranks_p, sign_p, 0.0, superiority, count)
    error = spread / math.sqrt(count)
    reach = float(stats.t.ppf(0.5 + 0.5 * confidence, count - 1)) * error
    # Asymptotic, because the exact distribution takes a second where there are ties. Any: a named
    # tuple made at run time.
    ranks: Any = stats.wilcoxon(differences, zero_method="pratt", method="asymptotic")
    return PairedDifference(
        mean=mean,
        low=mean - reach,
        high=mean + reach,
        p_value=float(2.0 * stats.t.sf(abs(mean) / error, count - 1)),
        wilcoxon_p=float(ranks.pvalue),
        sign_p=sign_p,
        effect=mean / spread,
        superiority=superiority,
        count=count,
    )


@dataclass(frozen=True, eq=False)
class SurvivalCurve:
    """Share of runs without a loss so far, a step function that is 1 before the first time.

    Attributes:
        times: Where it steps, increasing, shape (k,) [s].
        survival: Its value from each time on, shape (k,).
        low, high: Pointwise confidence interval, shape (k,); equal to `survival` where it is 1
            or 0, where no interval is defined.
    """

    times: np.ndarray
    survival: np.ndarray
    low: np.ndarray
    high: np.ndarray


def kaplan_meier(times: ArrayLike, lost: ArrayLike, confidence: float = 0.95) -> SurvivalCurve:
    """Kaplan and Meier's estimate of a survival curve, with Greenwood's log-log interval.

    Args:
        times: Of loss, or of the end of a run without one, shape (n,) [s].
        lost: Whether it was a loss, shape (n,), bool.
        confidence: Of the pointwise interval, between 0 and 1.

    Raises:
        InvalidInput: There is no sample, or a time is negative or not finite.

    Source: Kaplan and Meier, JASA 53 (1958), by `scipy.stats.ecdf`.
    """
    require_confidence(confidence)
    times, lost = _sample(times, lost)
    data = stats.CensoredData(uncensored=times[lost], right=times[~lost])
    curve = stats.ecdf(data).sf
    survival = np.asarray(curve.probabilities)
    low, high = _interval(curve, confidence)
    defined = np.isfinite(low) & np.isfinite(high) & (survival > 0.0) & (survival < 1.0)
    return SurvivalCurve(
        np.asarray(curve.quantiles),
        survival,
        np.where(defined, low, survival),
        np.where(defined, high, survival),
    )


def restricted_mean(
    times: ArrayLike, lost: ArrayLike, horizon: float, confidence: float = 0.95
) -> Estimate:
    """Mean of min(T, horizon): the area under the survival curve up to the horizon.

    The variance is Greenwood's, sum_i A_i^2 d_i / (n_i (n_i - d_i)) with A_i the area right of
    the i-th time of loss, times n / (n - 1); the interval is Student's, cut to [0, horizon].
    Without censoring before the horizon this is the sample mean with its t interval. If nothing
    was lost there is no spread to go by: the lower end is then horizon * c, c being Clopper and
    Pearson's lower limit for the share of runs without a loss.

    Args:
        times, lost: As in `kaplan_meier`.
        horizon: [s].
        confidence: Of the interval, between 0 and 1.

    Raises:
        InvalidInput: There is no sample, or a number is out of its range.

    Source: Klein and Moeschberger, Survival Analysis (2003), 4.5.
    """
    require_positive("horizon", horizon)
    require_confidence(confidence)
    times, lost = _sample(times, lost)
    count, tail = len(times), 0.5 * (1.0 - confidence)
    # What happens after the horizon does not count.
    lost = lost & (times <= horizon)
    times = np.minimum(times, horizon)
    if not lost.any():
        low = horizon * tail ** (1.0 / count) if (times >= horizon).all() else 0.0
        return Estimate(horizon, low, horizon, 0.0, count)
    moments = np.unique(times[lost])
    losses = (times[lost][:, None] == moments).sum(axis=0)
    at_risk = (times[:, None] >= moments).sum(axis=0)
    survival = np.cumprod(1.0 - losses / at_risk)
    widths = np.diff(np.append(moments, horizon))
    areas = np.cumsum((survival * widths)[::-1])[::-1]
    value = float(moments[0] + areas[0])
    left = at_risk - losses
    # Where the last ones are lost no area is left, and the term is 0.
    terms = np.where(left > 0, areas**2 * losses / (at_risk * np.maximum(left, 1)), 0.0)
    if count == 1:
        return Estimate(value, 0.0, horizon, math.inf, count)
    error = math.sqrt(terms.sum() * count / (count - 1))
    reach = float(stats.t.ppf(1.0 - tail, count - 1)) * error
    return Estimate(value, max(value - reach, 0.0), min(value + reach, horizon), error, count)


def _interval(curve: Any, confidence: float) -> tuple[np.ndarray, np.ndarray]:
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        # SciPy warns where no interval is defined, and puts NaN there.
        warnings.simplefilter("ignore", RuntimeWarning)
        interval = curve.confidence_interval(confidence, method="log-log")
    return np.asarray(interval.low.probabilities), np.asarray(interval.high.probabilities)


def _sample(times: ArrayLike, lost: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Both as arrays of one length, checked."""
    times, lost = np.asarray(times, dtype=float), np.asarray(lost, dtype=bool)
    require(times.ndim == 1 and times.shape == lost.shape, "times", "match `lost`", times.shape)
    require(len(times) > 0, "times", "hold at least one run", "none")
    require(
        bool(np.isfinite(times).all() and (times >= 0).all()),
        "times",
        "be finite and not negative",
        times,
    )
    return times, lost


# Of the bootstrap.
RESAMPLES = 2000


def run_slopes(values: ArrayLike, levels: ArrayLike) -> np.ndarray:
    """Slope of the straight line through each run's values, by least squares.

    Args:
        values: A row for each run, shape (runs, k).
        levels: Shape (k,), not all the same.

    Returns:
        Shape (runs,): change per unit of the level.

    Raises:
        InvalidInput: The shapes do not fit, or the levels are all the same.
    """
    values, levels = np.asarray(values, dtype=float), np.asarray(levels, dtype=float)
    fits = values.ndim == 2 and levels.shape == values.shape[1:]
    require(fits, "values", "have a column for each level", values.shape)
    centred = levels - levels.mean()
    require(bool(centred.any()), "levels", "not be all the same", levels)
    return values @ centred / (centred @ centred)


def spread_of_means(samples: np.ndarray) -> np.ndarray:
    """Variance between the means of k treatments of the same runs, without bias.

    The variance of sample means also holds their noise; its expectation, the mean variance of
    what is left of each run over the number of runs, is taken off. The result may be negative.

    Args:
        samples: Shape (..., runs, k), two runs and two treatments at least.
    """
    runs = samples.shape[-2]
    means = samples.mean(axis=-2)
    rest = samples - means[..., None, :]
    noise = rest.var(axis=-1, ddof=1).mean(axis=-1) / (runs - 1)
    return means.var(axis=-1, ddof=1) - noise


def spread_trend(
    samples: np.ndarray, levels: ArrayLike, confidence: float = 0.95, seed: int = 0
) -> Estimate:
    """How the variance between means of treatments changes with a level.

    Args:
        samples: For each cell its runs under each treatment, shape (cells, runs, k). Row r of all
            cells is one run, and is drawn as one.
        levels: Of each cell, shape (cells,).
        confidence: Of the percentile interval, between 0 and 1.
        seed: Of the bootstrap.

    Returns:
        Slope of `spread_of_means` over the level, per unit of it.

    Raises:
        InvalidInput: There are fewer than two runs or treatments, or the levels do not fit.

    Source: Efron and Tibshirani, An introduction to the bootstrap (1993), 13.
    """
    require_confidence(confidence)
    samples = np.asarray(samples, dtype=float)
    fine = samples.ndim == 3 and min(samples.shape[1:]) > 1
    require(fine, "samples", "hold two runs of two treatments or more", samples.shape)
    count = samples.shape[1]
    rng = np.random.default_rng(seed)
    value = float(run_slopes(spread_of_means(samples)[None], levels)[0])
    drawn = [spread_of_means(samples[:, rng.integers(0, count, count)]) for _ in range(RESAMPLES)]
    slopes = run_slopes(np.array(drawn), levels)
    tail = 50.0 * (1.0 - confidence)
    low, high = np.percentile(slopes, [tail, 100.0 - tail])
    return Estimate(value, float(low), float(high), float(slopes.std(ddof=1)), count)


def holm(p_values: ArrayLike) -> np.ndarray:
    """Holm's step-down adjustment.

    The i-th smallest of m p-values becomes the largest of (m - k + 1) p_(k) for k up to i, at
    most 1. Rejecting where the result is at most alpha keeps the family-wise error below alpha,
    whatever the tests have to do with each other.

    Args:
        p_values: Shape (m,), in [0, 1].

    Returns:
        Adjusted p-values in the order given, shape (m,).

    Raises:
        InvalidInput: A value is no probability.

    Source: Holm, Scandinavian Journal of Statistics 6 (1979).
    """
    raw = np.asarray(p_values, dtype=float)
    fine = raw.ndim == 1 and bool(((raw >= 0.0) & (raw <= 1.0)).all())
    require(fine, "p_values", "be probabilities", raw)
    order = np.argsort(raw, kind="stable")
    factors = len(raw) - np.arange(len(raw))
    adjusted = np.empty_like(raw)
    adjusted[order] = np.minimum(np.maximum.accumulate(factors * raw[order]), 1.0)
    return adjusted
