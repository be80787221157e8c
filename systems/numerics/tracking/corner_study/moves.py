"""How the players move round a corner, and how values are interpolated on a grid.

The numerical solutions of the corner game are scaled: lengths are in units of r_p, the evader's
also divided by the speed ratio, so that both players have speed one and the state is
(phi_p, phi_e, rho) with rho = r_e / (a r_p). A value is in units of r_p as well.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from ...errors import require


@dataclass(frozen=True, eq=False)
class CornerGrid:
    """Nodes of (phi_p, phi_e, rho), rho = r_e / (a r_p). Build one with `corner_grid`.

    Attributes:
        alpha: Interior angle of the obstacle [rad].
        phi_p: Pursuer's polar angles, alpha - pi to 0, shape (p,) [rad].
        phi_e: Evader's polar angles, up to pi, same spacing, shape (e,) [rad]. The first may lie
            behind edge B; it stands for the edge.
        rho: Evader's distances from the corner, 0 to about 2, shape (r,), in units of a r_p.
        step: Duration of one move, in units of r_p / v_p.
    """

    alpha: float
    phi_p: np.ndarray
    phi_e: np.ndarray
    rho: np.ndarray
    step: float

    @property
    def shape(self) -> tuple[int, int, int]:
        """(p, e, r)."""
        return len(self.phi_p), len(self.phi_e), len(self.rho)

    @property
    def gap(self) -> np.ndarray:
        """pi + phi_p - phi_e, exactly zero on the sight ray, shape (p, e) [rad]."""
        p, e, _ = self.shape
        spacing = (math.pi - self.alpha) / (p - 1)
        return spacing * (np.arange(p)[:, None] - np.arange(e) + e - p)


def corner_grid(alpha: float, nodes: int) -> CornerGrid:
    """Make a grid with `nodes` pursuer angles, and spacings in proportion.

    Both players' angles have the same spacing, so that every sight ray passes through nodes.
    rho = 1, where the barrier lies for many states, is half-way between two nodes, so that no
    node is on the barrier by accident.

    Args:
        alpha: Interior angle of the obstacle, in (0, pi) [rad].
        nodes: Number of pursuer angles, odd and at least 5.

    Raises:
        InvalidInput: `alpha` or `nodes` is out of range.
    """
    require(0 < alpha < math.pi, "alpha", "lie in (0, pi)", alpha)
    require(nodes >= 5 and nodes % 2 == 1, "nodes", "be odd and at least 5", nodes)
    spacing = (math.pi - alpha) / (nodes - 1)
    intervals = math.ceil((2 * math.pi - alpha) / spacing - 1e-9)
    distances = 2 * nodes - 1
    spacing_rho = 2 / distances
    return CornerGrid(
        alpha,
        phi_p=spacing * np.arange(1 - nodes, 1),
        phi_e=math.pi + spacing * np.arange(-intervals, 1),
        rho=spacing_rho * np.arange(distances),
        step=max(spacing, spacing_rho),
    )


@dataclass(frozen=True, eq=False)
class CornerValues:
    """Values of the corner game on a grid, all in units of r_p (and v_p).

    Attributes:
        grid: The nodes.
        lead: Negative where the evader can get out of sight before the pursuer reaches the star
            region, positive where it cannot. Shape (p, e, r).
        time: Time until sight is lost [r_p / v_p]; without meaning where `lead` is positive.
            Shape (p, e, r).
        iterations: Sweeps that `lead` and `time` took.
        residual: Largest change of a value in the last sweep, in units of the step.
        converged: Whether both came below the tolerance.
    """

    grid: CornerGrid
    lead: np.ndarray
    time: np.ndarray
    iterations: tuple[int, int]
    residual: float
    converged: bool


@njit(cache=True)
def pursuer_move(
    phi_p: float, ux: float, uy: float, step: float, alpha: float
) -> tuple[float, float, float]:
    """Move the pursuer from (1, phi_p), phi_p < 0, along (ux, uy), stopping in the star region.

    Args:
        phi_p: Polar angle in [alpha - pi, 0) [rad].
        ux, uy: Velocity, at most one long [v_p].
        step: Duration [r_p / v_p].
        alpha: Interior angle of the obstacle [rad].

    Returns:
        (phi, r, spare): where it gets to, sliding along edge B, and how much of the step was
        left when it reached the star region. phi = 0 there.
    """
    x = math.cos(phi_p) + step * ux
    y = math.sin(phi_p) + step * uy
    # Points clockwise of edge B are in the obstacle: move on along the edge instead.
    bx = -math.cos(alpha)
    by = -math.sin(alpha)
    if bx * y - by * x < 0.0:
        along = max(bx * x + by * y, 0.0)
        x, y = along * bx, along * by
    if y < 0.0:
        return max(math.atan2(y, x), alpha - math.pi), math.hypot(x, y), 0.0
    if y > 0.0:
        share = -math.sin(phi_p) / (step * uy)
        x = math.cos(phi_p) + share * step * ux
        return 0.0, abs(x), (1.0 - share) * step
    return 0.0, abs(x), 0.0


@njit(cache=True)
def evader_move(
    phi_e: float, rho: float, wx: float, wy: float, step: float, alpha: float
) -> tuple[float, float]:
    """Move the evader from (rho, phi_e) along (wx, wy), sliding along the obstacle's edges.

    A straight step that would pass through the obstacle from one edge to the other is refused: the
    evader stays. Use `round_corner` for the way round.

    Args:
        phi_e, rho: The evader's polar coordinates [rad], [r_p].
        wx, wy: Its velocity [v_p].
        step: Duration [r_p / v_p].
        alpha: Interior angle of the obstacle [rad].

    Returns:
        (phi, rho) after the step.
    """
    x = rho * math.cos(phi_e) + step * wx
    y = rho * math.sin(phi_e) + step * wy
    phi = math.atan2(y, x)
    if phi < 0.5 * alpha - math.pi:
        phi += 2.0 * math.pi
    if phi > math.pi:
        phi = math.pi
        r = max(-x, 0.0)
    elif phi < alpha - math.pi:
        phi = alpha - math.pi
        r = max(-x * math.cos(alpha) - y * math.sin(alpha), 0.0)
    else:
        r = math.hypot(x, y)
    if abs(phi - phi_e) > math.pi:
        return phi_e, rho
    return phi, r


@njit(cache=True)
def round_corner(phi_e: float, rho: float, step: float) -> tuple[float, float]:
    """Move the evader straight to the corner, and with the rest of the step along edge A.

    Args:
        phi_e, rho: The evader's polar coordinates [rad], [r_p].
        step: Duration [r_p / v_p].
    """
    if rho >= step:
        return phi_e, rho - step
    return math.pi, step - rho


@njit(cache=True)
def edge_distance(phi_e: float, rho: float) -> float:
    """Distance from (rho, phi_e) to edge A, the half-line at polar angle pi."""
    return rho if phi_e <= 0.5 * math.pi else rho * math.sin(phi_e)


@njit(cache=True)
def growth(value: float, ratio: float) -> float:
    """Extrapolate a value to `ratio` >= 1 times the evader's distance at the end of the grid.

    There the evader's distance is the only scale left, so times and distances grow in proportion.
    A negative lead is an angle, which does not grow.
    """
    return value * ratio if value > 0.0 else value


@njit(cache=True)
def look_up(
    values: np.ndarray,
    phi_p: float,
    phi_e: float,
    rho: float,
    spacing: float,
    spacing_rho: float,
) -> float:
    """Interpolate trilinearly in values of shape (phi_p, phi_e, rho), r_p = 1.

    The grid ends at phi_p = 0 and at phi_e = pi and begins at rho = 0. Beyond the largest rho the
    value there is extrapolated by `growth`.

    Args:
        values: At the grid's nodes, shape (p, e, r).
        phi_p, phi_e, rho: Where [rad], [rad], [r_p].
        spacing: Of the angles' nodes [rad].
        spacing_rho: Of the nodes in rho [r_e / (a r_p)].
    """
    n_p, n_e, n_r = values.shape
    f = n_p - 1 + phi_p / spacing
    g = n_e - 1 + (phi_e - math.pi) / spacing
    k = rho / spacing_rho
    scale = 1.0
    if k > n_r - 1:
        scale = k / (n_r - 1)
        k = n_r - 1.0
    i = min(max(int(f), 0), n_p - 2)
    j = min(max(int(g), 0), n_e - 2)
    m = min(int(k), n_r - 2)
    f = min(max(f - i, 0.0), 1.0)
    g = min(max(g - j, 0.0), 1.0)
    k -= m
    near = (1.0 - g) * ((1.0 - k) * values[i, j, m] + k * values[i, j, m + 1]) + g * (
        (1.0 - k) * values[i, j + 1, m] + k * values[i, j + 1, m + 1]
    )
    far = (1.0 - g) * ((1.0 - k) * values[i + 1, j, m] + k * values[i + 1, j, m + 1]) + g * (
        (1.0 - k) * values[i + 1, j + 1, m] + k * values[i + 1, j + 1, m + 1]
    )
    return growth((1.0 - f) * near + f * far, scale)


@dataclass(frozen=True, eq=False)
class Landings:
    """End points of steps, the pursuer's of shape (p, d), the evader's (e, r, d + 1).

    Attributes:
        cell: Index of the interval of the player's angle in which it lands; of that shape.
        share: Position in the interval, 0 to 1; of that shape.
        distance: Distance from the corner, the pursuer's [r_p], the evader's in units of the
            spacing in rho; of that shape.
    """

    cell: np.ndarray
    share: np.ndarray
    distance: np.ndarray


def pursuer_landings(grid: CornerGrid, angles: np.ndarray, step: float) -> Landings:
    """End points of the pursuer's steps at given angles, shape (d,) [rad]."""
    return Landings(
        *_pursuer_landings(grid.phi_p, np.cos(angles), np.sin(angles), step, grid.alpha)
    )


