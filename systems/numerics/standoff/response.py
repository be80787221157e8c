"""Response of a stand-off loop from a starting distance, and its delay margin.

`respond` integrates the closed loop until it settles, breaks down or runs away. `delay_margin` is
for a loop whose estimate comes late: linearised at the wanted equilibrium, with s = -f' there, the
open loop, cut behind the estimate, is L(jw) = s (K_P + K_I / jw + K_D jw / (1 + jw tau)) / jw,
with tau the derivative filter's time constant. A delay T multiplies it by exp(-jwT). The delay
margin is the smallest T that brings L to -1: (pi + arg L) / w at the smallest such quotient over
the frequencies with |L| = 1.

Source: ours; the method is textbook (e.g. Astrom and Murray, Feedback Systems, 10.3).
"""

import cmath
import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from ..errors import require, require_finite, require_non_negative, require_positive
from .loop import StandoffLoop, root_slope, singularities, span, wanted_equilibrium

SETTLED, SINGULAR, DIVERGED, MOVING = "settled", "singular", "diverged", "moving"

# In units of the distance between the equilibria (see `span`): a motion this far away has diverged,
# and one this near to an equilibrium, with its integral this near to zero, has settled.
_LOST, _NEAR = 1e6, 1e-7
# How near to the singularity, in 1 - K_D f', the equation counts as broken down.
_BREAKDOWN = 1e-9
_TOLERANCE = 1e-11


@dataclass(frozen=True, eq=False)
class StandoffResponse:
    """A motion of the loop.

    Attributes:
        times: Shape (n,) [s].
        y: True distance, shape (n,) [m].
        integral: Of f, shape (n,) [m s].
        outcome: `settled` at an equilibrium, `singular`: ran into the singularity, where the
            equation ends, `diverged`, or `moving` still.
        end: Where it settled or stopped [m]; infinite if it diverged.
    """

    times: np.ndarray
    y: np.ndarray
    integral: np.ndarray
    outcome: str
    end: float


def still_integral(loop: StandoffLoop, y: float) -> float:
    """The integral with which a loop starts at rest, y' = 0, from a distance [m]; [m s]."""
    return -loop.kp * loop.miss(y) / loop.ki if loop.integrates else 0.0


def respond(
    loop: StandoffLoop, start: float, *, duration: float = 60.0, integral: float = 0.0
) -> StandoffResponse:
    """Solve the closed loop from a distance.

    Args:
        loop: The closed loop.
        start: Distance at the start [m].
        duration: At most so long [s].
        integral: Of f at the start [m s]; zero for P and PD.

    Raises:
        InvalidInput: The start is not finite or a singularity, the duration is not positive, or
            there is no equilibrium.
    """
    require_start(loop, start)
    require_positive("duration", duration)
    # In x = y - rest, f = x (a x - s), without cancellation, however large `rest` is.
    rest, slope, curvature = wanted_equilibrium(loop).y, root_slope(loop), loop.error.a
    rests = [0.0, slope / curvature] if curvature else [0.0]
    length, away = span(loop), start - rest
    # Equilibria may lie very far apart, so the tolerance is bounded.
    near = _NEAR * min(length, 1.0)
    gain, derivative = loop.integral_gain, loop.derivative_gain

    def miss(x):
        return x * (curvature * x - slope)

    def inertia(x):
        return 1 - derivative * (2 * curvature * x - slope)

    side = math.copysign(1.0, inertia(away))

    def rates(_, state):
        x, total = state
        return [(loop.kp * miss(x) + gain * total) / inertia(x), miss(x) if gain else 0.0]

    def breakdown(_, state):
        return side * inertia(state[0]) - _BREAKDOWN

    def lost(_, state):
        return _LOST * max(length, abs(away)) - abs(state[0])

    def settled(_, state):
        off = min(abs(state[0] - each) for each in rests)
        return max(off, gain / loop.kp * abs(state[1])) - near

    for event in (breakdown, lost, settled):
        event.terminal = True  # type: ignore[attr-defined]  # how SciPy marks events
    weak = loop.integrates and loop.ki < 1e-3 * loop.kp**2 * slope
    stiff = weak or derivative > 0
    path = solve_ivp(
        rates,
        (0.0, duration),
        [away, integral],
        # Implicit: stiff beside the singularity, and with a weak integral.
        method="Radau" if stiff else "DOP853",
        rtol=1e-9 if stiff else _TOLERANCE,
        atol=_TOLERANCE * min(length, 1.0),
        events=(breakdown, lost, settled),
    )
    hits = [len(times) > 0 for times in path.t_events]
    outcome, end = MOVING, float(path.y[0, -1])
    if hits[2] or settled(0.0, path.y[:, -1]) <= 0:
        outcome, end = SETTLED, rest + min(rests, key=lambda each: abs(each - end))
    elif hits[1]:
        outcome, end = DIVERGED, math.copysign(math.inf, end)
    # Beside the singularity the rate outgrows every step size, and the solver gives up.
    elif hits[0] or path.status == -1:
        outcome, end = _ending(loop, rest + end)
    else:
        end += rest
    return StandoffResponse(path.t, rest + path.y[0], path.y[1], outcome, end)


