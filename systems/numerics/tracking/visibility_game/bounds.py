"""The three bounds of the visibility game: how each discretises it, and who goes first.

- `middle` assumes that both players are on nodes; evader nodes beside a wall also stand for the
  place at the wall.
- `lower`: the pursuer is on nodes and goes first; the evader may be anywhere within a slack of its
  node, and all of that has to be seen, between steps as well.
- `upper`: the evader is on nodes and goes first; the pursuer may be anywhere within a slack of its
  node, and sees whatever is visible from some point there. Sight counts only at the ends of steps.

Pursuit by the lower bound needs grids that fit its period, and times to turn; what a team certifies
then follows from the times of its pairs.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ...errors import require, require_non_negative, require_positive
from ...geometry.edge_index import EdgeIndex, build_edge_index, index_regions
from ...geometry.world import World
from ..corner_game import corner_table
from .ground import (
    NO_WALL_PLACES,
    Spots,
    WallPlaces,
    all_ways,
    beside_walls,
    no_walls,
    nodes_by_rim,
    nodes_near,
    nodes_to_follow,
    wall_places,
    ways,
    without_thin_obstacles,
)
from .lattice import SLACK, Lattice, Moves, are_free, cover, free_nodes, moves_within
from .moves_in_sight import moves_that_keep_sight
from .near_sight import see_runs_from_near
from .sight_rows import see_runs

# Both players' moves: an octagon, so that speed is nearly the same in all directions.
MOVES = moves_within(5)

# A pursuer that goes first has longer moves, but along the grid only those of one cell.
LONG = moves_within(10)
LONG_OFFSETS = LONG.offsets[(LONG.offsets.all(axis=1)) | (np.abs(LONG.offsets).sum(axis=1) <= 1)]

# Following an evader on nodes overestimates its speed; more moves make the error smaller.
FOLLOWED = moves_within(20)

# Mean length of the pursuer's moves at full speed, as the octagon has it [cells].
PACE = 2.17

# Spacing of the pursuer's nodes for `lower`, and length of its step, in units of the grid.
LOWER_SPACING = 0.5
LOWER_STEP = LOWER_SPACING * LONG.longest

# Games with more pairs of nodes than this are refused at once.
MOST_PAIRS = 20e9

# So are games with more evader nodes than this, or with more in a row.
MOST_NODES, MOST_NODES_A_ROW = 10e6, 32767

NO_SPOTS = Spots(np.zeros((0, 2)), np.zeros((0, 2), dtype=np.int64))
NO_CORNERS = np.zeros((0, 6))


class Setting(NamedTuple):
    """The game of one bound on grids, without what is seen.

    Attributes:
        step: Distance that the pursuer moves in a step [m].
        slack: Largest distance of a followed player from its node [m].
        pace: Distance that a followed evader moves in a step [m].
        hold: Distance that it moves while the pursuer still turns [m].
        pursuer_grid, evader_grid: The players' grids.
        pursuer_nodes, evader_nodes: Nodes where they can be, or be followed, shape (rows, columns),
            bool.
        pursuer_region, evader_region: Edges of the players' regions.
        sight: Edges that block sight.
        corners: Corners near whose shadows nodes do not count as seen, from `corner_table`, shape
            (k, 6).
        spots: Points that have to be seen for nodes near walls.
        wall_places: Points that have to be seen for nodes near walls from behind the wall.
        ways: Where a pursuer may go from each node, as in `Rules`.
        moves: The evader's moves.
        walls: Moves of evaders that are not blocked by walls, from `beside_walls`.
        by_rim: Nodes near which a followed evader cannot go everywhere, shape (rows, columns),
            bool.
        evader_first: Whether the evader commits to its move first.
    """

    step: float
    slack: float
    pace: float
    pursuer_grid: Lattice
    evader_grid: Lattice
    pursuer_nodes: np.ndarray
    evader_nodes: np.ndarray
    pursuer_region: EdgeIndex
    evader_region: EdgeIndex
    sight: EdgeIndex
    corners: np.ndarray
    spots: Spots
    wall_places: WallPlaces
    ways: tuple[np.ndarray, np.ndarray]
    moves: Moves
    walls: tuple[np.ndarray, np.ndarray, np.ndarray]
    by_rim: np.ndarray
    evader_first: bool
    hold: float = 0.0

    @property
    def places(self) -> np.ndarray:
        """The pursuer's nodes, shape (n, 2) [m]."""
        return self.pursuer_grid.at(*np.nonzero(self.pursuer_nodes))

    def see(
        self, places: np.ndarray, sight_range: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Nodes that places see, by `see_runs`.

        Args:
            places: Shape (n, 2) [m].
            sight_range: How far, or infinity [m].
        """
        slack = 0.0 if self.evader_first else self.slack + self.hold
        windows, runs, ends, sighted = see_runs(
            self.sight,
            places,
            tuple(self.evader_grid),
            self.evader_nodes,
            *self.spots,
            self.wall_places,
            self.corners,
            sight_range,
            self.step,
            slack,
            self.pace - self.hold,
        )
        if self.evader_first:
            # The pursuer cannot be at some of the nodes on which it is followed.
            sighted[~are_free(self.pursuer_region, places)] = 0
        return windows, runs, ends, sighted

    def take_care(
        self, runs: np.ndarray, ends: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Moves that may lose sight on the way, by `moves_that_keep_sight`.

        Args:
            runs, ends: What the pursuer's nodes see, by `see`, shapes (m, 3), (n,).
        """
        if len(self.corners) == 0:
            starts = np.zeros(len(ends) + 1, dtype=np.int64)
            return starts, np.zeros((0, 2), dtype=np.int32), np.zeros(0, dtype=np.uint32)
        return moves_that_keep_sight(
            self.sight,
            self.places,
            *self.ways,
            tuple(self.evader_grid),
            runs,
            ends,
            self.by_rim,
            self.corners,
            self.step,
            self.slack + self.hold,
            self.pace - self.hold,
        )

    def see_from_near(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What is seen from near the pursuer's nodes, by `see_runs_from_near`."""
        nodes = self.pursuer_nodes
        return see_runs_from_near(
            self.sight,
            np.where(nodes, np.cumsum(nodes).reshape(nodes.shape) - 1, -1),
            tuple(self.pursuer_grid),
            tuple(self.evader_grid),
            self.evader_nodes,
            self.slack,
            self.moves.reach,
        )


def middle_setting(
    world: World,
    ratio: float,
    grid: float,
    pursuer_regions: Sequence[World],
    evader_regions: Sequence[World],
    sight_range: float,
    *,
    evader: Moves = MOVES,
    evader_pace: float = PACE,
) -> Setting:
    """The game with both players on nodes, the evader's grid finer by the ratio of the speeds.

    Args:
        world, ratio, grid, pursuer_regions, evader_regions, sight_range: See
            `solve_visibility_game`; the ratio is that of the speeds.
        evader: Moves of an evader.
        evader_pace: Mean length of these at full speed [cells].

    Raises:
        InvalidInput: The grid is far too fine for the world.
    """
    evader_spacing = ratio * PACE * grid / evader_pace
    _require_few(world, grid, evader_spacing, sight_range, grid)
    pursuing, evading = (
        index_regions("pursuer_regions", pursuer_regions),
        index_regions("evader_regions", evader_regions),
    )
    pursuer_grid, evader_grid = cover(world.bounds, grid), cover(world.bounds, evader_spacing)
    free, evader_nodes = free_nodes(pursuer_grid, pursuing), free_nodes(evader_grid, evading)
    reach = float(np.hypot(*evader.offsets.T).max()) * evader_spacing
    return Setting(
        step=PACE * grid,
        slack=0.0,
        pace=0.0,
        pursuer_grid=pursuer_grid,
        evader_grid=evader_grid,
        pursuer_nodes=free,
        evader_nodes=evader_nodes,
        pursuer_region=pursuing,
        evader_region=evading,
        sight=build_edge_index(world),
        corners=NO_CORNERS,
        spots=NO_SPOTS,
        wall_places=wall_places(evader_grid, evader_nodes, evading, reach),
        ways=ways(pursuer_grid, free, pursuing, MOVES.offsets),
        moves=evader,
        walls=beside_walls(evader_grid, evader_nodes, evading, evader),
        by_rim=np.zeros_like(evader_nodes),
        evader_first=False,
    )


def lower_setting(
    world: World,
    ratio: float,
    grid: float,
    pursuer_regions: Sequence[World],
    evader_regions: Sequence[World],
    sight_range: float,
    *,
    offsets: np.ndarray = LONG_OFFSETS,
    evader: Moves = FOLLOWED,
    wait: float = 0.0,
) -> Setting:
    """The game with the pursuer on nodes of half the spacing `grid`, and the evader followed.

    Args:
        world, ratio, grid, pursuer_regions, evader_regions, sight_range: See `middle_setting`.
        offsets: Moves of the pursuer, shape (n, 2) [cells].
        evader: Moves of an evader.
        wait: Distance that the pursuer could move in the time that it turns before each step [m].

    Raises:
        InvalidInput: The grid is far too fine for the world.
    """
    spacing = LOWER_SPACING * grid
    step = spacing * float(np.hypot(*offsets.T).max())
    pace, hold = ratio * (step + wait), ratio * wait
    evader_spacing = pace / evader.pace
    slack = SLACK * evader_spacing
    _require_few(world, spacing, evader_spacing, sight_range, grid)
    pursuing = index_regions("pursuer_regions", pursuer_regions)
    pursuer_grid = cover(world.bounds, spacing)
    evader_grid = cover(world.bounds, evader_spacing, 2.0 * slack)
    free = free_nodes(pursuer_grid, pursuing)
    blocking = without_thin_obstacles(world, max(step, 2.0 * (slack + pace)))
    evader_nodes, spots = nodes_to_follow(evader_grid, evader_regions, slack)
    return Setting(
        step=step,
        slack=slack,
        pace=pace,
        pursuer_grid=pursuer_grid,
        evader_grid=evader_grid,
        pursuer_nodes=free,
        evader_nodes=evader_nodes,
        pursuer_region=pursuing,
        evader_region=index_regions("evader_regions", evader_regions),
        sight=build_edge_index(*blocking),
        corners=np.concatenate([corner_table(part) for part in blocking]),
        spots=spots,
        wall_places=NO_WALL_PLACES,
        ways=ways(pursuer_grid, free, pursuing, offsets),
        moves=evader,
        walls=no_walls(evader_grid, evader),
        by_rim=nodes_by_rim(evader_grid, evader_regions, slack + pace),
        evader_first=False,
        hold=hold,
    )


def _upper(
    world: World,
    ratio: float,
    grid: float,
    pursuer_regions: Sequence[World],
    evader_regions: Sequence[World],
    sight_range: float,
) -> Setting:
    """The game with the evader on nodes, and the pursuer followed on nodes of half the spacing."""
    spacing = 0.5 * grid
    step = MOVES.pace * spacing
    evader_spacing = ratio * step / MOVES.longest
    slack = SLACK * spacing
    _require_few(world, spacing, evader_spacing, sight_range, grid)
    evading = index_regions("evader_regions", evader_regions)
    pursuer_grid = cover(world.bounds, spacing, 2.0 * slack)
    evader_grid = cover(world.bounds, evader_spacing)
    followed = nodes_near(pursuer_grid, pursuer_regions, slack)
    evader_nodes = free_nodes(evader_grid, evading)
    return Setting(
        step=step,
        slack=slack,
        pace=0.0,
        pursuer_grid=pursuer_grid,
        evader_grid=evader_grid,
        pursuer_nodes=followed,
        evader_nodes=evader_nodes,
        pursuer_region=index_regions("pursuer_regions", pursuer_regions),
        evader_region=evading,
        sight=build_edge_index(world),
        corners=NO_CORNERS,
        spots=NO_SPOTS,
        wall_places=NO_WALL_PLACES,
        ways=all_ways(pursuer_grid, followed, MOVES),
        moves=MOVES,
        walls=beside_walls(evader_grid, evader_nodes, evading, MOVES),
        by_rim=np.zeros_like(evader_nodes),
        evader_first=True,
    )


# The settings, by the name of the bound.
BOUNDS: dict[str, Callable[..., Setting]] = {
    "lower": lower_setting,
    "middle": middle_setting,
    "upper": _upper,
}


def _require_few(
    world: World, spacing: float, evader_spacing: float, sight_range: float, grid: float
) -> None:
    """Refuse grids with far too many nodes, and suggest a spacing that would do."""
    width, height = world.bounds[2:] - world.bounds[:2]
    reach = min(sight_range, math.hypot(width, height))
    seen = min(width * height, math.pi * reach**2)

    def are_few(scale: float) -> bool:
        here, there = scale * spacing, scale * evader_spacing
        # Test the rows first, so that no number of nodes overflows.
        if max(width, height) > MOST_NODES_A_ROW * there:
            return False
        # With a margin on either side, for an evader that is followed.
        rows, columns = height / there + 6.0, width / there + 6.0
        few = width * height * seen <= MOST_PAIRS * (here * there) ** 2
        few = few and rows * columns <= MOST_NODES
        return bool(few and max(rows, columns) <= MOST_NODES_A_ROW)

    scale = 1.0
    # For a tiny grid, or a very slow evader, no finite scale may be large enough.
    while scale < math.inf and not are_few(scale):
        scale *= 1.1
    say = f", {scale * grid:.2g} m say" if scale < math.inf else ""
    require(scale == 1.0, "grid", f"be coarser for so large a world{say}", f"{grid:.6g}")


def certified_grid(grid: float, pursuer_speed: float, period: float) -> float:
    """Return the largest spacing, at most `grid`, for which a step is a whole number of periods.

    The lower bound holds for pursuers that are at nodes at the end of a step, and robots get new
    commands once a period. If one period is already longer than the step of `grid`, the step is
    one period, and the spacing larger than `grid`.

    Args:
        grid: Desired spacing, see `solve_visibility_game` [m].
        pursuer_speed: Top speed [m/s].
        period: Between commands [s].

    Raises:
        InvalidInput: A number is not positive.
    """
    for name, value in (("grid", grid), ("pursuer_speed", pursuer_speed), ("period", period)):
        require_positive(name, value)
    periods = max(math.floor(LOWER_STEP * grid / (pursuer_speed * period) + 1e-9), 1)
    return periods * pursuer_speed * period / LOWER_STEP


def turning_time(top_turn_rate: float, period: float) -> float:
    """Longest time that a differential drive turns in place before it drives straight [s].

    It also drives backwards, so it turns by a right angle at most. The time is rounded up to whole
    periods.

    Args:
        top_turn_rate: [rad/s].
        period: Between commands [s].

    Raises:
        InvalidInput: A number is not positive.
    """
    require_positive("top_turn_rate", top_turn_rate)
    require_positive("period", period)
    return math.ceil(0.5 * math.pi / (top_turn_rate * period) - 1e-9) * period


def turning_margin(grid: float, pursuer_speed: float, turning_time: float) -> float:
    """Factor by which the pursuer's turning makes an evader effectively faster, no unit.

    In a step a pursuer turns for `turning_time` and then drives, while the evader runs all the
    time. Relative to the pursuer's motion, the evader's speed is multiplied by the duration of the
    step divided by the time in which the pursuer drives.

    Args:
        grid: See `solve_visibility_game`, for the lower bound [m].
        pursuer_speed: Top speed [m/s].
        turning_time: [s].

    Raises:
        InvalidInput: A number is out of its range.
    """
    require_positive("grid", grid)
    require_positive("pursuer_speed", pursuer_speed)
    require_non_negative("turning_time", turning_time)
    return 1.0 + pursuer_speed * turning_time / (LOWER_STEP * grid)


def team_certificate(times: np.ndarray, assignment: np.ndarray, evaders: int) -> float:
    """For how long all evaders are kept in sight, whatever they do [s].

    Args:
        times: For how long each pursuer can keep its own evader, shape (n,) [s].
        assignment: Each pursuer's evader, -1 for none, shape (n,).
        evaders: How many there are.

    Returns:
        The shortest time over all evaders, each with its best pursuer; 0 if an evader has none.
    """
    kept = np.zeros(evaders)
    for time, evader in zip(times, assignment, strict=True):
        if evader >= 0:
            kept[int(evader)] = max(kept[int(evader)], time)
    return float(kept.min())
