"""The station: robots, motion capture, radio, sensors and camera behind one set of ports.

Supervision between what is measured and what is sent, and the strategies of `sightfield track`, are
wired once for every mode.
"""

import atexit
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import Multiplexer

from ...systems.drake_parts import add_named
from ...systems.numerics.errors import require, require_type
from ...systems.numerics.geometry.world import World
from ...systems.numerics.station.pose_checks import PoseLimits
from ...systems.station.gates import RUNNING, CommandGate, InfraredReflex, PoseParts
from ...systems.station.supervision import FloorGuard, MotionCheck, PoseGate, RobotSupervisor
from ...systems.tracking.collision_avoidance import CollisionStop
from ..tracking.game import TrackingGame, set_up_game
from ..tracking.make_tracking import AddTracking, ConnectTeams, OwnAssignment
from ..tracking.scenario import CERTIFIED, RobotTeam
from ..tracking.team_ports import AddAvoidance, AddDrive, TeamPorts, deflections_of, inputs_of
from .hardware import AddDevices, Devices, Operator, OperatorPort, RunLog
from .laboratories import AddRecordedLaboratory, AddSimulatedLaboratory
from .ports import (
    COMMANDS,
    IMAGE,
    MODE,
    REASON,
    SENT,
    STARTS_SAID,
    VIEW_AGE,
    believed_ports,
    constant,
    device_ports,
    join_teams,
    split_teams,
    supervisor_ports,
)
from .scenario import StationScenario
from .session import open_laboratory


@dataclass(frozen=True, eq=False)
class Supervised:
    """What the supervisor says.

    Attributes:
        pose: Of all robots, as far as they are believed.
        go: Which may run.
        arm_again: Which are to be armed again.
        ports: Of the station, by name: believed poses, and what stands in log and page.
    """

    pose: OutputPort
    go: OutputPort
    arm_again: OutputPort
    ports: dict[str, OutputPort]


def AddSupervision(
    builder: DiagramBuilder,
    scenario: StationScenario,
    game: TrackingGame,
    ports: dict[str, OutputPort],
    sent_command: OutputPort,
) -> Supervised:
    """Add a gate on poses, a check of the motion, a guard of the floor, and what decides.

    Args:
        builder: Of the station.
        scenario: The laboratory.
        game: What is played.
        ports: Of the devices, by name.
        sent_command: What goes to the robots.
    """
    add, connect, period = partial(add_named, builder), builder.Connect, scenario.period
    teams, rules, count = scenario.tracking, scenario.supervision, scenario.size
    fleet = (teams.pursuers, teams.evaders)
    bounds = game.world.bounds
    limits = PoseLimits(
        top_speed=max(team.top_speed for team in fleet),
        top_turn_rate=max(team.top_turn_rate for team in fleet),
        bounds=(float(bounds[0]), float(bounds[1]), float(bounds[2]), float(bounds[3])),
        jump=rules.jump,
        flip=rules.flip,
    )
    starts = np.concatenate([game.pursuer_starts, game.evader_starts])
    valid = join_teams(builder, "valid", ports)
    gate = add("pose_gate", PoseGate(limits, starts, period=period))
    connect(join_teams(builder, "poses", ports), gate.GetInputPort("pose"))
    connect(valid, gate.GetInputPort("valid"))
    stamp = join_teams(builder, "stamp", ports)
    connect(stamp, gate.GetInputPort("stamp"))
    pose, fault = gate.GetOutputPort("believed_pose"), gate.GetOutputPort("fault")

    motion = add("motion_check", MotionCheck(rules.chassis, count, period=period))
    age = ports["infrared.age"]
    for name, port in {
        "pose": pose,
        "valid": valid,
        "stamp": stamp,
        "pose_age": join_teams(builder, "age", ports),
        "pose_fault": fault,
        "sent_command": sent_command,
        "counts": ports["radio.counts"],
        "age": age,
    }.items():
        connect(port, motion.GetInputPort(name))

    guard = add("floor_guard", FloorGuard(game.world, scenario.radii, slack=rules.slack))
    connect(pose, guard.get_input_port())

    supervisor = add("supervisor", RobotSupervisor(rules.rules, count, period=period))
    for name, port in {
        "valid": valid,
        "pose_fault": fault,
        "motion_fault": motion.GetOutputPort("fault"),
        "floor_fault": guard.get_output_port(),
        "robot_state": ports["radio.state"],
        "robot_flags": ports["radio.flags"],
        "age": age,
        "mode": ports[MODE],
        "view_age": ports[VIEW_AGE],
    }.items():
        connect(port, supervisor.GetInputPort(name))
    for system in (gate, motion, supervisor):
        connect(ports[STARTS_SAID], system.GetInputPort("starts_said"))

    told = {f"supervisor.{n}": supervisor.GetOutputPort(n) for n in ("standing", "reason", "clock")}
    believed = split_teams(builder, scenario, "believed_poses", pose, 3)
    return Supervised(
        pose=pose,
        go=supervisor.GetOutputPort("go"),
        arm_again=supervisor.GetOutputPort("arm_again"),
        ports=believed | told,
    )


# Longer than a command takes to have its effect: half of a gap is used up in no less [s].
_HORIZON = 0.4


