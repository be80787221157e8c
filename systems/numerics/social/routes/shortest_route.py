"""Shortest routes by Dijkstra's algorithm, between end points that the graph does not keep.

An end point costs one sight test per corner; no test between corners is ever repeated.

Source: Zhang 2014, Algorithm 4; Dijkstra, Numerische Mathematik 1 (1959), 269-271.
"""

from dataclasses import dataclass

import numpy as np

from ...compiled import compiled, kernel
from ...errors import require, require_non_negative
from ...geometry.edge_index import EdgeIndex
from ...geometry.segment_sight import segment_is_clear
from .route_graph import RouteGraph


@dataclass(frozen=True, eq=False)
class Route:
    """A way between two points, or that there is none.

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

    An end in a grown obstacle is led by the nearest free point; a way ends there, but begins at
    the start itself, as far as it may be from free space.

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
                # Sight of an end is tested when it is asked for, and only where it would help.
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
    """Whether a segment comes nearer to a point than it may."""
    ex, ey = bx - ax, by - ay
    square = ex * ex + ey * ey
    for k in range(len(blocks)):
        px, py = blocks[k, 0] - ax, blocks[k, 1] - ay
        t = min(1.0, max(0.0, (px * ex + py * ey) / square)) if square > 0.0 else 0.0
        if np.hypot(px - t * ex, py - t * ey) < reach[k] - 1e-9:
            return True
    return False
