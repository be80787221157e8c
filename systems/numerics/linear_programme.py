"""Linear programmes, solved to within rounding."""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

Vector = NDArray[np.float64]

# By which answers may miss a bound.
ACCURACY = 1e-9


def optimum(
    cost: Vector,
    rows: Vector,
    equal: Vector,
    sides: Vector,
    bounds: list[tuple[float | None, float | None]],
    limits: Vector | None = None,
) -> Vector | None:
    """The x of least cost @ x with rows @ x <= limits and equal @ x = sides, or None.

    Args:
        cost: Shape (n,).
        rows: Of inequalities, shape (m, n); m may be 0.
        equal: Rows of equations, shape (k, n).
        sides: Their right sides, shape (k,).
        bounds: Least and greatest value of each unknown, n pairs; None: no bound.
        limits: Right sides of the inequalities, shape (m,); None: ones.
    """
    answer = linprog(
        cost,
        A_ub=rows if len(rows) else None,
        b_ub=(np.ones(len(rows)) if limits is None else limits) if len(rows) else None,
        A_eq=equal,
        b_eq=sides,
        bounds=bounds,
        method="highs",
        options={"primal_feasibility_tolerance": ACCURACY, "dual_feasibility_tolerance": ACCURACY},
    )
    return np.asarray(answer.x) if answer.status == 0 else None
