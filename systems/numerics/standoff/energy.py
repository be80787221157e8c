"""An energy of a stand-off loop with integral part: a Lyapunov function in closed form.

In the state (y, z), z the integral of f, and with q = 1 - K_D f',

    q y' = K_P f + K_I z,    z' = f,    E = K_I z^2 / 2 - integral of f q dy from the rest,

    q E' = -K_P f^2 q, so E' = -K_P f^2: it falls wherever q > 0.

Hence there are no limit cycles, and the part of E < E(edge) around the wanted equilibrium is
attracted to it, where the edge is the other equilibrium or the singularity, whichever is nearer.

Source: ours.
"""

import math

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike

from .equilibria import other_equilibrium, singularities, wanted_equilibrium
from .loop import StandoffLoop


def edge(loop: StandoffLoop) -> float:
    """The distance that attraction cannot pass: other equilibrium or singularity [m].

    It lies above the wanted equilibrium for a > 0, and below it for a < 0. A straight error
    (a = 0) has none: infinity.
    """
    if loop.error.a == 0:
        return math.inf
    places = [other_equilibrium(loop).y, *singularities(loop)]
    return min(places) if loop.error.a > 0 else max(places)


def potential(loop: StandoffLoop) -> Polynomial:
    """W(y): minus the integral of f (1 - K_D f') dy from the wanted equilibrium [m^2]."""
    a, linear = loop.error.a, loop.error.b - 1
    miss = Polynomial([loop.error.c + loop.reference, linear, a])
    force = miss * (1 - loop.derivative_gain * miss.deriv())
    return -force.integ(lbnd=wanted_equilibrium(loop).y)


def energy(loop: StandoffLoop, y: ArrayLike, integral: ArrayLike) -> np.ndarray:
    """E(y, z) [m^2]; scalars or arrays of one shape."""
    return loop.integral_gain * np.square(integral) / 2 + potential(loop)(np.asarray(y))


def certified_interval(loop: StandoffLoop) -> tuple[float, float]:
    """Starts with an empty integral that the energy alone certifies, low and high [m].

    Inside the exact region, and equal to it on the side of the edge. A straight error (a = 0) has
    an energy that grows without bound: everything is certified.
    """
    barrier = edge(loop)
    if math.isinf(barrier):
        return -math.inf, math.inf
    wall = potential(loop)
    level = wall(barrier)
    rest = wanted_equilibrium(loop).y
    # W grows without bound on the side away from the edge, so that there is such a root.
    roots = (wall - level).roots()
    beyond = [
        float(root.real)
        for root in roots
        if abs(root.imag) < 1e-6 * (1 + abs(root)) and (root.real - rest) * (barrier - rest) < 0
    ]
    opposite = min(beyond, key=lambda root: abs(root - rest))
    low, high = sorted((opposite, barrier))
    return math.nextafter(low, high), math.nextafter(high, low)
