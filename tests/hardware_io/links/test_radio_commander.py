"""The radio's system sends once a period, and holds back what is not to be followed."""

import math
import time

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.hardware_io.links.radio_commander import RadioCommander
from sightfield.hardware_io.links.robot_link import LinkHealth, RobotFlag, RobotReport, RobotState
from sightfield.systems.numerics.errors import InvalidInput


class KeptLink:
    """Keeps what it is given to send; robot 3 has been heard and robot 8 has not."""

    robots = (3, 8)

    def __init__(self):
        self.sent, self.armed = [], []

    def send_commands(self, velocities, valid, age):
        self.sent.append((velocities.copy(), valid.copy(), age))

    def arm_again(self, robots):
        self.armed.append(robots)

    def telemetry(self):
        report = RobotReport(
            time=time.monotonic() - 2.0,
            state=RobotState.IDLE,
            flags=RobotFlag.LOW_BATTERY,
            counts=(17, -4),
            ranges=(0.4, 0.25, 0.01, 0.0),
            battery=7.4,
        )
        return {3: report}

    def health(self):
        return LinkHealth(
            sent=9,
            acknowledged=0,
            retried=0,
            lost=0,
            received=1,
            refused=0,
            rssi=-50,
            round_trip=0.02,
            quality=(0.9, 0.0),
        )


@pytest.fixture
def link():
    return KeptLink()


def run(link, duration, *, valid=None, age=None, velocities=(0.3, 1.0, -0.1, 0.0), **options):
    system = RadioCommander(link, period=0.05, **options)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    system.get_velocity_commands_input_port().FixValue(context, np.array(velocities))
    if valid is not None:
        system.get_valid_input_port().FixValue(context, np.array(valid))
    if age is not None:
        system.get_pose_age_input_port().FixValue(context, np.broadcast_to(age, 2).astype(float))
    simulator.AdvanceTo(duration)
    return system, context


def test_commands_go_out_once_a_period(link):
    run(link, 0.524)
    assert len(link.sent) == 11
    for velocities, valid, age in link.sent:
        assert velocities.tolist() == [[0.3, 1.0], [-0.1, 0.0]]
        assert valid.tolist() == [True, True]
        assert age == 0.0


def test_commands_go_out_a_stated_time_later(link):
    run(link, 0.0501, offset=0.001)
    assert len(link.sent) == 1


def test_commands_are_repeated_within_a_period_while_reports_stay(link):
    heard = []
    link.telemetry = lambda: heard.append(None) or {}
    run(link, 0.124, repeats=2)
    assert (len(link.sent), len(heard)) == (5, 3)


def test_what_is_not_valid_or_not_a_number_is_not_to_be_followed(link):
    run(link, 0.0, valid=[0.0, 1.0])
    run(link, 0.0, valid=[1.0, 1.0], velocities=(0.3, math.nan, -0.1, 0.0))
    assert [valid.tolist() for _, valid, _ in link.sent] == [[False, True], [False, True]]


@pytest.mark.parametrize("age", [math.inf, math.nan, -1.0])
def test_commands_from_poses_of_unknown_age_are_not_to_be_followed(link, age):
    run(link, 0.0, age=age)
    assert [(valid.tolist(), age) for _, valid, age in link.sent] == [([False, False], 0.0)]


def test_the_greatest_age_of_poses_that_are_gone_by_is_passed_on(link):
    run(link, 0.0, age=[0.12, 0.05])
    run(link, 0.0, age=[0.12, 0.05], valid=[0.0, 1.0])
    run(link, 0.0, age=[math.inf, 0.05])
    assert [age for _, _, age in link.sent] == [0.12, 0.05, 0.05]
    assert [valid.tolist() for _, valid, _ in link.sent] == [[True, True], *[[False, True]] * 2]


def test_robots_are_armed_again_before_their_commands_go_out(link):
    system = RadioCommander(link, period=0.05)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    system.get_velocity_commands_input_port().FixValue(context, np.zeros(4))
    system.GetInputPort("arm_again").FixValue(context, np.array([0.0, 1.0]))
    simulator.AdvanceTo(0.0)
    assert link.armed == [[8]]


def test_reports_come_out_and_what_was_not_heard_is_blank(link):
    system, context = run(link, 0.06)

    def output(name):
        return system.GetOutputPort(name).Eval(context)

    assert output("infrared_ranges") == pytest.approx([0.4, 0.25, 0.01, 0.0, *[math.inf] * 4])
    assert output("battery") == pytest.approx([7.4, 0.0])
    assert output("link_quality") == pytest.approx([0.9, 0.0])
    assert output("robot_state").tolist() == [RobotState.IDLE, -1]
    assert output("robot_flags").tolist() == [RobotFlag.LOW_BATTERY, 0]
    assert output("counts").tolist() == [17, -4, 0, 0]
    assert output("age")[0] >= 2.0
    assert output("age")[1] == math.inf


@pytest.mark.parametrize("wrong", [{"period": 0.0}, {"offset": -0.1}, {"repeats": 0}])
def test_times_that_are_none_are_refused(link, wrong):
    with pytest.raises(InvalidInput):
        RadioCommander(link, **wrong)
