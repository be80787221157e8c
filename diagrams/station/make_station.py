"""The station: robots, motion capture, radio, sensors and camera behind one set of ports."""

import atexit
from contextlib import ExitStack

import numpy as np
from pydrake.systems.framework import Diagram, DiagramBuilder

from ...systems.station.command_gate import RUNNING, CommandGate
from ...systems.station.infrared_reflex import InfraredReflex
from ...systems.tracking.collision_avoidance import CollisionStop
from ..tracking.game import TrackingGame, set_up_game
from .hardware import AddDevices, Devices, Operator, OperatorPort, RunLog
from .ports import (
    COMMANDS,
    IMAGE,
    MODE,
    REASON,
    SENT,
    STARTS_SAID,
    VIEW_AGE,
    believed_ports,
    device_ports,
    supervisor_ports,
)
from .recorded import AddRecordedLaboratory
from .scenario import StationScenario
from .session import open_laboratory
from .simulated import AddSimulatedLaboratory
from .supervision import AddSupervision
from .wiring import constant

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
        SightfieldError: The game cannot be set up, or a device is missing.
    """
    game = game or set_up_game(scenario.tracking)
    builder = DiagramBuilder()
    gate = builder.AddNamedSystem("gate", CommandGate(scenario.size))
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
            builder.AddNamedSystem("operator", port)
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
    builder.AddNamedSystem("spacing", spacing)
    builder.Connect(supervised.pose, spacing.GetInputPort("pose"))
    reflex = InfraredReflex(
        scenario.size, distance=scenario.infrared.reflex, period=scenario.period
    )
    builder.AddNamedSystem("reflex", reflex)
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
