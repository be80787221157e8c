"""How long one pursuer can keep one evader in sight on a map, whatever the evader does.

Both players move on grids, the evader's finer by the ratio of the speeds, so that both have the
same moves in cells, and the game is solved in whole steps (`sweeps`). Three bounds (`bounds`):

- `middle` assumes that both are on nodes, and that evaders beside a wall may be at the wall too. It
  may err in either direction, the less the finer the grid.
- `lower` is certified: the pursuer keeps the evader in sight for at least this time, wherever the
  evader is and whatever way it takes. The evader is followed on nodes (`lattice`), and sight is
  kept between steps as well (`sight_rows`). Obstacles so thin that two lines of sight could pass
  them on either side within a step are thickened.
- `upper` is certified for the evader: it hides within this time, wherever the pursuer is and
  whatever way it takes. The pursuer is followed on nodes, and sees what is visible from near its
  node (`near_sight`).

Source: ours. Esteve-Yague & Tsai (2023) show that the value jumps where the evader can just reach a
corner, so nothing is interpolated here; the scheme is that of safety games on graphs.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import require, require_non_negative, require_one_of, require_positive
from ...geometry.edge_index import EdgeIndex, point_is_free
from ...geometry.segment_sight import are_clear, segment_is_clear
from ...geometry.world import World
from .bounds import BOUNDS
from .ground import connected_share, padded
from .lattice import SLACK, Lattice, finite_point
from .moves_in_sight import keeps_sight
from .plane_steps import count_kept, count_pairs, steps_from
from .planes import (
    FOR_EVER,
    MOST_STEPS,
    TILE,
    Planes,
    Rules,
    best_answer,
    keeps_by_table,
    worst_reply,
)
from .sight_rows import fill_tiles, lay_out
from .sweeps import full_agenda, settle, sweep

# Least fraction of the pursuer's nodes that must be connected; single nodes in nooks need not be.
LEAST_CONNECTED = 0.95

# Assumed moment in the last step at which sight ends [steps before its end].
LAST_STEP = {"lower": 1.0, "middle": 0.5, "upper": 0.0}

# Largest distance between a pursuer and the node that represents it [cells].
NEAREST = 2.0

# Number of places from which the size of a table is estimated.
SAMPLE = 64


@dataclass(frozen=True, eq=False)
class GuaranteedTimes:
    """The visibility game of one pursuer and one evader, solved.

    Attributes:
        bound: "lower", "middle" or "upper".
        pursuer_speed, evader_speed: Top speeds [m/s].
        sight_range: How far the pursuer sees, or infinity [m].
        step: Duration of a step, turning included [s].
        turning_time: Time in each step in which the pursuer may turn before it drives [s].
        pursuer_grid, evader_grid: The players' grids.
        slack: Largest distance of a followed player from its node [m].
        places: Nodes where the pursuer can be, or be followed, shape (n, 2) [m].
        evader_nodes: Nodes where evaders can be, or be followed, shape (rows, columns), bool.
        sighted: Number of evader nodes that each place sees, shape (n,); 0 where no pursuer can be.
        kept: Fraction of the nodes that each place sees that can be kept in sight for ever, shape
            (n,), no unit.
        lasting: Mean time for which the nodes that each place sees are kept, the horizon counting
            for nodes kept for ever, shape (n,) [s].
        sight: Edges that block sight; for "lower" thin obstacles are thickened.
        pursuer_region, evader_region: Edges of the players' regions.
        corners: From `corner_table`, shape (k, 6), only for "lower".
        planes, rules: See `planes`.
        updates: Number of planes computed until nothing changed.
    """

    bound: str
    pursuer_speed: float
    evader_speed: float
    sight_range: float
    step: float
    turning_time: float
    pursuer_grid: Lattice
    evader_grid: Lattice
    slack: float
    places: np.ndarray
    evader_nodes: np.ndarray
    sighted: np.ndarray
    kept: np.ndarray
    lasting: np.ndarray
    sight: EdgeIndex
    pursuer_region: EdgeIndex
    evader_region: EdgeIndex
    corners: np.ndarray
    planes: Planes
    rules: Rules
    updates: int

    @property
    def pairs(self) -> int:
        """Number of pairs of nodes in sight of each other."""
        return int(self.sighted.sum())

    @property
    def nbytes(self) -> int:
        """Memory that the table takes [bytes]."""
        rules = self.rules
        care = (rules.care_starts, rules.care_nodes, rules.care_moves)
        return sum(array.nbytes for array in (*self.planes, *care))

    @property
    def horizon(self) -> float:
        """Time beyond which an evader counts as kept for ever [s]."""
        return self.rules.horizon * self.step

    @property
    def share_for_ever(self) -> float:
        """Fraction of all pairs in sight of each other that can be kept so for ever, no unit."""
        return float(self.kept @ self.sighted) / max(self.pairs, 1)

    @property
    def watched(self) -> np.ndarray:
        """Value of each place as a viewpoint: mean time for which an evader that may be anywhere is
        kept in sight, 0 where it is not seen, shape (n,) [s]."""
        return self.lasting * self.sighted / np.count_nonzero(self.evader_nodes)

    def times_from(self, pursuer: object) -> np.ndarray:
        """Guaranteed times for every node of the evader, from the pursuer's nearest node.

        For "upper" they are from the pursuer's own position.

        Args:
            pursuer: Shape (2,) [m].

        Returns:
            Shape (rows, columns) [s]; infinite if for ever or beyond the horizon, and NaN where no
            evader can be.

        Raises:
            InvalidInput: The pursuer cannot be there.
        """
        node = self.nearest_place(pursuer)
        grid = self.evader_grid
        steps = steps_from(self.planes, self.rules, node)[: grid.rows, : grid.columns]
        if self.bound == "upper":
            p = finite_point("pursuer", pursuer)
            for other in self._places_near(p, self.slack):
                again = steps_from(self.planes, self.rules, int(other))
                steps = np.minimum(steps, again[: grid.rows, : grid.columns])
            # More is seen from near the pursuer than from its own position.
            doubtful = self.evader_nodes & (steps > 0)
            points = grid.points[doubtful]
            steps[doubtful] *= are_clear(self.sight, np.tile(p, (len(points), 1)), points)
        return np.where(self.evader_nodes, self._seconds(steps.astype(float)), np.nan)

    def time(self, pursuer: object, evader: object) -> float:
        """How long the pursuer can keep the evader in sight [s]; infinite from the horizon on.

        For "middle" the time is from the nearest nodes. Otherwise it is from the exact positions:
        for "lower" the pursuer's first step leads to the best node in its reach, for "upper" the
        evader's.

        Args:
            pursuer, evader: Shape (2,) [m].

        Raises:
            InvalidInput: One of them cannot be there.
        """
        best = self.hiding_step if self.bound == "upper" else self.best_step
        return best(pursuer, evader)[1]

    def best_step(
        self,
        pursuer: object,
        evader: object,
        allowed: Callable[[np.ndarray], bool] | None = None,
    ) -> tuple[np.ndarray, float]:
        """Where the pursuer should be a step from now, and the time that it can then guarantee.

        For "middle" and "lower"; for the evader's step see `hiding_step`. Of places with the same
        time the nearest is taken.

        Args:
            pursuer, evader: Shape (2,) [m].
            allowed: Whether the pursuer may go to a place, shape (2,) [m]; None: all are allowed.

        Returns:
            The place, shape (2,) [m]; the time from now [s], infinite if for ever. Where nothing is
            guaranteed the pursuer stays.

        Raises:
            InvalidInput: One of them cannot be there.
        """
        node = self.nearest_place(pursuer)
        p, e = np.asarray(pursuer, dtype=float), np.asarray(evader, dtype=float)
        reach = self.pursuer_speed * (self.step - self.turning_time)
        pace, hold = self.evader_speed * self.step, self.evader_speed * self.turning_time
        row, column = self._evader_node(e)
        apart = math.hypot(*(e - p))
        if apart > self.sight_range or not segment_is_clear(self.sight, p[0], p[1], e[0], e[1]):
            return p, 0.0
        if self.bound == "middle":
            first, last = self.rules.neighbour_starts[node : node + 2]
            choices = [(int(q), row, column) for q in self.rules.neighbours[first:last]]
        elif apart > self.sight_range - hold - 0.25 * (pace - hold):
            choices = []
        else:
            # `reach` is the length of the longest moves; a rounding margin is included.
            near = self._places_near(p, reach)
            near = near[np.argsort(np.hypot(*(self.places[near] - p).T), kind="stable")]
            start = np.tile(p, (len(near), 1))
            near = near[are_clear(self.pursuer_region, start, self.places[near])]
            around = self._nodes_near(e)
            choices = [(int(q), j, i) for q in near for j, i in around]
        at_node = math.hypot(*(self.places[node] - p)) <= 1e-9 * self.pursuer_grid.spacing
        best, place = 0, p
        for q, j, i in choices:
            steps = worst_reply(self.planes, q, j, i)
            # At a node a move that the table allows will do; for "middle", without corners, any.
            if steps <= best or not (allowed is None or allowed(self.places[q])):
                continue
            if (at_node and keeps_by_table(self.planes, self.rules, node, q, j, i)) or keeps_sight(
                self.sight, p, self.places[q], e, self.corners, pace, hold
            ):
                best, place = steps, self.places[q]
        # W counts from the end of the step.
        return place, float(self._seconds(np.array(best + float(best < FOR_EVER))))

    def hiding_step(self, pursuer: object, evader: object) -> tuple[np.ndarray, float]:
        """Where the evader should be a step from now, and the latest time at which it is hidden.

        For "upper": the evader commits itself to a straight move, and follows the table from there.

        Args:
            pursuer, evader: Shape (2,) [m].

        Returns:
            The place, shape (2,) [m]; the time from now [s], infinite if hiding is not guaranteed.
            Then, and if it is hidden already, the evader stays.

        Raises:
            InvalidInput: One of them cannot be there.
        """
        self.nearest_place(pursuer)
        p, e = finite_point("pursuer", pursuer), finite_point("evader", evader)
        free = bool(point_is_free(self.evader_region, e[0], e[1]))
        require(free, "evader", "be where the robot has room", e.tolist())
        if not segment_is_clear(self.sight, p[0], p[1], e[0], e[1]):
            return e, 0.0
        grid = self.evader_grid
        rows, columns = self._nodes_within(e, self.evader_speed * self.step)
        ends = grid.at(rows, columns)
        clear = are_clear(self.evader_region, np.tile(e, (len(ends), 1)), ends)
        least, place = int(FOR_EVER), e
        for n in self._places_near(p, self.slack):
            for j, i in zip(rows[clear], columns[clear], strict=True):
                steps = best_answer(self.planes, self.rules, int(n), int(j), int(i))
                if steps < least:
                    least, place = steps, grid.at(j, i)
        return place, float(self._seconds(np.array(least + float(least < FOR_EVER))))

    def _seconds(self, steps: np.ndarray) -> np.ndarray:
        """Steps as seconds: sight ends somewhere within the last one."""
        seconds = np.maximum(steps - LAST_STEP[self.bound], 0.0) * self.step
        return np.where(steps == FOR_EVER, np.inf, seconds)

    def nearest_place(self, pursuer: object) -> int:
        """Number of the pursuer's node nearest to a point.

        Args:
            pursuer: Shape (2,) [m].

        Raises:
            InvalidInput: The pursuer cannot be there, or the grid is too coarse for it.
        """
        p = finite_point("pursuer", pursuer)
        require(
            bool(point_is_free(self.pursuer_region, p[0], p[1])),
            "pursuer",
            "be where the robot has room",
            p.tolist(),
        )
        apart = np.hypot(*(self.places - p).T)
        if self.bound == "upper":
            # A followed pursuer's node may be behind a wall.
            return int(np.argmin(apart))
        near = np.flatnonzero(apart <= NEAREST * self.pursuer_grid.spacing)
        near = near[np.argsort(apart[near], kind="stable")]
        near = near[are_clear(self.pursuer_region, np.tile(p, (len(near), 1)), self.places[near])]
        require(len(near) > 0, "grid", f"have a node near {p.tolist()}", self.pursuer_grid.spacing)
        return int(near[0])

    def _evader_node(self, evader: object) -> tuple[int, int]:
        """Row and column of the evader's nearest node."""
        e = finite_point("evader", evader)
        nodes = self._nodes_near(e)
        require(len(nodes) > 0, "evader", "be where the robot has room", e.tolist())
        return nodes[0]

    def _places_near(self, p: np.ndarray, radius: float) -> np.ndarray:
        """Numbers of the pursuer's nodes within a radius [m], up to rounding."""
        return np.flatnonzero(np.hypot(*(self.places - p).T) <= radius * (1.0 + 1e-9))

    def _nodes_near(self, e: np.ndarray) -> list[tuple[int, int]]:
        """Nodes of the evader within the slack of a point, nearest first."""
        rows, columns = self._nodes_within(e, SLACK * self.evader_grid.spacing)
        return list(zip(rows.tolist(), columns.tolist(), strict=True))

    def _nodes_within(self, e: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
        """Rows and columns of the evader's nodes within a radius [m], nearest first."""
        grid = self.evader_grid
        low = np.maximum(np.floor((e - radius - grid.at(0, 0)) / grid.spacing).astype(int), 0)
        high = np.maximum(np.ceil((e + radius - grid.at(0, 0)) / grid.spacing).astype(int) + 1, 0)
        nodes = self.evader_nodes[low[1] : high[1], low[0] : high[0]]
        rows, columns = np.nonzero(nodes) + low[::-1, None]
        distances = np.hypot(*(grid.at(rows, columns) - e).T)
        within = np.flatnonzero(distances <= radius * (1.0 + 1e-9))
        within = within[np.argsort(distances[within], kind="stable")]
        return rows[within], columns[within]


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
    sight_range: float = math.inf,
    turning_time: float = 0.0,
    memory: float = 4e9,
    progress: Callable[[float], None] | None = None,
) -> GuaranteedTimes:
    """Solve the game of one pursuer that keeps one evader in sight.

    Args:
        world: Whose obstacles block sight.
        pursuer_speed, evader_speed: Top speeds, the evader's the lower one [m/s].
        grid: Spacing of the pursuer's nodes [m]; half of it is used for "lower" and "upper".
        bound: "lower", "middle" or "upper".
        pursuer_regions, evader_regions: Where their centres may be, from `shrink_world`; None: the
            whole world, for points.
        horizon: Time beyond which an evader counts as kept for ever [s]; at most MOST_STEPS steps.
        sight_range: How far the pursuer sees [m]; infinite for "upper".
        turning_time: Longest time that the pursuer turns before it drives, in each step [s]; only
            for "lower".
        memory: Most memory that the table may take [bytes].
        progress: Called now and then with the fraction of the planes that are settled.

    Raises:
        InvalidInput: A number is out of its range; the grid has no node for a player, or is so
            coarse that passages separate the pursuer's nodes; or the table would take more memory.
    """
    require_one_of("bound", bound, tuple(BOUNDS))
    for name, value in (("pursuer_speed", pursuer_speed), ("grid", grid)):
        require_positive(name, value)
    require_positive("horizon", horizon)
    require(sight_range > 0, "sight_range", "be positive", sight_range)
    whole = bound != "upper" or math.isinf(sight_range)
    require(whole, "sight_range", "be infinite for the upper bound", sight_range)
    require_non_negative("turning_time", turning_time)
    timely = bound == "lower" or turning_time == 0.0
    require(timely, "turning_time", "be zero but for the lower bound", turning_time)
    require_positive("memory", memory)
    require_positive("evader_speed", evader_speed)
    ratio = evader_speed / pursuer_speed
    require(ratio < 1, "speed_ratio", "lie in (0, 1)", f"{ratio:.6g}")
    regions = pursuer_regions or (world,)
    waiting = {"wait": pursuer_speed * turning_time} if turning_time else {}
    setting = BOUNDS[bound](
        world, ratio, grid, regions, evader_regions or (world,), sight_range, **waiting
    )
    places, evader_nodes = setting.places, setting.evader_nodes
    require(len(places) > 0, "grid", "leave the pursuer a place", f"{grid:.6g}")
    if not setting.evader_first:
        share = connected_share(setting.pursuer_grid, setting.pursuer_nodes, regions, *setting.ways)
        require(share >= LEAST_CONNECTED, "grid", "be finer than the passages", f"{grid:.6g}")
    require(bool(evader_nodes.any()), "grid", "leave the evader a place", f"{grid:.6g}")

    def require_room(size: float) -> None:
        require(
            size <= memory,
            "grid",
            f"be coarser, so that the table takes at most {memory / 1e9:.3g} GB",
            f"{grid:.6g}, which takes {size / 1e9:.3g} GB",
        )

    def size_of(slots: np.ndarray, tiles: int, windows: np.ndarray) -> int:
        return tiles * TILE * TILE + slots.nbytes + windows.nbytes

    # Estimate the size of the table from a sample of places first.
    sample = places[:: max(len(places) // SAMPLE, 1)].copy()
    windows, runs, ends, _ = setting.see(sample, sight_range)
    size = size_of(*lay_out(windows, runs, ends), windows)
    require_room(size * len(places) / len(sample) / 1.2)
    windows, runs, ends, sighted = setting.see(places, sight_range)
    seen = None
    if setting.evader_first:
        seen = runs, ends
        windows, runs, ends = setting.see_from_near()
    slots, tiles = lay_out(windows, runs, ends)
    size = size_of(slots, tiles, windows)
    require_room(size)
    care = setting.take_care(runs, ends)
    require_room(size + sum(array.nbytes for array in care))
    planes = Planes(windows, slots, np.zeros((tiles, TILE * TILE), dtype=np.uint8))
    fill_tiles(windows, slots, runs, ends, planes.tiles, FOR_EVER)
    del runs, ends
    step = setting.step / pursuer_speed + turning_time
    last = min(math.ceil(horizon / step), MOST_STEPS)
    rules = Rules(
        padded(evader_nodes, setting.moves),
        setting.moves.halves,
        *setting.ways,
        *setting.walls,
        *care,
        last,
        setting.evader_first,
    )
    agenda = full_agenda(planes)
    nodes = np.nonzero(setting.pursuer_nodes)
    updates = settle(nodes, agenda.due, lambda order: sweep(planes, rules, order, agenda), progress)
    if seen is not None:
        # More is seen from near a place than from the place itself.
        for_ever, others = (count_kept(planes, *seen) * (sighted > 0)[:, None]).T
        held = sighted
    else:
        held, for_ever, others = count_pairs(planes, rules).T
    steps = others - LAST_STEP[bound] * (held - for_ever) + rules.horizon * for_ever
    return GuaranteedTimes(
        bound=bound,
        pursuer_speed=pursuer_speed,
        evader_speed=evader_speed,
        sight_range=sight_range,
        step=step,
        turning_time=turning_time,
        pursuer_grid=setting.pursuer_grid,
        evader_grid=setting.evader_grid,
        slack=setting.slack,
        places=places,
        evader_nodes=evader_nodes,
        sighted=sighted,
        kept=for_ever / np.maximum(sighted, 1),
        lasting=steps * step / np.maximum(sighted, 1),
        sight=setting.sight,
        pursuer_region=setting.pursuer_region,
        evader_region=setting.evader_region,
        corners=setting.corners,
        planes=planes,
        rules=rules,
        updates=updates,
    )
