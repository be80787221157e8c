"""The tractor-trailer: its parameters, and its equations of motion, which stand here once.

They are written so that NumPy arrays, Drake's scalars and CasADi's symbols all go through them.

Source: Zhang 2014, 3.2.2 and (3.18)-(3.20); the hitch offset is the usual extension.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..checked import Checked, Finite, Positive
from ..errors import require
from ..tracking.mobile_agents import clip_symmetric


@dataclass(frozen=True, kw_only=True)
class Trailer(Checked):
    """A tractor and its trailer.

    The state is (x, y, theta, beta): the tractor's rear axle [m], its heading [rad], and the angle
    from the trailer's heading to the tractor's [rad]. The control is (v, omega): speed [m/s] and
    turn rate [rad/s] of the tractor.

    Raises:
        InvalidInput: A number is out of its range.
    """

    # Speed of the tractor [m/s].
    speed: Positive = 1.0
    # Bound of its turn rate [rad/s].
    turn_rate: Positive = 1.0
    # From the hitch to the trailer's axle [m].
    length: Positive = 1.0
    # From the tractor's rear axle back to the hitch [m].
    hitch_offset: Finite = 0.0
    # Whether it may drive backwards too, at the same speed.
    reverse: bool = False
    # Largest |beta| [rad]; pi: no limit.
    jackknife: float = math.pi

    def __post_init__(self) -> None:
        super().__post_init__()
        require(isinstance(self.reverse, bool), "reverse", "be true or false", self.reverse)
        require(0 < self.jackknife <= math.pi, "jackknife", "lie in (0, pi]", self.jackknife)


# Any: NumPy, Drake and CasADi have no type in common that sine and product take.
def trailer_rates(
    theta: Any, beta: Any, v: Any, omega: Any, trailer: Trailer
) -> tuple[Any, Any, Any, Any]:
    """Rates of x, y, theta and beta; scalars or arrays of any kind that NumPy's sine takes.

    x' = v cos(theta), y' = v sin(theta), theta' = omega,
    beta' = omega - (v sin(beta) - M omega cos(beta)) / L,

    with L the length and M the hitch offset; in the normalised model beta' = omega - v sin(beta),
    which is (3.14).
    """
    pull = (v * np.sin(beta) - trailer.hitch_offset * omega * np.cos(beta)) / trailer.length
    return v * np.cos(theta), v * np.sin(theta), omega, omega - pull


def trailer_pose(x, y, theta, beta, trailer: Trailer):
    """The trailer's axle and heading: x, y [m], [m] and theta - beta [rad].

    Scalars or arrays of any kind that NumPy's sine takes.
    """
    heading = theta - beta
    behind, length = trailer.hitch_offset, trailer.length
    axle_x = x - behind * np.cos(theta) - length * np.cos(heading)
    axle_y = y - behind * np.sin(theta) - length * np.sin(heading)
    return axle_x, axle_y, heading


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
