"""How long one pursuer can keep two evaders in sight on a map, whatever they do.

The game ends when the first of the two is lost. The bounds `middle` and `lower` are available, as
for one evader, on coarser grids; `triples` solves the game. The proof of the lower bound is that
for one evader, applied to each: the pursuer commits first, both evaders are followed on nodes, a
node of either counts as seen only if all places that it stands for are in sight, and a move has to
keep sight of both on the way (`moves_in_sight`).

That each of two evaders could be kept alone does not suffice: one of them may draw the pursuer away
from where it has to be for the other.

Source: ours.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from ...errors import require, require_one_of, require_positive
from ...geometry.edge_index import EdgeIndex, point_is_free
from ...geometry.segment_sight import are_clear, segment_is_clear
from ...geometry.world import World
from .bounds import MOVES, PACE, lower_setting, middle_setting
from .lattice import CLEAR, NOWHERE, SLACK, Lattice, clear_moves, finite_point, moves_within
from .moves_in_sight import keeps_sight
from .planes import FOR_EVER, MOST_STEPS
from .sweeps import settle
from .triples import (
    Roads,
    Triples,
    begin_for_ever,
    count_triples,
    keeps_two_by_table,
    lay_out_triples,
    steps_of_two,
    sweep_triples,
    worst_reply_of_two,
)

BOUNDS = ("middle", "lower")

# Evaders' moves in a step, by their number: a square, or the pursuer's octagon.
EVADER_MOVES = {9: moves_within(2), 21: MOVES}

# Nominal length of a step of a player on nodes, for "middle", chosen so that the square's mean
# speed over all directions is as near to the true one as the octagon's [cells].
PACES = {9: 1.154, 21: PACE}


@dataclass(frozen=True, eq=False)
class GuaranteedTimesOfTwo:
    """The visibility game of one pursuer and two evaders, solved.

    Attributes:
        bound: "middle" or "lower".
        pursuer_speed, evader_speed: Top speeds [m/s].
        step: Duration of a step [s].
        pursuer_grid, evader_grid: The players' grids.
        places: Nodes of the pursuer, shape (n, 2) [m].
        evader_numbers: Number of each evader node, or -1 where no evader can be, or be followed,
            shape (rows, columns).
        sight: Edges that block sight; for "lower" thin obstacles are thickened.
        pursuer_region: Edges of the pursuer's region.
        corners: From `corner_table`, shape (k, 6), none for "middle".
        triples, roads: See `triples`.
        updates: Number of planes computed until nothing changed.
    """

    bound: str
    pursuer_speed: float
    evader_speed: float
    step: float
    pursuer_grid: Lattice
    evader_grid: Lattice
    places: np.ndarray
    evader_numbers: np.ndarray
    sight: EdgeIndex
    pursuer_region: EdgeIndex
    corners: np.ndarray
    triples: Triples
    roads: Roads
    updates: int

    @property
    def nbytes(self) -> int:
        """Memory that the table takes [bytes]."""
        return sum(array.nbytes for array in self.triples)

    @cached_property
    def _counts(self) -> np.ndarray:
        return count_triples(self.triples, self.roads)

    @property
    def triples_in_sight(self) -> int:
        """Number of triples of a place and two evader nodes in its sight, in either order."""
        return int(self._counts[:, 0].sum())

    @property
    def share_for_ever(self) -> float:
        """Fraction of those triples kept for ever, or beyond the horizon, no unit."""
        return float(self._counts[:, 1].sum()) / max(self.triples_in_sight, 1)

    def times_from(self, pursuer: object, evader: object) -> np.ndarray:
        """Guaranteed times for every node of the second evader, with all players at nodes.

        Args:
            pursuer, evader: Shape (2,) [m].

        Returns:
            Shape (rows, columns) [s]; infinite if for ever, or to the horizon, zero where the
            pursuer does not see one of them, and NaN where no evader can be.

        Raises:
            InvalidInput: One of them cannot be there.
        """
        node, number = self.nearest_place(pursuer), self._numbers_near("evader", evader)[0]
        triples, worth = self.triples, np.zeros(self.triples.rank.shape[1])
        seen = triples.seen[triples.seen_starts[node] : triples.seen_starts[node + 1]]
        if number in seen:
            worth[seen] = steps_of_two(triples, self.roads, node)[list(seen).index(number)]
        times = np.full(self.evader_numbers.shape, np.nan)
        times[self.evader_numbers >= 0] = self.seconds(worth)
        return times

    def time(self, pursuer: object, evader_1: object, evader_2: object) -> float:
        """How long the pursuer can keep both in sight [s]; infinite from the horizon on.

        Args:
            pursuer, evader_1, evader_2: Shape (2,) [m].

        Raises:
            InvalidInput: One of them cannot be there.
        """
        return self.best_step(pursuer, evader_1, evader_2)[1]

    def best_step(
        self, pursuer: object, evader_1: object, evader_2: object
    ) -> tuple[np.ndarray, float]:
        """Where the pursuer should be a step from now, and the time that it can then guarantee.

        For "middle" the time is from the nearest nodes. For "lower" it is from the exact positions:
        the pursuer's first step leads to the best node in its reach.

        Args:
            pursuer, evader_1, evader_2: Shape (2,) [m].

        Returns:
            The place, shape (2,) [m]; the time from now [s], infinite if for ever. Where nothing is
            guaranteed the pursuer stays.

        Raises:
            InvalidInput: One of them cannot be there.
        """
        node, p = self.nearest_place(pursuer), np.asarray(pursuer, dtype=float)
        named = (("evader_1", evader_1), ("evader_2", evader_2))
        numbers = [self._numbers_near(name, evader) for name, evader in named]
        evaders = [np.asarray(evader, dtype=float) for _, evader in named]
        if not all(segment_is_clear(self.sight, p[0], p[1], e[0], e[1]) for e in evaders):
            return p, 0.0
        at_node = math.hypot(*(self.places[node] - p)) <= 1e-9 * self.pursuer_grid.spacing
        best, place = 0, p
        for q, e1, e2 in self._choices(node, p, numbers):
            steps = worst_reply_of_two(self.triples, q, e1, e2)
            if steps > best and (
                (at_node and self._keeps_by_table(node, q, e1, e2))
                or self._keeps_sight(p, self.places[q], evaders)
            ):
                best, place = steps, self.places[q]
        # W counts from the end of the step.
        return place, float(self.seconds(np.array(best + float(best < FOR_EVER))))

    def _choices(
        self, node: int, p: np.ndarray, numbers: list[list[int]]
    ) -> Iterator[tuple[int, int, int]]:
        """Where the pursuer may go, and the nodes on which it may follow the evaders."""
        if self.bound == "middle":
            first, last = self.roads.neighbour_starts[node : node + 2]
            for q in self.roads.neighbours[first:last]:
                yield int(q), numbers[0][0], numbers[1][0]
            return
        # The length of the longest moves, with a margin for rounding.
        reach = self.pursuer_speed * self.step * (1.0 + 1e-9)
        near = np.flatnonzero(np.hypot(*(self.places - p).T) <= reach)
        near = near[are_clear(self.pursuer_region, np.tile(p, (len(near), 1)), self.places[near])]
        for e1, e2 in product(*numbers):
            for q in near:
                yield int(q), e1, e2

    def _keeps_by_table(self, node: int, q: int, e1: int, e2: int) -> bool:
        """Whether a node sees both evaders' nodes, and the table allows a move from it."""
        first, last = self.triples.seen_starts[node : node + 2]
        seen = self.triples.seen[first:last]
        return bool(np.isin([e1, e2], seen).all()) and bool(
            keeps_two_by_table(self.roads, node, q, e1, e2)
        )

    def _keeps_sight(self, p: np.ndarray, to: np.ndarray, evaders: list[np.ndarray]) -> bool:
        """Whether a step keeps sight of both evaders on the way, by their exact positions."""
        pace = self.evader_speed * self.step
        return all(keeps_sight(self.sight, p, to, e, self.corners, pace, 0.0) for e in evaders)

    def seconds(self, steps: np.ndarray) -> np.ndarray:
        """Convert values to seconds; sight is taken to end within the last step.

        Args:
            steps: V, shape (...) [steps].
        """
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
        p = finite_point("pursuer", pursuer)
        free = bool(point_is_free(self.pursuer_region, p[0], p[1]))
        require(free, "pursuer", "be where the robot has room", p.tolist())
        return int(np.argmin(np.hypot(*(self.places - p).T)))

    def _numbers_near(self, name: str, evader: object) -> list[int]:
        """Numbers of an evader's nodes within the slack of it, nearest first."""
        e, grid = finite_point(name, evader), self.evader_grid
        row, column = (int(each[0]) for each in grid.nearest(e[None]))
        found = []
        for j in range(max(row - 1, 0), min(row + 2, grid.rows)):
            for i in range(max(column - 1, 0), min(column + 2, grid.columns)):
                distance = math.hypot(*(grid.at(j, i) - e))
                if self.evader_numbers[j, i] >= 0 and distance <= SLACK * grid.spacing:
                    found.append((distance, int(self.evader_numbers[j, i])))
        require(len(found) > 0, name, "be where the robot has room", e.tolist())
        return [number for _, number in sorted(found)]


