"""A team of robots behind walls, with the same ports whatever its robots are."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import DiagramBuilder, InputPort, OutputPort

from ...systems.numerics.geometry.world import World
from ...systems.tracking.agent_team import AgentTeam
from ...systems.tracking.differential_drive_team import DifferentialDriveTeam
from ...systems.tracking.heading_controller import HeadingController
from ...systems.tracking.wall_sliding import WallSliding
from ...systems.tracking.wall_stop import WallStop
from .scenario import Team


@dataclass(frozen=True, eq=False)
class TeamPorts:
    """How a team is wired.

    Attributes:
        velocity: Input, desired velocities, size 2 N [m/s].
        position: Output, positions, size 2 N [m].
        direction: Output, vectors along the headings, size 2 N; zero for a point at rest.
    """

    velocity: InputPort
    position: OutputPort
    direction: OutputPort


def AddTeam(
    builder: DiagramBuilder,
    name: str,
    team: Team,
    starts: ArrayLike,
    regions: Sequence[World],
    period: float,
) -> TeamPorts:
    """Add a team that stays in its regions, and what drives it, to a diagram.

    Args:
        builder: Of the diagram.
        name: Prefix of the subsystems' names.
        team: What robots it has.
        starts: Poses, shape (N, 3) [m], [m], [rad].
        regions: Where centres may be.
        period: Time step [s].
    """
    starts = np.asarray(starts, dtype=float)
    add, connect, count = builder.AddNamedSystem, builder.Connect, len(starts)
    walls = add(f"{name}_wall_sliding", WallSliding(regions, count=count, period=period))
    velocity = walls.GetInputPort("velocity")
    safe_velocity = walls.GetOutputPort("safe_velocity")
    if team.model == "point":
        points = AgentTeam(starts[:, :2], top_speed=team.top_speed, time_step=period)
        plant = add(f"{name}_team", points)
        connect(safe_velocity, plant.GetInputPort("velocity"))
        connect(plant.GetOutputPort("position"), walls.GetInputPort("position"))
        return TeamPorts(velocity, plant.GetOutputPort("position"), safe_velocity)
    limits = {"top_speed": team.top_speed, "top_turn_rate": team.top_turn_rate}
    plant = add(f"{name}_team", DifferentialDriveTeam(starts, time_step=period, **limits))
    command = AddDrive(
        builder,
        name,
        team,
        regions,
        period,
        velocity=safe_velocity,
        pose=plant.GetOutputPort("pose"),
    )
    connect(plant.GetOutputPort("position"), walls.GetInputPort("position"))
    connect(command, plant.GetInputPort("command"))
    return TeamPorts(velocity, plant.GetOutputPort("position"), plant.GetOutputPort("direction"))


def AddDrive(
    builder: DiagramBuilder,
    name: str,
    team: Team,
    regions: Sequence[World],
    period: float,
    *,
    velocity: OutputPort,
    pose: OutputPort,
) -> OutputPort:
    """Add what turns velocities of points into commands of differential drives.

    Args:
        builder, name, team, regions, period: As of `AddTeam`.
        velocity: Velocities that slide along the walls, size 2 N [m/s].
        pose: Poses of the robots, size 3 N [m], [m], [rad].

    Returns:
        Commands that stop short of walls, size 2 N [m/s], [rad/s].
    """
    add, connect, count = builder.AddNamedSystem, builder.Connect, velocity.size() // 2
    limits = {"top_speed": team.top_speed, "top_turn_rate": team.top_turn_rate}
    heading = add(f"{name}_heading", HeadingController(count, gain=team.heading_gain))
    stop = add(f"{name}_wall_stop", WallStop(regions, count=count, period=period, **limits))
    connect(pose, heading.GetInputPort("pose"))
    connect(velocity, heading.GetInputPort("velocity"))
    connect(pose, stop.GetInputPort("pose"))
    connect(heading.GetOutputPort("command"), stop.GetInputPort("command"))
    return stop.GetOutputPort("safe_command")
