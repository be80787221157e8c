"""A stand-off loop in its own units: the wanted equilibrium at zero, the edge of attraction at one.

With y = rest + d x, time in units of 1 / (K_P s) and K_I z in units of K_P s d,

    q x' = m + w,   w' = ratio m,   m = x (x / other - 1),   q = 1 + damping - 2 damping x / other,

where d reaches from the wanted equilibrium to the edge (see `energy`), s is the root of the
discriminant, `other` is where the other equilibrium lies, damping = K_D s, ratio = K_I / (K_P^2 s).
"""

from dataclasses import dataclass

from .energy import edge
from .equilibria import root_slope, wanted_equilibrium
from .loop import StandoffLoop


@dataclass(frozen=True)
class NormalisedLoop:
    """The numbers above.

    Attributes:
        rest: Of the wanted equilibrium [m].
        distance: d, negative for an error with a < 0 [m].
        integral_unit: What w = 1 stands for [m s]; zero without an integral part.
        other, damping, ratio: See above [1].
    """

    rest: float
    distance: float
    integral_unit: float
    other: float
    damping: float
    ratio: float

    def miss(self, x):
        """m, the miss f in units of s d; plain arithmetic, for scalars of any kind."""
        return x * (x / self.other - 1)

    def inertia(self, x):
        """q = 1 - K_D f'; plain arithmetic."""
        return 1 + self.damping - 2 * self.damping / self.other * x


def normalise(loop: StandoffLoop) -> NormalisedLoop:
    """Express a loop in its own units.

    Raises:
        InvalidInput: There is no equilibrium.
    """
    rest, slope = wanted_equilibrium(loop).y, root_slope(loop)
    distance = edge(loop) - rest
    return NormalisedLoop(
        rest=rest,
        distance=distance,
        integral_unit=loop.kp * slope * distance / loop.ki if loop.integrates else 0.0,
        other=slope / (loop.error.a * distance),
        damping=loop.derivative_gain * slope,
        ratio=loop.integral_gain / (loop.kp**2 * slope),
    )
