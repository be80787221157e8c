"""Fast sweeping for the time to go of a tractor with a trailer.

A node takes the best of long steps under constant control, words of arcs into the goal bound it
from above, and the passes go up and down in theta: some twenty of them with linear interpolation,
then a few with limited cubic interpolation, whose values replace the old ones (their minimum would
lock undershoot in).

Close to the goal the time to go bends sharply within a cell, at the faces of the box and for paths
that just miss it: interpolated times are too short there, and spread over the whole plane. So in
the open the times of short words, which are exact, are held fixed.

Source: Zhang 2014, 3.5.1; semi-Lagrangian steps that end on theta nodes are ours.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from ...errors import require
from ...geometry.world import World
from ..arc_words.words import normalised
from ..footprint import Discs, covering_discs
from ..goal import Goal, require_plannable_cart
from ..trailer import Trailer
from .grid import StateGrid, grid_around, is_mirrored
from .known_words import HELD
from .near_field import first_hits, near_words
from .obstacles import FINENESS, FINER, make_walls, shut_ways
from .policy import way_time
from .sweeps import (
    FAR,
    LIMIT,
    Motions,
    make_motions,
    settle_row,
    step_multiples,
    sweep_row,
    sweep_walled_row,
)
from .value_function import ValueFunction


def carried_over(value: ValueFunction, grid: StateGrid) -> np.ndarray:
    """A table interpolated linearly at the nodes of another grid, one direction after the other.

    Args:
        value: A table in the frame of the grid.
        grid: Where it is wanted; larger or smaller, coarser or finer.

    Returns:
        Shape of the grid, float32 [s]; FAR off the first grid, and beside unreachable nodes.
    """
    table = np.where(np.isfinite(value.table), value.table, FAR)
    places = [
        _places(axis, first, step)
        for axis, first, step in zip(
            (grid.axes()[2], grid.axes()[3], grid.axes()[1], grid.axes()[0]),
            (0.0, 0.0, value.grid.y_min, value.grid.x_min),
            (value.grid.theta_step, value.grid.beta_step, value.grid.step, value.grid.step),
            strict=True,
        )
    ]
    # The planes first: there are fewer of them before the angles are refined.
    for direction in (3, 2, 1, 0):
        table = _along(table, direction, *places[direction], periodic=direction < 2)
    return np.where(table < LIMIT, table, FAR)


def _places(axis: np.ndarray, first: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes below coordinates, and how far past them they are, in [0, 1)."""
    cells = (axis - first) / step
    cells = np.where(np.abs(cells - np.round(cells)) < 1e-6, np.round(cells), cells)
    nodes = np.floor(cells).astype(int)
    return nodes, (cells - nodes).astype(np.float32)


def _along(
    table: np.ndarray, direction: int, nodes: np.ndarray, parts: np.ndarray, *, periodic: bool
) -> np.ndarray:
    """Linear interpolation in one direction."""
    count = table.shape[direction]
    if periodic:
        low, high = nodes % count, (nodes + 1) % count
        off = np.zeros(len(nodes), dtype=bool)
    else:
        low, high = nodes.clip(0, count - 1), (nodes + (parts > 0)).clip(0, count - 1)
        off = (nodes < 0) | (nodes + (parts > 0) > count - 1)
    shape = [1] * table.ndim
    shape[direction] = -1
    part = parts.reshape(shape)
    mixed = table.take(low, direction)
    mixed *= np.float32(1.0) - part
    mixed += part * table.take(high, direction)
    mixed[(slice(None),) * direction + (off,)] = FAR
    return mixed


# Passes with cubic interpolation, in the open.
POLISH = 4
# Most passes with linear interpolation, and the change below which they end: without cubic passes
# to follow, and before cubic ones [1 / turn rate].
LINEAR_LIMIT = 400
LINEAR_CHANGE = 1e-3
ROUGH_CHANGE = 0.1

Progress = Callable[[int, float], None]


