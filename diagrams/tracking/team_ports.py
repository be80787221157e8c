"""A team of robots that touch nobody and no wall, with the same ports whatever its robots are."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import DiagramBuilder, InputPort, OutputPort, System

from ...systems.drake_parts import add_named
from ...systems.numerics.errors import require, require_type
from ...systems.numerics.geometry.edge_index import index_regions, point_is_free
from ...systems.numerics.geometry.world import World
from ...systems.tracking.agent_team import AgentTeam, DifferentialDriveTeam
from ...systems.tracking.collision_avoidance import CollisionAvoidance, CollisionStop
from ...systems.tracking.heading_controller import HeadingController, TurnFirstController
from .scenario import CLEARANCE, RobotTeam


@dataclass(frozen=True, eq=False)
class TeamPorts:
    """How a team is wired.

    Attributes:
        velocity: Input, desired velocities, size 2 N [m/s].
        position: Output, positions, size 2 N [m].
        direction: Output, vectors along the headings, size 2 N; zero for a point at rest.
        others: Inputs, positions of the robots of other teams, size 2 M each [m]; none where
            there are none to keep off.
        deflections: Outputs, by how much parts of what drives the team change what was asked of
            them, size N each [m/s].
        right_of_way: Inputs, 1 for robots that keep a promise, size N each; only with rank 1.
    """

    velocity: InputPort
    position: OutputPort
    direction: OutputPort
    others: tuple[InputPort, ...] = ()
    deflections: tuple[OutputPort, ...] = ()
    right_of_way: tuple[InputPort, ...] = ()


def AddTeam(
    builder: DiagramBuilder,
    name: str,
    team: RobotTeam,
    starts: ArrayLike,
    regions: Sequence[World],
    period: float,
    other_radii: Sequence[float] | None = None,
    *,
    rank: int = 0,
    pace: float | None = None,
) -> TeamPorts:
    """Add a team that stays in its regions, and what drives it, to a diagram.

    Args:
        builder: Of the diagram.
        name: Prefix of the subsystems' names.
        team: What robots it has.
        starts: Poses, shape (N, 3) [m], [m], [rad].
        regions: Where centres may be.
        period: Time step [s].
        other_radii: Of the robots of other teams to keep off, shape (M,) [m]; None where robots
            have no bodies, and drive through one another.
        rank, pace: Whether others yield to the team or it yields to them, and the top speed of who
            is yielded to [m/s]; as of `CollisionAvoidance`.

    Raises:
        InvalidInput: Not one start for each robot, a start is in no region, or a parameter is out
            of its range.
    """
    require_type("team", team, RobotTeam)
    starts = np.asarray(starts, dtype=float)
    whole = starts.shape == (team.size, 3)
    require(whole, "starts", f"have shape ({team.size}, 3), a pose a robot", starts.shape)
    free = index_regions("regions", regions)
    for start in starts:
        inside = point_is_free(free, start[0], start[1])
        require(inside, "starts", "lie in the regions of the team", start[:2])
    add, connect = partial(add_named, builder), builder.Connect
    yielding = {"rank": rank, "pace": pace}
    avoidance = AddAvoidance(builder, name, team, regions, period, other_radii, **yielding)
    velocity = avoidance.GetInputPort("velocity")
    safe_velocity = avoidance.GetOutputPort("safe_velocity")
    others = inputs_of(avoidance)
    if team.model == "point":
        points = AgentTeam(starts[:, :2], top_speed=team.top_speed, time_step=period)
        plant = add(f"{name}_team", points)
        connect(safe_velocity, plant.GetInputPort("velocity"))
        connect(plant.GetOutputPort("position"), avoidance.GetInputPort("position"))
        position = plant.GetOutputPort("position")
        return TeamPorts(
            velocity,
            position,
            safe_velocity,
            others,
            deflections_of(avoidance),
            rights_of(avoidance),
        )
    limits = {"top_speed": team.top_speed, "top_turn_rate": team.top_turn_rate}
    plant = add(f"{name}_team", DifferentialDriveTeam(starts, time_step=period, **limits))
    heading, stop = AddDrive(
        builder,
        name,
        team,
        regions,
        period,
        other_radii,
        velocity=safe_velocity,
        pose=plant.GetOutputPort("pose"),
        deflection=avoidance.GetOutputPort("deflection") if rank == 1 else None,
        **yielding,
    )
    connect(plant.GetOutputPort("position"), avoidance.GetInputPort("position"))
    connect(stop.GetOutputPort("safe_command"), plant.GetInputPort("command"))
    return TeamPorts(
        velocity,
        plant.GetOutputPort("position"),
        plant.GetOutputPort("direction"),
        others + inputs_of(stop),
        deflections_of(avoidance, stop),
        rights_of(avoidance) + rights_of(heading) + rights_of(stop),
    )


def AddAvoidance(
    builder: DiagramBuilder,
    name: str,
    team: RobotTeam,
    regions: Sequence[World],
    period: float,
    other_radii: Sequence[float] | None = None,
    *,
    rank: int = 0,
    pace: float | None = None,
) -> System:
    """Add what keeps the velocities of a team off walls and robots.

    Args:
        builder, name, team, regions, period, other_radii, rank, pace: As of `AddTeam`.

    Raises:
        InvalidInput: `team` is no RobotTeam, or a name in the diagram is taken.
    """
    require_type("team", team, RobotTeam)
    avoidance = CollisionAvoidance(
        regions,
        count=team.size,
        period=period,
        top_speed=team.top_speed,
        radii=0.0 if other_radii is None else (1.0 + CLEARANCE) * team.radius,
        other_radii=other_radii or (),
        rank=rank,
        pace=pace,
    )
    return add_named(builder, f"{name}_avoidance", avoidance)


def inputs_of(system: System) -> tuple[InputPort, ...]:
    """The inputs of a system for the positions of the robots of other teams.

    Args:
        system: From `AddAvoidance` or `AddDrive`.
    """
    return _input(system, "other_position")


def rights_of(system: System) -> tuple[InputPort, ...]:
    """The inputs of a system for who has the right of way.

    Args:
        system: From `AddAvoidance`, or one of those from `AddDrive`.
    """
    return _input(system, "right_of_way")


def _input(system: System, name: str) -> tuple[InputPort, ...]:
    return (system.GetInputPort(name),) if system.HasInputPort(name) else ()


def deflections_of(*systems: System) -> tuple[OutputPort, ...]:
    """The outputs of systems that say by how much they change what was asked of them.

    Args:
        systems: From `AddAvoidance` or `AddDrive`.
    """
    return tuple(system.GetOutputPort("deflection") for system in systems)


def AddDrive(
    builder: DiagramBuilder,
    name: str,
    team: RobotTeam,
    regions: Sequence[World],
    period: float,
    other_radii: Sequence[float] | None = None,
    *,
    velocity: OutputPort,
    pose: OutputPort,
    deflection: OutputPort | None = None,
    rank: int = 0,
    pace: float | None = None,
) -> tuple[System, System]:
    """Add what turns velocities of points into commands of differential drives.

    Args:
        builder, name, team, regions, period, other_radii, rank, pace: As of `AddTeam`.
        velocity: Velocities from `AddAvoidance`, size 2 N [m/s].
        pose: Poses of the robots, size 3 N [m], [m], [rad].
        deflection: Of `AddAvoidance`, where robots keep promises: these turn before they drive.

    Returns:
        The system that turns velocities into commands, and the one whose output `safe_command`
        stops short of walls and robots, size 2 N [m/s], [rad/s].
    """
    add, connect, count = partial(add_named, builder), builder.Connect, velocity.size() // 2
    limits = {"top_speed": team.top_speed, "top_turn_rate": team.top_turn_rate}
    gain = team.heading_gain
    if deflection is None:
        heading = add(f"{name}_heading", HeadingController(count, gain=gain))
    else:
        law = TurnFirstController(count, gain=gain, top_speed=team.top_speed, period=period)
        heading = add(f"{name}_heading", law)
        connect(deflection, heading.GetInputPort("deflection"))
    stop = CollisionStop(
        regions,
        count=count,
        period=period,
        radii=0.0 if other_radii is None else (1.0 + CLEARANCE) * team.radius,
        other_radii=other_radii or (),
        rank=rank,
        pace=pace,
        **limits,
    )
    add(f"{name}_stop", stop)
    connect(pose, heading.GetInputPort("pose"))
    connect(velocity, heading.GetInputPort("velocity"))
    connect(pose, stop.GetInputPort("pose"))
    connect(heading.GetOutputPort("command"), stop.GetInputPort("command"))
    return heading, stop
