"""How a run of the laboratory is written down, and what other tools see of it.

What the diagram keeps from tick to tick is written too, so that a replay goes on after a gap.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from pydrake.systems.framework import Context, Diagram, DiscreteValues, System

from ..rosbag.bag import RosBag
from ..tracking.game import TrackingGame
from .hardware import McapRunWriter, RunWriter, without_password
from .ports import SENT
from .scenario import StationScenario


class Memory:
    """The discrete state of systems, each by its path.

    Args:
        systems: Of a diagram, which may be built later, with all below them.
    """

    def __init__(self, systems: Sequence[System]) -> None:
        self._systems: dict[str, System] = {}
        self.sizes: dict[str, int] = {}
        for path, system in _leaves(systems, ""):
            size = _joined(system.AllocateDiscreteVariables()).size
            if size:
                self._systems[path], self.sizes[path] = system, size

    def read(self, root: Context) -> np.ndarray:
        """Everything in the order of `sizes`, shape (sum of the sizes,).

        Args:
            root: Of the whole diagram.
        """
        parts = [
            _joined(system.GetMyContextFromRoot(root).get_discrete_state())
            for system in self._systems.values()
        ]
        return np.concatenate([np.empty(0), *parts])

    def write(self, root: Context, values: Mapping[str, np.ndarray]) -> None:
        """Put back what is known of systems that are here and of the same size.

        Args:
            root: Of the whole diagram.
            values: By path, as many numbers each as the size.
        """
        for path, system in self._systems.items():
            known = values.get(path)
            if known is None or len(known) != self.sizes[path]:
                continue
            context = system.GetMyMutableContextFromRoot(root)
            at = 0
            for k in range(context.num_discrete_state_groups()):
                size = context.get_discrete_state(k).size()
                vector = context.get_mutable_discrete_state(k)
                vector.SetFromVector(known[at : at + size])  # type: ignore[arg-type]  # the stubs lag behind NumPy's
                at += size


def _leaves(systems: Sequence[System], prefix: str) -> Iterator[tuple[str, System]]:
    for system in systems:
        path = f"{prefix}/{system.get_name()}"
        if isinstance(system, Diagram):
            yield from _leaves(system.GetSystems(), path)
        else:
            yield path, system


def _joined(values: DiscreteValues) -> np.ndarray:
    groups = [values.get_vector(k).value() for k in range(values.num_groups())]
    return np.concatenate([np.empty(0), *groups])


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


def station_tree(scenario: StationScenario, game: TrackingGame) -> dict[str, Any]:
    """A laboratory as nested mappings, complete without any file, for `build`.

    Passwords of the camera are left out: nobody who reads a log shall look through it.
    """
    tree = asdict(scenario)
    tree["omni_camera"]["place"] = without_password(tree["omni_camera"]["place"])
    world = game.world
    if scenario.tracking.world.file:
        tree["tracking"]["world"] = {
            "boundary": world.boundary.tolist(),
            "obstacles": [ring.tolist() for ring in world.obstacles],
        }
    return tree
