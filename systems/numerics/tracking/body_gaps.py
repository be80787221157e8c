"""Gaps between robots' bodies: from a log of positions, and along a path among moving robots.

Source: ours; closest approach of points in uniform motion.
"""

import numpy as np


def pair_gaps(positions: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Gap between the bodies of each pair [m], negative where they overlap.

    Args:
        positions: Of all robots, shape (..., N, 2) [m].
        radii: Theirs, shape (N,) [m].

    Returns:
        Shape (..., N (N - 1) / 2); pairs in the order of `numpy.triu_indices`.
    """
    first, second = np.triu_indices(len(radii), 1)
    offsets = positions[..., first, :] - positions[..., second, :]
    return np.hypot(offsets[..., 0], offsets[..., 1]) - radii[first] - radii[second]


def gaps_between_samples(positions: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Least gap of each pair between consecutive samples, with straight motion in between [m].

    Args:
        positions: Shape (T, N, 2) [m].
        radii: Shape (N,) [m].

    Returns:
        Shape (T - 1, N (N - 1) / 2).
    """
    first, second = np.triu_indices(len(radii), 1)
    offsets = positions[:, first] - positions[:, second]
    start, change = offsets[:-1], np.diff(offsets, axis=0)
    square = np.einsum("tpk,tpk->tp", change, change)
    towards = -np.einsum("tpk,tpk->tp", start, change)
    moment = np.clip(np.divide(towards, square, out=np.zeros_like(square), where=square > 0), 0, 1)
    nearest = start + moment[..., None] * change
    return np.hypot(nearest[..., 0], nearest[..., 1]) - radii[first] - radii[second]


def count_contacts(gaps: np.ndarray) -> int:
    """Count how often a pair that did not overlap before begins to overlap.

    Args:
        gaps: Over time, from `gaps_between_samples`, shape (T, pairs) [m].
    """
    overlaps = gaps < 0.0
    return int(overlaps[:1].sum() + (overlaps[1:] & ~overlaps[:-1]).sum())


# Gaps along a path, for choosing among paths. A path is sampled, so a gap may be a little less
# between two samples. `collision_stop` is what guarantees that robots do not touch.

# Number of samples along a path.
SAMPLES = 9


def gap_to_runners(
    start: np.ndarray,
    end: np.ndarray,
    seconds: tuple[float, float],
    runners: np.ndarray,
    contacts: np.ndarray,
    top_speed: float,
) -> float:
    """Least gap on a path to robots that may move anywhere [m]; negative if they may be hit.

    Args:
        start, end: Of the path, shape (2,) [m].
        seconds: Times at which the robot starts and arrives [s].
        runners: Positions of the others at time 0, shape (m, 2) [m].
        contacts: Distance at which bodies touch, shape (m,) [m].
        top_speed: Of the others; 0 if they stand [m/s].
    """
    if len(runners) == 0:
        return np.inf
    parts = np.linspace(0.0, 1.0, SAMPLES)
    times = seconds[0] + parts * (seconds[1] - seconds[0])
    path = start + parts[:, None] * (end - start)
    apart = np.hypot(*(path[:, None] - runners).T)
    return float((apart - contacts[:, None] - top_speed * times).min())


def gap_to_paths(
    start: np.ndarray, end: np.ndarray, paths: np.ndarray, contacts: np.ndarray
) -> float:
    """Least gap between a path and the straight paths of others, regardless of timing [m].

    Args:
        start, end: Of the path, shape (2,) [m].
        paths: Starts and ends of the others, shape (k, 4) [m].
        contacts: Distance at which bodies touch, shape (k,) [m].
    """
    if len(paths) == 0:
        return np.inf
    points = start + np.linspace(0.0, 1.0, SAMPLES)[:, None] * (end - start)
    low, way = paths[:, :2], paths[:, 2:] - paths[:, :2]
    length = np.maximum((way**2).sum(axis=1), 1e-300)
    along = np.clip(((points[:, None] - low) * way).sum(axis=2) / length, 0.0, 1.0)
    apart = np.hypot(*(points[:, None] - low - along[:, :, None] * way).T)
    return float((apart - contacts[:, None]).min())
