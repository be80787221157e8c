"""The result: time to go from every state, and what is known of how it was found."""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from ...errors import require, require_finite
from ..goal import Goal
from ..trailer import Trailer
from .beyond_jumps import look_beyond_jumps
from .grid import StateGrid
from .lookup import look_up
from .obstacles import Walls


@dataclass(frozen=True, eq=False, kw_only=True)
class ValueFunction:
    """Shortest time to a goal box, on a grid.

    In the open field the time depends only on where the cart is relative to the goal, so that one
    table serves every goal: see `moved`.

    Attributes:
        table: Time to go at the nodes, shape (n_theta, n_beta, n_y, n_x), float32; infinite:
            unreachable on this grid [s].
        grid: Where the nodes are, in the table's own frame.
        trailer: Whose time it is.
        goal: The box that was solved for, in the table's own frame.
        scheme: "cubic" or "linear", of the last passes.
        sweeps: Passes over the grid.
        residual: Largest change of a node in the last pass [s].
        converged: Whether nothing changed any more in the last pass. A few cubic passes leave a
            residual beside barriers, and a table that has not converged.
        wall_time: [s].
        warnings: What a reader should know of the answer.
        walls: Free distances and the cart's discs, on a raster fine enough to drive by; None: the
            open field.
        placement: Pose (x, y, heading) of the table's frame in the world [m], [m], [rad].
    """

    table: np.ndarray
    grid: StateGrid
    trailer: Trailer
    goal: Goal
    scheme: str
    sweeps: int
    residual: float
    converged: bool
    wall_time: float = 0.0
    warnings: tuple[str, ...] = ()
    walls: Walls | None = None
    placement: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0))

    @property
    def walled(self) -> bool:
        """Whether there are obstacles."""
        return self.walls is not None

    def time_to_go(self, states) -> np.ndarray:
        """Interpolated time from states to the box, shape (..., 4) -> (...,) [s].

        Where it jumps within a cell of an open field, it is looked up beyond the jump. It may be
        too long or too short; what a path really takes is in `policy.attained_times`.
        Zero inside the box; infinite off the grid, beyond the jackknife limit, and where the goal
        is out of reach on this grid.
        """
        local = self.to_table(states)
        flat = np.ascontiguousarray(local.reshape(-1, 4))
        if self.walled:
            times, _ = look_up(self.table, self.grid, flat)
        else:
            times = look_beyond_jumps(self.table, self.grid, self.trailer, self.goal, flat)
        return self._settled(flat, times).reshape(local.shape[:-1])

    def interpolated(self, states) -> np.ndarray:
        """The same without a look beyond jumps: quick, and enough to compare neighbours."""
        local = self.to_table(states)
        flat = np.ascontiguousarray(local.reshape(-1, 4))
        return self._settled(flat, look_up(self.table, self.grid, flat)[0]).reshape(
            local.shape[:-1]
        )

    def _settled(self, flat: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Times with the box and the jackknife limit seen to."""
        out[self.goal.contains(flat) & np.isfinite(out)] = 0.0
        beta = np.remainder(flat[:, 3] + math.pi, math.tau) - math.pi
        if self.trailer.jackknife < math.pi:
            out[np.abs(beta) > self.trailer.jackknife + 1e-9] = np.inf
        return out

    def to_table(self, states) -> np.ndarray:
        """States in the table's own frame, shape (..., 4).

        Raises:
            InvalidInput: States do not have four entries, or some are not finite.
        """
        states = np.array(states, dtype=float)
        require(
            states.ndim > 0 and states.shape[-1] == 4, "states", "have shape (..., 4)", states.shape
        )
        require(bool(np.isfinite(states).all()), "states", "be finite numbers", "others")
        x, y, heading = self.placement
        dx, dy = states[..., 0] - x, states[..., 1] - y
        states[..., 0] = math.cos(heading) * dx + math.sin(heading) * dy
        states[..., 1] = math.cos(heading) * dy - math.sin(heading) * dx
        states[..., 2] -= heading
        return states

    def moved(self, x: float, y: float, theta: float) -> "ValueFunction":
        """The same table for the same goal elsewhere; the goal's box turns with it.

        Only in the open field: obstacles would move too.

        Args:
            x, y, theta: Where the goal is to be [m], [m], [rad].

        Raises:
            InvalidInput: A number is not finite.
        """
        for value in (x, y, theta):
            require_finite("goal", value)
        gx, gy, g_theta, _ = self.goal.state
        turn = theta - g_theta
        c, s = math.cos(turn), math.sin(turn)
        return replace(self, placement=(x - c * gx + s * gy, y - s * gx - c * gy, turn))
