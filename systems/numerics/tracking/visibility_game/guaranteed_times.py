"""How long one pursuer can keep one evader in sight on a map, whatever the evader does.

Both are put on grids, the evader's finer by the ratio of the speeds, so that both have the same
moves in cells, and the game is solved in whole steps (`sweeps`). Two bounds:

- `middle` takes both for being on nodes. It errs to either side, the less the finer the grid.
- `lower` is certified: the pursuer keeps the evader in sight for as long as it says, wherever the
  evader is and whatever way it takes. The evader is followed on nodes (`lattice`), and sight holds
  between steps as well (`sight_rows`). Obstacles that two lines of sight could pass on either side
  within a step count as thicker than they are.

Source: ours. Esteve-Yague & Tsai (2023) show that the value jumps where the evader can just reach a
corner, so that nothing is interpolated here; the scheme is that of safety games on graphs.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...errors import InvalidInput, require, require_one_of, require_positive
from ...geometry.edge_index import EdgeIndex, build_edge_index, point_is_free
from ...geometry.segment_sight import are_clear, segment_is_clear
from ...geometry.world import World
from ..corner_table import corner_table
from .ground import Spots, beside_walls, nodes_to_follow, padded, ways, without_thin_obstacles
from .lattice import SLACK, Lattice, cover, free_nodes, moves_within
from .sight_rows import keeps_off_corners, lay_out, see_runs
from .sweeps import (
    FOR_EVER,
    MOST_STEPS,
    TILE,
    Planes,
    Rules,
    count_pairs,
    steps_from,
    sweep,
    worst_reply,
)

BOUNDS = ("middle", "lower")

# Both players' moves: an octagon, so that speed is nearly the same in all directions.
MOVES = moves_within(5)

# Mean length of the pursuer's moves at full speed, as the octagon has it [cells].
PACE = 2.17

# More pairs of nodes than this are not even looked at.
MOST_PAIRS = 20e9

# Places that tell how much room a table will take.
SAMPLE = 64


@dataclass(frozen=True, eq=False)
class GuaranteedTimes:
    """The visibility game of one pursuer and one evader, solved.

    Attributes:
        bound: "middle" or "lower".
        pursuer_speed, evader_speed: Top speeds [m/s].
        step: What a step lasts [s].
        pursuer_grid, evader_grid: Where they can be.
        places: Nodes of the pursuer, shape (n, 2) [m].
        evader_nodes: Where evaders can be, or be followed, shape (rows, columns), bool.
        sighted: Evader nodes that each place sees, shape (n,).
        sight: Edges that block sight, a little thicker here and there for "lower".
        pursuer_region: Edges of where the pursuer can be.
        corners: From `corner_table`, shape (k, 6), none for "middle".
        planes, rules: See `sweeps`.
        updates: Planes computed until nothing changed.
    """

    bound: str
    pursuer_speed: float
    evader_speed: float
    step: float
    pursuer_grid: Lattice
    evader_grid: Lattice
    places: np.ndarray
    evader_nodes: np.ndarray
    sighted: np.ndarray
    sight: EdgeIndex
    pursuer_region: EdgeIndex
    corners: np.ndarray
    planes: Planes
    rules: Rules
    updates: int

    @property
    def pairs(self) -> int:
        """Pairs of places in sight of each other."""
        return int(self.sighted.sum())

    @property
    def bytes(self) -> int:
        """What the table takes [bytes]."""
        return sum(array.nbytes for array in self.planes)

    @cached_property
    def kept(self) -> np.ndarray:
        """Part of what each place sees that can be kept in sight for ever, shape (n,), no unit."""
        forever = count_pairs(self.planes, self.rules)[:, 1]
        return forever / np.maximum(self.sighted, 1)

    @property
    def share_for_ever(self) -> float:
        """Part of all pairs in sight of each other that can be kept so for ever, no unit."""
        return float(self.kept @ self.sighted) / max(self.pairs, 1)

    def times_from(self, pursuer: object) -> np.ndarray:
        """Guaranteed times for every place of the evader, from the pursuer's nearest node.

        Args:
            pursuer: Shape (2,) [m].

        Returns:
            Shape (rows, columns) [s]; infinite for ever, or to the horizon, and NaN where no
            evader can be.

        Raises:
            InvalidInput: The pursuer cannot be there.
        """
        node = self.nearest_place(pursuer)
        grid = self.evader_grid
        steps = steps_from(self.planes, self.rules, node)[: grid.rows, : grid.columns]
        return np.where(self.evader_nodes, self._seconds(steps.astype(float)), np.nan)

    def time(self, pursuer: object, evader: object) -> float:
        """How long the pursuer can keep the evader in sight [s]; infinite from the horizon on.

        For "middle" from the nearest nodes. For "lower" from the places given: the pursuer's first
        step leads to the best node within its reach.

        Args:
            pursuer, evader: Shape (2,) [m].

        Raises:
            InvalidInput: One of them cannot be there.
        """
        return self.best_step(pursuer, evader)[1]

    def best_step(self, pursuer: object, evader: object) -> tuple[np.ndarray, float]:
        """Where the pursuer should be a step from now, and the time that it can then guarantee.

        Args:
            pursuer, evader: Shape (2,) [m].

        Returns:
            The place, shape (2,) [m]; the time from now [s], infinite for ever. Where nothing is
            guaranteed the pursuer stays.

        Raises:
            InvalidInput: One of them cannot be there.
        """
        node = self.nearest_place(pursuer)
        p, e = np.asarray(pursuer, dtype=float), np.asarray(evader, dtype=float)
        reach, pace = self.pursuer_speed * self.step, self.evader_speed * self.step
        row, column = self._evader_node(e)
        if not segment_is_clear(self.sight, p[0], p[1], e[0], e[1]):
            return p, 0.0
        if self.bound == "middle":
            first, last = self.rules.neighbour_starts[node : node + 2]
            choices = [(int(q), row, column) for q in self.rules.neighbours[first:last]]
        elif keeps_off_corners(self.sight, p[0], p[1], e[0], e[1], self.corners, reach, pace):
            # The longest moves are as long as that, up to rounding.
            near = np.flatnonzero(np.hypot(*(self.places - p).T) <= reach * (1.0 + 1e-9))
            start = np.tile(p, (len(near), 1))
            near = near[are_clear(self.pursuer_region, start, self.places[near])]
            choices = [(int(q), j, i) for j, i in self._nodes_near(e) for q in near]
        else:
            choices = []
        best, place = 0, p
        for q, j, i in choices:
            steps = worst_reply(self.planes, q, j, i)
            if steps > best:
                best, place = steps, self.places[q]
        # W counts from the end of the step.
        return place, float(self._seconds(np.array(best + float(best < FOR_EVER))))

    def _seconds(self, steps: np.ndarray) -> np.ndarray:
        """Steps as seconds: sight ends somewhere within the last one."""
        part = 0.5 if self.bound == "middle" else 1.0
        seconds = np.maximum(steps - part, 0.0) * self.step
        return np.where(steps == FOR_EVER, np.inf, seconds)

    def nearest_place(self, pursuer: object) -> int:
        """Number of the pursuer's node nearest to a point.

        Args:
            pursuer: Shape (2,) [m].

        Raises:
            InvalidInput: The pursuer cannot be there.
        """
        p = _point("pursuer", pursuer)
        require(
            bool(point_is_free(self.pursuer_region, p[0], p[1])),
            "pursuer",
            "be where the robot has room",
            p.tolist(),
        )
        return int(np.argmin(np.hypot(*(self.places - p).T)))

    def _evader_node(self, evader: object) -> tuple[int, int]:
        """Row and column of the evader's nearest node."""
        e = _point("evader", evader)
        nodes = self._nodes_near(e)
        require(len(nodes) > 0, "evader", "be where the robot has room", e.tolist())
        return nodes[0]

    def _nodes_near(self, e: np.ndarray) -> list[tuple[int, int]]:
        """Nodes of the evader within the slack, nearest first."""
        grid = self.evader_grid
        row = round((e[1] - grid.y) / grid.spacing)
        column = round((e[0] - grid.x) / grid.spacing)
        found = []
        for j in range(max(row - 1, 0), min(row + 2, grid.rows)):
            for i in range(max(column - 1, 0), min(column + 2, grid.columns)):
                distance = math.hypot(*(grid.at(j, i) - e))
                if self.evader_nodes[j, i] and distance <= SLACK * grid.spacing:
                    found.append((distance, j, i))
        return [(j, i) for _, j, i in sorted(found)]


