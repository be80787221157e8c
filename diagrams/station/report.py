"""What a run on a station leaves in its folder beside its log: numbers, arrays, a plot."""

from pathlib import Path

import numpy as np

from ..tracking.game import TrackingGame
from ..tracking.report import write_report
from ..tracking.run import LOGGED, TrackingRun
from ..tracking.summary import summarise
from .hardware import RunLog
from .ports import SENT
from .run import StationRun


def tracking_run(run: StationRun, log: RunLog, game: TrackingGame) -> TrackingRun:
    """The run as a run of `sightfield track`, whose samples are what the station knew."""
    pursuers = game.scenario.pursuers.size
    shapes = dict.fromkeys(LOGGED, (-1, 2))
    shapes |= {"visibility": (pursuers, -1), "assignment": (-1,)}
    arrays = {
        name: log.samples[f"tracking.{name}"].reshape(len(log.times), *shape)
        for name, shape in shapes.items()
    }
    arrays["visibility"] = arrays["visibility"] > 0.5
    arrays["assignment"] = np.rint(arrays["assignment"]).astype(int)
    return TrackingRun(
        game=game,
        times=log.times,
        log=arrays,
        tracking_time=run.tracking_time,
        lost_evader=run.lost_evader,
        wall_time=run.wall_time,
        scene=None,
    )


def summarise_station(
    run: StationRun, log: RunLog, game: TrackingGame, scenario: str, seconds: float, mode: str
) -> dict[str, object]:
    """The run in numbers, ready for JSON.

    Args:
        run: How it went.
        log: What its ports said.
        game: What was played.
        scenario: Its name.
        seconds: The station's horizon [s].
        mode: How it was played.

    Returns:
        What `summarise` says, with the station's horizon, and: mode, ended (how the run did),
        ticks (samples in the log), poses_valid (part of all poses that were), pose_age (mean and
        greatest of those seen) [s],
        link_quality (mean of each robot, from 0 to 1, null if never known), ranges_valid (part of
        all infrared ranges that were), top_command (fastest that was sent) [m/s].
    """
    valid = np.concatenate([log.samples[f"{team}.valid"] for team in ("pursuer", "evader")], axis=1)
    ages = np.concatenate([log.samples[f"{team}.age"] for team in ("pursuer", "evader")], axis=1)
    seen = ages[np.isfinite(ages)]
    quality = log.samples["radio.quality"].mean(axis=0)
    speeds = np.abs(log.samples[SENT][:, ::2])
    return {
        **summarise(tracking_run(run, log, game), scenario),
        "seconds": seconds,
        "mode": mode,
        "ended": run.how,
        "ticks": len(log.times),
        "poses_valid": float(valid.mean()),
        "pose_age": [float(seen.mean()), float(seen.max())] if len(seen) else None,
        "link_quality": [float(each) if np.isfinite(each) else None for each in quality],
        "ranges_valid": float(log.samples["infrared.valid"].mean()),
        "top_command": float(speeds.max()),
    }


def write_station_report(
    run: StationRun, log: RunLog, game: TrackingGame, summary: dict[str, object], folder: Path
) -> list[str]:
    """Write `summary.json`, arrays with their units, and `tracks.png`; return the names."""
    return write_report(tracking_run(run, log, game), summary, folder)
