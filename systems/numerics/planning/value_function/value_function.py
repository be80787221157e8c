"""The result: time to go from every state, and what is known of how it was found.

Interpolation across a jump mixes two times neither of which applies, and takes over the errors of
the nodes. So in the open the time to go is looked up by words: the table says which to try, and
their durations are chosen for the state itself. Among walls it is the time of a path that is
searched down the table.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ...compiled import compiled, kernel
from ...errors import require, require_finite
from ..arc_words.quickest import ArcWord
from ..goal import Goal
from ..trailer import Trailer
from .grid import StateGrid, is_mirrored
from .known_words import (
    JUMP,
    SHORTER,
    KnownWords,
    times_by_words,
    word_by_descents,
    word_of_three_arcs,
)
from .obstacles import Walls
from .sweeps import FAR, between, slack_for

# A state this near to the mirror axis, or to heading along it, counts as on it.
_ON_AXIS = 1e-9


def look_up(
    table: np.ndarray, grid: StateGrid, states: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Value at each state, by limited cubics, and how much the nodes of its cell differ.

    The value is infinite outside the grid, and where a node of the state's own cell is unreachable.

    Args:
        table: Shape (n_theta, n_beta, n_y, n_x), float32; infinite: unreachable.
        grid: Where its nodes are.
        states: x, y, theta, beta, shape (n, 4).

    Returns:
        Values and spreads, each of shape (n,).
    """
    values, spreads = np.full(len(states), np.inf), np.zeros(len(states))
    _look_up(table, grid.x_min, grid.y_min, grid.step, states, values, spreads)
    return values, spreads


@compiled
def _look_up(table, x_min, y_min, step, states, out, spreads):
    theta_count, beta_count, y_count, x_count = table.shape
    parts = np.empty(4, dtype=np.float32)
    values = np.empty((4, 4, 4, 4), dtype=np.float32)
    nodes = np.empty((4, 4), dtype=np.int64)
    slack = slack_for(theta_count)
    for s in range(len(states)):
        x = (states[s, 0] - x_min) / step
        y = (states[s, 1] - y_min) / step
        # Rounding must not put a state on the edge of the grid outside.
        x = _snap(x)
        y = _snap(y)
        if not (0.0 <= x <= x_count - 1.0 and 0.0 <= y <= y_count - 1.0):
            continue
        theta = _snap((states[s, 2] / (2.0 * math.pi) % 1.0) * theta_count)
        beta = _snap((states[s, 3] / (2.0 * math.pi) % 1.0) * beta_count)
        parts[0] = _place(theta, theta_count, True, nodes[0])
        parts[1] = _place(beta, beta_count, True, nodes[1])
        parts[2] = _place(y, y_count, False, nodes[2])
        parts[3] = _place(x, x_count, False, nodes[3])
        spreads[s] = _gather(table, nodes, parts, values)
        if spreads[s] < np.inf:
            out[s] = _interpolate(parts, slack, values)


@kernel
def _snap(cell):
    near = np.rint(cell)
    return near if abs(cell - near) < 1e-6 else cell


@kernel
def _place(cell, count, periodic, nodes):
    """The four nodes around a coordinate in cells; returns where it is between the inner two."""
    n = math.floor(cell)
    if not periodic:
        n = min(n, count - 2)
    for k in range(4):
        nodes[k] = (n - 1 + k) % count if periodic else min(max(n - 1 + k, 0), count - 1)
    return cell - n


@kernel
def _gather(table, nodes, parts, values):
    """Collect values at the nodes around; returns the spread of those that linear weights use.

    The spread is infinite if one of these is unreachable.
    """
    low, high = np.float32(np.inf), np.float32(0.0)
    for a in range(4):
        for b in range(4):
            for c in range(4):
                for d in range(4):
                    value = table[nodes[0, a], nodes[1, b], nodes[2, c], nodes[3, d]]
                    if (
                        _counts(a, parts[0])
                        and _counts(b, parts[1])
                        and _counts(c, parts[2])
                        and _counts(d, parts[3])
                    ):
                        low, high = min(low, value), max(high, value)
                    values[a, b, c, d] = min(value, FAR)
    return np.float32(np.inf) if high == np.inf else high - low


