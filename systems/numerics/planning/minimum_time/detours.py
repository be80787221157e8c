"""Short routes of a point among obstacles: where a vehicle might pass."""

import heapq
import math
from collections.abc import Sequence

import numpy as np
import shapely

from ...geometry.world import World

# Routes keep this many times the clearance away, so that the solver starts in free space.
_EXTRA = 1.1


def detours(
    world: World, clearance: float, start: Sequence[float], end: Sequence[float]
) -> list[np.ndarray]:
    """Routes along corners of the obstacles, the shortest first.

    For every corner there is the shortest route through it; of routes with no obstacle between
    them, the shortest is kept.

    Args:
        world: With the obstacles.
        clearance: Least distance from them [m]; less where the ends are nearer.
        start: x, y [m].
        end: x, y [m].

    Returns:
        Polylines from start to end, shape (n, 2) each; empty if there is no way.
    """
    free = world.polygon.buffer(-_EXTRA * clearance, join_style="mitre")
    corners = np.unique(shapely.get_coordinates(free), axis=0)
    nodes = np.vstack([np.array([start, end], dtype=float), corners])
    one, other = np.triu_indices(len(nodes), 1)
    lines = np.asarray(shapely.linestrings(np.stack([nodes[one], nodes[other]], axis=1)))
    # The ends may be nearer to a wall than the clearance: lines from there only keep out of it.
    roomy = shapely.covers(free.buffer(1e-6 * world.size), lines)
    legal = np.where(one < 2, shapely.covers(world.polygon, lines), roomy)
    lengths = np.full((len(nodes), len(nodes)), np.inf)
    lengths[one[legal], other[legal]] = lengths[other[legal], one[legal]] = shapely.length(
        lines[legal]
    )
    from_start, before = _shortest(lengths, 0)
    from_end, after = _shortest(lengths, 1)
    routes: dict[tuple[int, ...], float] = {}
    for via in np.argsort(from_start + from_end).tolist():
        total = float(from_start[via] + from_end[via])
        if math.isfinite(total):
            route = [*_chain(before, via)[::-1], *_chain(after, via)[1:]]
            if len(set(route)) == len(route):
                routes.setdefault(tuple(route), total)
    kept: list[np.ndarray] = []
    for route in sorted(routes, key=lambda route: routes[route]):
        line = nodes[list(route)]
        if all(_obstacle_between(world, line, each) for each in kept):
            kept.append(line)
    return kept


def _obstacle_between(world: World, line: np.ndarray, other: np.ndarray) -> bool:
    """Whether two routes with the same ends enclose something that is not free."""
    loop = np.vstack([line, other[-2:0:-1]])
    if len(loop) < 3:
        return False
    enclosed = shapely.make_valid(shapely.Polygon(loop))
    return enclosed.difference(world.polygon).area > 1e-6 * world.free_area


def _shortest(lengths: np.ndarray, source: int) -> tuple[np.ndarray, list[int]]:
    """Dijkstra's distances from a node, and the node before each on the way."""
    best, before = np.full(len(lengths), np.inf), [-1] * len(lengths)
    best[source] = 0.0
    queue = [(0.0, source)]
    while queue:
        distance, node = heapq.heappop(queue)
        if distance > best[node]:
            continue
        for next_node in np.flatnonzero(np.isfinite(lengths[node])).tolist():
            longer = distance + float(lengths[node, next_node])
            if longer < best[next_node]:
                best[next_node], before[next_node] = longer, node
                heapq.heappush(queue, (longer, next_node))
    return best, before


def _chain(before: list[int], node: int) -> list[int]:
    """From a node back to the source."""
    chain = [node]
    while before[chain[-1]] >= 0:
        chain.append(before[chain[-1]])
    return chain
