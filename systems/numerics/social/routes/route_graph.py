"""The visibility graph of grown obstacles, which stays while end points come and go.

The nodes are the corners round which a way can bend: the reflex vertices of the free region for
robots' centres. (Zhang 2014, 2.3.4.3, takes all vertices; no shortest way touches the others.)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
import shapely.ops

from ...errors import require
from ...geometry.edge_index import EdgeIndex, build_edge_index, point_is_free
from ...geometry.segment_sight import are_clear
from ...geometry.world import World


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
    index = build_edge_index(*regions)
    nodes = np.concatenate([region.corners.points for region in regions]).reshape(-1, 2)
    lengths = np.full((len(nodes), len(nodes)), np.inf)
    i, j = np.triu_indices(len(nodes), 1)
    clear = are_clear(index, nodes[i], nodes[j])
    distances = np.hypot(*(nodes[i] - nodes[j]).T)
    lengths[i[clear], j[clear]] = lengths[j[clear], i[clear]] = distances[clear]
    np.fill_diagonal(lengths, 0.0)
    return RouteGraph(tuple(regions), index, nodes, lengths)
