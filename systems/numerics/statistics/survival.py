"""Times until a loss, some of them cut off before one: survival curves and restricted means.

A run that ends at the horizon without a loss says that its time is at least that long, not that it
is that long (right-censored). Plain averages of such times measure the horizon.
"""

import math
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from ..errors import require, require_positive
from .estimate import Estimate, require_confidence


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