def solve_value_function(
    trailer: Trailer,
    goal: Goal,
    grid: StateGrid,
    *,
    polish: int | None = None,
    progress: Progress | None = None,
    obstacles: World | None = None,
    discs: Discs | None = None,
    warm_start: ValueFunction | None = None,
) -> ValueFunction:
    """Shortest times to a box from every node of a grid.

    Args:
        trailer: The cart; forward only or with reverse.
        goal: The box; a tolerance below one cell is widened to it, with a warning.
        grid: Where; leaving it is not allowed.
        polish: Passes with cubic interpolation; 0: linear only. By default a few in the open, and
            none among walls, where cubics take too much from what is beside the way.
        progress: Called after each pass with its number and the largest change [s].
        obstacles: The world in whose free region tractor and trailer stay. Beside walls a cell's
            value comes from its reachable nodes: times there are good to a cell, and values of
            states within a cell of a wall are infinite; see `plan_from_table` for paths from
            there.
        discs: What the cart covers; by default `covering_discs(trailer)`.
        warm_start: A table of the same cart and goal on another grid, from which the passes start.
            Linear passes then only fill in what it leaves out; `polish` has to correct the rest.

    Raises:
        InvalidInput: The goal is off the grid, or an option is out of its range.
    """
    if polish is None:
        polish = POLISH if obstacles is None else 0
    require_plannable_cart(trailer)
    require(isinstance(polish, int) and polish >= 0, "polish", "be zero or more", polish)
    started = perf_counter()
    box, warnings = widened(goal, grid)
    scale = trailer.radius
    cart = normalised(trailer)
    multiples = step_multiples(grid, cubic=polish > 0)
    walls = shut = finer = None
    if obstacles is not None:
        body = discs or covering_discs(trailer)
        walls, finer = (make_walls(obstacles, body, grid, each) for each in (FINENESS, FINER))
        shut = shut_ways(grid, cart, walls, scale, multiples)
    # Half the rows are enough where nodes are mirror images of nodes.
    along_x = abs(math.sin(box.state[2])) < 0.5
    mirrored = walls is None and along_x and is_mirrored(grid, box)
    words = None
    if walls is None:
        near, words = near_words(grid, cart, box, scale, mirrored=mirrored)
        held = HELD
    else:
        near = first_hits(grid, cart, box, scale, walls)
        held = -math.inf
    motions = make_motions(grid, cart, scale, multiples)
    sweep = _Sweep(grid, near, held, motions, mirrored, shut)
    unit = 1.0 / trailer.turn_rate
    if warm_start is not None:
        require(polish > 0, "polish", "be positive with a warm start", polish)
        require(warm_start.trailer == trailer, "warm_start", "be for this trailer", "another")
        same = warm_start.goal == box and warm_start.placement == (0.0, 0.0, 0.0)
        require(same, "warm_start", "be for the goal as the grid resolves it", warm_start.goal)
        sweep.start_from(carried_over(warm_start, grid) / np.float32(unit))
    sweeps, change = 0, math.inf
    for change in sweep.passes(polish):
        sweeps += 1
        if progress:
            progress(sweeps, change * unit)
    return ValueFunction(
        table=sweep.times(unit),
        grid=grid,
        trailer=trailer,
        goal=box,
        scheme="cubic" if polish else "linear",
        sweeps=sweeps,
        residual=change * unit,
        converged=change < LINEAR_CHANGE,
        wall_time=perf_counter() - started,
        warnings=warnings,
        walls=finer,
        way_time=None if finer is None else way_time,
        words=words,
    )


def widened(goal: Goal, grid: StateGrid) -> tuple[Goal, tuple[str, ...]]:
    """The goal that the grid can resolve, and a warning where it is not the one asked for.

    Raises:
        InvalidInput: The goal is off the grid, or its x or y is free.
    """
    x, y = goal.state[:2]
    require(grid.holds(x, y), "goal", "lie on the grid", f"({x}, {y}) with bounds {grid.bounds}")
    require(
        all(math.isfinite(width) for width in goal.tolerance[:2]),
        "tolerance",
        "be finite in x and y",
        goal.tolerance,
    )
    # Two digits of slack: 0.251 is the thesis's 2 pi / 25.
    least = [0.99 * cell for cell in grid.cell]
    if all(width >= cell for width, cell in zip(goal.tolerance, least, strict=True)):
        return goal, ()
    wide = tuple(
        width if width >= small else cell
        for width, small, cell in zip(goal.tolerance, least, grid.cell, strict=True)
    )
    x_width, y_width, theta_width, beta_width = wide
    text = ", ".join(f"{width:.4g}" for width in wide)
    warning = (
        f"tolerance below one cell of the grid: times are to the wider box ({text}), "
        "and shorter than to the goal asked for"
    )
    return replace(goal, tolerance=(x_width, y_width, theta_width, beta_width)), (warning,)


