"""Sight between two teams, blocked by walls and by the round bodies of robots.

Bodies are discs about all members of both teams. A line of sight is blocked where it passes
through the interior of the disc of a third robot; the robots at its two ends never block it. So a
robot inside the disc of another sees nobody else, and is seen by nobody else. A line that touches
a disc, or enters it no deeper than the world's tolerance, is clear, as at corners of obstacles:
the blocking disc is smaller by that tolerance. The time at which a disc begins to block is taken
to be the time at which the line touches its rim.

Lines and centres are relative to the viewer: the line leads from 0 to d, the centre is c.

The moments at which a disc begins or ends to block within a step are real roots of a polynomial
between 0 and 1. Between two neighbouring roots of its derivative a polynomial is monotone, so it
has one root there if its values at the two ends differ in sign, and else none. The roots of the
derivative are found in the same way, from the linear one upwards. Nothing is divided by the leading
coefficient, which may be zero: the answer is the same whether or not a line moves along with a
disc, say.
"""

from collections.abc import Sequence

import numpy as np

from ..compiled import compiled, kernel
from ..errors import require, require_non_negative
from .edge_index import TOLERANCE, EdgeIndex
from .segment_sight import segment_is_clear

# Newton's steps, and halvings where they leave the bracket, before the bracket is taken as it is.
MOST_STEPS = 200


