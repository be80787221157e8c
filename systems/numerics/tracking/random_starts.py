"""Random starts of two teams in a world, with every evader in some pursuer's sight."""

import numpy as np
import shapely

from ..errors import InvalidInput
from ..geometry.edge_index import EdgeIndex, build_edge_index
from ..geometry.segment_sight import are_clear
from ..geometry.world import World

# Draws for one team member before the world is called too crowded.
MAX_DRAWS = 200

# Distance kept between two robots at the start, in sums of their radii.
SPACING = 1.1


def draw_starts(
    world: World,
    pursuer_region: World,
    evader_region: World,
    *,
    pursuer_radius: float,
    evader_radius: float,
    pursuers: int,
    evaders: int,
    seed: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Draw starting points uniformly, evaders among the points that the pursuers see.

    Args:
        world: Whose obstacles block sight.
        pursuer_region, evader_region: Where centres may be: parts of the shrunk world.
        pursuer_radius, evader_radius: Radii of the bodies, which do not overlap [m].
        pursuers, evaders: Sizes of the teams.
        seed: Same seed, same starts.

    Returns:
        Positions, shapes (pursuers, 2) and (evaders, 2) [m].

    Raises:
        InvalidInput: No room was found for one of the robots.
    """
    rng = np.random.default_rng(seed)
    index = build_edge_index(world)
    taken = np.zeros((0, 3))
    for i in range(pursuers):
        point = _draw(rng, pursuer_region, taken, pursuer_radius, None, index)
        if point is None:
            raise InvalidInput(f"`pursuers` must fit into the world; no room for number {i}")
        taken = np.vstack([taken, np.array([*point, pursuer_radius])])
    viewers = taken[:, :2].copy()
    for j in range(evaders):
        point = _draw(rng, evader_region, taken, evader_radius, viewers, index)
        if point is None:
            raise InvalidInput(
                f"`evaders` must fit where a pursuer sees them; no room for number {j}"
            )
        taken = np.vstack([taken, np.array([*point, evader_radius])])
    return viewers, taken[pursuers:, :2].copy()


def _draw(
    rng: np.random.Generator,
    region: World,
    taken: np.ndarray,
    radius: float,
    viewers: np.ndarray | None,
    index: EdgeIndex,
) -> np.ndarray | None:
    """One point of a region, clear of the robots already placed and, if asked for, seen."""
    low, high = region.bounds[:2], region.bounds[2:]
    shapely.prepare(region.polygon)
    for _ in range(MAX_DRAWS):
        points = rng.uniform(low, high, (64, 2))
        points = points[shapely.contains_properly(region.polygon, shapely.points(points))]
        for point in points:
            gaps = np.hypot(*(taken[:, :2] - point).T)
            if (gaps <= SPACING * (taken[:, 2] + radius)).any():
                continue
            if viewers is None:
                return point
            if are_clear(index, viewers, np.broadcast_to(point, viewers.shape)).any():
                return point
    return None
