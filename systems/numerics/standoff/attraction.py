"""Region of attraction of a stand-off loop: its energy, its border, and the starts that settle.

In the state (y, z), z the integral of f, and with q = 1 - K_D f',

    q y' = K_P f + K_I z,    z' = f,    E = K_I z^2 / 2 - integral of f q dy from the rest,

    q E' = -K_P f^2 q, so E' = -K_P f^2: it falls wherever q > 0.

Hence there are no limit cycles, and the part of E < E(edge) around the wanted equilibrium belongs
to its region of attraction. The edge is the other equilibrium or the singularity, whichever is
nearer.

With an integral part the exact border is the stable manifold of the edge. Multiplied by q > 0, the
equations

    y' = K_P f + K_I z,    z' = f q

are smooth, and have saddles where f = 0 and where q = 0 = K_P f + K_I z. The manifold of the nearer
one is traced backwards. The energy grows backwards, so the curve never comes back between the
equilibrium and the saddle, and crosses z = 0 beyond the equilibrium exactly once.

The border is computed in normalised units: the wanted equilibrium at zero, the edge at one.
With y = rest + d x, time in units of 1 / (K_P s) and K_I z in units of K_P s d,

    q x' = m + w,   w' = ratio m,   m = x (x / other - 1),   q = 1 + damping - 2 damping x / other,

where d reaches from the wanted equilibrium to the edge, s is the root of the discriminant, `other`
is where the other equilibrium lies, damping = K_D s, ratio = K_I / (K_P^2 s).

Source: ours.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike
from scipy.integrate import solve_ivp

from ..errors import require
from .loop import StandoffLoop, other_equilibrium, root_slope, singularities, wanted_equilibrium


def edge(loop: StandoffLoop) -> float:
    """The distance that attraction cannot pass: other equilibrium or singularity [m].

    It lies above the wanted equilibrium for a > 0, and below it for a < 0. A straight error
    (a = 0) has none: infinity.
    """
    if loop.error.a == 0:
        return math.inf
    places = [other_equilibrium(loop).y, *singularities(loop)]
    return min(places) if loop.error.a > 0 else max(places)


@lru_cache(maxsize=8)
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
    """Interval of starts with zero integral that the energy alone certifies, low and high [m].

    It lies inside the exact region, and ends where that does on the side of the edge. For a
    straight error (a = 0) the energy grows without bound: everything is certified.
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


# Ratios outside these cannot be told from zero or infinity in double precision; a derivative part
# lowers the upper one.
_WEAKEST, _STRONGEST = 1e-14, 1e12


@dataclass(frozen=True)
class NormalisedLoop:
    """Parameters of the normalised equations in the module's docstring.

    Attributes:
        rest: Distance of the wanted equilibrium [m].
        distance: d, negative for an error with a < 0 [m].
        integral_unit: Integral z for w = 1 [m s]; zero without an integral part.
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
        InvalidInput: There is no equilibrium, or the integral is so weak or so strong beside K_P
            that rounding would swallow one of them.
    """
    rest, slope = wanted_equilibrium(loop).y, root_slope(loop)
    distance = edge(loop) - rest
    if loop.integrates:
        unit = loop.kp**2 * slope
        low, high = _WEAKEST * unit, _STRONGEST * unit / (1 + loop.derivative_gain * slope)
        words = f"lie between {low:.3g} and {high:.3g} for these kp and kd"
        require(low <= loop.ki <= high, "ki", words, loop.ki)
    return NormalisedLoop(
        rest=rest,
        distance=distance,
        integral_unit=loop.kp * slope * distance / loop.ki if loop.integrates else 0.0,
        other=slope / (loop.error.a * distance),
        damping=loop.derivative_gain * slope,
        ratio=loop.integral_gain / (loop.kp**2 * slope),
    )


