"""Inverses of curves that rise, for radii and angles of lenses."""

import math
from collections.abc import Callable

import numpy as np

# A table this fine leaves Newton's method a few steps.
_TABLE = 65
_STEPS = 60


def invert_rising(
    curve: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    values: np.ndarray,
    end: float,
) -> np.ndarray:
    """Where a curve that rises from 0 takes given values: Newton's method, kept in brackets.

    Args:
        curve: Values and slopes, shapes (n,), at arguments of shape (n,).
        values: Shape (n,), in the unit of the curve.
        end: Of the arguments, which begin at 0, in their unit [-].

    Returns:
        Arguments, shape (n,); NaN where the curve does not reach the value before its end.
    """
    grid = np.linspace(0.0, end, _TABLE)
    heights, _ = curve(grid)
    reached = (values >= heights[0]) & (values <= heights[-1])
    wanted = np.where(reached, values, heights[0])
    found = np.interp(wanted, heights, grid)
    low, high = np.zeros_like(found), np.full_like(found, end)
    for _ in range(_STEPS):
        value, slope = curve(found)
        over = value > wanted
        low, high = np.where(over, low, found), np.where(over, found, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            stepped = found - (value - wanted) / slope
        inside = (stepped >= low) & (stepped <= high)
        new = np.where(inside, stepped, 0.5 * (low + high))
        moved = np.abs(new - found)
        found = new
        if not moved.size or moved.max() <= 1e-15 * end:
            break
    return np.where(reached, found, np.nan)


def first_root(coefficients: list[float]) -> float:
    """Least positive real root of a polynomial, infinite if there is none.

    Args:
        coefficients: Of the powers 0, 1, ..., in units of the argument's powers [-].
    """
    # A coefficient below the least of doubles that can be divided by is none.
    roots = np.polynomial.Polynomial(coefficients).trim(1e-200).roots()
    real = roots[np.abs(roots.imag) <= 1e-9 * np.abs(roots)].real
    return float(min(real[real > 0], default=math.inf))
