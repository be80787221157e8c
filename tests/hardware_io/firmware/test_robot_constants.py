"""The firmware's numbers are the ones that its surroundings are computed with."""

import re

import pytest

from sightfield.hardware_io.emulation.robot_body import RobotBody, sensor_voltages
from sightfield.hardware_io.emulation.robot_cores import FIRMWARE
from sightfield.systems.numerics.social.routes.infrared import InfraredRing


@pytest.fixture(scope="module")
def constants() -> dict[str, int]:
    """The numbers that robot.h defines."""
    text = (FIRMWARE / "robot.h").read_text()
    found = re.findall(r"#define (\w+) (\d+)", text)
    return {name: int(value) for name, value in found}


def test_wheels_and_track_are_the_emulated_bodys(constants):
    body = RobotBody()
    assert constants["COUNTS_PER_METRE"] == pytest.approx(body.counts_per_metre, abs=0.5)
    assert constants["TRACK_WIDTH"] == pytest.approx(1000 * body.track_width)


def test_a_robot_can_reach_the_speed_that_it_may_be_asked_for(constants):
    body = RobotBody()
    assert constants["TOP_WHEEL_SPEED"] / 1000 < body.top_speed - body.friction


def test_timeout_and_braking_take_less_than_300_ms(constants):
    braking = RobotBody().stopping_time(constants["TOP_WHEEL_SPEED"] / 1000)
    waiting = (constants["LINK_TIMEOUT_MS"] + constants["TICK_MS"]) / 1000
    assert waiting + braking < 0.3


def test_two_lost_frames_in_a_row_are_no_silence_at_20_hz(constants):
    assert constants["LINK_TIMEOUT_MS"] > 3 * 50


def test_the_sensors_reach_as_far_as_the_diagrams_take_them_to(constants):
    assert constants["IR_REACH"] == pytest.approx(1000 * InfraredRing().reach)


def test_voltages_stay_within_the_converters_range():
    volts = sensor_voltages([0.0, 0.1, 0.4, 5.0], battery=8.4)
    assert (volts > 0).all()
    assert (volts < 5).all()
