"""The ground of the visibility game: the players' nodes, the ways between them, and walls."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from ...errors import require
from ...geometry.edge_index import EdgeIndex, build_edge_index
from ...geometry.segment_sight import are_clear
from ...geometry.world import World, world_from_polygon
from .lattice import BLOCKED, CLEAR, Lattice, Moves, are_free, clear_moves, free_nodes
from .planes import FOR_EVER, TILE

# Points on a quarter of the circle round a node.
QUADRANT = 16


class Spots(NamedTuple):
    """Points that have to be seen for a node near a wall.

    Attributes:
        points: Shape (n, 2) [m].
        nodes: Row and column of the node that each belongs to, shape (n, 2).
    """

    points: np.ndarray
    nodes: np.ndarray


class WallPlaces(NamedTuple):
    """Places at walls that are represented by the nodes beside them.

    Attributes:
        points: Shape (n, 2) [m].
        along: Direction of the wall, free space to its left, shape (n, 2), no unit.
        nodes: Row and column of the node, shape (n, 2).
    """

    points: np.ndarray
    along: np.ndarray
    nodes: np.ndarray


NO_WALL_PLACES = WallPlaces(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 2), dtype=np.int64))


def wall_places(grid: Lattice, free: np.ndarray, region: EdgeIndex, reach: float) -> WallPlaces:
    """Project nodes nearer than a cell to a wall onto that wall.

    The strip along a wall that a corner hides from a pursuer nearly in line with it is often
    thinner than a cell, so that no node lies in it. But an evader may run along the wall, in it.

    Edges shorter than two of the evader's steps get no places, nor do walls thinner than that:
    from the middle the evader would be round either end in one step. The pursuer, which moves
    first, could answer neither, although in reality it is faster, and each such wall would count
    as lost.

    Args:
        grid: The evader's grid.
        free: Its nodes, shape (rows, columns), bool.
        region: Edges of its region.
        reach: Longest distance that it moves in a step [m].
    """
    h, points, along, nodes = grid.spacing, [], [], []
    for _, _, ax, ay, bx, by in region.edges:
        low = np.floor((np.minimum([ay, ax], [by, bx]) - [grid.y, grid.x]) / h - 1.0).astype(int)
        high = np.ceil((np.maximum([ay, ax], [by, bx]) - [grid.y, grid.x]) / h + 2.0).astype(int)
        low, high = np.maximum(low, 0), np.maximum(high, 0)
        near = np.argwhere(free[low[0] : high[0], low[1] : high[1]]) + low
        start, way = np.array([ax, ay]), np.array([bx - ax, by - ay])
        length = math.hypot(*way)
        if length < 2.0 * reach:
            continue
        offset = grid.at(*near.T) - start
        along_wall = offset @ way / length
        aside = (way[0] * offset[:, 1] - way[1] * offset[:, 0]) / length
        # With a tolerance for rounding, so that a mirrored world gives the mirrored places.
        little = 1e-9 * h
        beside = (aside >= -little) & (aside <= h - little)
        beside &= (along_wall >= little) & (along_wall <= length - little)
        feet = start + along_wall[beside, None] * way / length
        across = feet + 2.0 * reach * np.array([way[1], -way[0]]) / length
        thick = ~are_free(region, across)
        beside[beside] = thick
        points.append(feet[thick])
        along.append(np.tile(way / length, (int(beside.sum()), 1)))
        nodes.append(near[beside])
    if not points:
        return NO_WALL_PLACES
    found = WallPlaces(*(np.concatenate(each) for each in (points, along, nodes)))
    # Leave out places behind another wall.
    clear = are_clear(region, grid.at(*found.nodes.T), found.points)
    return WallPlaces(*(each[clear] for each in found))


def ways(
    grid: Lattice, free: np.ndarray, region: EdgeIndex, offsets: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Where a pursuer may go from each node.

    Args:
        grid: The pursuer's.
        free: Its nodes, shape (rows, columns), bool.
        region: Edges of where it can be.
        offsets: What it may do in a step, shape (k, 2) [cells].

    Returns:
        Where the list of each node begins, and the numbers of nodes in those lists.
    """
    numbers = np.cumsum(free).reshape(free.shape) - 1
    nodes = np.argwhere(free)
    clear = clear_moves(grid, free, nodes, region, offsets)
    ends = nodes[:, None] + offsets
    starts = np.append(0, np.cumsum((clear == CLEAR).sum(axis=1)))
    return starts, numbers[tuple(ends[clear == CLEAR].T)]


