"""Room along a straight path among robots that move meanwhile.

For choosing among paths: a path is looked at in samples, so a gap may be a little less between two
of them. That robots do not touch is the rule of `collision_stop`.

Source: ours.
"""

import numpy as np

# Places along a path.
SAMPLES = 9


def gap_to_runners(
    start: np.ndarray,
    end: np.ndarray,
    seconds: tuple[float, float],
    runners: np.ndarray,
    contacts: np.ndarray,
    top_speed: float,
) -> float:
    """Least gap on a path to robots that may run anywhere [m]; negative where they may be met.

    Args:
        start, end: Of the path, shape (2,) [m].
        seconds: When the robot sets off, and when it arrives [s].
        runners: Where the others are at time 0, shape (m, 2) [m].
        contacts: Distance at which bodies touch, shape (m,) [m].
        top_speed: Of the others; 0 for what is there if they stand [m/s].
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
    """Least gap between a path and straight paths of others, at whatever times [m].

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
