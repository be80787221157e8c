"""The systems between a controller and its robots."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.station.channel import Channel
from sightfield.systems.numerics.station.supervision import Reason
from sightfield.systems.station.gates import (
    PAUSED,
    RUNNING,
    STOPPED,
    AgeLimit,
    CommandGate,
    InfraredReflex,
    PoseParts,
)
from sightfield.systems.station.stand_in_devices import (
    CommandTimeout,
    ImperfectChannel,
    PicturePlayer,
    SampledReceiver,
    SamplePlayer,
)


def evaluate(system, output, time=0.0, **inputs):
    """An output of a system for values of its inputs."""
    context = system.CreateDefaultContext()
    context.SetTime(time)
    for name, value in inputs.items():
        system.GetInputPort(name).FixValue(context, np.asarray(value, dtype=float))
    return system.GetOutputPort(output).Eval(context)


COMMANDS = [0.1, 1.0, 0.2, 2.0, 0.3, 3.0]


@pytest.mark.parametrize("mode", [PAUSED, STOPPED, 0.5, np.nan])
def test_nobody_moves_unless_the_operator_lets_them(mode):
    sent = evaluate(CommandGate(3), "sent_command", command=COMMANDS, valid=[1, 1, 1], mode=[mode])
    assert (sent == 0).all()


def test_a_robot_that_nobody_sees_stands_and_the_others_go_on():
    gate = CommandGate(3)
    sent = evaluate(gate, "sent_command", command=COMMANDS, valid=[1, 0, 1], mode=[RUNNING])
    assert sent.tolist() == [0.1, 1.0, 0.0, 0.0, 0.3, 3.0]


def feel(ranges, reflex=None, context=None, *, reason=(0, 0), valid=(1, 1)):
    """Commands and reasons of two robots that drive on and turn, by the ranges of the first."""
    reflex = reflex or InfraredReflex(2, distance=0.05, period=0.1)
    context = context or reflex.CreateDefaultContext()
    inputs = {
        "command": [0.1, 1.0, -0.2, 2.0],
        "ranges": [*ranges, 0.01, 0.01, 0.01, 0.01],
        "valid": valid,
        "reason": reason,
    }
    for name, value in inputs.items():
        reflex.GetInputPort(name).FixValue(context, np.asarray(value, dtype=float))
    ports = [reflex.GetOutputPort(name) for name in ("held_command", "told_reason")]
    return [port.Eval(context).tolist() for port in ports]


FAR, OBSTACLE = [0.3, 0.3, 0.3, 0.3], float(Reason.OBSTACLE)


@pytest.mark.parametrize("sensor", range(4))
def test_a_robot_drives_no_further_towards_what_it_feels_ahead_but_turns_and_drives_back(sensor):
    ranges = [0.3 if k != sensor else 0.049 for k in range(4)]
    ahead = sensor in (1, 2)
    commands, reasons = feel(ranges)
    # The second feels something as well, and drives back.
    assert commands == [0.0 if ahead else 0.1, 1.0, -0.2, 2.0]
    assert reasons == [OBSTACLE if ahead else 0.0, OBSTACLE]


def test_what_sensors_said_long_ago_holds_nobody_and_a_graver_reason_is_told():
    assert feel([0.0] * 4, valid=(0, 0)) == [[0.1, 1.0, -0.2, 2.0], [0.0, 0.0]]
    assert feel([0.0] * 4, reason=(2, 0))[1] == [2.0, OBSTACLE]


def test_a_robot_that_was_held_drives_on_when_the_way_is_a_little_longer():
    reflex = InfraredReflex(2, distance=0.05, period=0.1)
    simulator = Simulator(reflex)
    context = simulator.get_mutable_context()
    feel([0.04] * 4, reflex, context)
    simulator.AdvanceTo(0.25)
    held = [feel([away] * 4, reflex, context)[0][0] for away in (0.06, 0.08)]
    assert held == [0.0, 0.1]
    simulator.AdvanceTo(0.35)
    assert feel([0.06] * 4, reflex, context)[0][0] == 0.1


@pytest.mark.parametrize("nonsense", [np.nan, np.inf])
def test_a_command_that_is_no_number_is_zero(nonsense):
    command = [0.1, nonsense, 0.2, 2.0]
    sent = evaluate(CommandGate(2), "sent_command", command=command, valid=[1, 1], mode=[RUNNING])
    assert sent.tolist() == [0, 0, 0.2, 2.0]


def test_a_robot_that_hears_nothing_stops_after_the_limit():
    timeout = CommandTimeout(2, limit=0.2)
    stamps = [1.0, 1.15]
    command = [0.1, 1.0, 0.2, 2.0]
    before = evaluate(timeout, "obeyed_command", time=1.2, command=command, stamp=stamps)
    after = evaluate(timeout, "obeyed_command", time=1.21, command=command, stamp=stamps)
    assert before.tolist() == command
    assert after.tolist() == [0, 0, 0.2, 2.0]


def test_poses_come_apart_into_positions_and_directions():
    poses = [1, 2, 0, 3, 4, np.pi / 2]
    assert evaluate(PoseParts(2), "position", pose=poses).tolist() == [1, 2, 3, 4]
    assert np.allclose(evaluate(PoseParts(2), "direction", pose=poses), [1, 0, 0, 1])


def test_ages_beyond_the_limit_are_not_valid():
    assert evaluate(AgeLimit(3, limit=0.5), "valid", age=[0.5, 0.6, np.inf]).tolist() == [1, 0, 0]


def test_a_channel_and_its_receiver_tell_how_old_things_are():
    builder = DiagramBuilder()
    source = builder.AddSystem(ConstantVectorSource([5.0, 6.0]))
    channel = builder.AddSystem(
        ImperfectChannel(Channel(period=0.01, delay=0.03), np.zeros((2, 1)))
    )
    receiver = builder.AddSystem(SampledReceiver(np.zeros((2, 1)), period=0.1, stale_after=0.04))
    builder.Connect(source.get_output_port(), channel.GetInputPort("sent"))
    builder.Connect(channel.GetOutputPort("received"), receiver.GetInputPort("received"))
    builder.Connect(channel.GetOutputPort("stamp"), receiver.GetInputPort("arrival_stamp"))
    simulator = Simulator(builder.Build())
    context = receiver.GetMyContextFromRoot(simulator.get_context())

    def says(name):
        return receiver.GetOutputPort(name).Eval(context).tolist()

    simulator.AdvanceTo(0.05)
    # The tick at 0 saw nothing yet.
    assert says("value") == [0, 0]
    assert says("valid") == [0, 0]
    assert says("age") == [np.inf, np.inf]
    simulator.AdvanceTo(0.15)
    assert says("value") == [5, 6]
    assert says("valid") == [1, 1]
    # At the tick of 0.1 s what was taken at 0.07 s had come; it is held until the next.
    assert says("stamp") == pytest.approx([0.07, 0.07])
    assert says("age") == pytest.approx([0.03, 0.03])


def test_a_player_shows_each_sample_from_its_tick_on_and_the_last_for_ever():
    player = SamplePlayer([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]], [0.0, 0.0], period=0.1)
    simulator = Simulator(player)
    context = simulator.get_context()
    shown = [player.GetOutputPort("sample").Eval(context).tolist()]
    for k in range(5):
        simulator.AdvanceTo(0.1 * k + 0.05)
        shown.append(player.GetOutputPort("sample").Eval(context).tolist())
    assert shown == [[0, 0], [1, 2], [3, 4], [5, 6], [5, 6], [5, 6]]


def test_pictures_are_shown_from_the_tick_at_which_they_were_new():
    pictures = [np.full((2, 3, 4), number, dtype=np.uint8) for number in (10, 20)]
    player = PicturePlayer([1, 3], lambda number: pictures[number], period=0.1)
    simulator = Simulator(player)
    shown = []
    for k in range(5):
        simulator.AdvanceTo(0.1 * k + 0.05)
        image = player.GetOutputPort("image").Eval(simulator.get_context())
        shown.append((image.width(), int(image.data[0, 0, 0])))
    assert shown == [(1, 0), (3, 10), (3, 10), (3, 20), (3, 20)]


@pytest.mark.parametrize(
    "make",
    [
        lambda: CommandGate(0),
        lambda: CommandTimeout(2, limit=0.0),
        lambda: PoseParts(0),
        lambda: AgeLimit(1, limit=-1.0),
        lambda: SamplePlayer(np.zeros((0, 2)), [0, 0], period=0.1),
        lambda: SamplePlayer(np.zeros((2, 2)), [0, 0], period=0.0),
        lambda: PicturePlayer([], lambda number: np.zeros((1, 1, 4)), period=0.0),
        lambda: ImperfectChannel(Channel(), np.zeros(3)),
        lambda: SampledReceiver(np.zeros((2, 1)), period=0.1, stale_after=0.0),
    ],
)
def test_what_cannot_be_is_refused(make):
    with pytest.raises(InvalidInput):
        make()


def test_before_anything_has_come_it_is_infinitely_old():
    receiver = SampledReceiver([[0.1, 0.2]] * 2, period=0.1, stale_after=0.5)
    context = receiver.CreateDefaultContext()
    said = {
        name: receiver.GetOutputPort(name).Eval(context).tolist()
        for name in ("value", "valid", "age", "stamp")
    }
    assert said == {
        "value": [0.1, 0.2, 0.1, 0.2],
        "valid": [0.0, 0.0],
        "age": [np.inf, np.inf],
        "stamp": [-np.inf, -np.inf],
    }
