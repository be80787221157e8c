"""All that is known of one stand-off loop: its linearisation, a proof of attraction, and the JSON.

Poles come from Drake, the frequency response and the root locus from python-control, which loads
only when it is used: the command line starts without it.

The proof is by sums of squares, with Drake's `RegionOfAttraction`. P and PI are polynomial. PD and
PID are rational, with q = 1 - K_D f' below the line. Drake's implicit form wants a residual that is
a polynomial in state and rates, which a Python system cannot give; but q x' = p is implied by
x' = p / q, and so is q^2 x' = p q, which is polynomial, has the same orbits, and runs them in the
same direction on both sides of the singularity q = 0. A Lyapunov function of the one is one of the
other, and its certified set cannot pass q = 0, where the polynomial field is at rest. Drake's wheel
solves semidefinite programmes with Clarabel, CSDP and SCS; Clarabel is used here.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.solvers import ClarabelSolver
from pydrake.symbolic import Expression, Variable
from pydrake.systems.analysis import RegionOfAttraction as DrakeRegion
from pydrake.systems.analysis import RegionOfAttractionOptions
from pydrake.systems.primitives import Linearize, SymbolicVectorSystem

from ...systems.numerics.standoff.attraction import (
    RegionOfAttraction,
    certified_interval,
    normalise,
    region_of_attraction,
)
from ...systems.numerics.standoff.loop import (
    Equilibrium,
    HeldEquilibrium,
    StandoffLoop,
    equilibria,
    held_equilibria,
    root_slope,
    singularities,
    wanted_equilibrium,
)
from ...systems.numerics.standoff.response import DelayMargin, delay_margin
from ...systems.numerics.standoff.sampled_loop import (
    LoopMargins,
    SampledPid,
    loop_margins,
    sampled_loop,
)
from ...systems.numerics.standoff.sampled_region import sampled_region
from ...systems.standoff import StandoffClosedLoop


def drake_poles(loop: StandoffLoop, y: float) -> tuple[complex, ...]:
    """Eigenvalues of Drake's linearisation of the closed loop at an equilibrium [1/s].

    Args:
        loop: The closed loop.
        y: The equilibrium [m].
    """
    plant = StandoffClosedLoop(loop, y)
    matrix = Linearize(plant, plant.CreateDefaultContext()).A()
    poles = [complex(pole) for pole in np.linalg.eigvals(matrix)]
    return tuple(sorted(poles, key=lambda pole: (round(abs(pole), 9), pole.imag)))


def open_loop_transfer(loop: StandoffLoop, filter_time: float = 0.0) -> Any:
    """The loop that is open behind the estimate, at the wanted equilibrium, as a TransferFunction.

    L(s) = -f' (K_P + K_I / s + K_D s / (1 + s tau)) / s.

    Args:
        loop: The closed loop.
        filter_time: Time constant tau of the derivative's filter [s].
    """
    import control

    kp, ki, kd = loop.kp, loop.integral_gain, loop.derivative_gain
    # Without a derivative there is nothing to filter.
    filter_time = filter_time if kd else 0.0
    numerator = np.array([kp * filter_time + kd, kp + ki * filter_time, ki])
    denominator = np.array([filter_time, 1.0, 0.0, 0.0])
    if not loop.integrates:
        # s is in both: left there it would be a pole at zero that is none.
        numerator, denominator = numerator[:-1], denominator[:-1]
    return control.tf(
        root_slope(loop) * np.trim_zeros(numerator, "f"), np.trim_zeros(denominator, "f")
    )


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """L(jw), and its margins.

    Attributes:
        frequencies: w, shape (n,) [rad/s].
        response: L(jw), shape (n,).
        gain_margin: Factor on the loop's gain that it bears; infinite: any.
        phase_margin: [rad].
        crossover: Where the phase margin is taken [rad/s]; NaN without one.
    """

    frequencies: np.ndarray
    response: NDArray[np.complex128]
    gain_margin: float
    phase_margin: float
    crossover: float


def frequency_response(
    loop: StandoffLoop, frequencies: np.ndarray, filter_time: float = 0.0
) -> FrequencyResponse:
    """Bode's diagram of the open loop, by python-control.

    Args:
        loop: The closed loop.
        frequencies: Shape (n,) [rad/s].
        filter_time: Time constant of the derivative's filter [s].
    """
    import control

    transfer = open_loop_transfer(loop, filter_time)
    gain, phase, _, crossover = control.margin(transfer)
    response = np.asarray(transfer(1j * frequencies))
    return FrequencyResponse(
        frequencies, response, float(gain), float(np.radians(phase)), float(crossover)
    )


@dataclass(frozen=True, eq=False)
class RootLocus:
    """Poles over a common factor on all gains.

    Attributes:
        factors: Shape (n,).
        poles: Shape (n, number of poles) [1/s].
        zeros: Of the controller [1/s].
    """

    factors: np.ndarray
    poles: NDArray[np.complex128]
    zeros: NDArray[np.complex128]


def root_locus(loop: StandoffLoop, factors: np.ndarray, filter_time: float = 0.0) -> RootLocus:
    """Where the poles go as all gains grow together, by python-control.

    Args:
        loop: The closed loop.
        factors: On K_P, K_I and K_D alike, shape (n,).
        filter_time: Time constant of the derivative's filter [s].
    """
    import control

    transfer = open_loop_transfer(loop, filter_time)
    # Any: it says that it returns a list, and returns the map itself.
    found: Any = control.root_locus_map(transfer, gains=np.asarray(factors, dtype=float))
    return RootLocus(np.asarray(factors), np.asarray(found.loci), np.asarray(transfer.zeros()))


# The solver's tolerance lets a set reach about 1e-7 too far.
_SAFETY = 1 + 2e-6


@dataclass(frozen=True, eq=False)
class SumOfSquaresCertificate:
    """V(x) = (x - rest)^T matrix (x - rest) falls along all motions in V < 1.

    Attributes:
        rest: The wanted equilibrium, y, and 0 for the integral, shape (1,) or (2,) [m], [m s].
        matrix: Shape (1, 1) or (2, 2).
        low, high: Where V = 1 with an empty integral: starts between them settle [m].
    """

    rest: np.ndarray
    matrix: np.ndarray
    low: float
    high: float

    def value(self, states: np.ndarray) -> np.ndarray:
        """V of states of shape (..., 1) or (..., 2)."""
        off = np.asarray(states) - self.rest
        return np.einsum("...i,ij,...j->...", off, self.matrix, off)


def sum_of_squares_certificate(loop: StandoffLoop) -> SumOfSquaresCertificate | None:
    """The largest level set of the linear loop's Lyapunov function that can be proved attracted.

    The exact region (see `region_of_attraction`) is larger: a quadratic V reaches as far to one
    side as to the other.

    Returns:
        None if the solver finds none: with gains far apart the programme is ill-conditioned. None
        for a = 0 too: a linear loop has no largest level set.

    Raises:
        InvalidInput: There is no equilibrium.
    """
    if loop.error.a == 0:
        return None
    # In the loop's own units the equilibrium is exactly at rest, and the programme well scaled.
    unit = normalise(loop)
    names = [Variable("x"), Variable("w")][: 2 if loop.integrates else 1]
    x = Expression(names[0])
    inertia = unit.inertia(x) if loop.derivative_gain else Expression(1.0)
    field = [unit.miss(x) * inertia]
    if loop.integrates:
        drive = unit.miss(x) + Expression(names[1])
        field = [drive * inertia, unit.ratio * unit.miss(x) * inertia * inertia]
    # Any: the stubs put the dtype of an array where its shape belongs.
    state: Any = np.array(names)
    dynamics: Any = np.array([each.Expand() for each in field])
    system = SymbolicVectorSystem(state=state, dynamics=dynamics)
    context = system.CreateDefaultContext()
    origin: Any = np.zeros(len(names))
    context.SetContinuousState(origin)
    options = RegionOfAttractionOptions()
    options.state_variables = state
    options.solver_id = ClarabelSolver.id()
    try:
        lyapunov = DrakeRegion(system, context, options)
    except (RuntimeError, SystemExit):
        # Drake demands that its solver succeeds, and a demand that fails asks Python to exit.
        return None
    scale = np.array([unit.distance, unit.integral_unit])[: len(names)]
    matrix = _SAFETY * _quadratic_form(lyapunov, names) / np.outer(scale, scale)
    rest = np.array([unit.rest, 0.0])[: len(names)]
    reach = 1 / np.sqrt(matrix[0, 0])
    return SumOfSquaresCertificate(rest, matrix, float(rest[0] - reach), float(rest[0] + reach))


def _quadratic_form(lyapunov: Expression, names: list[Variable]) -> np.ndarray:
    """Half the Hessian of a quadratic expression."""
    hessian = np.array(
        [[lyapunov.Differentiate(a).Differentiate(b).Expand() for b in names] for a in names]
    )
    return np.vectorize(lambda entry: float(entry.Evaluate()))(hessian) / 2


_DEFAULT = SampledPid()
# The numbers of `LoopMargins` that JSON has, with their units.
MARGINS = {
    "gain_margin": "",
    "phase_margin": "rad",
    "crossover": "rad/s",
    "delay_margin": "s",
    "peak_sensitivity": "",
}


@dataclass(frozen=True, eq=False)
class StandoffAnalysis:
    """What `analyse_standoff` finds.

    Attributes:
        loop, sampled, delay_samples: What was analysed.
        equilibria: Nearest first.
        wanted: The one that the loop is meant for: stable for all gains.
        bias: Its distance less the reference, which is the estimate's error there [m].
        singularities: Where the equation breaks down [m].
        region: Starts with an empty integral that settle at the wanted equilibrium.
        region_at_rest: The same for starts with y' = 0, as in the thesis's Figure 2.20.
        energy_interval: The part of the region that the energy certifies in closed form [m].
        certificate: The part that a sum of squares certifies; None if the solver finds none.
        margin: Delay that the ideal loop bears.
        filtered_margin: Delay that it bears with the derivative filtered.
        sampled_region: Starts that it attracts, with its limit too; None if it is not stable.
        sampled_margins: Of the loop as a computer closes it, with its clock, filter and delay.
        held: Equilibria if the estimate holds its error outside the calibrated range.
    """

    loop: StandoffLoop
    sampled: SampledPid
    delay_samples: int
    equilibria: tuple[Equilibrium, ...]
    wanted: Equilibrium
    bias: float
    singularities: tuple[float, ...]
    region: RegionOfAttraction
    region_at_rest: RegionOfAttraction
    energy_interval: tuple[float, float]
    certificate: SumOfSquaresCertificate | None
    margin: DelayMargin
    filtered_margin: DelayMargin
    sampled_margins: LoopMargins
    sampled_region: RegionOfAttraction | None
    held: tuple[HeldEquilibrium, ...]

    def as_object(self) -> dict[str, object]:
        """What is promised as JSON, in SI units; null: unbounded, or none.

        An equilibrium is `stable` if a real loop, with a fast enough filter and clock, stays there;
        `stable_in_equation` if the poles of the ideal loop say so. What becomes of the wanted one
        with this clock, filter and delay stands under `sampled`.
        """
        certificate = self.certificate
        sums = (certificate.low, certificate.high) if certificate is not None else None
        sampled = self.sampled_margins
        return {
            "controller": self.loop.controller,
            "equilibria": [
                {
                    "y": each.y,
                    "stable": each.stable and each.realisable,
                    "stable_in_equation": each.stable,
                    "poles": _pairs(each.poles),
                }
                for each in self.equilibria
            ],
            "bias": self.bias,
            "singularities": list(self.singularities),
            "region_of_attraction": _ends(self.region.low, self.region.high),
            "region_from_rest": _ends(self.region_at_rest.low, self.region_at_rest.high),
            "certified": {
                "energy": _ends(*self.energy_interval),
                "sums_of_squares": _ends(*sums) if sums is not None else None,
            },
            "delay_margin": self.margin.delay,
            "delay_margin_filtered": self.filtered_margin.delay,
            "sampled": {
                "period": self.sampled.period,
                "filter_time": self.sampled.filter_time,
                "delay": self.delay_samples * self.sampled.period,
                "stable": sampled.stable,
                "poles": _pairs(sampled.poles),
                **{
                    name: _finite(getattr(sampled, name)) if sampled.stable else None
                    for name in MARGINS
                },
                "limit": _finite(self.sampled.limit),
                "region_of_attraction": None
                if self.sampled_region is None
                else _ends(self.sampled_region.low, self.sampled_region.high),
            },
            "held_equilibria": [
                {"y": each.y, "stable": each.stable, "calibrated": each.calibrated}
                for each in self.held
            ],
        }


def analyse_standoff(
    loop: StandoffLoop, sampled: SampledPid = _DEFAULT, delay_samples: int = 0
) -> StandoffAnalysis:
    """Analyse a loop.

    Args:
        loop: The closed loop.
        sampled: Its clock, and the filter of its derivative.
        delay_samples: How many samples late the estimate comes.

    Raises:
        InvalidInput: There is no equilibrium, or a singularity lies on one.
    """
    wanted = wanted_equilibrium(loop)
    return StandoffAnalysis(
        loop=loop,
        sampled=sampled,
        delay_samples=delay_samples,
        equilibria=equilibria(loop),
        wanted=wanted,
        bias=wanted.y - loop.reference,
        singularities=singularities(loop),
        region=region_of_attraction(loop),
        region_at_rest=region_of_attraction(loop, integral="still"),
        energy_interval=certified_interval(loop),
        certificate=sum_of_squares_certificate(loop),
        margin=delay_margin(loop),
        filtered_margin=delay_margin(loop, sampled.filter_time),
        sampled_margins=loop_margins(sampled_loop(loop, sampled, delay_samples)),
        sampled_region=sampled_region(loop, sampled, delay_samples),
        held=held_equilibria(loop),
    )


def _pairs(poles: Iterable[complex]) -> list[list[float]]:
    return [[float(pole.real), float(pole.imag)] for pole in poles]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _ends(low: float, high: float) -> list[float | None]:
    return [_finite(low), _finite(high)]