# Where tracing starts: distance from the saddle, as a part of the saddle's distance from the
# equilibrium; the error is of the order of its square.
_OFFSET = 1e-6
# How many times farther than the saddle the border is traced before it counts as unbounded.
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
        # The pace grows with the distance, so that each turn of an outward spiral takes equal time.
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


@dataclass(frozen=True)
class RegionOfAttraction:
    """An open interval of starting distances.

    Attributes:
        low, high: Its ends; infinite where it is unbounded [m].
    """

    low: float
    high: float

    def holds(self, y: float) -> bool:
        """Whether a distance [m] lies inside.

        Args:
            y: The distance [m].
        """
        return self.low < y < self.high


def region_of_attraction(loop: StandoffLoop, *, integral: str = "empty") -> RegionOfAttraction:
    """The starts that end at the wanted equilibrium.

    On one side lies the other equilibrium or the singularity, whichever is nearer, for all four
    controllers. On the other side P and PD attract from everywhere; with an integral part a start
    far away winds the integral up so much that the loop swings over the edge. A straight error
    (a = 0) makes the loop linear: it settles from everywhere.

    Args:
        loop: The closed loop.
        integral: How the integral of PI and PID starts: `empty`, at zero as it is at rest, or
            `still`, so that y' = 0 at the start, as in the thesis's Figure 2.20.

    Raises:
        InvalidInput: There is no equilibrium.
    """
    require(integral in ("empty", "still"), "integral", "be empty or still", integral)
    border = edge(loop)
    if math.isinf(border):
        return RegionOfAttraction(-math.inf, math.inf)
    outward = math.copysign(math.inf, loop.error.a)
    opposite: float | None = -outward
    if loop.integrates:
        found = separatrix(loop)
        opposite = found.empty if integral == "empty" else found.still
    far = -outward if opposite is None else opposite
    return RegionOfAttraction(min(far, border), max(far, border))


_STEPS = 4000
_STEP = 0.02


def attracted_states(loop: StandoffLoop, y: np.ndarray, integral: np.ndarray) -> np.ndarray:
    """Integrate motions until the energy certifies them, or they have passed the edge for good.

    Motions beyond the singularity count as not attracted, and so do those, near the border, that
    are still undecided at the end.

    Args:
        loop: With an integral part.
        y: Distances, any shape [m].
        integral: Of f, same shape [m s].

    Returns:
        Whether each state ends at the wanted equilibrium, same shape.
    """
    if loop.error.a == 0:
        # The energy grows without bound.
        return np.ones(y.shape, dtype=bool)
    side = 1.0 if loop.error.a > 0 else -1.0
    rest, border, other = wanted_equilibrium(loop).y, edge(loop), other_equilibrium(loop).y
    span, level = abs(border - rest), float(energy(loop, border, 0.0))
    speed = loop.kp * root_slope(loop) * span
    shape = y.shape
    states = np.stack([np.ravel(y), np.ravel(integral)]).astype(float)
    found = np.zeros(states.shape[1], dtype=bool)
    alive = np.arange(states.shape[1])

    def field(state):
        """The smooth equations, at a pace of at most one `span` in the unit of time."""
        inertia = loop.inertia(state[0])
        rates = np.stack(
            [loop.kp * loop.miss(state[0]) + loop.ki * state[1], loop.miss(state[0]) * inertia]
        )
        return rates * span / (speed + np.hypot(rates[0], rates[1]))

    for _ in range(_STEPS):
        now = states[:, alive]
        inside = (side * (border - now[0]) > 0) & (energy(loop, now[0], now[1]) < level)
        found[alive[inside]] = True
        # Lost: beyond the other equilibrium, with an integral that drives the motion farther.
        gone = (side * (now[0] - other) >= 0) & (side * now[1] >= 0)
        gone |= loop.inertia(now[0]) <= 0
        alive = alive[~(inside | gone)]
        if alive.size == 0:
            break
        now = states[:, alive]
        half = field(now + _STEP / 2 * field(now))
        states[:, alive] = now + _STEP * half
    return found.reshape(shape)
