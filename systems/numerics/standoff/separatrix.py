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
from functools import lru_cache

import numpy as np
from scipy.integrate import solve_ivp

from .loop import StandoffLoop
from .normalised import NormalisedLoop, normalise

# From the saddle, as a part of its distance to the equilibrium; the square is what is neglected.
_OFFSET = 1e-6
# How many times farther than the saddle the border is traced before it counts as endless.
_FAR = 1e6
# K_I / (K_P^2 s) below which motions first creep along m + w = 0 (see `_creep`).
_WEAK = 1e-3
# How far from there m + w is when the creeping is over.
_LEFT = 0.05


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


@lru_cache(maxsize=8)
def separatrix(loop: StandoffLoop) -> Separatrix:
    """Trace the border, to about 1e-9 of the distance between equilibrium and saddle.

    Args:
        loop: With an integral part, and an error that is not a straight line.

    Raises:
        InvalidInput: There is no equilibrium.
    """
    unit = normalise(loop)

    def backward(_, state):
        x, w = state
        miss = unit.miss(x)
        x_rate, w_rate = -(miss + w), -unit.ratio * miss * unit.inertia(x)
        # At a pace that grows with the distance: a spiral outwards takes equal times per turn.
        pace = (1 + math.hypot(x, w)) / math.hypot(x_rate, w_rate)
        return [x_rate * pace, w_rate * pace]

    saddle = np.array([1.0, -unit.miss(1.0)])
    start = _creep(unit) if unit.ratio < _WEAK else _beside_saddle(unit)
    first = np.array([start[0], start[1] - unit.miss(start[0])])
    far = _FAR / min(1.0, unit.ratio)
    emptied = _event(lambda state: state[1], terminal=False)
    stopped = _event(lambda state: unit.miss(state[0]) + state[1], terminal=True)
    escaped = _event(lambda state: far - math.hypot(state[0], state[1]), terminal=True)
    path = solve_ivp(
        backward,
        (0.0, 1000.0),
        first[:, -1],
        method="DOP853",
        rtol=1e-12,
        atol=1e-12,
        # Finer than the accuracy asks for, so that the points make a smooth line.
        max_step=0.05,
        events=(emptied, stopped, escaped),
    )
    units = np.array([unit.distance, unit.integral_unit])
    origin = np.array([unit.rest, 0.0])
    at_empty, at_still = path.y_events[0], path.y_events[1]
    return Separatrix(
        saddle=(float(origin[0] + units[0]), float(saddle[1] * units[1])),
        points=origin + np.vstack([saddle, first.T, path.y.T[1:]]) * units,
        empty=float(unit.rest + unit.distance * at_empty[0, 0]),
        still=float(unit.rest + unit.distance * at_still[0, 0]) if len(at_still) else None,
    )


def _beside_saddle(unit: NormalisedLoop) -> np.ndarray:
    """x and v = m + w where the border leaves the saddle, shape (2, 1)."""
    # Of the smooth equations there: d(m) / dx, and d(m q) / dx.
    growth = _slope(unit, 1.0)
    force = growth * unit.inertia(1.0) - 2 * unit.damping / unit.other * unit.miss(1.0)
    root = math.sqrt(growth**2 + 4 * unit.ratio * force)
    # The stable root, without the difference of two numbers that are nearly equal.
    stable = -2 * unit.ratio * force / (growth + root) if growth > 0 else (growth - root) / 2
    along = _OFFSET / math.hypot(1.0, growth - stable)
    return np.array([[1.0 - along], [-stable * along]])


def _creep(unit: NormalisedLoop) -> np.ndarray:
    """The border's part that creeps along m + w = 0, in x and v = m + w, shape (2, n).

    With a weak integral v is of the order of the ratio here: as the sum of m and w rounding would
    swallow it, and an explicit solver would take very many steps. So v is followed over x, which
    falls, as p = log(v / ratio): ratio dp/dx = exp(-p) (dm/dx + m q exp(-p)).
    """
    (first,), (leaving,) = _beside_saddle(unit)

    def backward(way, state):
        x, inverse = first - way, np.exp(-state[0])
        return [-inverse * (_slope(unit, x) + _force(unit, x) * inverse) / unit.ratio]

    def jacobian(way, state):
        x, inverse = first - way, np.exp(-state[0])
        pull = _slope(unit, x) + 2 * _force(unit, x) * inverse
        return [[inverse * pull / unit.ratio]]

    path = solve_ivp(
        backward,
        (0.0, first),
        [math.log(leaving / unit.ratio)],
        method="Radau",
        jac=jacobian,
        rtol=1e-10,
        atol=1e-11,
        max_step=0.02,
        events=_event(lambda state: math.log(_LEFT / unit.ratio) - state[0], terminal=True),
    )
    return np.stack([first - path.t, unit.ratio * np.exp(path.y[0])])


def _force(unit: NormalisedLoop, x: float) -> float:
    """m q, so that w' = ratio m q."""
    return unit.miss(x) * unit.inertia(x)


def _slope(unit: NormalisedLoop, x: float) -> float:
    """dm / dx."""
    return 2 * x / unit.other - 1


def _event(function: Callable[[np.ndarray], float], *, terminal: bool):
    """A falling zero of a function of the state, in the form that `solve_ivp` wants."""

    def event(_, state):
        return function(state)

    event.terminal = terminal  # type: ignore[attr-defined]  # how SciPy marks events
    event.direction = -1  # type: ignore[attr-defined]  # how SciPy marks events
    return event
