"""The sampled stand-off loop: its control law, its margins, and the design of its gains.

With eps the estimated minus the wanted distance, the law at every sample is

    d = (1 - exp(-h / tau)) (eps - w) / h,   u = feed_forward + K_P eps + K_I z + K_D d,
    v = u within the limit,   w += h d,   z += h (eps + (v - u) / K_P)

with z the integral, w the filtered miss, d its rate, h the sample time, tau the filter's time
constant, and v the command. The rate d is exactly that of w between samples: d = (eps - w) / tau
would be too large by half of h / tau. At the limit the integral is corrected by (v - u) / K_P, so
that it does not wind up. The filter starts at the first miss, so that switching on gives no kick.

Linear round the wanted equilibrium, with s = -f' there, an estimate that is d samples late, and
beta = 1 - exp(-h / tau), the loop that is open behind the estimate is exactly

    L(z) = s h z^-d (K_P + K_I h / (z - 1) + K_D beta (z - 1) / (h (z - 1 + beta))) / (z - 1)
         = s h z^-d N(x) / (x^2 (x + beta)),   x = z - 1,
    N(x) = A x^2 + B x + C,  A = K_P + K_D beta / h,  B = K_P beta + K_I h,  C = K_I h beta.

On the unit circle |x|^2 = v = 4 sin^2(w h / 2), so that |L| = 1 is a cubic in v:

    s^2 h^2 ((A v)^2 + B^2 v + C^2 - A B v^2 + A C (v^2 - 2 v) - B C v)
        = v^2 (beta^2 + (1 - beta) v)

The chosen gains are those on a grid whose slowest pole is fastest: K_D s on a fixed grid,
K_P s h on a geometric one, and K_I = K_P^2 s / (4 zeta^2), with which the ideal PI loop has damping
zeta. The largest K_P that keeps the margins is bisected at each K_D.

Source: Zhang 2014, 2.2.6, which has the ideal law. Filter, anti-windup by back-calculation and
margins as a specification are textbook (Astrom and Murray, Feedback Systems, 11.3 and 11.4), as is
the sampled loop (Astrom and Wittenmark, Computer-Controlled Systems, 3); the rest is ours.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

from ..checked import Checked, PositiveSized
from ..errors import InvalidInput, require, require_positive, require_sized
from ..tracking.mobile_agents import clip_symmetric
from .loop import StandoffLoop, root_slope


@dataclass(frozen=True, kw_only=True)
class SampledPid(Checked):
    """What the ideal law lacks.

    Raises:
        InvalidInput: A time is not positive or out of its range, or the limit is not positive.
    """

    # Time between samples, h [s].
    period: PositiveSized = 0.005
    # Time constant of the derivative's filter, tau [s].
    filter_time: PositiveSized = 0.02
    # Bound of the commanded speed [m/s]; infinite: none.
    limit: float = math.inf

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.limit != math.inf:
            require_positive("limit", self.limit)

    @property
    def blend(self) -> float:
        """How much of a step the filter takes in one sample: 1 - exp(-h/tau)."""
        return -math.expm1(-self.period / self.filter_time)


# Any: floats and the scalars of Drake and CasADi have no type in common.
def pid_step(
    state: Sequence[Any], estimate: Any, feed_forward: Any, loop: StandoffLoop, sampled: SampledPid
) -> tuple[tuple[Any, Any, Any], Any]:
    """One sample of the control law: the next state and the command.

    Plain arithmetic, for scalars of any kind that the limit's absolute values go through.

    Args:
        state: Integral z [m s], filtered miss w [m], and 1 once started, else 0.
        estimate: Distance as estimated [m].
        feed_forward: Speed that is added to the command [m/s].
        loop: Gains and reference; the error model is not looked at.
        sampled: Sample time, filter and limit.

    Returns:
        The next state, and the command [m/s].
    """
    integral, filtered, started = state
    miss = estimate - loop.reference
    filtered = filtered + (1 - started) * (miss - filtered)
    derivative = sampled.blend * (miss - filtered) / sampled.period
    wanted = (
        feed_forward
        + loop.kp * miss
        + loop.integral_gain * integral
        + loop.derivative_gain * derivative
    )
    command = wanted if math.isinf(sampled.limit) else clip_symmetric(wanted, sampled.limit)
    integral = integral + sampled.period * (miss + (command - wanted) / loop.kp)
    filtered = filtered + sampled.period * derivative
    return (integral, filtered, 1.0 + 0.0 * miss), command


# Points of the grid on which crossings are looked for, per decade and per turn of the delay.
_PER_DECADE, _PER_TURN = 60, 60
# How far below the slowest corner of the loop the grid begins.
_BELOW = 1e-3


@dataclass(frozen=True)
class SampledLoop:
    """The sampled loop, linearised at the wanted equilibrium.

    Attributes:
        slope: s, of the estimate over the distance at the wanted equilibrium [1].
        kp, ki, kd: Gains; zero where the controller has no such part [1/s], [1/s^2], [1].
        beta: Of the derivative's filter; 1 without a derivative part, where it has no part.
        period: h [s].
        delay_samples: d, by how many samples the estimate is late.
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
    """How far a loop is from instability.

    Attributes:
        stable: Whether all poles lie inside the unit circle. If not, the margins say nothing.
        poles: z, slowest first.
        gain_margin: Smallest factor above 1 on all gains at which L passes -1; infinite: none.
        gain_reduction: Largest factor up to 1 at which L passes -1; zero: none.
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
    """Frequency grid that resolves the loop's corners and delay, up to pi / h, rising [rad/s].

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
    """Factors on all gains at which L passes -1, and the frequencies, where L is negative real."""
    seen = linear.response(grid)
    # L crosses the negative real axis where its imaginary part changes sign and Re L < 0.
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