def all_ways(grid: Lattice, nodes: np.ndarray, moves: Moves) -> tuple[np.ndarray, np.ndarray]:
    """Where a followed pursuer may go: to all nodes within its moves, regardless of walls.

    Args:
        grid: The pursuer's.
        nodes: Those on which it is followed, shape (rows, columns), bool.
        moves: What it may do in a step.

    Returns:
        Where the list of each node begins, and the numbers of nodes in those lists.
    """
    reach = moves.reach
    numbers = np.where(nodes, np.cumsum(nodes).reshape(nodes.shape) - 1, -1)
    numbers = np.pad(numbers, reach, constant_values=-1)
    rows, columns = np.nonzero(nodes)
    offsets = moves.offsets
    found = numbers[rows[:, None] + reach + offsets[:, 0], columns[:, None] + reach + offsets[:, 1]]
    starts = np.append(0, np.cumsum((found >= 0).sum(axis=1)))
    return starts, found[found >= 0]


def connected_share(
    grid: Lattice,
    free: np.ndarray,
    regions: Sequence[World],
    starts: np.ndarray,
    neighbours: np.ndarray,
) -> float:
    """Fraction of the nodes that belong to the largest connected group of their region.

    Args:
        grid: The pursuer's.
        free: Its nodes, shape (rows, columns), bool.
        regions: The parts of its region.
        starts, neighbours: From `ways`, shapes (n + 1,), (w,).
    """
    n = len(starts) - 1
    parts = np.zeros(n, dtype=int)
    for number, region in enumerate(regions[1:], start=1):
        parts[free_nodes(grid, build_edge_index(region))[free]] = number
    graph = csr_array((np.ones(len(neighbours), dtype=bool), neighbours, starts), shape=(n, n))
    _, groups = connected_components(graph, directed=False)
    largest = np.zeros(parts.max() + 1, dtype=int)
    _, first, sizes = np.unique(groups, return_index=True, return_counts=True)
    # No way leads from one part of the region to another.
    np.maximum.at(largest, parts[first], sizes)
    return float(largest.sum()) / n


