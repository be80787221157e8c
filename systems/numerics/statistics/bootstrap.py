"""Intervals by drawing samples again, for what has no formula of its own."""

import numpy as np
from numpy.typing import ArrayLike

from ..errors import require
from .estimate import Estimate, require_confidence

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
