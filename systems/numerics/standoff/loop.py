"""The stand-off loop: the estimate's error, the controller, and its equilibrium distances.

The estimate's error is a parabola, e(y) = a y^2 + b y + c, true minus estimated distance. The
pursuer drives at the evader's velocity plus the controller's output for the miss
eps = y - e(y) - r, estimated minus wanted distance. With f = -eps,

    f(y) = a y^2 + (b - 1) y + c + r,    f'(y) = 2 a y + b - 1,

the block diagram says y' = K_P f + K_I z + K_D f'(y) y' with z' = f, z(0) = 0. Solved for y':

    P    y'  = K_P f
    PI   y'' = K_P f' y' + K_I f
    PD   y'  = K_P f / (1 - K_D f')
    PID  y'' = (K_P f' y' + K_I f + 2 a K_D y'^2) / (1 - K_D f')

The loop can rest at the roots of f; its equation breaks down where 1 - K_D f' = 0.

The parabola is a fit between two distances. Beyond them it is an extrapolation, and the thesis's
wanted equilibrium at 0.22 m lies below the shortest one, 0.38 m. A cautious estimator uses the
error at the nearer end instead: then f falls with slope -1 outside, and there may be other
equilibria (`held_equilibria`).

Source: Zhang 2014, 2.2.7, (2.8) for the error, in millimetres there and in metres here, and
(2.9)-(2.12) for the loop. Printed one derivative too high on the left of (2.10)-(2.12), and with
the denominator 1 - 2 a K_D y - (b - 1) in (2.12), which is right for K_D = 1 only.

The equations are plain arithmetic, so that NumPy arrays and Drake's scalars all go through them.
"""

import math
from dataclasses import dataclass, field
from typing import Annotated

from ..checked import Checked, Finite, NonNegativeSized, PositiveSized, Sized, one_of
from ..errors import (
    InvalidInput,
    require,
    require_non_negative,
    require_positive,
)

_INCH = 0.0254


@dataclass(frozen=True, kw_only=True)
class ErrorModel(Checked):
    """e(y) = a y^2 + b y + c: true distance minus estimated distance, over the true distance y.

    The defaults are the thesis's fit, a = 0.001062 1/mm, b = -0.7598, c = 137 mm, and the
    distances that it was measured at, 15 to 60 inches.

    Raises:
        InvalidInput: A number is out of its range, or the distances are in the wrong order.
    """

    # Curvature [1/m]; zero for an error that is a straight line in y.
    a: Sized = 1.062
    # Slope at y = 0 [1].
    b: Sized = -0.7598
    # Error at y = 0 [m].
    c: Sized = 0.137
    # Least distance at which the fit was measured [m].
    shortest: Finite = 15 * _INCH
    # Greatest distance at which it was measured [m].
    longest: Finite = 60 * _INCH

    def __post_init__(self) -> None:
        super().__post_init__()
        require(
            self.shortest < self.longest,
            "shortest",
            f"be less than longest, {self.longest}",
            self.shortest,
        )

    def error(self, y):
        """e(y) [m], for a distance y [m]; scalars or arrays of any kind."""
        return self.a * y * y + self.b * y + self.c

    def covers(self, y: float) -> bool:
        """Whether the fit was measured at this distance [m]; elsewhere it is a guess."""
        return self.shortest <= y <= self.longest


THESIS_ERROR = ErrorModel()


# The controllers of (2.9) to (2.12), by the names that `StandoffLoop` takes.
CONTROLLERS = ("P", "PI", "PD", "PID")


@dataclass(frozen=True, kw_only=True)
class StandoffLoop(Checked):
    """A controller, its gains, the distance that it is to keep, and the estimate's error.

    A gain that the controller has no use for is ignored. The defaults are the thesis's.

    Raises:
        InvalidInput: An unknown controller, or a gain out of its range.
    """

    # P, PI, PD or PID.
    controller: Annotated[str, one_of(CONTROLLERS)] = "PID"
    # Gain K_P [1/s].
    kp: PositiveSized = 10.0
    # Gain K_I [1/s^2].
    ki: Sized = 5.0
    # Gain K_D, a pure number.
    kd: NonNegativeSized = 1.0
    # Distance to keep, r [m].
    reference: Sized = 0.2
    error: ErrorModel = field(default=THESIS_ERROR)

    def __post_init__(self) -> None:
        super().__post_init__()
        # With ki = 0 a PI or PID controller would have a whole line of equilibria.
        refuse = require_positive if self.integrates else require_non_negative
        refuse("ki", self.ki)

    @property
    def integrates(self) -> bool:
        """Whether the controller has an integral part."""
        return "I" in self.controller

    @property
    def derivative_gain(self) -> float:
        """K_D, and 0 without a derivative part."""
        return self.kd if "D" in self.controller else 0.0

    @property
    def integral_gain(self) -> float:
        """K_I, and 0 without an integral part [1/s^2]."""
        return self.ki if self.integrates else 0.0

    def miss(self, y):
        """f(y) = a y^2 + (b - 1) y + c + r, wanted minus estimated distance [m]."""
        return self.error.error(y) - y + self.reference

    def slope(self, y):
        """f'(y) = 2 a y + b - 1 [1]."""
        return 2 * self.error.a * y + self.error.b - 1

    def inertia(self, y):
        """1 - K_D f'(y) [1]: zero at the singularity; below it derivative action runs away."""
        return 1 - self.derivative_gain * self.slope(y)

    def rate(self, y, integral=0.0):
        """y' for an integral z of f [m s]; [m/s]."""
        drive = self.kp * self.miss(y) + self.integral_gain * integral
        return drive / self.inertia(y)

    def acceleration(self, y, y_rate):
        """y'' of PI and PID, by the corrected (2.10) and (2.12) [m/s^2].

        Args:
            y: Distance [m].
            y_rate: Its rate [m/s].
        """
        curvature = 2 * self.error.a * self.derivative_gain
        pull = self.kp * self.slope(y) * y_rate + self.ki * self.miss(y)
        return (pull + curvature * y_rate * y_rate) / self.inertia(y)


