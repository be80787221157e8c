"""A proof of attraction by sums of squares, with Drake's `RegionOfAttraction`.

P and PI are polynomial. PD and PID are rational, with q = 1 - K_D f' below the line. Drake's
implicit form wants a residual that is a polynomial in state and rates, which a Python system
cannot give; but q x' = p is implied by x' = p / q, and so is q^2 x' = p q, which is polynomial, has
the same orbits, and runs them in the same direction on both sides of the singularity q = 0. A
Lyapunov function of the one is one of the other, and its certified set cannot pass q = 0, where
the polynomial field is at rest.

Drake's wheel solves semidefinite programmes with Clarabel, CSDP and SCS; Clarabel is used here.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.solvers import ClarabelSolver
from pydrake.symbolic import Expression, Variable
from pydrake.systems.analysis import RegionOfAttraction, RegionOfAttractionOptions
from pydrake.systems.primitives import SymbolicVectorSystem

from ...systems.numerics.standoff.loop import StandoffLoop
from ...systems.numerics.standoff.normalised import normalise

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
        lyapunov = RegionOfAttraction(system, context, options)
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
