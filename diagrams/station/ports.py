"""The ports of a station, the same in every mode, and small pieces of wiring between them."""

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import (
    ConstantVectorSource,
    Demultiplexer,
    MatrixGain,
    Multiplexer,
)

from ...systems.drake_parts import add_named
from .scenario import StationScenario

COMMANDS = "team.velocity_commands"
SENT = "team.sent_commands"
IMAGE = "omni_camera.image"
MODE = "operator.mode"
STARTS_SAID = "operator.starts_said"
VIEW_AGE = "operator.view_age"
STANDING, REASON, CLOCK = "supervisor.standing", "supervisor.reason", "supervisor.clock"

# Sensors of a robot.
INFRARED = 4


def device_ports(scenario: StationScenario) -> dict[str, int]:
    """Size of every port that a device fills, by name, in the order in which data flows.

    Poses are x, y [m], heading [rad]; `.valid` is 1 or 0; `.age` is the age at the last tick and
    `.stamp` the time at which it was taken [s]; ranges [m], battery [V], quality from 0 to 1; state
    and flags as robots report them, and counts of the left and right encoder.
    """
    sizes: dict[str, int] = {}
    teams = {"pursuer": scenario.tracking.pursuers.size, "evader": scenario.tracking.evaders.size}
    for team, count in teams.items():
        sizes[f"{team}.poses"] = 3 * count
        sizes |= {f"{team}.{name}": count for name in ("valid", "age", "stamp")}
    sizes |= {f"omni_camera.{name}": 1 for name in ("valid", "age", "stamp")}
    sizes["infrared.ranges"] = INFRARED * scenario.size
    sizes |= {f"infrared.{name}": scenario.size for name in ("valid", "age")}
    sizes |= {f"radio.{name}": scenario.size for name in ("quality", "battery", "state", "flags")}
    sizes["radio.counts"] = 2 * scenario.size
    sizes |= {MODE: 1, STARTS_SAID: 1, VIEW_AGE: 1}
    return sizes


def supervisor_ports(scenario: StationScenario) -> dict[str, int]:
    """Size of every port that the supervisor fills and a log holds, by name.

    Numbers of Standing and of Reason for each robot, and the time for which robots have run [s].
    """
    return {STANDING: scenario.size, REASON: scenario.size, CLOCK: 1}


def believed_ports(scenario: StationScenario) -> dict[str, int]:
    """Size of the ports of poses as far as they are believed, by name [m], [m], [rad]."""
    teams = scenario.tracking
    return {
        "pursuer.believed_poses": 3 * teams.pursuers.size,
        "evader.believed_poses": 3 * teams.evaders.size,
    }


def split_teams(
    builder: DiagramBuilder, scenario: StationScenario, name: str, port: OutputPort, width: int = 1
) -> dict[str, OutputPort]:
    """Split a port of all robots, `width` numbers each, into those of the two teams.

    Args:
        builder: Of the diagram.
        scenario: With the sizes of the teams.
        name: Of the subsystem.
        port: Of all robots.
        width: Numbers of a robot.
    """
    pursuers, evaders = scenario.tracking.pursuers.size, scenario.tracking.evaders.size
    split = Demultiplexer([width * pursuers, width * evaders])
    add_named(builder, f"{name}_of_teams", split)
    builder.Connect(port, split.get_input_port())
    return {
        f"pursuer.{name}": split.get_output_port(0),
        f"evader.{name}": split.get_output_port(1),
    }


def join_teams(builder: DiagramBuilder, name: str, ports: dict[str, OutputPort]) -> OutputPort:
    """Join a port of the pursuers and one of the evaders, as of `pursuer.poses`.

    Args:
        builder: Gets the joint.
        name: Of the joint.
        ports: By name, as `pursuer.poses` and `evader.poses`.
    """
    both = [ports[f"{team}.{name}"] for team in ("pursuer", "evader")]
    joined = add_named(builder, f"{name}_of_all", Multiplexer([port.size() for port in both]))
    for k, port in enumerate(both):
        builder.Connect(port, joined.get_input_port(k))
    return joined.get_output_port()


def constant(builder: DiagramBuilder, name: str, values: np.ndarray) -> OutputPort:
    """A port that always says the same.

    Args:
        builder: Of the diagram.
        name: Of the subsystem.
        values: What it says, shape (size,).
    """
    source = ConstantVectorSource(values)  # type: ignore[arg-type]  # the stubs want a list
    return add_named(builder, name, source).get_output_port()


def select(builder: DiagramBuilder, name: str, port: OutputPort, entries: list[int]) -> OutputPort:
    """Some entries of a port, in the order given.

    Args:
        builder: Of the diagram.
        name: Of the subsystem.
        port: From which.
        entries: Which.
    """
    gain = MatrixGain(D=np.eye(port.size())[entries])  # type: ignore[arg-type]  # the stubs lag behind NumPy's
    add_named(builder, name, gain)
    builder.Connect(port, gain.get_input_port())
    return gain.get_output_port()
