"""Where a stand-off loop can rest, its poles there, and where its equation breaks down."""

import math
from dataclasses import dataclass

from ..errors import InvalidInput, require
from .loop import StandoffLoop


@dataclass(frozen=True)
class Equilibrium:
    """A distance at which the estimate equals the reference.

    Attributes:
        y: True distance [m]; it differs from the reference by the estimate's error there.
        stable: Whether all poles lie in the left half plane.
        poles: Of the linearised closed loop [1/s], slowest first.
        realisable: Whether a derivative filter, however fast, leaves the loop as it is here:
            1 - K_D f'(y) > 0. If not, the equation has this equilibrium and a real loop runs away
            from it, even if the poles are stable.
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
    """A length to measure motions by: between the equilibria, and 1 m for a = 0 [m].

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
