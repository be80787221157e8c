"""The law of a stand-off controller as a computer runs it: sampled, filtered, limited.

With eps the estimated minus the wanted distance, at every sample

    d = (1 - exp(-h / tau)) (eps - w) / h,   u = feed_forward + K_P eps + K_I z + K_D d,
    v = u within the limit,   w += h d,   z += h (eps + (v - u) / K_P)

with z the integral, w the filtered miss, d its rate, h the sample time, tau the filter's time
constant, and v the command. The rate is exactly that of w, so that no derivative is lost or gained
between samples: d = (eps - w) / tau would be too strong by half of h / tau. At the limit the
integral moves to where it alone gives the limit, so that it does not wind up. The filter starts at
the first miss, so that switching on gives no kick.

Source: Zhang 2014, 2.2.6, which has the ideal law; filter and anti-windup by back-calculation are
textbook (Astrom and Murray, Feedback Systems, 11.4).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..errors import require_positive
from ..tracking.mobile_agents import clip_symmetric
from .loop import StandoffLoop


@dataclass(frozen=True, kw_only=True)
class SampledPid:
    """What the ideal law lacks.

    Raises:
        InvalidInput: A time is not positive and finite, or the limit is not positive.
    """

    # Time between samples, h [s].
    period: float = 0.005
    # Time constant of the derivative's filter, tau [s].
    filter_time: float = 0.02
    # Bound of the commanded speed [m/s]; infinite: none.
    limit: float = math.inf

    def __post_init__(self) -> None:
        require_positive("period", self.period)
        require_positive("filter_time", self.filter_time)
        if self.limit != math.inf:
            require_positive("limit", self.limit)

    @property
    def blend(self) -> float:
        """How much of a step the filter takes in one sample: 1 - exp(-h/tau)."""
        return -math.expm1(-self.period / self.filter_time)


# Any: floats and the scalars of Drake and CasADi have no type in common.
def pid_step(
    state: Sequence[Any], estimate: Any, feed_forward: Any, loop: StandoffLoop, sampled: SampledPid
) -> tuple[tuple[Any, Any, Any], Any]:
    """One sample.

    Plain arithmetic, for scalars of any kind that the limit's absolute values go through.

    Args:
        state: Integral z [m s], filtered miss w [m], and 1 once started, else 0.
        estimate: Distance as estimated [m].
        feed_forward: Speed that is added to the command [m/s].
        loop: Gains and reference; the error model is not looked at.
        sampled: Sample time, filter and limit.

    Returns:
        The next state, and the command [m/s].
    """
    integral, filtered, started = state
    miss = estimate - loop.reference
    filtered = filtered + (1 - started) * (miss - filtered)
    derivative = sampled.blend * (miss - filtered) / sampled.period
    wanted = (
        feed_forward
        + loop.kp * miss
        + loop.integral_gain * integral
        + loop.derivative_gain * derivative
    )
    command = wanted if math.isinf(sampled.limit) else clip_symmetric(wanted, sampled.limit)
    integral = integral + sampled.period * (miss + (command - wanted) / loop.kp)
    filtered = filtered + sampled.period * derivative
    return (integral, filtered, 1.0 + 0.0 * miss), command
