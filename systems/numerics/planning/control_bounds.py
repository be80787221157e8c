"""Which controls a tractor can follow: speed and turn rate within its bounds."""

import numpy as np

from ..tracking.mobile_agents import clip_symmetric
from .trailer import Trailer


def clip_control(v, omega, trailer: Trailer):
    """The nearest allowed speed and turn rate; without branches, for scalars of any kind.

    The speed lies in [0, speed], or in [-speed, speed] for a tractor that may reverse; the turn
    rate in [-turn_rate, turn_rate]. Beyond a bound, and on it to one side, the slope is zero.

    Args:
        v: Speed wished for [m/s].
        omega: Turn rate wished for [rad/s].
        trailer: Whose bounds.
    """
    if trailer.reverse:
        allowed_v = clip_symmetric(v, trailer.speed)
    else:
        half = trailer.speed / 2
        allowed_v = half + clip_symmetric(v - half, half)
    return allowed_v, clip_symmetric(omega, trailer.turn_rate)


def control_excess(controls: np.ndarray, trailer: Trailer) -> float:
    """By how much controls leave the bounds at most [m/s or rad/s]; 0 if they do not.

    Args:
        controls: v, omega, shape (n, 2) [m/s], [rad/s].
        trailer: Whose bounds.
    """
    v, omega = clip_control(controls[:, 0], controls[:, 1], trailer)
    gaps = np.abs(controls - np.stack([v, omega], axis=1))
    return float(np.max(gaps, initial=0.0))