def require_start(loop: StandoffLoop, start: float) -> None:
    """Refuse a start that is not finite, or on a singularity.

    Args:
        loop: With its singularities.
        start: y at the start [m].

    Raises:
        InvalidInput: It is.
    """
    require_finite("start", start)
    on_it = abs(loop.inertia(start)) < _BREAKDOWN
    place = "".join(f" at {y:.9g} m" for y in singularities(loop))
    require(not on_it, "start", f"not lie on the singularity{place}", start)


def _ending(loop: StandoffLoop, end: float) -> tuple[str, float]:
    """Why a solution stopped early: at a singularity, or by growing without bound."""
    places = singularities(loop)
    if places and abs(loop.inertia(end)) < 1e-3:
        return SINGULAR, places[0]
    return DIVERGED, math.copysign(math.inf, end)


@dataclass(frozen=True)
class DelayMargin:
    """A loop's margin.

    Attributes:
        delay: Largest delay that leaves the loop stable [s]; zero if none does.
        frequency: Frequency of oscillation at that delay [rad/s]; infinite for a margin of zero.
    """

    delay: float
    frequency: float


def open_loop(loop: StandoffLoop, frequency: float, filter_time: float = 0.0) -> complex:
    """L(jw) at a frequency w > 0 [rad/s]."""
    s = 1j * frequency
    derivative = loop.derivative_gain * s / (1 + s * filter_time)
    return root_slope(loop) * (loop.kp + loop.integral_gain / s + derivative) / s


def crossover_frequencies(loop: StandoffLoop, filter_time: float = 0.0) -> tuple[float, ...]:
    """Frequencies w at which |L(jw)| = 1 [rad/s], rising.

    With W = w^2, B = K_P tau + K_D and A = K_P + K_I tau they are the positive roots of
    tau^2 W^3 + (1 - s^2 B^2) W^2 + s^2 (2 K_I B - A^2) W - s^2 K_I^2 = 0.
    """
    s2 = root_slope(loop) ** 2
    ki = loop.integral_gain
    fast = loop.kp * filter_time + loop.derivative_gain
    slow = loop.kp + ki * filter_time
    roots = np.roots(
        [filter_time**2, 1 - s2 * fast**2, s2 * (2 * ki * fast - slow**2), -s2 * ki**2]
    )
    real = [root.real for root in roots if abs(root.imag) < 1e-9 * abs(root) and root.real > 0]
    return tuple(sorted(math.sqrt(root) for root in real))


def delay_margin(loop: StandoffLoop, filter_time: float = 0.0) -> DelayMargin:
    """The largest delay of the estimate that the loop bears at the wanted equilibrium.

    Zero for an unfiltered derivative with K_D s >= 1: then the loop has gain at all frequencies,
    and any delay, however short, lets it run away.

    Args:
        loop: The closed loop.
        filter_time: Time constant tau of the derivative filter; zero: ideal [s].

    Raises:
        InvalidInput: There is no equilibrium, or the filter time is negative.
    """
    require_non_negative("filter_time", filter_time)
    if filter_time == 0 and loop.derivative_gain * root_slope(loop) >= 1:
        return DelayMargin(0.0, math.inf)
    margins = []
    for frequency in crossover_frequencies(loop, filter_time):
        phase = math.pi + cmath.phase(open_loop(loop, frequency, filter_time))
        margins.append(DelayMargin(phase % (2 * math.pi) / frequency, frequency))
    # |L| falls from infinity to less than one, so it crosses one somewhere.
    return min(margins, key=lambda margin: margin.delay)
