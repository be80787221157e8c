"""Hausdorff distance between two outlines made of straight edges."""

import numpy as np
import shapely


def hausdorff_distance(rings: list[np.ndarray], others: list[np.ndarray], accuracy: float) -> float:
    """Largest distance from a point of either outline to the other outline [cells].

    It need not be at a vertex. Along a straight piece the distance to ONE edge of the other
    outline is convex, so the distance to that outline is nowhere larger than the larger of the
    two ends' distances to the same edge. Pieces for which this bound, taken with the edge nearest
    to either end, exceeds the largest distance found so far are halved.

    Args:
        rings, others: Closed rings without repeated ends, each shape (n, 2) [cells].
        accuracy: The result is at most this much below the true value [cells].
    """
    return max(_directed(rings, others, accuracy), _directed(others, rings, accuracy))


def _edges(rings: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    return np.concatenate(rings), np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])


def _directed(rings: list[np.ndarray], others: list[np.ndarray], accuracy: float) -> float:
    edges = np.asarray(shapely.linestrings(np.stack(_edges(others), axis=1)))
    tree = shapely.STRtree(edges)
    start, end = _edges(rings)
    largest = 0.0
    while len(start):
        bound = np.full(len(start), np.inf)
        tips = shapely.points(start), shapely.points(end)
        for tip in tips:
            nearest = edges[tree.query_nearest(tip, all_matches=False)[1]]
            away = [shapely.distance(other, nearest) for other in tips]
            largest = max(largest, float(shapely.distance(tip, nearest).max()))
            bound = np.minimum(bound, np.maximum(*away))
        open_ = bound > largest + accuracy
        start, end = start[open_], end[open_]
        middle = (start + end) / 2
        start, end = np.concatenate([start, middle]), np.concatenate([middle, end])
    return largest
