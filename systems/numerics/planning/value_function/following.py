"""The policy of a table in steps: a control for each period, from measurements that come late."""

import math
from typing import NamedTuple

import numpy as np

from ..arc_words.quickest import ArcWord
from ..arc_words.shortened import after, end_of
from ..trailer import Trailer
from .policy import next_word
from .value_function import ValueFunction


class Following(NamedTuple):
    """What a cart that goes down a table remembers.

    Attributes:
        word: What is left of the word that it follows; None: it follows none.
        given: Controls of the last periods, the newest last, shape (n, 2) [m/s], [rad/s].
        estimate: Where it was at the last measurement, by all of them, shape (4,); None: not known.
    """

    word: ArcWord | None
    given: np.ndarray
    estimate: np.ndarray | None

    @property
    def control(self) -> np.ndarray:
        """The control of this period: v, omega, shape (2,) [m/s], [rad/s]."""
        return self.given[-1]


AT_REST = Following(None, np.zeros((0, 2)), None)


def follow(
    value: ValueFunction,
    before: Following,
    measured,
    *,
    period: float,
    delay: float = 0.0,
    margin: float = 0.0,
    trust: float = 1.0,
) -> Following:
    """What to do for the next period.

    Where a switch falls within the period, the control is the mean over it.

    Args:
        value: The table.
        before: What was remembered until now; at first `AT_REST`.
        measured: x, y, theta, beta [m], [m], [rad], [rad].
        period: For how long the control is held [s].
        delay: From the moment of the measurement until the control acts [s]; the controls given
            meanwhile carry the state on.
        margin: See `next_word`.
        trust: Weight of a measurement against where those before and the controls since say that
            the cart is, in (0, 1].
    """
    measured = np.array(measured, dtype=float)
    estimate = _estimate(value.trailer, before, measured, period, delay, trust)
    state = _carried_on(value.trailer, estimate, before.given, period, delay)
    word = next_word(value, state, before.word, margin)
    if word is None:
        control = np.zeros(2)
    else:
        control = _mean_control(word, period)
        word = after(word, period)
    kept = math.ceil(delay / period) + 1
    return Following(word, np.vstack([before.given, control])[-kept:], estimate)


def _estimate(
    trailer: Trailer,
    before: Following,
    measured: np.ndarray,
    period: float,
    delay: float,
    trust: float,
) -> np.ndarray:
    """Where the cart was at a measurement, shape (4,)."""
    if trust == 1.0 or before.estimate is None:
        return measured
    # What acted from the measurement before until this one began a delay before it was given.
    count = math.ceil(delay / period - 1e-9) + 1
    held = np.vstack([np.zeros((max(count - len(before.given), 0), 2)), before.given[-count:]])
    durations = np.full(count, period)
    if count > 1:
        first = delay - (count - 2) * period
        durations[:2] = first, period - first
        durations[2:] = 0.0
    expected = end_of(trailer, before.estimate, ArcWord(held, durations))
    gaps = measured - expected
    gaps[2:] = np.remainder(gaps[2:] + math.pi, math.tau) - math.pi
    return expected + trust * gaps


def _mean_control(word: ArcWord, period: float) -> np.ndarray:
    """Of a word until the end of a period, shape (2,); where it is over, the cart stands."""
    # Exactly what is held, where there is no switch.
    if len(word.durations) and word.durations[0] >= period:
        return word.controls[0]
    begun = np.cumsum(word.durations) - word.durations
    return np.clip(period - begun, 0.0, word.durations) @ word.controls / period


def _carried_on(
    trailer: Trailer, measured, given: np.ndarray, period: float, delay: float
) -> np.ndarray:
    """A state when the controls of the last periods have acted for a delay, shape (4,)."""
    if delay == 0.0:
        return np.array(measured, dtype=float)
    count = math.ceil(delay / period - 1e-9)
    # Before the first control, it stood.
    held = np.vstack([np.zeros((max(count - len(given), 0), 2)), given[-count:]])
    durations = np.full(count, period)
    durations[0] = delay - (count - 1) * period
    return end_of(trailer, measured, ArcWord(held, durations))