def solve_two_evaders(
    world: World,
    *,
    pursuer_speed: float,
    evader_speed: float,
    grid: float,
    bound: str = "middle",
    evader_moves: int = 9,
    pursuer_regions: Sequence[World] | None = None,
    evader_regions: Sequence[World] | None = None,
    horizon: float = 120.0,
    memory: float = 4e9,
    progress: Callable[[float], None] | None = None,
) -> GuaranteedTimesOfTwo:
    """Solve the game of one pursuer that keeps two evaders in sight.

    Args:
        world: Whose obstacles block sight.
        pursuer_speed, evader_speed: Top speeds, the evaders' the lower one [m/s].
        grid: Spacing of the pursuer's nodes [m]; half of it is used for "lower".
        bound: "middle" or "lower".
        evader_moves: Number of moves of each evader in a step: 9 on a coarse grid, or 21 on one of
            twice as many nodes a side, for some ten times the memory and time.
        pursuer_regions, evader_regions: Where their centres may be, from `shrink_world`; None: the
            whole world, for points.
        horizon: Time beyond which evaders count as kept for ever [s]; at most MOST_STEPS steps.
        memory: Most memory that the table may take [bytes].
        progress: Called now and then with the fraction of the planes that are settled.

    Raises:
        InvalidInput: A number is out of its range; the grid has no node for a player; or the table
            would take more memory.
    """
    require_one_of("bound", bound, BOUNDS)
    require_one_of("evader_moves", evader_moves, EVADER_MOVES)
    for name, value in (("pursuer_speed", pursuer_speed), ("grid", grid)):
        require_positive(name, value)
    require_positive("evader_speed", evader_speed)
    require_positive("horizon", horizon)
    require_positive("memory", memory)
    ratio = evader_speed / pursuer_speed
    require(ratio < 1, "speed_ratio", "lie in (0, 1)", f"{ratio:.6g}")
    regions = pursuer_regions or (world,), evader_regions or (world,)
    moves = EVADER_MOVES[evader_moves]
    if bound == "lower":
        setting = lower_setting(
            world, ratio, grid, *regions, math.inf, offsets=MOVES.offsets, evader=moves
        )
    else:
        setting = middle_setting(
            world, ratio, grid, *regions, math.inf, evader=moves, evader_pace=PACES[evader_moves]
        )

    def require_room(size: float) -> None:
        require(
            size <= memory,
            "grid",
            f"be coarser, so that the table of two evaders takes at most {memory / 1e9:.3g} GB",
            f"{grid:.6g}, which takes {size / 1e9:.3g} GB",
        )

    places, evader_nodes = setting.places, setting.evader_nodes
    require(len(places) > 0, "grid", "leave the pursuer a place", f"{grid:.6g}")
    require(bool(evader_nodes.any()), "grid", "leave the evader a place", f"{grid:.6g}")
    # Check the size of the ranks alone before any array is made.
    require_room(4.0 * len(places) * np.count_nonzero(evader_nodes))
    numbers = np.where(evader_nodes, np.cumsum(evader_nodes).reshape(evader_nodes.shape) - 1, -1)
    nodes = np.argwhere(evader_nodes)
    found = clear_moves(
        setting.evader_grid, evader_nodes, nodes, setting.evader_region, moves.offsets
    )
    # Nodes for following may lie inside walls: then no wall blocks a move between them.
    left = found != NOWHERE if bound == "lower" else found == CLEAR
    evader_starts = np.append(0, np.cumsum(left.sum(axis=1)))
    evader_ways = numbers[tuple((nodes[:, None] + moves.offsets)[left].T)]
    _, runs, ends, _ = setting.see(places, math.inf)
    care_starts, care_nodes, care_moves = setting.take_care(runs, ends)
    care_nodes = numbers[care_nodes[:, 0], care_nodes[:, 1]]
    layout = lay_out_triples(runs, ends, numbers, evader_starts, evader_ways)
    require_room(float(layout[-1][-1]) + sum(array.nbytes for array in layout))
    triples = Triples(*layout, begin_for_ever(layout[2], layout[3], layout[5]))
    roads = Roads(
        *setting.ways,
        evader_starts,
        evader_ways,
        care_starts,
        care_nodes,
        care_moves,
        min(math.ceil(horizon * pursuer_speed / setting.step), MOST_STEPS),
    )
    due, order = np.ones(len(places), dtype=bool), np.nonzero(setting.pursuer_nodes)
    updates = settle(order, due, lambda order: sweep_triples(triples, roads, order, due), progress)
    return GuaranteedTimesOfTwo(
        bound=bound,
        pursuer_speed=pursuer_speed,
        evader_speed=evader_speed,
        step=setting.step / pursuer_speed,
        pursuer_grid=setting.pursuer_grid,
        evader_grid=setting.evader_grid,
        places=places,
        evader_numbers=numbers,
        sight=setting.sight,
        pursuer_region=setting.pursuer_region,
        corners=setting.corners,
        triples=triples,
        roads=roads,
        updates=updates,
    )
