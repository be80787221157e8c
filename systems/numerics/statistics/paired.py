"""Two strategies on the same runs: is one better, and by how much?"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from ..errors import require
from .estimate import require_confidence


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
