"""Small pieces of wiring that the modes of a station share."""

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import (
    ConstantVectorSource,
    Demultiplexer,
    MatrixGain,
    Multiplexer,
)

from .scenario import StationScenario


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
    builder.AddNamedSystem(f"{name}_of_teams", split)
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
    joined = builder.AddNamedSystem(f"{name}_of_all", Multiplexer([port.size() for port in both]))
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
    return builder.AddNamedSystem(name, source).get_output_port()


def select(builder: DiagramBuilder, name: str, port: OutputPort, entries: list[int]) -> OutputPort:
    """Some entries of a port, in the order given.

    Args:
        builder: Of the diagram.
        name: Of the subsystem.
        port: From which.
        entries: Which.
    """
    gain = MatrixGain(D=np.eye(port.size())[entries])  # type: ignore[arg-type]  # the stubs lag behind NumPy's
    builder.AddNamedSystem(name, gain)
    builder.Connect(port, gain.get_input_port())
    return gain.get_output_port()
