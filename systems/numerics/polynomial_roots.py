"""Real roots of a polynomial between 0 and 1, for equations of a moment within a step.

Between two neighbouring roots of its derivative a polynomial is monotone, so it has one root
there if its values at the two ends differ in sign, and else none. The roots of the derivative are
found in the same way, from the linear one upwards. Nothing is divided by the leading coefficient,
which may be zero: the answer is the same whether or not a line moves along with a disc, say.
"""

import numpy as np

from .compiled import compiled, kernel

# Newton's steps, and halvings where they leave the bracket, before the bracket is taken as it is.
MOST_STEPS = 200


@compiled
def unit_roots(coefficients: np.ndarray) -> np.ndarray:
    """Roots at which a polynomial of low degree crosses zero in [0, 1].

    A root of even order, at which the polynomial touches zero without changing sign, is found
    where its value there comes out as zero, and may be missed or doubled by rounding: nothing
    happens at it. Of a polynomial that is zero throughout, 0 is the only root named.

    Args:
        coefficients: Shape (degree + 1,), from the constant upwards, of any unit [-].

    Returns:
        Shape (at most degree,), ascending, fractions of the interval.
    """
    degree = len(coefficients) - 1
    roots = np.empty(max(degree, 0))
    if degree < 1 or _keeps_its_sign(coefficients):
        return roots[:0]
    # Row k holds the k-th derivative.
    table = np.zeros((degree, degree + 1))
    table[0] = coefficients
    for k in range(1, degree):
        for i in range(degree + 1 - k):
            table[k, i] = (i + 1) * table[k - 1, i + 1]
    count = 0
    for k in range(degree - 1, -1, -1):
        # The roots of row k + 1 are read from the array into which those of row k are written,
        # which never overtake them: each piece has at most one.
        found, low, low_value = 0, 0.0, table[k, 0]
        for piece in range(count + 1):
            last = piece == count
            high = 1.0 if last else roots[piece]
            high_value = _value(table, k, high)
            if low_value == 0.0:
                roots[found] = low
                found += 1
            elif min(low_value, high_value) < 0.0 < max(low_value, high_value):
                roots[found] = _root_between(table, k, low, high, low_value > 0.0)
                found += 1
            elif last and high_value == 0.0:
                roots[found] = 1.0
                found += 1
            low, low_value = high, high_value
        count = found
    return roots[:count]


@kernel
def _keeps_its_sign(coefficients: np.ndarray) -> bool:
    """Whether all Bernstein coefficients have one sign, so that there is no root in [0, 1]."""
    degree = len(coefficients) - 1
    positive = coefficients[0] > 0.0
    for i in range(degree + 1):
        bernstein, weight = 0.0, 1.0
        for j in range(i + 1):
            bernstein += weight * coefficients[j]
            if j < i:
                weight *= (i - j) / (degree - j)
        if bernstein == 0.0 or (bernstein > 0.0) != positive:
            return False
    return True


@kernel
def _value(table: np.ndarray, k: int, t: float) -> float:
    """Row k of the table as a polynomial of t."""
    value = 0.0
    for i in range(table.shape[1] - 1 - k, -1, -1):
        value = value * t + table[k, i]
    return value


@kernel
def _slope(table: np.ndarray, k: int, t: float) -> float:
    """The derivative of that polynomial."""
    value = 0.0
    for i in range(table.shape[1] - 1 - k, 0, -1):
        value = value * t + i * table[k, i]
    return value


@kernel
def _root_between(table: np.ndarray, k: int, low: float, high: float, falls: bool) -> float:
    """The root of row k between two points at which its signs differ: Newton's within a bracket."""
    t = 0.5 * (low + high)
    for _ in range(MOST_STEPS):
        value, slope = _value(table, k, t), _slope(table, k, t)
        if value == 0.0:
            return t
        if (value > 0.0) == falls:
            low = t
        else:
            high = t
        step = t - value / slope if slope != 0.0 else low
        if not low < step < high:
            step = 0.5 * (low + high)
        if step == t or step in (low, high):
            return step
        t = step
    return 0.5 * (low + high)
