"""Team tracking on a station: the strategies of `sightfield track`, wired once for every mode."""

from collections.abc import Sequence

from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import Multiplexer

from ...systems.numerics.errors import require
from ...systems.numerics.geometry.world import World
from ...systems.station.pose_parts import PoseParts
from ..tracking.game import TrackingGame
from ..tracking.make_tracking import AddTracking, ConnectTeams, OwnAssignment
from ..tracking.scenario import CERTIFIED, RobotTeam
from ..tracking.team_ports import AddAvoidance, AddDrive, TeamPorts, deflections_of, inputs_of
from .ports import COMMANDS


def AddStationTracking(
    builder: DiagramBuilder,
    station: Diagram,
    game: TrackingGame,
    *,
    assignment: OwnAssignment | None = None,
    evasion: System | None = None,
) -> dict[str, OutputPort]:
    """Wire team tracking to the ports of a station.

    Args:
        builder: Of the diagram, which has the station.
        station: From `MakeStation`, in any mode.
        game: What is played.
        assignment, evasion: Of your own, instead of the scenario's, as of `AddTracking`.

    Returns:
        Outputs by name, as of `AddTracking`.

    Raises:
        InvalidInput: What is of your own does not fit, as of `AddTracking`; or the pursuers are to
            be certified, which robots that answer late cannot be.
    """
    scenario = game.scenario
    field = scenario.pursuers.field
    require(field != CERTIFIED, "pursuers.field", "be another one in the laboratory", field)
    teams = {
        "pursuer": (scenario.pursuers, game.pursuer_regions, scenario.evader_radii),
        "evader": (scenario.evaders, game.evader_regions, scenario.pursuer_radii),
    }
    ports, commands = [], []
    for name, (team, regions, other_radii) in teams.items():
        pose = station.GetOutputPort(f"{name}.believed_poses")
        team_ports, command = _add_team(
            builder, name, team, regions, scenario.period, other_radii, pose
        )
        ports.append(team_ports)
        commands.append(command)
    joined = Multiplexer([command.size() for command in commands])
    builder.AddNamedSystem("commands", joined)
    for k, command in enumerate(commands):
        builder.Connect(command, joined.get_input_port(k))
    builder.Connect(joined.get_output_port(), station.GetInputPort(COMMANDS))
    pursuing, evading = ports
    ConnectTeams(builder, pursuing, evading)
    teams = pursuing, evading
    return AddTracking(builder, game, assignment=assignment, evasion=evasion, teams=teams)


def _add_team(
    builder: DiagramBuilder,
    name: str,
    team: RobotTeam,
    regions: Sequence[World],
    period: float,
    other_radii: Sequence[float] | None,
    pose: OutputPort,
) -> tuple[TeamPorts, OutputPort]:
    """Add what stands between a strategy and the station's differential drives."""
    count = team.size
    parts = builder.AddNamedSystem(f"{name}_parts", PoseParts(count))
    avoidance = AddAvoidance(builder, name, team, regions, period, other_radii)
    builder.Connect(pose, parts.get_input_port())
    position, direction = parts.GetOutputPort("position"), parts.GetOutputPort("direction")
    builder.Connect(position, avoidance.GetInputPort("position"))
    safe = avoidance.GetOutputPort("safe_velocity")
    _, stop = AddDrive(builder, name, team, regions, period, other_radii, velocity=safe, pose=pose)
    others = inputs_of(avoidance) + inputs_of(stop)
    velocity, deflections = avoidance.GetInputPort("velocity"), deflections_of(avoidance, stop)
    ports = TeamPorts(velocity, position, direction, others, deflections)
    return ports, stop.GetOutputPort("safe_command")
