"""Packets are those of MAVLink, signed where there is a key; what is old does not count."""

import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from sightfield.hardware_io.emulation.stand_in_laboratory import Sensed
from sightfield.hardware_io.kinds import mavlink_link
from sightfield.hardware_io.kinds.mavlink_link import MavlinkLink, Packer, read_key
from sightfield.hardware_io.kinds.rover import Rover
from sightfield.hardware_io.links.reporting_link import NoMessage, Order, What
from sightfield.hardware_io.links.robot_link import RobotState
from sightfield.systems.numerics.errors import InvalidInput

KEY, OTHER = bytes(range(32)), bytes(32)


def sensed(left=0, right=0):
    return Sensed((left, right), (0.0, 0.0), (0.0, 0.0, 0.0), (math.inf,) * 4, 11.1)


@pytest.fixture
def pair(monkeypatch):
    """A function that makes a link, by a clock that a test sets, and a rover of system 7."""

    def make(station_key=None, rover_key=None):
        link = MavlinkLink([7], ["127.0.0.1:14550"], counts_per_metre=4000.0, key=station_key)
        rover = Rover(7, 3.0, counts_per_metre=4000.0, key=rover_key)
        link.now = 50.0
        monkeypatch.setattr(mavlink_link.time, "monotonic", lambda: link.now)
        return link, rover

    return make


def told(link, rover, what, now=0.0, **order):
    order = {"sequence": 1, "deadline": math.inf} | order
    data = link.encode(7, Order(what, **order))
    rover.take(data, now)
    return data


def heard(link, rover, now=0.0, **ways):
    for data in rover.reports(now, sensed(**ways)):
        link.decode(7, data)
    return link.telemetry()[7]


def test_a_command_is_the_setpoint_that_ardupilot_documents(pair):
    link, _ = pair()
    order = Order(What.COMMAND, 4, deadline=60.0, speed=0.25, turn_rate=0.5)
    parser = dialect.MAVLink(None)
    messages = parser.parse_buffer(link.encode(7, order))
    setpoint = messages[-1]
    assert setpoint.get_type() == "SET_POSITION_TARGET_LOCAL_NED"
    assert (setpoint.target_system, setpoint.target_component) == (7, 1)
    assert (setpoint.coordinate_frame, setpoint.type_mask) == (8, 1511)
    assert (setpoint.vx, setpoint.vy) == (0.25, 0.0)
    # MAVLink's yaw turns to the right.
    assert setpoint.yaw_rate == -0.5
    assert (setpoint.get_srcSystem(), messages[0].get_type()) == (255, "HEARTBEAT")
    # Twice a second it hears that a ground station is there.
    assert len(parser.parse_buffer(link.encode(7, order))) == 1
    link.now += 0.5
    assert parser.parse_buffer(link.encode(7, order))[0].get_type() == "HEARTBEAT"


def test_a_command_whose_deadline_has_passed_is_not_sent(pair):
    link, rover = pair()
    told(link, rover, What.ARM)
    told(link, rover, What.COMMAND, 0.1, deadline=49.9, speed=0.3)
    assert rover.targets(0.1) is None
    told(link, rover, What.COMMAND, 0.1, deadline=50.1, speed=0.25, turn_rate=-1.5)
    assert rover.targets(0.1) == (0.25, -1.5)
    assert rover.targets(3.09) == (0.25, -1.5)
    assert rover.targets(3.1) is None


def test_arms_and_stops_show_in_what_it_reports(pair):
    link, rover = pair()
    told(link, rover, What.HAIL)
    assert heard(link, rover).state == RobotState.DISARMED
    told(link, rover, What.ARM)
    assert heard(link, rover, 0.01).state == RobotState.IDLE
    told(link, rover, What.COMMAND, 0.02, speed=0.3)
    heard(link, rover, 0.11)
    link.now += 0.2
    report = heard(link, rover, 0.31, left=200, right=-100)
    assert (report.state, report.counts) == (RobotState.DRIVING, (200, -100))
    assert report.time == link.now
    assert report.battery == 11.1
    told(link, rover, What.STOP, 0.32)
    assert rover.targets(0.32) is None
    assert heard(link, rover, 0.33, left=200).state == RobotState.DISARMED
    told(link, rover, What.COMMAND, 0.34, speed=0.3)
    assert rover.targets(0.34) is None