@kernel
def _interpolate(parts, slack, values):
    """Limited cubic in beta, y, x, theta in turn, into the first of the values."""
    for a in range(4):
        for c in range(4):
            for d in range(4):
                v = values[a, :, c, d]
                v[0] = between(v[0], v[1], v[2], v[3], parts[1], slack)
        for d in range(4):
            v = values[a, 0, :, d]
            v[0] = between(v[0], v[1], v[2], v[3], parts[2], slack)
        v = values[a, 0, 0]
        v[0] = between(v[0], v[1], v[2], v[3], parts[3], slack)
    v = values[:, 0, 0, 0]
    return between(v[0], v[1], v[2], v[3], parts[0], slack)


@kernel
def _counts(k, part):
    """Whether node k of the four in a row has weight in linear interpolation."""
    return k == 1 or (k == 2 and part > 0.0)


def look_up_by_words(value: "ValueFunction", states: np.ndarray) -> np.ndarray:
    """Time to go by the words that the table leads to; interpolated where it leads to none.

    Beside jumps, and where the interpolated time is shorter, words of three arcs are looked for
    too; that costs some milliseconds for each such state.

    Args:
        value: A table; if its nodes close to the goal have no known words, all times are
            interpolated.
        states: In the table's frame, shape (n, 4).

    Returns:
        Shape (n,) [s].
    """
    table, grid, trailer, goal = value.table, value.grid, value.trailer, value.goal
    if value.words is None:
        return look_up(table, grid, states)[0]
    states, _ = _on_one_side(grid, goal, states)
    promised, spreads = look_up(table, grid, states)
    at = np.flatnonzero(np.isfinite(promised))
    times = times_by_words(table, grid, trailer, goal, value.words, states[at])
    doubtful = (spreads[at] * trailer.turn_rate > JUMP) | (
        times > (1 + SHORTER) * promised[at] + SHORTER / trailer.turn_rate
    )
    for n in np.flatnonzero(doubtful):
        word = word_known(value, states[at[n]])
        times[n] = times[n] if word is None else min(times[n], word.time)
    promised[at] = np.where(np.isfinite(times), times, promised[at])
    return promised


def word_known(value: "ValueFunction", state: np.ndarray) -> ArcWord | None:
    """The quickest word into the box that a table of an open field leads to, looked for thoroughly.

    Args:
        value: A table; if its nodes close to the goal have no known words, the answer is None.
        state: x, y, theta, beta in the table's frame, shape (4,).
    """
    if value.words is None:
        return None
    table, grid, trailer, goal = value.table, value.grid, value.trailer, value.goal
    known = value.words
    (state,), (mirrored,) = _on_one_side(grid, goal, state[None])
    words = [
        word_by_descents(table, grid, trailer, goal, known, state),
        word_by_descents(table, grid, trailer, goal, known, state, thorough=True),
        word_of_three_arcs(grid, trailer, goal, state),
    ]
    best = min((word for word in words if word), key=lambda word: word.time, default=None)
    return best._replace(controls=best.controls * [1, -1]) if best and mirrored else best


