"""A grid of the corner game's states with scale removed, and the values known on it."""

import math
from dataclasses import dataclass

import numpy as np

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

    Both players' angles have one spacing, so that every sight ray passes through nodes. rho = 1,
    which is where the game turns for many states, lies half-way between two nodes, so that none
    is on the barrier by accident.

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