def MakeStation(
    scenario: StationScenario,
    hardware: bool | Devices | RunLog = False,
    *,
    game: TrackingGame | None = None,
    operator: Operator | None = None,
) -> Diagram:
    """Make a station, whose ports are the same whatever is behind them.

    Input port: `team.velocity_commands` (2 N), speed [m/s] and turn rate [rad/s] of each robot,
    pursuers first. Slowed where robots would come too near to one another, and without their
    forward part where infrared sensors feel something near ahead, they go to those that the
    supervisor lets run; the others stand.

    Output ports, in the order in which data flows: `pursuer.poses` (3 Np) and `evader.poses`
    (3 Ne) [m], [m], [rad], with `.valid`, `.age` [s] and `.stamp` [s] of each robot;
    `omni_camera.image` (ImageRgba8U) and its `.valid`, `.age` and `.stamp`; `infrared.ranges`
    (4 N) [m] with `.valid` and `.age` of each robot; `radio.quality` (N) and `radio.battery` (N)
    [V], `radio.state` (N), `radio.flags` (N) and `radio.counts` (2 N) as robots report them;
    `operator.mode` (1): 1 to run, 0 for a pause, -1 for an emergency stop, `operator.starts_said`
    (1) and `operator.view_age` (1) [s]; of the supervisor, `pursuer.believed_poses` and
    `evader.believed_poses`, which strategies go by, `supervisor.standing` (N), `supervisor.reason`
    (N) and `supervisor.clock` (1) [s]; and `team.sent_commands` (2 N), what really went out.

    Everything is sampled at the period of the game and held. An event at the tick itself sees the
    samples of the tick before: send, log and look a little later, as the station itself does.

    Args:
        scenario: The laboratory.
        hardware: False simulates it; True opens its devices and arms its robots, until the
            process ends; or devices that are open, or a recorded run to play again.
        game: The scenario's, if it is set up already.
        operator: Who may pause and stop; None: nobody does.

    Raises:
        InvalidInput: `scenario` is no StationScenario.
        SightfieldError: The game cannot be set up, or a device is missing.
    """
    require_type("scenario", scenario, StationScenario)
    game = game or set_up_game(scenario.tracking)
    builder = DiagramBuilder()
    gate = add_named(builder, "gate", CommandGate(scenario.size))
    sent = gate.GetOutputPort("sent_command")
    if hardware is True:
        stack = ExitStack()
        atexit.register(stack.close)
        laboratory = open_laboratory(scenario, game, "hardware", operator or Operator())
        hardware = stack.enter_context(laboratory)
    if isinstance(hardware, RunLog):
        ports = AddRecordedLaboratory(builder, scenario, game, hardware)
    else:
        if isinstance(hardware, Devices):
            ports = AddDevices(builder, scenario, game, sent, hardware)
        else:
            ports = AddSimulatedLaboratory(builder, scenario, game, sent)
        if operator is None:
            ports[MODE] = constant(builder, "operator", np.array([RUNNING]))
            ports[STARTS_SAID] = constant(builder, "starts_said", np.zeros(1))
            ports[VIEW_AGE] = constant(builder, "view_age", np.zeros(1))
        else:
            port = OperatorPort(operator, period=scenario.period)
            add_named(builder, "operator", port)
            for name in (MODE, STARTS_SAID, VIEW_AGE):
                ports[name] = port.GetOutputPort(name.removeprefix("operator."))
    supervised = AddSupervision(builder, scenario, game, ports, sent)
    ports |= supervised.ports
    if isinstance(hardware, Devices):
        radio = builder.GetSubsystemByName("radio")
        builder.Connect(supervised.arm_again, radio.GetInputPort("arm_again"))
    fleet = (scenario.tracking.pursuers, scenario.tracking.evaders)
    spacing = CollisionStop(
        count=scenario.size,
        top_speed=max(team.top_speed for team in fleet),
        top_turn_rate=max(team.top_turn_rate for team in fleet),
        period=scenario.period,
        horizon=max(_HORIZON, scenario.period),
        radii=scenario.radii,
    )
    add_named(builder, "spacing", spacing)
    builder.Connect(supervised.pose, spacing.GetInputPort("pose"))
    reflex = InfraredReflex(
        scenario.size, distance=scenario.infrared.reflex, period=scenario.period
    )
    add_named(builder, "reflex", reflex)
    builder.Connect(spacing.GetOutputPort("safe_command"), reflex.GetInputPort("command"))
    builder.Connect(ports["infrared.ranges"], reflex.GetInputPort("ranges"))
    builder.Connect(ports["infrared.valid"], reflex.GetInputPort("valid"))
    builder.Connect(ports[REASON], reflex.GetInputPort("reason"))
    ports[REASON] = reflex.GetOutputPort("told_reason")
    builder.Connect(reflex.GetOutputPort("held_command"), gate.GetInputPort("command"))
    builder.Connect(supervised.go, gate.GetInputPort("valid"))
    builder.Connect(ports[MODE], gate.GetInputPort("mode"))
    builder.ExportInput(spacing.GetInputPort("command"), COMMANDS)
    told = (*believed_ports(scenario), *supervisor_ports(scenario))
    for name in (*device_ports(scenario), IMAGE, *told):
        builder.ExportOutput(ports[name], name)
    builder.ExportOutput(sent, SENT)
    station = builder.Build()
    station.set_name("station")
    return station


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
    require_type("game", game, TrackingGame)
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
    add_named(builder, "commands", joined)
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
    parts = add_named(builder, f"{name}_parts", PoseParts(count))
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
