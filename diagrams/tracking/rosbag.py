"""A tracking run as a ROS 2 bag in one file."""

import json
from dataclasses import asdict
from pathlib import Path

from ..rosbag.bag import RosBag
from .run import TrackingRun
from .summary import log_arrays, units_of

TEAMS = ("pursuer", "evader")


def write_tracking_rosbag(run: TrackingRun, path: Path) -> None:
    """Write a run: `/world`, `/tf`, each robot's velocity, and every array of the log.

    Robots are points to the log: their frames `pursuer_0`, ... are never turned. The arrays of
    `log.npz` are in `/log/<name>`, the same to the last bit.

    Args:
        run: A finished run.
        path: Of the MCAP file; must not exist.

    Raises:
        InvalidInput: The file exists, cannot be written, or the extra is not installed.
    """
    about = {"scenario": asdict(run.game.scenario), "units": units_of(run)}
    arrays = {name: values for name, values in log_arrays(run).items() if name != "time"}
    with RosBag(path) as bag:
        bag.about(json.dumps(about))
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