def solve_visibility_game(
    world: World,
    *,
    pursuer_speed: float,
    evader_speed: float,
    grid: float,
    bound: str = "middle",
    pursuer_regions: Sequence[World] | None = None,
    evader_regions: Sequence[World] | None = None,
    horizon: float = 120.0,
    memory: float = 4e9,
    progress: Callable[[float], None] | None = None,
) -> GuaranteedTimes:
    """Solve the game of one pursuer that keeps one evader in sight.

    Args:
        world: Whose obstacles block sight.
        pursuer_speed, evader_speed: Top speeds, the evader's the lower one [m/s].
        grid: Between places of the pursuer [m]; half of it for "lower".
        bound: "middle" or "lower".
        pursuer_regions, evader_regions: Where their centres may be, from `shrink_world`; the
            world where they are points.
        horizon: What lasts longer counts as for ever [s]; at most MOST_STEPS steps.
        memory: What the table may take [bytes].
        progress: Called now and then with the part of the planes that are settled.

    Raises:
        InvalidInput: A number is out of its range; the grid leaves a player no place; or the table
            would take more memory.
    """
    require_one_of("bound", bound, BOUNDS)
    for name, value in (("pursuer_speed", pursuer_speed), ("grid", grid)):
        require_positive(name, value)
    require_positive("horizon", horizon)
    require_positive("memory", memory)
    require_positive("evader_speed", evader_speed)
    ratio = evader_speed / pursuer_speed
    require(ratio < 1, "speed_ratio", "lie in (0, 1)", f"{ratio:.6g}")
    certified = bound == "lower"
    if certified:
        spacing = 0.5 * grid
        cells = MOVES.longest
        evader_spacing = ratio * cells * spacing / MOVES.pace
    else:
        spacing, cells, evader_spacing = grid, PACE, ratio * grid
    step, slack = cells * spacing, SLACK * evader_spacing if certified else 0.0
    width, height = world.bounds[2:] - world.bounds[:2]
    pairs = (width * height) ** 2 / (spacing * evader_spacing) ** 2
    require(pairs <= MOST_PAIRS, "grid", "be coarser for so large a world", f"{grid:.6g}")
    pursuing = build_edge_index(*(pursuer_regions or (world,)))
    evading = evader_regions or (world,)
    pursuer_grid = cover(world.bounds, spacing)
    evader_grid = cover(world.bounds, evader_spacing, 2.0 * slack)
    free = free_nodes(pursuer_grid, pursuing)
    places = pursuer_grid.at(*np.nonzero(free))
    require(len(places) > 0, "grid", "leave the pursuer a place", f"{grid:.6g}")
    starts, neighbours = ways(pursuer_grid, free, pursuing, MOVES)
    if certified:
        pace = MOVES.pace * evader_spacing
        blocking = without_thin_obstacles(world, max(step, 2.0 * (slack + pace)))
        sight = build_edge_index(*blocking)
        corners = np.concatenate([corner_table(part) for part in blocking])
        evader_nodes, spots = nodes_to_follow(evader_grid, evading, slack)
        walls = np.zeros((0, 4), dtype=np.int64), np.zeros((0, 2), dtype=np.int64)
    else:
        pace, sight, corners = 0.0, build_edge_index(world), np.zeros((0, 6))
        region = build_edge_index(*evading)
        evader_nodes = free_nodes(evader_grid, region)
        spots = Spots(np.zeros((0, 2)), np.zeros((0, 2), dtype=np.int64))
        walls = beside_walls(evader_grid, evader_nodes, region, MOVES)
    require(bool(evader_nodes.any()), "grid", "leave the evader a place", f"{grid:.6g}")

    def look(places: np.ndarray) -> tuple:
        """Runs, their layout, and the bytes that they and the table take."""
        windows, runs, ends, sighted = see_runs(
            sight, places, tuple(evader_grid), evader_nodes, *spots, corners, step, slack, pace
        )
        slots, row_starts, run_starts, tiles = lay_out(windows, runs, ends)
        size = tiles * TILE * TILE + 3 * runs.nbytes + slots.nbytes + run_starts.nbytes
        return windows, slots, row_starts, run_starts, runs, tiles, sighted, size

    def require_room(size: float) -> None:
        require(
            size <= memory,
            "grid",
            f"be coarser, so that the table takes at most {memory / 1e9:.3g} GB",
            f"{grid:.6g}, which takes {size / 1e9:.3g} GB",
        )

    # A sample tells beforehand.
    sample = places[:: max(len(places) // SAMPLE, 1)]
    require_room(look(sample)[-1] * len(places) / len(sample) / 1.2)
    windows, slots, row_starts, run_starts, runs, tiles, sighted, size = look(places)
    require_room(size)
    values = np.full((tiles, TILE * TILE), FOR_EVER, dtype=np.uint8)
    columns = np.ascontiguousarray(runs[:, 1:]).astype(np.int64)
    planes = Planes(windows, slots, row_starts, run_starts, columns, values)
    last = min(math.ceil(horizon * pursuer_speed / step), MOST_STEPS)
    blocked = padded(evader_nodes, MOVES)
    rules = Rules(blocked, MOVES.halves, starts, neighbours, *walls, last)
    updates = _settle(planes, rules, np.nonzero(free), progress)
    return GuaranteedTimes(
        bound=bound,
        pursuer_speed=pursuer_speed,
        evader_speed=evader_speed,
        step=step / pursuer_speed,
        pursuer_grid=pursuer_grid,
        evader_grid=evader_grid,
        places=places,
        evader_nodes=evader_nodes,
        sighted=sighted,
        sight=sight,
        pursuer_region=pursuing,
        corners=corners,
        planes=planes,
        rules=rules,
        updates=updates,
    )


def _settle(
    planes: Planes,
    rules: Rules,
    nodes: tuple[np.ndarray, ...],
    progress: Callable[[float], None] | None,
) -> int:
    """Sweep by rows and by columns, to and fro, until nothing changes; count planes computed."""
    rows, columns = nodes
    by_rows, by_columns = np.lexsort((columns, rows)), np.lexsort((rows, columns))
    due = np.ones(len(rows), dtype=bool)
    updates = 0
    while True:
        for order in (by_rows, by_rows[::-1].copy(), by_columns, by_columns[::-1].copy()):
            if not due.any():
                return updates
            updates += sweep(planes, rules, order, due)
            if progress is not None:
                progress(1.0 - float(due.mean()))


def _point(name: str, value: object) -> np.ndarray:
    point = np.asarray(value, dtype=float)
    if point.shape != (2,) or not np.isfinite(point).all():
        raise InvalidInput(f"`{name}` must be a finite point [x, y]; got {value}")
    return point
