"""From the outline of a region to a closed line that a combine can drive."""

import numpy as np
import shapely

# Spacing of a loop's points, in radii.
STEP = 1 / 16

# Rounds of averaging before the line is taken as it is; one brings arcs in by 0.4 % of the radius.
MOST_ROUNDS = 40


def drivable_loop(region: shapely.Polygon, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """The outline of a region, clockwise, bent nowhere more than a radius allows.

    The region's corners have been rounded to a larger radius; what kinks are left, as between
    the chords of an arc, are spread by averaging neighbours as long as there are some.

    Args:
        region: Its exterior is taken.
        radius: Least turning radius [m].

    Returns:
        points: Without the first repeated, shape (n, 2) [m].
        headings: Continuous along the loop, shape (n,) [rad].
    """
    ring = shapely.remove_repeated_points(region.exterior, 1e-6)
    outline = np.array(ring.coords)[:-1]
    if shapely.is_ccw(ring):
        outline = outline[::-1]
    points = _resampled(outline, radius * STEP)
    for _ in range(MOST_ROUNDS):
        if np.abs(_curvature(points)).max() <= 0.995 / radius:
            break
        points = np.mean([np.roll(points, k, axis=0) for k in range(-2, 3)], axis=0)
    chords = np.roll(points, -1, axis=0) - points
    courses = np.unwrap(np.arctan2(chords[:, 1], chords[:, 0]))
    turns = np.round((courses[0] - courses[-1]) / (2 * np.pi))
    before = np.concatenate([[courses[-1] + 2 * np.pi * turns], courses[:-1]])
    return points, (before + courses) / 2


def _resampled(ring: np.ndarray, step: float) -> np.ndarray:
    """Points at equal ways along a closed line."""
    closed = np.vstack([ring, ring[:1]])
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    count = max(16, int(np.ceil(way[-1] / step)))
    at = way[-1] * np.arange(count) / count
    return np.stack([np.interp(at, way, column) for column in closed.T], axis=1)


def _curvature(points: np.ndarray) -> np.ndarray:
    """Turn at each point of a closed line over the mean of its two chords [1/m]."""
    after = np.roll(points, -1, axis=0) - points
    before = points - np.roll(points, 1, axis=0)
    turn = np.arctan2(
        before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0], (before * after).sum(axis=1)
    )
    return 2 * turn / (np.hypot(*before.T) + np.hypot(*after.T))
