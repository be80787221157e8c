"""A run of the laboratory as a ROS 2 bag."""

import json
from pathlib import Path

import numpy as np

from ..rosbag.bag import RosBag
from .ports import IMAGE, SENT
from .replay import Recording

# Of a robot's pose, x, y [m] and heading [rad], and of its command [m/s] and [rad/s].
_POSE, _COMMAND = 3, 2


def write_station_rosbag(recording: Recording, folder: Path) -> None:
    """Write a recorded run: `/world`, `/tf`, what each robot was sent, pictures, and every port.

    Robots are the frames `pursuer_0`, ..., at their poses as the motion capture had them. The
    samples of the ports are in `/log/<port>`, with `/` for its dots, the same to the last bit.

    Args:
        recording: Of a station, as far as its log tells.
        folder: Must not exist.

    Raises:
        InvalidInput: The package `rosbags` is not installed.
    """
    log = recording.log
    teams = {
        "pursuer": recording.scenario.tracking.pursuers.size,
        "evader": recording.scenario.tracking.evaders.size,
    }
    robots = [f"{team}_{number}" for team, size in teams.items() for number in range(size)]
    poses = np.concatenate([log.samples[f"{team}.poses"] for team in teams], axis=1)
    poses = poses.reshape(len(log.times), len(robots), _POSE)
    commands = log.samples[SENT].reshape(len(log.times), len(robots), _COMMAND)
    with RosBag(folder, {"about": json.dumps(log.about)}) as bag:
        bag.world(recording.game.world)
        for sample, time in enumerate(log.times.tolist()):
            bag.transforms(time, dict(zip(robots, poses[sample].tolist(), strict=True)))
            for robot, (speed, turn) in zip(robots, commands[sample], strict=True):
                bag.twist(f"/{robot}/command", time, robot, speed, 0.0, turn)
            for name, values in log.samples.items():
                bag.numbers(f"/log/{name.replace('.', '/')}", time, values[sample])
        for time, png in log.pictures.get(IMAGE, []):
            bag.picture(f"/{IMAGE.replace('.', '/')}", time, "omni_camera", png)