def evader_landings(grid: CornerGrid, angles: np.ndarray) -> Landings:
    """End points of the evader's steps at given angles, then of the step round the corner.

    Angles have the shape (d,) [rad].

    """
    return Landings(
        *_evader_landings(
            grid.phi_e, grid.rho, np.cos(angles), np.sin(angles), grid.step, grid.alpha
        )
    )


@njit(cache=True)
def _pursuer_landings(phi_p, cosines, sines, step, alpha):
    """Arrays of `Landings` for the pursuer; it does not move from the last node (star region)."""
    shape = (len(phi_p), len(cosines))
    cell = np.zeros(shape, np.int64)
    share, distance = np.zeros(shape), np.ones(shape)
    spacing = phi_p[1] - phi_p[0]
    for i in range(shape[0] - 1):
        for d in range(shape[1]):
            phi, r, _ = pursuer_move(phi_p[i], cosines[d], sines[d], step, alpha)
            place = (phi - phi_p[0]) / spacing
            cell[i, d] = min(max(int(place), 0), shape[0] - 2)
            share[i, d] = place - cell[i, d]
            distance[i, d] = r
    return cell, share, distance


@njit(cache=True)
def _evader_landings(phi_e, rho, cosines, sines, step, alpha):
    """Arrays of `Landings` for the evader."""
    n = len(cosines)
    shape = (len(phi_e), len(rho), n + 1)
    cell = np.zeros(shape, np.int64)
    share, distance = np.zeros(shape), np.zeros(shape)
    spacing = phi_e[1] - phi_e[0]
    for j in range(shape[0]):
        start = max(phi_e[j], alpha - math.pi)
        for k in range(shape[1]):
            for d in range(n + 1):
                if d < n:
                    phi, r = evader_move(start, rho[k], cosines[d], sines[d], step, alpha)
                else:
                    phi, r = round_corner(start, rho[k], step)
                place = (phi - phi_e[0]) / spacing
                cell[j, k, d] = min(max(int(place), 0), shape[0] - 2)
                share[j, k, d] = place - cell[j, k, d]
                distance[j, k, d] = r / rho[1]
    return cell, share, distance