@dataclass(frozen=True)
class Equilibrium:
    """A distance at which the estimate equals the reference.

    Attributes:
        y: True distance [m]; it differs from the reference by the estimate's error there.
        stable: Whether all poles lie in the left half plane.
        poles: Of the linearised closed loop [1/s], slowest first.
        realisable: Whether a loop with a fast derivative filter behaves like the ideal one:
            1 - K_D f'(y) > 0. If not, a real loop runs away from this equilibrium, even if the
            poles here are stable.
    """

    y: float
    stable: bool
    poles: tuple[complex, ...]
    realisable: bool


def equilibria(loop: StandoffLoop) -> tuple[Equilibrium, ...]:
    """The roots of f(y) = a y^2 + (b - 1) y + c + r, nearest first: two, or one for a = 0.

    f' is -s and +s there, with s the root of the discriminant. Poles: (1 - K_D f') lambda = K_P f'
    without integral part, else (1 - K_D f') lambda^2 = K_P f' lambda + K_I f'.

    Raises:
        InvalidInput: The estimate never crosses the reference, or the singularity lies on an
            equilibrium.
    """
    signs = (-1, 1) if loop.error.a else (-1,)
    return tuple(sorted((_rest(loop, sign) for sign in signs), key=lambda each: each.y))


def wanted_equilibrium(loop: StandoffLoop) -> Equilibrium:
    """The equilibrium with f'(y) < 0, which is stable and realisable for all gains.

    Raises:
        InvalidInput: As for `equilibria`.
    """
    return _rest(loop, -1)


def other_equilibrium(loop: StandoffLoop) -> Equilibrium:
    """The equilibrium with f'(y) > 0.

    Raises:
        InvalidInput: As for `equilibria`, or a = 0: a straight line has one root.
    """
    require(loop.error.a != 0, "a", "not be zero, or there is no other equilibrium", loop.error.a)
    return _rest(loop, 1)


def singularities(loop: StandoffLoop) -> tuple[float, ...]:
    """Distances at which 1 - K_D f'(y) = 0 [m]; none without derivative part or with a = 0."""
    if loop.derivative_gain == 0 or loop.error.a == 0:
        return ()
    return ((1 / loop.derivative_gain + 1 - loop.error.b) / (2 * loop.error.a),)


def root_slope(loop: StandoffLoop) -> float:
    """s, the root of the discriminant (b - 1)^2 - 4 a (c + r): |f'| at both equilibria [1].

    Raises:
        InvalidInput: The discriminant is not positive; or, for a = 0, b is not less than 1.
    """
    a, linear = loop.error.a, loop.error.b - 1
    if a == 0:
        words = "be less than 1 for a = 0, or the estimate does not grow with the distance"
        require(linear < 0, "b", words, loop.error.b)
        return -linear
    discriminant = linear**2 - 4 * a * (loop.error.c + loop.reference)
    if not discriminant > 0:
        bound = linear**2 / (4 * a) - loop.error.c
        side = "less" if a > 0 else "more"
        raise InvalidInput(
            f"`reference` must be {side} than {bound:.6g}, or no distance is in equilibrium "
            f"(discriminant (b - 1)^2 - 4 a (c + r) = {discriminant:.4g}); got {loop.reference}"
        )
    return math.sqrt(discriminant)


def span(loop: StandoffLoop) -> float:
    """Length scale of motions: distance between the equilibria, or 1 m for a = 0 [m].

    Raises:
        InvalidInput: As for `equilibria`.
    """
    slope = root_slope(loop)
    return slope / abs(loop.error.a) if loop.error.a else 1.0


def _rest(loop: StandoffLoop, sign: int) -> Equilibrium:
    root = root_slope(loop)
    slope = sign * root
    a, linear = loop.error.a, loop.error.b - 1
    # One numerator cannot cancel; the other root follows from the product of both.
    steady = math.copysign(1.0, -linear)
    larger = -linear + steady * root
    # For a = 0 there is no division by it: the wanted root is the other one.
    y = larger / (2 * a) if sign == steady else 2 * (loop.error.c + loop.reference) / larger
    inertia = 1 - loop.derivative_gain * slope
    if abs(inertia) < 1e-12:
        raise InvalidInput(
            f"`kd` must not put the singularity on the equilibrium at {y:.6g} m; got {loop.kd}"
        )
    damping = loop.kp * slope / inertia
    poles: tuple[complex, ...] = (complex(damping),)
    if loop.integrates:
        poles = _roots(damping, loop.ki * slope / inertia)
    stable = all(pole.real < 0 for pole in poles)
    return Equilibrium(y, stable, poles, inertia > 0)


def _roots(damping: float, stiffness: float) -> tuple[complex, complex]:
    """Roots of x^2 = damping x + stiffness, nearest to zero first; of a pair, the lower first."""
    square = damping**2 + 4 * stiffness
    if square < 0:
        pole = complex(damping, -math.sqrt(-square)) / 2
        return pole, pole.conjugate()
    far = (damping + math.copysign(math.sqrt(square), damping)) / 2
    return complex(-stiffness / far), complex(far)


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
