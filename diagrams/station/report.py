"""What a run on a station leaves in its folder beside its log: numbers, arrays, a plot."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...systems.numerics.station.supervision import transitions, view_is_gone
from ..tracking.game import TrackingGame
from ..tracking.report import summarise_tracking, write_tracking_report
from ..tracking.run import LOGGED, TrackingRun
from .hardware import RunLog
from .ports import REASON, SENT, STANDING, VIEW_AGE
from .run import StationRun

# No evader has so high a number.
_MANY = 1e6


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
    known = np.isfinite(arrays["assignment"]) & (np.abs(arrays["assignment"]) < _MANY)
    arrays["assignment"] = np.rint(np.where(known, arrays["assignment"], -1)).astype(int)
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
        What `summarise_tracking` says, with the station's horizon, and: mode, ended (how the run
        did), ticks (samples in the log), poses_valid (part of all poses that were), pose_age (mean
        and greatest of those seen) [s],
        events (each time, robot and text: what the supervisor made of robots when), faults (how
        many of these were that something was wrong, and losses of the operator's view),
        link_quality (mean of each robot, from 0 to 1, null if never known), ranges_valid (part of
        all infrared ranges that were), top_command (fastest that was sent) [m/s]. What is not
        finite is None.
    """
    # A device may have said anything; what comes of it is None.
    with np.errstate(over="ignore", invalid="ignore"):
        return _finite(_numbers(run, log, game, scenario, seconds, mode))


def _numbers(
    run: StationRun, log: RunLog, game: TrackingGame, scenario: str, seconds: float, mode: str
) -> dict[str, object]:
    valid = np.concatenate([log.samples[f"{team}.valid"] for team in ("pursuer", "evader")], axis=1)
    ages = np.concatenate([log.samples[f"{team}.age"] for team in ("pursuer", "evader")], axis=1)
    seen = ages[np.isfinite(ages)]
    quality = log.samples["radio.quality"].mean(axis=0)
    speeds = np.abs(log.samples[SENT][:, ::2])
    events = events_of(log, game)
    if run.failure:
        events.append(RunEvent(float(log.times[-1]), "", run.failure, True))
    return {
        **summarise_tracking(tracking_run(run, log, game), scenario),
        "seconds": seconds,
        "mode": mode,
        "ended": run.how,
        "ticks": len(log.times),
        "poses_valid": float(valid.mean()),
        "events": [vars(each) for each in events],
        "faults": sum(each.fault for each in events),
        "pose_age": [float(seen.mean()), float(seen.max())] if len(seen) else None,
        "link_quality": [float(each) for each in quality],
        "ranges_valid": float(log.samples["infrared.valid"].mean()),
        "top_command": float(speeds.max()),
    }


@dataclass(frozen=True)
class RunEvent:
    """Something that the supervisor noticed.

    Attributes:
        time: In the run [s].
        robot: Name of the robot, "" where it is of all.
        text: What happened.
        fault: Whether something was wrong.
    """

    time: float
    robot: str
    text: str
    fault: bool


def events_of(log: RunLog, game: TrackingGame) -> list[RunEvent]:
    """What the supervisor noticed in a run, in order.

    Args:
        log: Of the run.
        game: What was played.
    """
    teams = game.scenario
    names = [f"pursuer{i}" for i in range(teams.pursuers.size)]
    names += [f"evader{j}" for j in range(teams.evaders.size)]
    gone = view_is_gone(log.samples[VIEW_AGE][:, 0])
    events: list[RunEvent] = []
    before = None
    for k, time in enumerate(log.times.tolist()):
        now = (log.samples[STANDING][k], log.samples[REASON][k])
        events += [RunEvent(time, *each) for each in transitions(names, before, now)]
        if gone[k] != (k > 0 and gone[k - 1]):
            text = "the operator's view is gone" if gone[k] else "the operator's view is back"
            events.append(RunEvent(time, "", text, bool(gone[k])))
        before = now
    return events


def _finite(value: Any) -> Any:
    """The same, with None for every number that JSON does not know."""
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_station_report(
    run: StationRun, log: RunLog, game: TrackingGame, summary: dict[str, object], folder: Path
) -> list[str]:
    """Write `summary.json`, arrays with their units, and `tracks.png`; return the names."""
    with np.errstate(over="ignore", invalid="ignore"):
        return write_tracking_report(tracking_run(run, log, game), summary, folder)