def _on_one_side(grid: StateGrid, goal: Goal, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Replace a state and its mirror image by the same one of the two, so both take as long.

    Args:
        grid, goal: Of a table; where they have no mirror images, the states stay.
        states: In the table's frame, shape (n, 4).

    Returns:
        States, shape (n, 4), and whether each is a mirror image, shape (n,).
    """
    local = goal.to_frame(states)
    sides = np.column_stack([local[:, 1] / grid.step, np.sin(local[:, 2:])])
    # On the axis the heading decides the side, or else beta; rounding must not decide it.
    sides[np.abs(sides) < _ON_AXIS] = 0.0
    firsts = np.argmax(sides != 0.0, axis=1)
    mirrored = (sides[np.arange(len(sides)), firsts] < 0.0) & is_mirrored(grid, goal)
    images = goal.from_frame(local * [1.0, -1.0, -1.0, -1.0])
    return np.where(mirrored[:, None], images, states), mirrored


# From a table and a state to a time; see `ValueFunction.way_time`.
WayTime = Callable[["ValueFunction", np.ndarray], float]


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
        words: Words into the goal from nodes close to it; None: a table among walls, or of another
            scheme, which is interpolated.
        walls: Free distances and the cart's discs, on a raster fine enough to drive by; None: the
            open field.
        way_time: Time of a way down the table from a state in its frame, infinite where none is
            found [s]; None: times are looked up.
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
    words: KnownWords | None = None
    walls: Walls | None = None
    way_time: "WayTime | None" = None
    placement: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0))

    @property
    def walled(self) -> bool:
        """Whether there are obstacles."""
        return self.walls is not None

    def time_to_go(self, states) -> np.ndarray:
        """Time from states to the box, shape (..., 4) -> (...,) [s].

        It is the time of a path that ends in the box, so it can only be too long, where a quicker
        path is missed. In an open field the path is a word, which costs about two milliseconds
        for each state; among walls it is what `attained_times` finds, in half a second.
        Where no path is found the time is interpolated, and may be too short as well.
        Zero inside the box; infinite off the grid, beyond the jackknife limit, and where the goal
        is out of reach on this grid.
        """
        if self.way_time is None:
            return self.looked_up(states)
        local = self.to_table(states)
        flat = np.ascontiguousarray(local.reshape(-1, 4))
        times = np.array([self.way_time(self, state) for state in flat])
        lost = ~np.isfinite(times)
        times[lost] = look_up(self.table, self.grid, flat[lost])[0]
        return self._settled(flat, times).reshape(local.shape[:-1])

    def looked_up(self, states) -> np.ndarray:
        """Time to go from the table alone: by words in an open field, else interpolated [s].

        It is meant for comparison with the time of a path that was driven down the table.
        """
        local = self.to_table(states)
        flat = np.ascontiguousarray(local.reshape(-1, 4))
        return self._settled(flat, look_up_by_words(self, flat)).reshape(local.shape[:-1])

    def interpolated(self, states) -> np.ndarray:
        """Time to go by interpolation alone: quick, and enough to compare neighbours [s]."""
        local = self.to_table(states)
        flat = np.ascontiguousarray(local.reshape(-1, 4))
        return self._settled(flat, look_up(self.table, self.grid, flat)[0]).reshape(
            local.shape[:-1]
        )

    def _settled(self, flat: np.ndarray, out: np.ndarray) -> np.ndarray:
        """Set times to zero in the box, and to infinity beyond the jackknife limit."""
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


def look_up_in_reach(value: ValueFunction, states) -> np.ndarray:
    """Time to go from the reachable nodes around each state, shape (..., 4) -> (...,) [s].

    Their linear average, looser than `ValueFunction.interpolated`, which is infinite beside every
    wall: it guides a search and promises nothing. Infinite where no node of the cell is reachable.
    """
    local = value.to_table(states)
    flat = np.ascontiguousarray(local.reshape(-1, 4))
    out = np.empty(len(flat))
    grid = value.grid
    _look_up_in_reach(value.table, grid.x_min, grid.y_min, grid.step, flat, out)
    return out.reshape(local.shape[:-1])


@compiled
def _look_up_in_reach(table, x_min, y_min, step, states, out):
    theta_count, beta_count, y_count, x_count = table.shape
    for s in range(len(states)):
        x, y = (states[s, 0] - x_min) / step, (states[s, 1] - y_min) / step
        theta = (states[s, 2] / (2.0 * math.pi) % 1.0) * theta_count
        beta = (states[s, 3] / (2.0 * math.pi) % 1.0) * beta_count
        i, j, t, b = math.floor(x), math.floor(y), math.floor(theta), math.floor(beta)
        total, known = 0.0, 0.0
        for corner in range(16):
            di, dj, dt, db = corner & 1, corner >> 1 & 1, corner >> 2 & 1, corner >> 3
            if not (0 <= i + di < x_count and 0 <= j + dj < y_count):
                continue
            weight = abs(1 - di - (x - i)) * abs(1 - dj - (y - j))
            weight *= abs(1 - dt - (theta - t)) * abs(1 - db - (beta - b))
            time = table[(t + dt) % theta_count, (b + db) % beta_count, j + dj, i + di]
            if weight > 0.0 and time < np.inf:
                total += weight * time
                known += weight
        out[s] = total / known if known > 0.0 else np.inf