@njit(cache=True)
def pursuer_turn(
    value: np.ndarray,
    out: np.ndarray,
    cell: np.ndarray,
    share: np.ndarray,
    distance: np.ndarray,
) -> None:
    """Write to `out` the largest value that one step of the pursuer leads to.

    Args:
        value, out: Values, shape (p, r, e).
        cell, share, distance: The pursuer's `Landings`, shape (p, d) each.
    """
    n_p, n_r, n_e = value.shape
    out[:] = value
    for i in range(n_p - 1):
        for d in range(cell.shape[1]):
            c, s, r = cell[i, d], share[i, d], distance[i, d]
            if r == 0.0:
                continue
            for k in range(1, n_r):
                # rho grows as r_p shrinks.
                place = min(k / r, n_r - 1.0)
                ratio = k / (r * place)
                m = min(int(place), n_r - 2)
                f = place - m
                near_in, near_out = (1.0 - s) * (1.0 - f), (1.0 - s) * f
                far_in, far_out = s * (1.0 - f), s * f
                for j in range(n_e):
                    x = near_in * value[c, m, j] + near_out * value[c, m + 1, j]
                    x += far_in * value[c + 1, m, j] + far_out * value[c + 1, m + 1, j]
                    x = r * growth(x, ratio)
                    if x > out[i, k, j]:
                        out[i, k, j] = x


