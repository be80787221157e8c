"""What becomes of the stand-off loop where the estimate was never calibrated.

The parabola is a fit between two distances. Beyond them it is a guess, and the thesis's wanted
equilibrium at 0.22 m lies below the shortest, 0.38 m. A cautious estimator holds the error of the
nearer end instead: then f falls with slope -1 outside, and there may be other equilibria.
"""

from dataclasses import dataclass

import numpy as np

from .equilibria import equilibria
from .loop import StandoffLoop


@dataclass(frozen=True)
class HeldEquilibrium:
    """An equilibrium of a loop whose estimate holds its error outside the calibrated range.

    Attributes:
        y: True distance [m].
        stable: Whether a loop with a filtered derivative stays there: f' < 0.
        calibrated: Whether it lies inside the calibrated range.
    """

    y: float
    stable: bool
    calibrated: bool


def held_error(loop: StandoffLoop, y):
    """e(y), held at its end values outside the calibrated range [m]; y [m], scalar or array."""
    return loop.error.error(np.clip(y, loop.error.shortest, loop.error.longest))


def held_equilibria(loop: StandoffLoop) -> tuple[HeldEquilibrium, ...]:
    """All equilibria of e_held(y) - y + r = 0, nearest first.

    Raises:
        InvalidInput: The parabola itself never meets the reference.
    """
    model = loop.error
    found = [
        HeldEquilibrium(each.y, loop.slope(each.y) < 0, True)
        for each in equilibria(loop)
        if model.covers(each.y)
    ]
    below = model.error(model.shortest) + loop.reference
    above = model.error(model.longest) + loop.reference
    if below < model.shortest:
        found.append(HeldEquilibrium(below, True, False))
    if above > model.longest:
        found.append(HeldEquilibrium(above, True, False))
    return tuple(sorted(found, key=lambda each: each.y))
