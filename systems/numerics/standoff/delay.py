"""How late an estimate may come before the stand-off loop starts to swing.

Linear round the wanted equilibrium, with s = -f' there, the loop that is open behind the estimate
is L(jw) = s (K_P + K_I / jw + K_D jw / (1 + jw tau)) / jw, with tau the derivative filter's time
constant. A delay T multiplies it by exp(-jwT). The delay margin is the smallest T that brings L to
-1: (pi + arg L) / w at the smallest such quotient over the frequencies with |L| = 1.

Source: ours; the method is textbook (e.g. Astrom and Murray, Feedback Systems, 10.3).
"""

import cmath
import math
from dataclasses import dataclass

import numpy as np

from ..errors import require_non_negative
from .equilibria import root_slope
from .loop import StandoffLoop


@dataclass(frozen=True)
class DelayMargin:
    """A loop's margin.

    Attributes:
        delay: Largest delay that leaves the loop stable [s]; zero if none does.
        frequency: At which it swings at that delay [rad/s]; infinite for a margin of zero.
    """

    delay: float
    frequency: float


def open_loop(loop: StandoffLoop, frequency: float, filter_time: float = 0.0) -> complex:
    """L(jw) at a frequency w > 0 [rad/s]."""
    s = 1j * frequency
    derivative = loop.derivative_gain * s / (1 + s * filter_time)
    return root_slope(loop) * (loop.kp + loop.integral_gain / s + derivative) / s


def crossover_frequencies(loop: StandoffLoop, filter_time: float = 0.0) -> tuple[float, ...]:
    """Frequencies w at which |L(jw)| = 1 [rad/s], rising.

    With W = w^2, B = K_P tau + K_D and A = K_P + K_I tau they are the positive roots of
    tau^2 W^3 + (1 - s^2 B^2) W^2 + s^2 (2 K_I B - A^2) W - s^2 K_I^2 = 0.
    """
    s2 = root_slope(loop) ** 2
    ki = loop.integral_gain
    fast = loop.kp * filter_time + loop.derivative_gain
    slow = loop.kp + ki * filter_time
    roots = np.roots(
        [filter_time**2, 1 - s2 * fast**2, s2 * (2 * ki * fast - slow**2), -s2 * ki**2]
    )
    real = [root.real for root in roots if abs(root.imag) < 1e-9 * abs(root) and root.real > 0]
    return tuple(sorted(math.sqrt(root) for root in real))


def delay_margin(loop: StandoffLoop, filter_time: float = 0.0) -> DelayMargin:
    """The largest delay of the estimate that the loop bears at the wanted equilibrium.

    Zero for an unfiltered derivative with K_D s >= 1: then the loop has gain at all frequencies,
    and any delay, however short, lets it run away.

    Args:
        loop: The closed loop.
        filter_time: Time constant tau of the derivative filter; zero: ideal [s].

    Raises:
        InvalidInput: There is no equilibrium, or the filter time is negative.
    """
    require_non_negative("filter_time", filter_time)
    if filter_time == 0 and loop.derivative_gain * root_slope(loop) >= 1:
        return DelayMargin(0.0, math.inf)
    margins = []
    for frequency in crossover_frequencies(loop, filter_time):
        phase = math.pi + cmath.phase(open_loop(loop, frequency, filter_time))
        margins.append(DelayMargin(phase % (2 * math.pi) / frequency, frequency))
    # |L| falls from infinity to less than one, so it crosses one somewhere.
    return min(margins, key=lambda margin: margin.delay)
