"""A number with the interval in which it may lie."""

from dataclasses import dataclass

from scipy import stats

from ..errors import require


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
    require(0.0 < confidence < 1.0, "confidence", "lie between 0 and 1", confidence)


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