@njit(cache=True)
def evader_turn(
    value: np.ndarray,
    out: np.ndarray,
    cell: np.ndarray,
    share: np.ndarray,
    distance: np.ndarray,
    angles: np.ndarray,
    phi_e: np.ndarray,
    rho: np.ndarray,
    step: float,
    timed: bool,
) -> None:
    """Write to `out` the least value after one evader's step, plus the step's time if `timed`.

    A timed step into the shadow ends on the sight ray.

    Args:
        value, out: Values, shape (e, r, p).
        cell, share, distance: The evader's `Landings`, shape (e, r, d + 1) each.
        angles: Its directions, shape (d,) [rad].
        phi_e, rho, step: Of the grid, shapes (e,), (r,) [rad], [r_p], [r_p / v_p].
        timed: Whether the value is a time.
    """
    n_e, n_r, n_p = value.shape
    # The sight ray of the pursuer's node i passes through the evader's node i + offset.
    offset = n_e - n_p
    cost = step if timed else 0.0
    out[:] = value + cost
    for j in range(n_e):
        for k in range(n_r):
            for d in range(len(angles) + 1):
                c, s = cell[j, k, d], share[j, k, d]
                place = min(distance[j, k, d], n_r - 1.0)
                ratio = distance[j, k, d] / place if place > 0.0 else 1.0
                m = min(int(place), n_r - 2)
                f = place - m
                near_in, near_out = (1.0 - s) * (1.0 - f), (1.0 - s) * f
                far_in, far_out = s * (1.0 - f), s * f
                first = last = 0
                if timed:
                    first = max(j - offset + 1, 0)
                    last = max(math.ceil(c + s) - offset, first)
                for i in range(first):
                    x = near_in * value[c, m, i] + near_out * value[c, m + 1, i]
                    x += far_in * value[c + 1, m, i] + far_out * value[c + 1, m + 1, i]
                    x = cost + growth(x, ratio)
                    if x < out[j, k, i]:
                        out[j, k, i] = x
                for i in range(first, last):
                    x = rho[k]
                    if d < len(angles):
                        away = math.sin(angles[d] - phi_e[i + offset])
                        depth = rho[k] * math.sin(phi_e[i + offset] - phi_e[j])
                        x = min(depth / away, step) if away > 0.0 else step
                    if x < out[j, k, i]:
                        out[j, k, i] = x
                for i in range(last, n_p - 1):
                    x = near_in * value[c, m, i] + near_out * value[c, m + 1, i]
                    x += far_in * value[c + 1, m, i] + far_out * value[c + 1, m + 1, i]
                    x = cost + growth(x, ratio)
                    if x < out[j, k, i]:
                        out[j, k, i] = x
    # In the star region nobody moves.
    out[:, :, -1] = value[:, :, -1]