class _Sweep:
    """Passes over all theta rows: Gauss-Seidel over rows, Jacobi within a row."""

    def __init__(
        self,
        grid: StateGrid,
        near: np.ndarray,
        held: float,
        motions: Motions,
        mirrored: bool,
        shut: np.ndarray | None,
    ):
        """Begin with what is known near the goal, which is kept as it is where it is `held`."""
        gap = int(np.abs(motions.x_cells).max()) + 3
        self._grid, self._mirrored, self._width = grid, mirrored, grid.x_count + gap
        self._near, self._held = near, np.float32(held)
        lines = (*grid.shape[:3], self._width)
        self._table = np.full((*grid.shape[:2], grid.y_count * self._width), FAR, dtype=np.float32)
        self._table.reshape(lines)[..., : grid.x_count] = near
        self._best = np.empty(self._table.shape[1:], dtype=np.float32)
        self._shut = None
        if shut is not None:
            wide = np.pad(shut, ((0, 0), (0, 0), (0, 0), (0, gap)))
            self._shut = wide.reshape(self._table.shape)
        self._motions = motions

    def start_from(self, times: np.ndarray) -> None:
        """Lower the table to times, shape of the grid [1 / turn rate]."""
        table = self._nodes()
        np.minimum(table, times, out=table)

    def passes(self, polish: int) -> Iterator[float]:
        """Linear passes until little changes, then so many cubic ones; yields the changes."""
        enough = ROUGH_CHANGE if polish else LINEAR_CHANGE
        change = math.inf
        for number in range(LINEAR_LIMIT):
            if change < enough:
                break
            yield (change := self(cubic=False, upwards=number % 2 == 0))
        # Cubic passes forget what linear ones left, but not which way the first of them went.
        for number in range(polish):
            yield self(cubic=True, upwards=number % 2 == 0)

    def __call__(self, *, cubic: bool, upwards: bool) -> float:
        """One pass; returns the largest change."""
        count = self._grid.theta_count
        rows = range(count // 2 + 1) if self._mirrored else range(count)
        change = 0.0
        # Without the controls and multiples themselves.
        width, steps = self._width, self._motions[2:]
        for t in rows if upwards else reversed(rows):
            if self._shut is None:
                sweep_row(self._table, t, cubic, *steps, width, self._best)
            else:
                walled = (self._table, t, cubic, self._shut)
                sweep_walled_row(*walled, *steps, width, self._best)
            row = (self._table, t, self._best, self._near, self._held, width)
            change = max(change, float(settle_row(*row, self._mirrored)))
        return change

    def _nodes(self) -> np.ndarray:
        """The table without the unreachable columns, shape of the grid."""
        lines = self._table.reshape(*self._grid.shape[:3], self._width)
        return lines[..., : self._grid.x_count]

    def times(self, unit: float) -> np.ndarray:
        """The table so far in some unit; infinite: unreachable."""
        times = self._nodes().copy()
        times[times >= LIMIT] = np.inf
        times *= np.float32(unit)
        return times


# How far a start may be from the goal, along each axis of the goal, in turning radii: a table is
# made for the smallest of these that covers the start, so that neighbouring starts share one.
# The smallest makes the thesis's grid.
REACHES = (3.0, 4.5, 6.75, 10.0, 15.0)
# Number of tables that are kept: the most recently used ones.
_KEPT = 8

Solver = Callable[..., ValueFunction]

_tables: dict[tuple[Solver, Trailer, Goal, StateGrid], ValueFunction] = {}


def open_field_table(
    trailer: Trailer,
    start: Sequence[float],
    goal: Goal,
    step: float,
    progress: Progress | None = None,
    solve: Solver = solve_value_function,
) -> ValueFunction | None:
    """A table around a goal that covers a start; one that this process has kept, if it fits.

    Args:
        trailer: The cart.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: The box; a tolerance below a cell is widened, with a warning. It turns with its
            heading.
        step: Distance of nodes in turning radii.
        progress: See `solve_value_function`; not called for a table that was kept.
        solve: Function that computes a table.

    Returns:
        The table, placed at the goal; None for a start farther away than any of `REACHES`, or a
        goal that is free in x or y.

    Raises:
        InvalidInput: The step is out of range.
    """
    radius = trailer.radius
    x, y, heading, beta = goal.state
    dx, dy = start[0] - x, start[1] - y
    c, s = math.cos(heading), math.sin(heading)
    away = abs(c * dx + s * dy) / radius, abs(c * dy - s * dx) / radius
    if max(away) > REACHES[-1] or any(map(math.isinf, goal.tolerance[:2])):
        return None
    width, height = (next(reach for reach in REACHES if reach >= each) for each in away)
    centred = Goal(state=(0.0, 0.0, 0.0, beta), tolerance=goal.tolerance)
    far = (width * radius, height * radius, 0.0, 0.0)
    grid = grid_around(trailer, far, centred, step)
    key = solve, trailer, centred, grid
    table = _tables.pop(key, None)
    if table is None:
        table = solve(trailer, centred, grid, progress=progress)
    _tables[key] = table
    for oldest in list(_tables)[:-_KEPT]:
        del _tables[oldest]
    return table.moved(x, y, heading)
