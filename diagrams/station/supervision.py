"""The supervisor between what is measured and what is sent, wired once for every mode."""

from dataclasses import dataclass

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort

from ...systems.numerics.station.pose_checks import PoseLimits
from ...systems.station.floor_guard import FloorGuard
from ...systems.station.motion_check import MotionCheck
from ...systems.station.pose_gate import PoseGate
from ...systems.station.robot_supervisor import RobotSupervisor
from ..tracking.game import TrackingGame
from .ports import MODE, STARTS_SAID, VIEW_AGE
from .scenario import StationScenario
from .wiring import join_teams, split_teams


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
    add, connect, period = builder.AddNamedSystem, builder.Connect, scenario.period
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