def beside_walls(
    grid: Lattice, free: np.ndarray, region: EdgeIndex, moves: Moves
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """List evader nodes from which a wall blocks moves, where the nodes of each tile begin in the
    list, and the moves that are left; see `Rules`.

    Args:
        grid: The evader's.
        free: Its nodes, shape (rows, columns), bool.
        region: Edges of where it can be.
        moves: What it may do in a step.
    """
    nodes = np.argwhere(free).astype(np.int32)
    clear = clear_moves(grid, free, nodes, region, moves.offsets)
    beside = (clear == BLOCKED).any(axis=1)
    nodes, clear = nodes[beside], clear[beside] == CLEAR
    return _by_tiles(grid, nodes, clear, moves.offsets)


def no_walls(grid: Lattice, moves: Moves) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What `beside_walls` returns where no wall blocks a move; see `Rules`.

    Args:
        grid: The evader's.
        moves: What it may do in a step.
    """
    offsets = moves.offsets
    nodes, clear = np.zeros((0, 2), dtype=np.int32), np.zeros((0, len(offsets)), dtype=bool)
    return _by_tiles(grid, nodes, clear, offsets)


def _by_tiles(
    grid: Lattice, nodes: np.ndarray, clear: np.ndarray, offsets: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sort nodes beside walls by tiles; see `Rules`.

    Args:
        grid: The evader's.
        nodes: Row and column of each, shape (n, 2).
        clear: Which moves are left, shape (n, k), bool.
        offsets: Of the moves, shape (k, 2) [cells].
    """
    rows, columns = (-(-size // TILE) for size in (grid.rows, grid.columns))
    tile = nodes[:, 0] // TILE * columns + nodes[:, 1] // TILE
    order = np.argsort(tile, kind="stable")
    last = np.cumsum(clear[order].sum(axis=1))
    first = np.append(0, last[:-1]) if len(last) else last
    listed = np.column_stack([nodes[order], first, last]).astype(np.int64)
    starts = np.searchsorted(tile[order], np.arange(rows * columns + 1))
    left = np.broadcast_to(offsets, (len(nodes), *offsets.shape))[clear[order]]
    return listed, starts, left.astype(np.int64)


def nodes_near(grid: Lattice, regions: Sequence[World], slack: float) -> np.ndarray:
    """Nodes within the slack of a player's region, shape (rows, columns), bool.

    Args:
        grid: The player's grid.
        regions: Where it can be.
        slack: Largest distance [m].
    """
    free = shapely.union_all([region.polygon for region in regions])
    shapely.prepare(free)
    # Up to rounding.
    return np.asarray(shapely.dwithin(free, shapely.points(grid.points), slack * (1.0 + 1e-9)))


def nodes_by_rim(grid: Lattice, regions: Sequence[World], radius: float) -> np.ndarray:
    """Nodes within a radius of the boundary of a player's region, shape (rows, columns), bool.

    Args:
        grid: The player's.
        regions: Where it can be.
        radius: [m].
    """
    rim = shapely.union_all([region.polygon for region in regions]).boundary
    shapely.prepare(rim)
    return np.asarray(shapely.dwithin(rim, shapely.points(grid.points), radius * (1.0 + 1e-9)))


def nodes_to_follow(
    grid: Lattice, regions: Sequence[World], slack: float
) -> tuple[np.ndarray, Spots]:
    """Nodes within the slack of the evaders' region, and points to be seen for those near walls.

    If a node is in sight, and no ray along which sight ends comes near, its whole disc is in
    sight. But walls may cut the disc into pieces; then one point of each piece has to be seen.

    Args:
        grid: The evader's grid.
        regions: Where it can be.
        slack: Radius of a disc [m].

    Returns:
        The nodes, shape (rows, columns), bool; and the points.
    """
    free = shapely.union_all([region.polygon for region in regions])
    points = np.asarray(shapely.points(grid.points))
    follow = nodes_near(grid, regions, slack)
    rim = free.boundary
    shapely.prepare(rim)
    cut = follow & shapely.dwithin(rim, points, slack)
    # A circumscribed polygon, so that no piece is missed.
    wide = slack / math.cos(math.pi / (4 * QUADRANT)) * (1.0 + 1e-9)
    pieces = shapely.intersection(free, shapely.buffer(points[cut], wide, quad_segs=QUADRANT))
    parts, owners = shapely.get_parts(pieces, return_index=True)
    whole = shapely.area(parts) > 0.0
    spots = shapely.get_coordinates(shapely.point_on_surface(parts[whole]))
    return follow, Spots(spots, np.argwhere(cut)[owners[whole]])


def without_thin_obstacles(world: World, thickness: float) -> tuple[World, ...]:
    """The world with thin obstacles grown, so that none fits between two lines of sight.

    Args:
        world: Whose obstacles block sight.
        thickness: Least thickness of an obstacle [m].

    Returns:
        The free region's parts.

    Raises:
        InvalidInput: No free region is left.
    """
    grown = []
    for ring in world.obstacles:
        obstacle = shapely.Polygon(ring)
        thin = thickness - _thickness(obstacle)
        if thin > 0.0:
            grown.append(obstacle.buffer(0.5 * thin, join_style="mitre"))
    if not grown:
        return (world,)
    free = world.polygon.difference(shapely.union_all(grown))
    parts = [part for part in shapely.get_parts(free) if part.area > world.tolerance * world.size]
    require(len(parts) > 0, "grid", "be finer, so that obstacles leave room", thickness)
    return tuple(world_from_polygon(part) for part in parts)


def _thickness(obstacle: shapely.Polygon) -> float:
    """Least width of an obstacle's convex hull [m]."""
    hull = shapely.get_coordinates(obstacle.convex_hull)[:-1]
    edges = np.roll(hull, -1, axis=0) - hull
    normals = np.column_stack([-edges[:, 1], edges[:, 0]]) / np.hypot(*edges.T)[:, None]
    return float(np.ptp(normals @ hull.T, axis=1).min())


def padded(evader_nodes: np.ndarray, moves: Moves) -> np.ndarray:
    """Mask of nodes where no evader can be, in whole tiles with a rim; see `Rules.blocked`.

    Args:
        evader_nodes: Where it can be, shape (rows, columns), bool.
        moves: What it may do in a step.
    """
    rows, columns = evader_nodes.shape
    reach = moves.reach
    whole = [-(-size // TILE) * TILE + 2 * reach for size in (rows, columns)]
    blocked = np.full(whole, FOR_EVER, dtype=np.uint8)
    inner = blocked[reach : reach + rows, reach : reach + columns]
    inner[evader_nodes] = 0
    return blocked
