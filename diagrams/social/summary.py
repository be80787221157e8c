"""A search in a few numbers, and in arrays for whoever wants to look closer."""

import itertools

import numpy as np

from ...systems.numerics.geometry.clearance import clearances
from ...systems.numerics.geometry.edge_index import build_edge_index
from .run import SocialRun

# Units of the arrays in the log; "1" for numbers without one.
UNITS = {
    "time": "s",
    "pose": "m, m, rad",
    "connected": "1",
    "waiting": "1",
    "requests_sent": "1",
    "pictures_scanned": "1",
    "locations": "1",
    "evader_position": "m",
    "evader_covariance": "m^2",
    "located_at": "s",
    "route": "m",
}


def summarise_search(run: SocialRun, scenario: str, network: str = "memory") -> dict[str, object]:
    """The search in numbers, ready for JSON.

    Args:
        run: A finished one.
        scenario: What to call it.
        network: Which network it used.

    Returns:
        scenario, network, seed, agents (their number), seconds (horizon) [s];
        time_to_first_location (until the pursuer knew where the evader was, None if it never did)
        [s]; locations (how often the evader was located anew); location_error (of each location,
        from where the evader was in that picture: median and 90 % quantile, None without any) [m];
        tracking_error (of the estimate held, from where the evader was at the same time: median and
        90 % quantile from the first location on) [m]; pursuer_distance (from the evader, median
        from the first location on) [m]; connected_fraction (of the time, for each agent),
        all_connected_fraction; requests_sent, pictures_scanned; collisions (of robots with walls or
        each other: occasions, not samples), min_wall_gap and min_robot_gap (from rim to wall, from
        rim to rim) [m]; wall_time [s], realtime_factor.
    """
    game, log, times = run.game, run.log, run.times
    located = run.located
    known = log["located_at"] >= 0
    evader, pursuer = log["pose"][known, 1, :2], log["pose"][known, 0, :2]
    wall_gaps, robot_gaps = gaps(run)
    return {
        "scenario": scenario,
        "network": network,
        "seed": game.scenario.seed,
        "agents": game.scenario.agents.size,
        "seconds": game.scenario.seconds,
        "time_to_first_location": float(times[located[0]]) if len(located) else None,
        "locations": int(log["locations"][-1]),
        "location_error": _quantiles(run.location_errors),
        "tracking_error": _quantiles(np.hypot(*(log["evader_position"][known] - evader).T)),
        "pursuer_distance": float(np.median(np.hypot(*(pursuer - evader).T)))
        if known.any()
        else None,
        "connected_fraction": log["connected"].mean(axis=0).tolist(),
        "all_connected_fraction": float(log["connected"].all(axis=1).mean()),
        "requests_sent": int(log["requests_sent"][-1]),
        "pictures_scanned": int(log["pictures_scanned"][-1]),
        "collisions": _occasions(wall_gaps < 0) + _occasions(robot_gaps < 0),
        "min_wall_gap": float(wall_gaps.min()),
        "min_robot_gap": float(robot_gaps.min()),
        "wall_time": run.wall_time,
        "realtime_factor": float(times[-1]) / run.wall_time,
    }


def gaps(run: SocialRun) -> tuple[np.ndarray, np.ndarray]:
    """How near robots were: from each robot's rim to the walls, shape (T, N), and from rim to rim
    of each pair, shape (T, N (N - 1) / 2) [m]."""
    positions, radius = run.log["pose"][:, :, :2], run.game.maze.robot_radius
    index = build_edge_index(run.game.maze.world)
    walls = clearances(index, positions.reshape(-1, 2)).reshape(positions.shape[:2]) - radius
    pairs = itertools.combinations(range(positions.shape[1]), 2)
    between = [np.hypot(*(positions[:, i] - positions[:, j]).T) - 2 * radius for i, j in pairs]
    return walls, np.stack(between, axis=1)


def log_arrays(run: SocialRun) -> dict[str, np.ndarray]:
    """The run's samples by the names in UNITS, time along every array's first axis."""
    return {"time": run.times, **run.log}


def _quantiles(errors: np.ndarray) -> dict[str, float] | None:
    if errors.size == 0:
        return None
    return {"median": float(np.median(errors)), "p90": float(np.quantile(errors, 0.9))}


def _occasions(touching: np.ndarray) -> int:
    """How often a touch begins, over all columns of samples, shape (T, n) bool."""
    return int((touching & ~np.vstack([np.zeros_like(touching[:1]), touching[:-1]])).sum())
