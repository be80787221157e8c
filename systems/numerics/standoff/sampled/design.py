"""Gains that a sampled stand-off loop bears with the margins asked for.

The gains are those whose slowest pole is fastest, of all on a grid: K_D s on a fixed grid, K_P s h
on a geometric one, and K_I = K_P^2 s / (4 zeta^2), with which the ideal PI loop has damping zeta.
The largest K_P that keeps the margins is bisected at each K_D.

Source: ours; margins as a specification are textbook (Astrom and Murray, Feedback Systems, 11.3).
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ...errors import InvalidInput, require, require_positive
from ..equilibria import root_slope
from ..loop import StandoffLoop
from ..sampled_pid import SampledPid
from .margins import LoopMargins, loop_margins, sampled_loop

# K_P s h, from largest to smallest, and K_D s, that are tried.
_SPEEDS = np.geomspace(3.0, 1e-5, 70)
_ADDED = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.4, 2.0)
# Halvings of the step between two speeds.
_HALVINGS = 12


@dataclass(frozen=True, kw_only=True)
class Specification:
    """What a loop has to bear.

    Raises:
        InvalidInput: A number is out of its range.
    """

    # Least phase margin [rad].
    phase_margin: float = math.radians(60)
    # Least gain margin [1].
    gain_margin: float = 2.0
    # Largest peak Ms of the sensitivity [1].
    peak_sensitivity: float = 1.6
    # Least further delay that it bears [s].
    delay_margin: float = 0.0
    # Of the ideal PI loop's pair of poles; 1: both at one place [1].
    damping: float = 1.0

    def __post_init__(self) -> None:
        require_positive("damping", self.damping)
        for name, low, high in (
            ("phase_margin", 0.0, math.pi / 2),
            ("gain_margin", 1.0, math.inf),
            ("peak_sensitivity", 1.0, math.inf),
        ):
            value = getattr(self, name)
            # Written so that NaN fails.
            require(low < value < high, name, f"lie between {low:.4g} and {high:.4g}", value)
        words = "be a finite number, zero or positive"
        require(0 <= self.delay_margin < math.inf, "delay_margin", words, self.delay_margin)

    def holds(self, margins: LoopMargins) -> bool:
        """Whether a loop has these margins.

        Args:
            margins: Of the loop.
        """
        return (
            margins.stable
            and margins.phase_margin >= self.phase_margin
            and margins.gain_margin >= self.gain_margin
            and margins.peak_sensitivity <= self.peak_sensitivity
            and margins.delay_margin >= self.delay_margin
        )


@dataclass(frozen=True, eq=False)
class StandoffDesign:
    """Gains, and what they give.

    Attributes:
        loop: With the gains found.
        margins: Of the sampled loop.
    """

    loop: StandoffLoop
    margins: LoopMargins


def design_gains(
    loop: StandoffLoop,
    sampled: SampledPid,
    delay_samples: int = 0,
    asked: Specification | None = None,
) -> StandoffDesign:
    """Choose gains.

    Args:
        loop: Controller, reference and error; its gains are not looked at.
        sampled: Sample time and filter; the limit is not looked at.
        delay_samples: How many samples late the estimate comes.
        asked: The margins; by default those of `Specification`.

    Raises:
        InvalidInput: There is no equilibrium, or no gains on the grid have these margins.
    """
    wanted = Specification() if asked is None else asked
    slope = root_slope(loop)

    def attempt(speed: float, added: float) -> StandoffDesign:
        kp = speed / (slope * sampled.period)
        ki = kp**2 * slope / (4 * wanted.damping**2) if loop.integrates else loop.ki
        kd = added / slope if "D" in loop.controller else loop.kd
        tuned = replace(loop, kp=kp, ki=ki, kd=kd)
        return StandoffDesign(tuned, loop_margins(sampled_loop(tuned, sampled, delay_samples)))

    best: StandoffDesign | None = None
    for added in _ADDED if "D" in loop.controller else (0.0,):
        failing = float(_SPEEDS[0])
        found: StandoffDesign | None = None
        low = high = failing
        for speed in _SPEEDS[1:].tolist():
            found = attempt(speed, added)
            if wanted.holds(found.margins):
                low, high = speed, failing
                break
            failing, found = speed, None
        if found is None:
            continue
        for _ in range(_HALVINGS):
            middle = math.sqrt(low * high)
            between = attempt(middle, added)
            if wanted.holds(between.margins):
                low, found = middle, between
            else:
                high = middle
        if best is None or _pace(found) < _pace(best):
            best = found
    if best is None:
        raise InvalidInput(
            "`phase_margin, gain_margin, peak_sensitivity, delay_margin` must be attainable with "
            f"this clock, filter and delay; got {wanted}"
        )
    return best


def _pace(design: StandoffDesign) -> float:
    """What is left of a miss after one sample, in the long run."""
    return float(np.abs(design.margins.poles[0]))
