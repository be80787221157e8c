"""Shortest routes among grown obstacles: the regions, their visibility graph, Dijkstra's algorithm.

Obstacles are grown with round corners: mitred corners would close the maze's passages. An arc is
approximated by a polygon outside the true circle, so that no robot's centre comes too near to a
wall. The nodes of the graph are the corners round which a route can bend: the reflex vertices of
the free region. (Zhang 2014, 2.3.4.3, takes all vertices; no shortest route touches the others.)
The graph is built once: each new end point costs one sight test per corner, and tests between
corners are never repeated.

Source: Zhang 2014, Algorithm 4; Dijkstra, Numerische Mathematik 1 (1959), 269-271.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
import shapely.ops

from ...compiled import compiled, kernel
from ...errors import InvalidInput, require, require_non_negative, require_positive
from ...geometry.edge_index import EdgeIndex, index_regions, point_is_free
from ...geometry.segment_sight import are_clear, segment_is_clear
from ...geometry.world import World, world_from_polygon

# Sides of a quarter of a circle.
_SIDES = 4
# The polygon of an arc goes round the circle; GEOS simplifies a little before it offsets.
_OUTER = 1.01 / math.cos(math.pi / (4 * _SIDES))


def rounded_regions(world: World, distance: float) -> tuple[World, ...]:
    """The free region without all points nearer to a wall than a distance [m].

    Returns:
        Its parts, largest first.

    Raises:
        InvalidInput: The distance is not positive, or leaves no free space.
    """
    require_positive("distance", distance)
    free = world.polygon.buffer(-_OUTER * distance, quad_segs=_SIDES)
    parts = [part for part in shapely.get_parts(free) if part.area > world.tolerance**2]
    if not parts:
        raise InvalidInput(f"`distance` must leave free space in the world; got {distance}")
    parts.sort(key=lambda part: -part.area)
    return tuple(world_from_polygon(part) for part in parts)


@dataclass(frozen=True, eq=False)
class RouteGraph:
    """The static part of the graph; make one with `build_route_graph`.

    Attributes:
        regions: Where centres may be, from `shrink_world`.
        index: Their edges.
        nodes: Corners, shape (k, 2) [m].
        lengths: Between corners in sight of each other, infinite elsewhere, shape (k, k) [m].
    """

    regions: tuple[World, ...]
    index: EdgeIndex
    nodes: np.ndarray
    lengths: np.ndarray

    @cached_property
    def free(self) -> shapely.MultiPolygon:
        """The regions as one geometry."""
        return shapely.MultiPolygon([region.polygon for region in self.regions])

    def nearest_free(self, point: np.ndarray) -> np.ndarray:
        """The point of the regions that is nearest to a point, shape (2,) [m]."""
        x, y = float(point[0]), float(point[1])
        if point_is_free(self.index, x, y):
            return np.array([x, y])
        found = shapely.ops.nearest_points(self.free, shapely.Point(x, y))[0]
        return np.array([found.x, found.y])


def build_route_graph(regions: Sequence[World]) -> RouteGraph:
    """Connect all corners of regions that see each other.

    Args:
        regions: Free regions for robots' centres, no two of them overlapping.

    Raises:
        InvalidInput: There is no region.
    """
    require(len(regions) > 0, "regions", "hold a region at least", "none")
    index = index_regions("regions", regions)
    nodes = np.concatenate([region.corners.points for region in regions]).reshape(-1, 2)
    lengths = np.full((len(nodes), len(nodes)), np.inf)
    i, j = np.triu_indices(len(nodes), 1)
    clear = are_clear(index, nodes[i], nodes[j])
    distances = np.hypot(*(nodes[i] - nodes[j]).T)
    lengths[i[clear], j[clear]] = lengths[j[clear], i[clear]] = distances[clear]
    np.fill_diagonal(lengths, 0.0)
    return RouteGraph(tuple(regions), index, nodes, lengths)


@dataclass(frozen=True, eq=False)
class Route:
    """Result of a search for a way between two points.

    Attributes:
        points: Corners of the way, ends included, shape (m, 2), m >= 1 [m]; the start alone where
            there is no way.
        length: [m]; infinite where there is no way.
        found: Whether there is a way.
    """

    points: np.ndarray
    length: float
    found: bool


def shortest_route(
    graph: RouteGraph,
    start: object,
    goal: object,
    *,
    avoid: object = (),
    distance: float = 0.0,
) -> Route:
    """The shortest way from start to goal.

    An end inside a grown obstacle is replaced by the nearest free point; the route still begins at
    the given start, but ends at the replaced goal.

    Args:
        graph: From `build_route_graph`.
        start, goal: Shape (2,) [m].
        avoid: Points that stand in the way for a while, shape (m, 2) [m]. The way passes each at
            `distance` or more, or, if it begins or ends nearer, comes no nearer than that.
        distance: [m].

    Raises:
        InvalidInput: An end is no finite point, or the distance is negative.
    """
    require_non_negative("distance", distance)
    blocks = np.asarray(avoid, dtype=float).reshape(-1, 2)
    ends = []
    for name, end in (("start", start), ("goal", goal)):
        point = np.asarray(end, dtype=float)
        require(
            point.shape == (2,) and bool(np.isfinite(point).all()),
            name,
            "be a finite point [x, y]",
            end,
        )
        ends.append(point)
    first, last = (graph.nearest_free(end) for end in ends)
    if np.array_equal(first, last):
        between = np.array([first])
    else:
        reach = np.full(len(blocks), float(distance))
        for end in (first, last):
            reach = np.minimum(reach, np.hypot(*(blocks - end).T))
        order = _dijkstra(graph.index, graph.nodes, graph.lengths, first, last, blocks, reach)
        if len(order) == 0:
            return Route(ends[0].reshape(1, 2), np.inf, False)
        between = np.concatenate([graph.nodes, [first, last]])[order]
    if not np.array_equal(ends[0], first):
        between = np.vstack([ends[0], between])
    return Route(between, float(np.hypot(*np.diff(between, axis=0).T).sum()), True)


@compiled
def _dijkstra(
    index: EdgeIndex,
    nodes: np.ndarray,
    lengths: np.ndarray,
    start: np.ndarray,
    goal: np.ndarray,
    blocks: np.ndarray,
    reach: np.ndarray,
) -> np.ndarray:
    """Nodes of the shortest way in order; the start is node k, the goal k + 1; empty: no way."""
    count = len(nodes)
    distance = np.full(count + 2, np.inf)
    previous = np.full(count + 2, -1)
    done = np.zeros(count + 2, dtype=np.bool_)
    points = np.concatenate((nodes, start.reshape((1, 2)), goal.reshape((1, 2))))
    distance[count] = 0.0
    while True:
        near = -1
        for i in range(count + 2):
            if not done[i] and distance[i] < np.inf and (near < 0 or distance[i] < distance[near]):
                near = i
        if near < 0 or near == count + 1:
            break
        done[near] = True
        for i in range(count + 2):
            if done[i]:
                continue
            if near < count and i < count:
                length = lengths[near, i]
            else:
                # Sight from or to an end is tested only if it would shorten the way.
                length = np.hypot(points[i, 0] - points[near, 0], points[i, 1] - points[near, 1])
                if distance[near] + length < distance[i] and not segment_is_clear(
                    index, points[near, 0], points[near, 1], points[i, 0], points[i, 1]
                ):
                    length = np.inf
            if distance[near] + length < distance[i] and not _is_blocked(
                points[near, 0], points[near, 1], points[i, 0], points[i, 1], blocks, reach
            ):
                distance[i] = distance[near] + length
                previous[i] = near
    if distance[count + 1] == np.inf:
        return np.empty(0, dtype=np.int64)
    order = [count + 1]
    while order[-1] != count:
        order.append(previous[order[-1]])
    return np.array(order[::-1])


@kernel
def _is_blocked(
    ax: float, ay: float, bx: float, by: float, blocks: np.ndarray, reach: np.ndarray
) -> bool:
    """Whether a segment comes nearer to one of the points than the point's `reach`."""
    ex, ey = bx - ax, by - ay
    square = ex * ex + ey * ey
    for k in range(len(blocks)):
        px, py = blocks[k, 0] - ax, blocks[k, 1] - ay
        t = min(1.0, max(0.0, (px * ex + py * ey) / square)) if square > 0.0 else 0.0
        if np.hypot(px - t * ex, py - t * ey) < reach[k] - 1e-9:
            return True
    return False