@compiled
def unit_roots(coefficients: np.ndarray) -> np.ndarray:
    """Roots at which a polynomial of low degree crosses zero in [0, 1].

    A root of even order, at which the polynomial touches zero without changing sign, is found
    where its value there comes out as zero, and may be missed or doubled by rounding: nothing
    happens at it. Of a polynomial that is zero throughout no root but 0 is named.

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


def checked_radii(radii: Sequence[float], robots: int) -> np.ndarray | None:
    """Check radii of bodies, and return them in the form that the sight functions take.

    Args:
        radii: Of each robot, viewers first [m]; empty: bodies do not block sight.
        robots: How many there are.

    Returns:
        Shape (robots,) [m], or None where bodies do not block sight.

    Raises:
        InvalidInput: The number of radii is wrong; a radius is negative or not finite.
    """
    if len(radii) == 0:
        return None
    require(len(radii) == robots, "body_radii", f"be empty or name {robots} radii", len(radii))
    for k, radius in enumerate(radii):
        require_non_negative(f"body_radii.{k}", float(radius))
    return np.array(radii, dtype=float)


def require_a_radius_each(radii: np.ndarray, viewers: np.ndarray, targets: np.ndarray) -> None:
    """Require one radius for each robot, so that no kernel reads beyond the array.

    Args:
        radii: Shape (n + m,) [m].
        viewers, targets: Positions, shapes (2 n,) and (2 m,) [m].

    Raises:
        InvalidInput: The number of radii is wrong.
    """
    robots = (len(viewers) + len(targets)) // 2
    require(radii.shape == (robots,), "radii", f"have the shape ({robots},)", radii.shape)


@compiled
def hide_behind_bodies(
    seen: np.ndarray, viewers: np.ndarray, targets: np.ndarray, radii: np.ndarray, tolerance: float
) -> None:
    """Write 0 for each pair of viewer and target between which a third body stands.

    Args:
        seen: 1.0 where the viewer sees the target, row by row of viewers, shape (at least n m,).
        viewers, targets: Shapes (2 n,) and (2 m,) [m].
        radii: Viewers first, shape (n + m,) [m].
        tolerance: Depth of penetration up to which a line only touches a body [m].
    """
    n, m = len(viewers) // 2, len(targets) // 2
    for i in range(n):
        x, y = viewers[2 * i], viewers[2 * i + 1]
        for j in range(m):
            if seen[i * m + j] == 0.0:
                continue
            line = (targets[2 * j] - x, targets[2 * j + 1] - y)
            for k in range(n + m):
                if k in (i, n + j):
                    continue
                at, body = (viewers, k) if k < n else (targets, k - n)
                centre = (at[2 * body] - x, at[2 * body + 1] - y)
                if disc_blocks(line, centre, radii[k] - tolerance):
                    seen[i * m + j] = 0.0
                    break


@kernel
def disc_blocks(line: tuple[float, float], centre: tuple[float, float], radius: float) -> bool:
    """Whether a line of sight passes through the inside of a disc (kernel).

    Args:
        line: From the viewer to the target, x and y [m].
        centre: From the viewer to the disc's centre [m].
        radius: Of the disc [m]; without a positive radius it has no interior.
    """
    if radius <= 0.0:
        return False
    dx, dy = line
    x, y = centre
    square = dx * dx + dy * dy
    along = dx * x + dy * y
    if along <= 0.0:
        return x * x + y * y < radius * radius
    if along >= square:
        return (x - dx) * (x - dx) + (y - dy) * (y - dy) < radius * radius
    cross = dx * y - dy * x
    return cross * cross < radius * radius * square


# Vectors are pairs, so that a moving line and a moving disc are five arguments instead of nine.
@compiled
def rim_times(
    line: tuple[float, float],
    line_rate: tuple[float, float],
    centre: tuple[float, float],
    centre_rate: tuple[float, float],
    radius: float,
) -> np.ndarray:
    """Times at which the rim of a moving disc touches a moving line of sight (not its extension).

    With d = line + line_rate t and c = centre + centre_rate t the disc touches the line between
    its ends where cross(d, c)^2 = r^2 |d|^2, of the fourth degree in t, and at its ends where
    |c|^2 = r^2 or |c - d|^2 = r^2. Between two such times the disc blocks all the time or never.

    Args:
        line: From the viewer to the target at t = 0, x and y [m].
        line_rate: Change of that vector until t = 1 [m].
        centre: From the viewer to the disc's centre at t = 0 [m].
        centre_rate: Change of that vector until t = 1 [m].
        radius: Of the disc [m].

    Returns:
        Shape (at most 8,), fractions of the interval in [0, 1], unordered; they may include
        superfluous times.
    """
    times = np.empty(8)
    dx, dy = line
    wx, wy = line_rate
    x, y = centre
    vx, vy = centre_rate
    # The line sweeps over at most the triangle 0, d(0), d(1).
    if (
        radius <= 0.0
        or max(x, x + vx) + radius < min(0.0, dx, dx + wx)
        or min(x, x + vx) - radius > max(0.0, dx, dx + wx)
        or max(y, y + vy) + radius < min(0.0, dy, dy + wy)
        or min(y, y + vy) - radius > max(0.0, dy, dy + wy)
    ):
        return times[:0]
    square = radius * radius
    # cross(d, c) = constant + linear t + quadratic t^2.
    constant = dx * y - dy * x
    linear = dx * vy - dy * vx + wx * y - wy * x
    quadratic = wx * vy - wy * vx
    quartic = np.empty(5)
    quartic[0] = constant * constant - square * (dx * dx + dy * dy)
    quartic[1] = 2.0 * (constant * linear - square * (dx * wx + dy * wy))
    quartic[2] = linear * linear + 2.0 * constant * quadratic - square * (wx * wx + wy * wy)
    quartic[3] = 2.0 * linear * quadratic
    quartic[4] = quadratic * quadratic
    count = 0
    for t in unit_roots(quartic):
        lx, ly = dx + t * wx, dy + t * wy
        along = lx * (x + t * vx) + ly * (y + t * vy)
        # Generous at the ends of the line: an extra time does no harm.
        if -1e-9 <= along <= (lx * lx + ly * ly) * (1.0 + 1e-9):
            times[count] = t
            count += 1
    for end in range(2):
        # The disc's centre seen from that end of the line.
        ex, ey, ux, uy = (x - dx, y - dy, vx - wx, vy - wy) if end else (x, y, vx, vy)
        distance = np.array(
            [ex * ex + ey * ey - square, 2.0 * (ex * ux + ey * uy), ux * ux + uy * uy]
        )
        for t in unit_roots(distance):
            times[count] = t
            count += 1
    return times[:count]


def sight_matrix(
    index: EdgeIndex, viewers: np.ndarray, targets: np.ndarray, radii: np.ndarray | None = None
) -> np.ndarray:
    """Which target each viewer sees.

    Args:
        index: The world's edges.
        viewers: Shape (2 n,), x and y of each viewer [m].
        targets: Shape (2 m,) [m].
        radii: Of the bodies that block sight, viewers first, shape (n + m,) [m]; None: none does.

    Returns:
        Shape (n m,), row by row of viewers: 1.0 where the line between the two is clear, else 0.

    Raises:
        InvalidInput: There is not one radius for each robot.
    """
    seen = _sight_matrix(index, viewers, targets)
    if radii is not None:
        require_a_radius_each(radii, viewers, targets)
        hide_behind_bodies(seen, viewers, targets, radii, index.frame[TOLERANCE])
    return seen


@compiled
def _sight_matrix(index: EdgeIndex, viewers: np.ndarray, targets: np.ndarray) -> np.ndarray:
    n, m = len(viewers) // 2, len(targets) // 2
    seen = np.zeros(n * m)
    for i in range(n):
        x, y = viewers[2 * i], viewers[2 * i + 1]
        for j in range(m):
            seen[i * m + j] = segment_is_clear(index, x, y, targets[2 * j], targets[2 * j + 1])
    return seen
