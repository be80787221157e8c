"""Does something grow with a level, run by run, or between averages?"""

import numpy as np
from numpy.typing import ArrayLike

from ..errors import require
from .estimate import Estimate, require_confidence

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