# K_P s h, from largest to smallest, and K_D s, that are tried.
_SPEEDS = np.geomspace(3.0, 1e-5, 70)
_ADDED = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.4, 2.0)
# Halvings of the step between two speeds.
_HALVINGS = 12


@dataclass(frozen=True, kw_only=True)
class Specification:
    """What a loop has to bear.

    Raises:
        InvalidInput: A number is out of its range.
    """

    # Least phase margin [rad].
    phase_margin: float = math.radians(60)
    # Least gain margin [1].
    gain_margin: float = 2.0
    # Largest peak Ms of the sensitivity [1].
    peak_sensitivity: float = 1.6
    # Least further delay that it bears [s].
    delay_margin: float = 0.0
    # Of the ideal PI loop's pair of poles; 1: both at one place [1].
    damping: float = 1.0

    def __post_init__(self) -> None:
        require_positive("damping", self.damping)
        require_sized("damping", self.damping)
        for name, low, high in (
            ("phase_margin", 0.0, math.pi / 2),
            ("gain_margin", 1.0, math.inf),
            ("peak_sensitivity", 1.0, math.inf),
        ):
            value = getattr(self, name)
            worded = _angle if name == "phase_margin" else "{:.4g}".format
            wish = f"lie between {worded(low)} and {worded(high)}"
            # Written so that NaN fails.
            require(low < value < high, name, wish, worded(value))
        words = "be a finite number, zero or positive"
        require(0 <= self.delay_margin < math.inf, "delay_margin", words, self.delay_margin)

    def __str__(self) -> str:
        return (
            f"phase margin {_angle(self.phase_margin)}, gain margin {self.gain_margin:.4g}, "
            f"peak sensitivity {self.peak_sensitivity:.4g}, delay margin {self.delay_margin:.4g} s"
        )

    def holds(self, margins: LoopMargins) -> bool:
        """Whether a loop has these margins.

        Args:
            margins: Of the loop.
        """
        return (
            margins.stable
            and margins.phase_margin >= self.phase_margin
            and margins.gain_margin >= self.gain_margin
            and margins.peak_sensitivity <= self.peak_sensitivity
            and margins.delay_margin >= self.delay_margin
        )


def _angle(value: float) -> str:
    """Word an angle in radians and in degrees, for error messages."""
    return f"{value:.4g} rad ({math.degrees(value):.4g} degrees)"


@dataclass(frozen=True, eq=False)
class StandoffDesign:
    """Gains, and what they give.

    Attributes:
        loop: With the gains found.
        margins: Of the sampled loop.
    """

    loop: StandoffLoop
    margins: LoopMargins


def design_gains(
    loop: StandoffLoop,
    sampled: SampledPid,
    delay_samples: int = 0,
    asked: Specification | None = None,
) -> StandoffDesign:
    """Choose gains.

    Args:
        loop: Controller, reference and error; its gains are not looked at.
        sampled: Sample time and filter; the limit is not looked at.
        delay_samples: How many samples late the estimate comes.
        asked: The margins; by default those of `Specification`.

    Raises:
        InvalidInput: There is no equilibrium, or no gains on the grid have these margins.
    """
    wanted = Specification() if asked is None else asked
    slope = root_slope(loop)

    def attempt(speed: float, added: float) -> StandoffDesign:
        kp = speed / (slope * sampled.period)
        ki = kp**2 * slope / (4 * wanted.damping**2) if loop.integrates else loop.ki
        kd = added / slope if "D" in loop.controller else loop.kd
        tuned = replace(loop, kp=kp, ki=ki, kd=kd)
        return StandoffDesign(tuned, loop_margins(sampled_loop(tuned, sampled, delay_samples)))

    best: StandoffDesign | None = None
    for added in _ADDED if "D" in loop.controller else (0.0,):
        failing = float(_SPEEDS[0])
        found: StandoffDesign | None = None
        low = high = failing
        for speed in _SPEEDS[1:].tolist():
            found = attempt(speed, added)
            if wanted.holds(found.margins):
                low, high = speed, failing
                break
            failing, found = speed, None
        if found is None:
            continue
        for _ in range(_HALVINGS):
            middle = math.sqrt(low * high)
            between = attempt(middle, added)
            if wanted.holds(between.margins):
                low, found = middle, between
            else:
                high = middle
        if best is None or _pace(found) < _pace(best):
            best = found
    if best is None:
        raise InvalidInput(
            "`phase_margin, gain_margin, peak_sensitivity, delay_margin` must be attainable with "
            f"this clock, filter and delay; got {wanted}"
        )
    return best


def _pace(design: StandoffDesign) -> float:
    """Magnitude of the slowest pole: the share of a miss that remains after each sample."""
    return float(np.abs(design.margins.poles[0]))
