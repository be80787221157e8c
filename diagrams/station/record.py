"""How a run of the laboratory is written down, and what other tools see of it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..rosbag.bag import RosBag
from ..tracking.game import TrackingGame
from .hardware import McapRunWriter, RunWriter
from .ports import SENT
from .scenario import StationScenario

# Of a robot's pose, x, y [m] and heading [rad], and of its command [m/s] and [rad/s].
_POSE, _COMMAND = 3, 2
# How the name of a log in MCAP ends.
_MCAP = ".mcap"


class RobotTopics:
    """Robots as ROS 2 has them: `/world`, `/tf`, and what each was sent, `/<robot>/command`.

    Robots are the frames `pursuer_0`, ..., at their poses as the motion capture had them.

    Args:
        scenario: The laboratory.
        game: Its game, set up.
    """

    def __init__(self, scenario: StationScenario, game: TrackingGame) -> None:
        teams = scenario.tracking
        self._robots = [f"pursuer_{number}" for number in range(teams.pursuers.size)]
        self._robots += [f"evader_{number}" for number in range(teams.evaders.size)]
        self._world = game.world

    def begin(self, bag: RosBag) -> None:
        """Write the outlines of the world.

        Args:
            bag: To which they are written.
        """
        bag.world(self._world)

    def tick(self, bag: RosBag, time: float, samples: Mapping[str, np.ndarray]) -> None:
        """Write poses and commands.

        Args:
            bag: To which they are written.
            time: [s].
            samples: Of every port of a station, each of shape (size,).
        """
        poses = np.concatenate(
            [samples[f"{team}.poses"] for team in ("pursuer", "evader")]
        ).reshape(-1, _POSE)
        bag.transforms(time, dict(zip(self._robots, poses.tolist(), strict=True)))
        commands = samples[SENT].reshape(-1, _COMMAND).tolist()
        for robot, (speed, turn) in zip(self._robots, commands, strict=True):
            bag.twist(f"/{robot}/command", time, robot, speed, 0.0, turn)


def open_run_writer(
    path: Path,
    scenario: StationScenario,
    game: TrackingGame,
    *,
    ports: Mapping[str, int],
    pictures: tuple[str, ...],
    memory: Mapping[str, int],
    about: Mapping[str, Any],
) -> RunWriter | McapRunWriter:
    """What writes a run of a station: as MCAP if the name ends so.

    Args:
        path: Of the log; must not exist.
        scenario: The laboratory.
        game: Its game, set up.
        ports: Sizes of the ports by name.
        pictures: Names of the ports of pictures.
        memory: Sizes of what the diagram keeps, by name.
        about: What else is to be known, ready for JSON.

    Raises:
        InvalidInput: The file exists or cannot be written, or the extra is not installed.
    """
    if path.suffix == _MCAP:
        return McapRunWriter(
            path,
            ports=ports,
            pictures=pictures,
            memory=memory,
            about=about,
            beside=RobotTopics(scenario, game),
        )
    return RunWriter(path, ports=ports, pictures=pictures, memory=memory, about=about)
