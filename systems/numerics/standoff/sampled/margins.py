"""Margins of the stand-off loop that a computer closes: sampled, delayed, its derivative filtered.

Linear round the wanted equilibrium, with s = -f' there, a command held over each sample time h, an
estimate that is d samples late, and beta = 1 - exp(-h / tau) of the filter, the loop that is open
behind the estimate is exactly

    L(z) = s h z^-d (K_P + K_I h / (z - 1) + K_D beta (z - 1) / (h (z - 1 + beta))) / (z - 1)
         = s h z^-d N(x) / (x^2 (x + beta)),   x = z - 1,
    N(x) = A x^2 + B x + C,  A = K_P + K_D beta / h,  B = K_P beta + K_I h,  C = K_I h beta.

On the unit circle |x|^2 = v = 4 sin^2(w h / 2), so that |L| = 1 is a cubic in v:

    s^2 h^2 ((A v)^2 + B^2 v + C^2 - A B v^2 + A C (v^2 - 2 v) - B C v)
        = v^2 (beta^2 + (1 - beta) v)

Source: ours; the method is textbook (Astrom and Wittenmark, Computer-Controlled Systems, 3).
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

from ..equilibria import root_slope
from ..loop import StandoffLoop
from ..sampled_pid import SampledPid

# Points of the grid on which crossings are looked for, per decade and per turn of the delay.
_PER_DECADE, _PER_TURN = 60, 60
# How far below the slowest corner of the loop the grid begins.
_BELOW = 1e-3


@dataclass(frozen=True)
class SampledLoop:
    """A linear loop, and the coefficients above.

    Attributes:
        slope: s, of the estimate over the distance at the wanted equilibrium [1].
        kp, ki, kd: Gains; zero where the controller has no such part [1/s], [1/s^2], [1].
        beta: Of the derivative's filter; 1 without a derivative part, where it has no part.
        period: h [s].
        delay_samples: d.
    """

    slope: float
    kp: float
    ki: float
    kd: float
    beta: float
    period: float
    delay_samples: int

    @property
    def a(self) -> float:
        """A [1/s]."""
        return self.kp + self.kd * self.beta / self.period

    @property
    def b(self) -> float:
        """B [1/s]."""
        return self.kp * self.beta + self.ki * self.period

    @property
    def c(self) -> float:
        """C [1/s]."""
        return self.ki * self.period * self.beta

    @property
    def gain(self) -> float:
        """s h [s]."""
        return self.slope * self.period

    def response(self, frequencies: np.ndarray) -> NDArray[np.complex128]:
        """L(exp(jwh)) at frequencies w up to pi / h [rad/s], of any shape."""
        angle = np.asarray(frequencies) * self.period
        # exp(j angle) - 1, without the difference of two numbers that are nearly equal.
        x = 2j * np.sin(angle / 2) * np.exp(0.5j * angle)
        numerator = (self.a * x + self.b) * x + self.c
        late = np.exp(-1j * angle * self.delay_samples)
        return self.gain * late * numerator / (x * x * (x + self.beta))

    def matrix(self) -> np.ndarray:
        """One sample as a matrix, shape (d + 3, d + 3).

        State: the distance's deviation now and at each of the d samples before [m], the integral
        of the miss [m s], and the filtered miss [m].
        """
        late, integral, filtered = (
            self.delay_samples,
            self.delay_samples + 1,
            self.delay_samples + 2,
        )
        step = np.zeros((late + 3, late + 3))
        step[0, 0] = 1.0
        step[np.arange(1, late + 1), np.arange(late)] = 1.0
        rate = self.kd * self.beta / self.period
        step[0, late] -= self.gain * (self.kp + rate)
        step[0, integral] -= self.period * self.ki
        step[0, filtered] += self.period * rate
        step[integral, integral] = 1.0
        step[integral, late] = self.gain
        step[filtered, filtered] = 1 - self.beta
        step[filtered, late] = self.beta * self.slope
        return step

    def parts(self) -> np.ndarray:
        """Which entries of the state have a part, shape (d + 3,): not all without K_I or K_D."""
        return np.array([True] * (self.delay_samples + 1) + [self.ki > 0, self.kd > 0])

    def poles(self) -> NDArray[np.complex128]:
        """Poles of the closed loop, z, slowest first."""
        found = np.linalg.eigvals(self.matrix()[np.ix_(self.parts(), self.parts())])
        found = found.astype(complex)
        return found[np.argsort(-np.abs(found), kind="stable")]

    def crossovers(self) -> tuple[float, ...]:
        """Frequencies at which |L| = 1, up to pi / h, rising [rad/s]."""
        # With v = h^2 V and these, all coefficients stay of the size of the continuous loop's.
        h, s = self.period, self.slope
        a, b, c, beta = self.a, self.b / h, self.c / h**2, self.beta / h
        squared = np.array(
            [
                1 - self.beta,
                beta**2 - s**2 * (a * a - h * a * b + h * h * a * c),
                -(s**2) * (b * b - 2 * a * c - h * b * c),
                -((s * c) ** 2),
            ]
        )
        roots = np.roots(np.trim_zeros(squared, "f"))
        real = [root.real for root in roots if abs(root.imag) < 1e-9 * abs(root)]
        places = [root * h * h / 4 for root in real if root > 0]
        return tuple(sorted(2 / h * math.asin(math.sqrt(v)) for v in places if v <= 1))


def sampled_loop(loop: StandoffLoop, sampled: SampledPid, delay_samples: int = 0) -> SampledLoop:
    """Linearise the loop that a computer closes, at the wanted equilibrium.

    Args:
        loop: Gains, reference and error.
        sampled: Sample time and filter; the limit is not looked at.
        delay_samples: How many samples late the estimate comes.

    Raises:
        InvalidInput: There is no equilibrium.
    """
    return SampledLoop(
        slope=root_slope(loop),
        kp=loop.kp,
        ki=loop.integral_gain,
        kd=loop.derivative_gain,
        beta=sampled.blend if loop.derivative_gain else 1.0,
        period=sampled.period,
        delay_samples=delay_samples,
    )


@dataclass(frozen=True, eq=False)
class LoopMargins:
    """How far a loop is from swinging.

    Attributes:
        stable: Whether all poles lie inside the unit circle. If not, the margins say nothing.
        poles: z, slowest first.
        gain_margin: Smallest factor above 1 on all gains at which it swings; infinite: none.
        gain_reduction: Largest factor below 1 at which it swings; zero: none.
        gain_frequency: Where the gain margin is taken [rad/s]; NaN without one.
        phase_margin: Smallest over all crossovers [rad]; infinite without one.
        crossover: Where the phase margin is taken [rad/s]; NaN without one.
        delay_margin: Further delay that it bears [s]; infinite without a crossover.
        peak_sensitivity: Ms, the largest |1 / (1 + L)|; 1 / Ms is how near L comes to -1 [1].
        peak_frequency: Where that is [rad/s].
    """

    stable: bool
    poles: NDArray[np.complex128]
    gain_margin: float
    gain_reduction: float
    gain_frequency: float
    phase_margin: float
    crossover: float
    delay_margin: float
    peak_sensitivity: float
    peak_frequency: float


def loop_margins(linear: SampledLoop) -> LoopMargins:
    """Stability and margins of a sampled loop.

    Args:
        linear: See `sampled_loop`.
    """
    poles = linear.poles()
    crossovers = linear.crossovers()
    grid = frequency_grid(linear)
    phases = [(math.pi + _phase(linear, w)) % (2 * math.pi) for w in crossovers]
    # A loop that lags by more than a half turn has its margin on the other side.
    phase, crossover = min(
        zip((min(p, 2 * math.pi - p) for p in phases), crossovers, strict=True),
        default=(math.inf, math.nan),
    )
    delay = min((p / w for p, w in zip(phases, crossovers, strict=True)), default=math.inf)
    factors = _gains_that_swing(linear, grid)
    gain, at = min((pair for pair in factors if pair[0] > 1), default=(math.inf, math.nan))
    peak, where = _peak(linear, grid)
    return LoopMargins(
        stable=bool(np.all(np.abs(poles) < 1)),
        poles=poles,
        gain_margin=gain,
        gain_reduction=max((factor for factor, _ in factors if factor <= 1), default=0.0),
        gain_frequency=at,
        phase_margin=phase,
        crossover=crossover,
        delay_margin=delay,
        peak_sensitivity=peak,
        peak_frequency=where,
    )


def frequency_grid(linear: SampledLoop) -> np.ndarray:
    """Frequencies fine enough for all that the loop does, up to pi / h, rising [rad/s].

    Args:
        linear: See `sampled_loop`.
    """
    top = math.pi / linear.period
    corners = [top, *linear.crossovers(), linear.beta / linear.period]
    if linear.c:
        corners.append(linear.c / linear.b / linear.period)
    low = _BELOW * min(corners)
    rough = np.geomspace(low, top, max(200, math.ceil(_PER_DECADE * math.log10(top / low))))
    turns = np.linspace(0, top, _PER_TURN * (linear.delay_samples + 2) // 2 + 2)[1:]
    return np.union1d(rough, turns)


def _phase(linear: SampledLoop, frequency: float) -> float:
    return float(np.angle(linear.response(np.array(frequency))))


def _gains_that_swing(linear: SampledLoop, grid: np.ndarray) -> list[tuple[float, float]]:
    """Factors at which L passes -1, and where: L is real and negative there."""
    seen = linear.response(grid)
    # Turned so that crossings of the negative axis are changes of sign.
    changes = np.flatnonzero((np.diff(np.sign(seen.imag)) != 0) & (seen.real[1:] < 0))
    found = []
    for k in changes.tolist():
        low, high = grid[k], grid[k + 1]

        def imaginary(frequency: float) -> float:
            return float(linear.response(np.array(frequency)).imag)

        if k + 2 == len(grid):
            # At pi / h it is real, but for rounding.
            continue
        if imaginary(low) * imaginary(high) < 0:
            # Any: the stubs allow for more results, which nobody asked for.
            root: Any = brentq(imaginary, low, high, xtol=1e-13 * high)
            place = float(root)
            found.append((float(1 / np.abs(linear.response(np.array(place)))), place))
    last = seen[-1].real
    if last < 0:
        found.append((float(-1 / last), float(grid[-1])))
    return found


def _peak(linear: SampledLoop, grid: np.ndarray) -> tuple[float, float]:
    """Ms and where."""

    def nearness(logarithm: float) -> float:
        frequency = np.array(math.exp(logarithm))
        return float(np.abs(1 + linear.response(frequency)))

    best = int(np.argmin(np.abs(1 + linear.response(grid))))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    found = minimize_scalar(
        nearness, bounds=(math.log(low), math.log(high)), method="bounded",
        options={"xatol": 1e-9},
    )  # fmt: skip
    ends = [(nearness(math.log(w)), w) for w in (low, grid[best], high)]
    least, where = min((float(found.fun), math.exp(float(found.x))), *ends)
    return 1 / least, float(where)
