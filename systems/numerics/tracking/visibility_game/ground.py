"""What the two players of the visibility game stand on: nodes, the ways between them, and walls."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely

from ...errors import require
from ...geometry.edge_index import EdgeIndex
from ...geometry.world import World, world_from_polygon
from .lattice import Lattice, Moves, clear_moves
from .sweeps import FOR_EVER, TILE

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


def ways(
    grid: Lattice, free: np.ndarray, region: EdgeIndex, moves: Moves
) -> tuple[np.ndarray, np.ndarray]:
    """Where a pursuer may go from each node.

    Args:
        grid: The pursuer's.
        free: Its nodes, shape (rows, columns), bool.
        region: Edges of where it can be.
        moves: What it may do in a step.

    Returns:
        Where the list of each node begins, and the numbers of nodes in those lists.
    """
    numbers = np.cumsum(free).reshape(free.shape) - 1
    found, clear = clear_moves(grid, free, region, moves.offsets)
    found = found[clear]
    source = numbers[found[:, 0], found[:, 1]]
    starts = np.searchsorted(source, np.arange(free.sum() + 1))
    return starts, numbers[found[:, 2], found[:, 3]]


def beside_walls(
    grid: Lattice, free: np.ndarray, region: EdgeIndex, moves: Moves
) -> tuple[np.ndarray, np.ndarray]:
    """Evader nodes from which a wall blocks moves, and the moves that are left; see `Rules`.

    Args:
        grid: The evader's.
        free: Its nodes, shape (rows, columns), bool.
        region: Edges of where it can be.
        moves: What it may do in a step.
    """
    found, clear = clear_moves(grid, free, region, moves.offsets)
    number = found[:, 0] * grid.columns + found[:, 1]
    beside = np.isin(number, number[~clear]) & clear
    found, number = found[beside], number[beside]
    nodes, first = np.unique(number, return_index=True)
    last = np.append(first[1:], len(found)) if len(nodes) else first
    listed = np.column_stack([nodes // grid.columns, nodes % grid.columns, first, last])
    return listed.astype(np.int64), (found[:, 2:] - found[:, :2]).astype(np.int64)


def nodes_to_follow(
    grid: Lattice, regions: Sequence[World], slack: float
) -> tuple[np.ndarray, Spots]:
    """Nodes within the slack of where evaders can be, and what has to be seen of those by walls.

    All of a node's disc is in sight if the node is, and no ray along which sight ends comes near;
    but walls may cut the disc, and then one point of each piece has to be seen.

    Args:
        grid: The evader's.
        regions: Where it can be.
        slack: Radius of a disc [m].

    Returns:
        The nodes, shape (rows, columns), bool; and the points.
    """
    free = shapely.union_all([region.polygon for region in regions])
    shapely.prepare(free)
    points = np.asarray(shapely.points(grid.points))
    follow = np.asarray(shapely.dwithin(free, points, slack))
    rim = free.boundary
    shapely.prepare(rim)
    cut = follow & shapely.dwithin(rim, points, slack)
    # Circumscribed, so that no piece is forgotten.
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
        thickness: What each obstacle is to have at least [m].

    Returns:
        The free region's parts.

    Raises:
        InvalidInput: Nothing is left of it.
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
    """Where no evader can be, in whole tiles with a rim; see `Rules`.

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
