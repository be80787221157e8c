"""The border of what is attracted, for a stand-off loop with an integral part.

In the state (y, z), z the integral of f, multiplied by q = 1 - K_D f' > 0,

    y' = K_P f + K_I z,    z' = f q

is smooth, and has saddles where f = 0 and where q = 0 = K_P f + K_I z. The border of the wanted
equilibrium's region is the stable manifold of the nearer one, traced backwards here. The energy
(see `energy`) grows backwards, so it never comes back between the equilibrium and the saddle, and
crosses z = 0 beyond the equilibrium exactly once.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from .energy import edge
from .equilibria import root_slope, wanted_equilibrium
from .loop import StandoffLoop

# From the saddle, as a part of its distance to the equilibrium; the square is what is neglected.
_OFFSET = 1e-6
# How many times farther than the saddle the border is traced before it counts as endless.
_FAR = 1e6
_TOLERANCE = 1e-12


@dataclass(frozen=True, eq=False)
class Separatrix:
    """The border's branch around the wanted equilibrium.

    Attributes:
        saddle: y and z of the saddle that it belongs to [m], [m s].
        points: y and z, from the saddle backwards in time, shape (n, 2) [m], [m s].
        empty: Where it crosses z = 0 beyond the equilibrium [m].
        still: Where it crosses y' = 0 beyond the equilibrium [m]; None if it does not.
    """

    saddle: tuple[float, float]
    points: np.ndarray
    empty: float
    still: float | None


def separatrix(loop: StandoffLoop) -> Separatrix:
    """Trace the border, to about 1e-9 of the distance between equilibrium and saddle.

    Args:
        loop: With an integral part.

    Raises:
        InvalidInput: There is no equilibrium.
    """
    # In units of the distance d from equilibrium to saddle, mirrored if a < 0: y = rest + d x,
    # z = (scale) w, in which f is s d x (x / x_0 - 1), with x_0 the other equilibrium.
    rest, border = wanted_equilibrium(loop).y, edge(loop)
    distance, root = border - rest, root_slope(loop)
    other = root / (loop.error.a * distance)
    damping = loop.derivative_gain * root
    # K_I z in units of K_P s d; time in units of 1 / (K_P s).
    ratio = loop.ki / (loop.kp**2 * root)

    def miss(x):
        return x * (x / other - 1)

    def inertia(x):
        return 1 + damping - 2 * damping * x / other

    def backward(_, state):
        x, w = state
        rates = -np.array([miss(x) + w, ratio * miss(x) * inertia(x)])
        # At a pace that grows with the distance: a spiral outwards takes equal times per turn.
        return rates * (1 + math.hypot(x, w)) / math.hypot(*rates)

    saddle = np.array([1.0, -miss(1.0)])
    growth = 2 / other - 1
    # Of w in the smooth equations: d(miss * inertia) / dx.
    force = growth * inertia(1.0) - 2 * damping / other * miss(1.0)
    slowest = (growth - math.sqrt(growth**2 + 4 * ratio * force)) / 2
    direction = np.array([-1.0, growth - slowest])
    start = saddle + _OFFSET * direction / np.hypot(*direction)
    emptied = _event(lambda state: state[1], terminal=False)
    stopped = _event(lambda state: miss(state[0]) + state[1], terminal=True)
    escaped = _event(lambda state: _FAR - math.hypot(state[0], state[1]), terminal=True)
    path = solve_ivp(
        backward,
        (0.0, 1000.0),
        start,
        method="DOP853",
        rtol=_TOLERANCE,
        atol=_TOLERANCE,
        # Finer than the accuracy asks for, so that the points make a smooth line.
        max_step=0.05,
        events=(emptied, stopped, escaped),
    )
    units = np.array([distance, loop.kp * root * distance / loop.ki])
    origin = np.array([rest, 0.0])
    at_empty, at_still = path.y_events[0], path.y_events[1]
    return Separatrix(
        saddle=(border, float(saddle[1] * units[1])),
        points=origin + np.vstack([saddle, path.y.T]) * units,
        empty=float(rest + distance * at_empty[0, 0]),
        still=float(rest + distance * at_still[0, 0]) if len(at_still) else None,
    )


def _event(function: Callable[[np.ndarray], float], *, terminal: bool):
    """A falling zero of a function of the state, in the form that `solve_ivp` wants."""

    def event(_, state):
        return function(state)

    event.terminal = terminal  # type: ignore[attr-defined]  # how SciPy marks events
    event.direction = -1  # type: ignore[attr-defined]  # how SciPy marks events
    return event