def test_a_rover_that_somebody_else_took_over_is_stopped(pair):
    link, rover = pair()
    told(link, rover, What.ARM)
    pilot = Packer(254, 1)
    mode = dialect.MAV_CMD_DO_SET_MODE
    rover.take(
        pilot.pack(dialect.MAVLink_command_long_message(7, 1, mode, 0, 1, 4, 0, 0, 0, 0, 0)), 0.1
    )
    assert heard(link, rover, 0.1).state == RobotState.STOPPED


def test_packets_that_are_repeated_or_overtaken_count_once(pair):
    link, rover = pair()
    told(link, rover, What.HAIL)
    (first,) = rover.reports(0.0, sensed(1, 1))
    (second,) = rover.reports(0.2, sensed(400, 400))
    link.decode(7, second)
    for data in (first, second, b"noise", b""):
        with pytest.raises(NoMessage):
            link.decode(7, data)
    assert link.telemetry()[7].counts == (400, 400)
    # One that was started anew counts from 0, and is heard after a while.
    again = Rover(7, 3.0, counts_per_metre=4000.0)
    told(link, again, What.ARM)
    (data,) = again.reports(0.0, sensed())
    with pytest.raises(NoMessage):
        link.decode(7, data)
    link.now += 0.6
    (data,) = again.reports(0.3, sensed())
    link.decode(7, data)
    assert link.telemetry()[7].counts == (0, 0)


@pytest.mark.parametrize("way", [1e12, 1e300, -1.7e308, math.inf, math.nan])
def test_ways_that_no_wheel_has_gone_are_not_counted_and_end_nothing(pair, way):
    link, _ = pair()
    vehicle = Packer(7, mavlink_link.AUTOPILOT)
    beat = dialect.MAVLink_heartbeat_message(10, 3, 0, 0, 4, 3)
    for ways, counts in (([0.1, 0.2], (400, 800)), ([way, 0.2], (400, 800)), ([1, 1], (4000,) * 2)):
        gone = dialect.MAVLink_wheel_distance_message(0, 2, [*ways, *[0.0] * 14])
        link.decode(7, vehicle.pack(beat, gone))
        assert link.telemetry()[7].counts == counts


def test_packets_of_other_systems_do_not_count(pair):
    link, rover = pair()
    stranger = Rover(8, 3.0, counts_per_metre=4000.0)
    told(link, stranger, What.ARM)
    (data,) = stranger.reports(0.0, sensed())
    with pytest.raises(NoMessage):
        link.decode(7, data)
    assert rover.targets(0.0) is None


def test_signed_packets_are_taken_once_and_with_the_right_key_only(pair):
    for station_key, rover_key in ((None, KEY), (OTHER, KEY)):
        link, rover = pair(station_key, rover_key)
        told(link, rover, What.ARM)
        told(link, rover, What.COMMAND, speed=0.3)
        assert rover.targets(0.0) is None
    link, rover = pair(KEY, KEY)
    told(link, rover, What.ARM)
    old = told(link, rover, What.COMMAND, 0.0, speed=0.3)
    told(link, rover, What.COMMAND, 0.1, speed=0.1)
    rover.take(old, 0.2)
    assert rover.targets(0.2)[0] == pytest.approx(0.1)
    (data,) = rover.reports(0.2, sensed())
    link.decode(7, data)
    assert link.telemetry()[7].state == RobotState.IDLE
    link, _ = pair(OTHER, KEY)
    with pytest.raises(NoMessage):
        link.decode(7, data)


@pytest.mark.parametrize("text", ["", "ab" * 31, "xy" * 32, "ab" * 33, "\u00e4" * 64])
def test_a_key_is_a_file_of_64_digits(tmp_path, text):
    file = tmp_path / "lab.key"
    file.write_text(KEY.hex() + "\n")
    assert read_key(str(file)) == KEY
    assert read_key("") is None
    file.write_text(text)
    for name in (str(file), str(tmp_path / "none.key")):
        with pytest.raises(InvalidInput, match="key_file` must") as error:
            read_key(name)
        assert "\n" not in str(error.value)


def test_no_system_has_the_number_0():
    with pytest.raises(InvalidInput, match="`robots` must be 1 to 254"):
        MavlinkLink([0], ["127.0.0.1:14550"], counts_per_metre=4000.0)
