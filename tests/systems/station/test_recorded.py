"""What the station's systems say over time, with changing inputs, is as recorded."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.station.channel import Channel
from sightfield.systems.numerics.station.motion_checks import Chassis
from sightfield.systems.numerics.station.pose_checks import PoseLimits
from sightfield.systems.numerics.station.supervision import SupervisionRules
from sightfield.systems.station import (
    AgeLimit,
    CommandGate,
    CommandTimeout,
    FloorGuard,
    ImperfectChannel,
    InfraredReflex,
    MotionCheck,
    PicturePlayer,
    PoseGate,
    PoseParts,
    RobotSupervisor,
    SampledReceiver,
    SamplePlayer,
    WheelEncoders,
)

PERIOD = 0.05
STARTS = np.array([[0.3, 0.4, 0.5], [1.0, 1.2, -2.0], [2.0, 0.6, 3.0]])
WORLD = make_world([[0, 0], [3, 0], [3, 2], [0, 2]], [[[1, 1], [1.5, 1], [1.2, 1.6]]])
LIMITS = PoseLimits(top_speed=0.5, top_turn_rate=3.0, bounds=(0.0, 0.0, 3.0, 2.0), margin=0.1)
CHASSIS = Chassis(track_width=0.19, counts_per_metre=2500.0)


def inputs_at(tick, size, name, rng):
    """What a port is told in a tick: numbers that fit its name."""
    if ("pose" in name and size == 9) or (name == "sent" and size == 9):
        heading = STARTS[:, 2] + 0.02 * tick
        way = 0.015 * tick * np.array([[1.0, 0.5], [-0.4, 0.8], [0.0, 0.3]])
        poses = np.column_stack([STARTS[:, :2] + way, heading])
        poses[1, :2] += 0.4 * (tick in (9, 10))
        return poses.ravel()
    match name:
        case "command" | "sent_command":
            return np.tile([0.3, 0.1 * (tick % 5) - 0.2], size // 2) * (1 + tick % 3)
        case "valid":
            return (rng.random(size) < 0.9).astype(float)
        case "stamp" | "arrival_stamp":
            return np.full(size, PERIOD * tick - 0.01) - 0.1 * (rng.random(size) < 0.2)
        case "age" | "pose_age":
            return np.where(rng.random(size) < 0.1, 1.4, 0.01)
        case "mode":
            return np.array([0.0 if tick % 13 == 5 else 1.0])
        case "starts_said":
            return np.array([float(tick // 15)])
        case "view_age":
            return np.array([1.2 if tick % 17 == 8 else 0.1])
        case "counts":
            return np.floor(2500 * 0.015 * tick * np.ones(size))
        case "ranges":
            return rng.uniform(0.03, 0.3, size)
        case "robot_state":
            return np.where(rng.random(size) < 0.1, rng.integers(-1, 5, size), 2).astype(float)
        case "robot_flags":
            return np.where(rng.random(size) < 0.05, 8.0, 0.0)
        case _:
            return np.where(rng.random(size) < 0.05, 13.0, 0.0)


SYSTEMS = {
    "age limit": lambda: AgeLimit(3, limit=0.5),
    "pose parts": lambda: PoseParts(3),
    "command gate": lambda: CommandGate(3),
    "reflex": lambda: InfraredReflex(3, distance=0.1, period=PERIOD),
    "channel": lambda: ImperfectChannel(
        Channel(period=PERIOD, delay=0.06, jitter=0.05, dropout=0.2, seed=3), STARTS
    ),
    "receiver": lambda: SampledReceiver(STARTS[:, :2], period=PERIOD, stale_after=0.05),
    "encoders": lambda: WheelEncoders(CHASSIS, STARTS, period=PERIOD),
    "timeout": lambda: CommandTimeout(3, limit=0.08),
    "player": lambda: SamplePlayer(
        np.arange(20.0).reshape(10, 2) ** 2, np.array([7.0, 8.0]), period=PERIOD
    ),
    "pose gate": lambda: PoseGate(LIMITS, STARTS, period=PERIOD),
    "motion check": lambda: MotionCheck(CHASSIS, 3, period=PERIOD),
    "floor guard": lambda: FloorGuard(WORLD, [0.1, 0.2, 0.15], slack=0.02),
    "supervisor": lambda: RobotSupervisor(SupervisionRules(), 3, period=PERIOD),
}


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_system_says_over_time_what_is_recorded(name, as_recorded):
    system, rng = SYSTEMS[name](), np.random.default_rng(4)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    said = {system.get_output_port(k).get_name(): [] for k in range(system.num_output_ports())}
    for tick in range(45):
        for k in range(system.num_input_ports()):
            port = system.get_input_port(k)
            port.FixValue(context, inputs_at(tick, port.size(), port.get_name(), rng))
        simulator.AdvanceTo(PERIOD * tick + 0.001)
        for port, rows in said.items():
            rows.append(system.GetOutputPort(port).Eval(context).copy())
    as_recorded({port: np.array(rows[:4]) for port, rows in said.items()}, "first")
    as_recorded({port: np.array(rows) for port, rows in said.items()}, "all")


def test_pictures_are_played_as_recorded(as_recorded):
    pictures = [np.full((2, 3 + k, 4), 40 * k + 7, np.uint8) for k in range(3)]
    player = PicturePlayer([1, 2, 5], lambda number: pictures[number], period=PERIOD)
    simulator, shown = Simulator(player), []
    for tick in range(8):
        simulator.AdvanceTo(PERIOD * tick + 0.001)
        image = player.GetOutputPort("image").Eval(simulator.get_context())
        shown.append([image.width(), image.height(), int(image.data[0, 0, 0])])
    as_recorded(shown)


def test_a_reflex_feels_ahead_alone_and_lets_go_a_little_farther():
    system = InfraredReflex(1, distance=0.1, period=PERIOD)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    for name, value in (("command", [0.3, 0.5]), ("valid", [1.0]), ("reason", [0.0])):
        system.GetInputPort(name).FixValue(context, np.array(value))
    speeds = []
    for tick, ahead in enumerate((0.3, 0.1, 0.099, 0.119, 0.121, 0.11, 0.3)):
        for sides in ([0.01, ahead, 0.5, 0.01], [0.01, 0.5, ahead, 0.01]):
            system.GetInputPort("ranges").FixValue(context, np.array(sides))
            simulator.AdvanceTo(PERIOD * tick + 0.001 * (1 + (sides[2] == ahead)))
        speeds.append(system.GetOutputPort("held_command").Eval(context).tolist())
    held = [0.0, 0.5]
    free = [0.3, 0.5]
    assert speeds == [free, free, held, held, free, free, free]


@pytest.mark.parametrize(
    "make",
    [
        lambda: AgeLimit(0, limit=0.5),
        lambda: AgeLimit(1, limit=0.0),
        lambda: PoseParts(0),
        lambda: CommandGate(0),
        lambda: InfraredReflex(0, distance=0.1, period=PERIOD),
        lambda: InfraredReflex(1, distance=-0.1, period=PERIOD),
        lambda: InfraredReflex(1, distance=0.1, period=0.0),
        lambda: ImperfectChannel(Channel(), np.zeros(3)),
        lambda: ImperfectChannel(Channel(), np.zeros((0, 3))),
        lambda: SampledReceiver(STARTS, period=0.0, stale_after=0.1),
        lambda: SampledReceiver(STARTS, period=PERIOD, stale_after=0.0),
        lambda: WheelEncoders(CHASSIS, STARTS, period=0.0),
        lambda: WheelEncoders(CHASSIS, STARTS[:, :2], period=PERIOD),
        lambda: WheelEncoders(CHASSIS, STARTS[0], period=PERIOD),
        lambda: CommandTimeout(0, limit=0.1),
        lambda: CommandTimeout(1, limit=0.0),
        lambda: SamplePlayer(np.zeros((0, 2)), np.zeros(2), period=PERIOD),
        lambda: SamplePlayer(np.zeros(2), np.zeros(2), period=PERIOD),
        lambda: SamplePlayer(np.zeros((1, 2)), np.zeros(2), period=0.0),
        lambda: PicturePlayer([], lambda number: np.zeros((1, 1, 4)), period=0.0),
        lambda: PoseGate(LIMITS, STARTS, period=0.0),
        lambda: PoseGate(LIMITS, STARTS[:, :2], period=PERIOD),
        lambda: MotionCheck(CHASSIS, 0, period=PERIOD),
        lambda: MotionCheck(CHASSIS, 1, period=0.0),
        lambda: FloorGuard(WORLD, [], slack=0.1),
        lambda: FloorGuard(WORLD, [[0.1]], slack=0.1),
        lambda: FloorGuard(WORLD, [0.1], slack=-0.1),
        lambda: RobotSupervisor(SupervisionRules(), 0, period=PERIOD),
        lambda: RobotSupervisor(SupervisionRules(), 1, period=0.0),
    ],
)
def test_what_no_system_can_be_made_of_is_refused(make):
    with pytest.raises(InvalidInput, match="` must"):
        make()


def test_a_system_of_one_robot_is_made():
    InfraredReflex(1, distance=0.0, period=PERIOD)
    FloorGuard(WORLD, [0.1], slack=0.0)
    for kind in (PoseParts, CommandGate):
        assert kind(1).num_output_ports() > 0
