"""A tracking run as a ROS 2 bag."""

import json
from dataclasses import asdict
from pathlib import Path

from ..rosbag.bag import RosBag
from .run import TrackingRun
from .summary import log_arrays, units_of

TEAMS = ("pursuer", "evader")


def write_tracking_rosbag(run: TrackingRun, folder: Path) -> None:
    """Write a run: `/world`, `/tf`, each robot's velocity, and every array of the log.

    Robots are points to the log: their frames `pursuer_0`, ... are never turned. The arrays of
    `log.npz` are in `/log/<name>`, the same to the last bit.

    Args:
        run: A finished run.
        folder: Must not exist.

    Raises:
        InvalidInput: The package `rosbags` is not installed.
    """
    about = {"scenario": json.dumps(asdict(run.game.scenario)), "units": json.dumps(units_of(run))}
    arrays = {name: values for name, values in log_arrays(run).items() if name != "time"}
    with RosBag(folder, about) as bag:
        bag.world(run.game.world)
        for sample, time in enumerate(run.times.tolist()):
            bag.transforms(
                time,
                {
                    f"{team}_{number}": (x, y, 0.0)
                    for team in TEAMS
                    for number, (x, y) in enumerate(run.log[f"{team}_position"][sample])
                },
            )
            for team in TEAMS:
                for number, (vx, vy) in enumerate(run.log[f"{team}_velocity"][sample]):
                    bag.twist(f"/{team}_{number}/velocity", time, "world", vx, vy, 0.0)
            for name, values in arrays.items():
                bag.numbers(f"/log/{name}", time, values[sample])
