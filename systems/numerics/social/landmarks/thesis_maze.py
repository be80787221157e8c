"""The thesis's maze, and a placement of landmarks so that pictures show one or, better, two.

The maze is the 8 ft x 8 ft one of Zhang 2014, 2.3.4, with our own obstacles, as its figure is not a
plan.
"""

import math

import numpy as np
import shapely

from ...errors import InvalidInput, require
from ...geometry.edge_index import build_edge_index
from ...geometry.segment_sight import are_clear
from ...geometry.world import World, make_world
from .maze import Landmark, Maze

# Spacing of candidates along a wall, and distance between a landmark and the wall's end [m].
_STEP, _MARGIN = 0.04, 0.02
# Views that are counted: approximate number of grid points, and headings at each.
_POINTS, _HEADINGS = 400, 12
# A landmark serves a view between these distances, in sides, at up to this angle off its normal,
# when its middle is up to this angle off the camera's axis [rad].
_NEAREST, _FARTHEST = 2.0, 8.0
_OBLIQUE, _OFF_AXIS = math.radians(60), math.radians(25)
# Worth of each further landmark in a view, relative to the one before.
_WORTH = 0.3


def hang_landmarks(
    world: World, count: int, *, side: float = 0.26, middle_height: float = 0.18
) -> tuple[Landmark, ...]:
    """Place landmarks one by one, each where it adds most over all views.

    Args:
        world: World whose rings are the walls.
        count: How many.
        side, middle_height: Of each landmark [m].

    Raises:
        InvalidInput: The walls have no room for so many.
    """
    require(count >= 1, "count", "be at least 1", count)
    candidates = np.vstack([_candidates(ring, side) for ring in world.rings])
    serves = _serves(world, candidates, side)
    seen = np.zeros(serves.shape[1:])
    free = np.ones(len(candidates), dtype=bool)
    chosen: list[int] = []
    while len(chosen) < count:
        if not free.any():
            raise InvalidInput(
                f"`count` must fit on walls of {side:g} m and more; got {count}, "
                f"room for {len(chosen)}"
            )
        gain = np.tensordot(serves, _WORTH**seen, axes=2)
        best = int(np.argmax(np.where(free, gain, -1.0)))
        chosen.append(best)
        seen += serves[best]
        # Two landmarks on one wall must not overlap.
        apart = np.hypot(*(candidates[:, :2] - candidates[best, :2]).T)
        beside = np.cos(candidates[:, 2] - candidates[best, 2]) > 0.99
        free &= ~(beside & (apart < side + _MARGIN))
    return tuple(
        Landmark(
            number=number,
            x=float(x),
            y=float(y),
            facing=float(facing),
            side=side,
            middle_height=middle_height,
        )
        for number, (x, y, facing) in enumerate(candidates[chosen])
    )


def _candidates(ring: np.ndarray, side: float) -> np.ndarray:
    """Places along a ring: x, y [m], facing [rad]; shape (n, 3)."""
    found = []
    for start, end in zip(ring, np.roll(ring, -1, axis=0), strict=True):
        length = math.hypot(*(end - start))
        room = length - side - 2 * _MARGIN
        if room < 0:
            continue
        along = (end - start) / length
        # Free space lies to the left.
        facing = math.atan2(along[0], -along[1])
        # From the wall's middle outwards, so that the middle wins ties.
        offsets = np.linspace(-0.5 * room, 0.5 * room, 2 * math.ceil(0.5 * room / _STEP) + 1)
        for offset in sorted(offsets.tolist(), key=abs):
            found.append((*(0.5 * (start + end) + offset * along), facing))
    return np.array(found).reshape(-1, 3)


def _serves(world: World, candidates: np.ndarray, side: float) -> np.ndarray:
    """Whether each candidate serves each view, shape (candidates, points, headings), as 0 or 1."""
    low, high = world.bounds[:2], world.bounds[2:]
    step = math.sqrt(world.free_area / _POINTS)
    axes = [np.arange(a + 0.5 * step, b, step) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    points = grid[shapely.contains_xy(world.polygon, grid)]
    offset = points[None] - candidates[:, None, :2]
    distance = np.hypot(offset[..., 0], offset[..., 1])
    bearing = np.arctan2(offset[..., 1], offset[..., 0])
    good = (distance >= _NEAREST * side) & (distance <= _FARTHEST * side)
    good &= np.cos(bearing - candidates[:, None, 2]) >= math.cos(_OBLIQUE)
    rows, columns = np.nonzero(good)
    normals = np.column_stack([np.cos(candidates[:, 2]), np.sin(candidates[:, 2])])
    # Slightly in front of the wall, so that the wall itself does not block the view.
    ends = candidates[rows, :2] + 1e-6 * world.size * normals[rows]
    good[rows, columns] = are_clear(build_edge_index(world), points[columns], ends)
    headings = 2 * math.pi * np.arange(_HEADINGS) / _HEADINGS
    # `bearing` leads from the landmark to the point; the view looks the opposite way.
    turned = np.cos(bearing[..., None] + math.pi - headings) >= math.cos(_OFF_AXIS)
    return (good[..., None] & turned).astype(float)


FOOT = 0.3048
SIDE = 8 * FOOT
LANDMARKS = 13


def thesis_maze() -> Maze:
    """The maze with its thirteen landmarks.

    Passages are at least 0.35 m wide: two robots of 0.1 m radius cannot pass each other
    everywhere, but each can go everywhere.
    """
    obstacles = [
        # An angle, a spur from the north wall, a short wall, a block and a wedge.
        [[0.5, 1.5], [1.0, 1.5], [1.0, 1.6], [0.6, 1.6], [0.6, 1.95], [0.5, 1.95]],
        [[1.3, 1.9], [1.4, 1.9], [1.4, SIDE], [1.3, SIDE]],
        [[1.8, 1.25], [1.9, 1.25], [1.9, 1.75], [1.8, 1.75]],
        [[1.4, 0.5], [1.8, 0.5], [1.8, 0.85], [1.4, 0.85]],
        [[0.5, 0.45], [0.95, 0.6], [0.6, 0.95]],
    ]
    world = make_world([[0, 0], [SIDE, 0], [SIDE, SIDE], [0, SIDE]], obstacles)
    return Maze(world=world, landmarks=hang_landmarks(world, LANDMARKS))
