"""The stand-off loop, linearised: Drake's poles, and python-control's frequency response and locus.

python-control loads only when it is used: the command line starts without it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.primitives import Linearize

from ...systems.numerics.standoff.equilibria import root_slope
from ...systems.numerics.standoff.loop import StandoffLoop
from ...systems.standoff.closed_loop import StandoffClosedLoop


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
