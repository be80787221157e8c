"""Conversations with the boards that stand in, and what links say to robots, are as recorded."""

import math
import struct
from types import SimpleNamespace

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from sightfield.hardware_io.emulation.stand_in_laboratory import Sensed
from sightfield.hardware_io.kinds import crtp_link, dds_link, mavlink_link, udp_link
from sightfield.hardware_io.kinds.crazyflie import Crazyflie
from sightfield.hardware_io.kinds.crtp_link import CrtpLink, _Vehicle
from sightfield.hardware_io.kinds.dds_driver import Driver
from sightfield.hardware_io.kinds.dds_link import DdsLink, _Driven
from sightfield.hardware_io.kinds.dds_node import (
    Header,
    Odometry,
    Point,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Time,
    Twist,
    TwistStamped,
    TwistWithCovariance,
    Vector3,
    planar,
)
from sightfield.hardware_io.kinds.mavlink_link import MavlinkLink, Packer
from sightfield.hardware_io.kinds.rover import Rover
from sightfield.hardware_io.kinds.udp_board import UdpBoard
from sightfield.hardware_io.kinds.udp_link import (
    MODULUS,
    OrderDatagram,
    OrderKind,
    ReportDatagram,
    UdpLink,
    encode_order,
    encode_report,
)
from sightfield.hardware_io.links.link_record import OdometryCounts
from sightfield.hardware_io.links.reporting_link import NoMessage, Order, What
from sightfield.hardware_io.links.robot_link import RobotFlag, RobotState
from sightfield.systems.numerics.station.motion_checks import Chassis

CHASSIS = Chassis(track_width=0.21, counts_per_metre=900.0)


def sensed(step, battery=7.4):
    at = 0.1 * step
    return Sensed(
        (40 * step, -31 * step),
        (0.3, -0.1),
        (0.4 + at, -0.2 * at, 2.5 * at),
        (0.1, 64.9, math.inf, 0.3),
        battery,
    )


@pytest.fixture
def clock(monkeypatch):
    """The time that all links take for the present one: its `now` is set by a test."""
    made = SimpleNamespace(now=50.0)
    time = SimpleNamespace(
        monotonic=lambda: made.now,
        time=lambda: 1.6e9 + made.now,
        time_ns=lambda: 1_600_000_000_000_000_000 + round(1e9 * made.now),
    )
    for module in (crtp_link, dds_link, mavlink_link, udp_link):
        monkeypatch.setattr(module, "time", time)
    return made


def packet(first, *data):
    return bytes([first, *data])


def hover(kind, *numbers):
    return bytes([0x7C, kind]) + struct.pack("<4f", *numbers)


@pytest.mark.parametrize("version", [7, 9, 11, 12])
def test_a_crazyflie_answers_as_recorded(version, as_recorded):
    board = Crazyflie(0.5, version=version)
    kind, arm = (10 if version >= 9 else 5), (0x9D, 1) if version >= 12 else (0xDC, 1)
    rows = [(0, 0), (6, 0), (4, 0), (5, 0), (1, 0)]
    told = [
        packet(0xDD, 0),
        packet(0xDD, 1),
        packet(0x5C, 3),
        *(packet(0x5C, 2, row, 0) for row in range(8)),
        packet(0x5C, 2, 0),
        packet(0xFD, 0),
        packet(0x2C, 3),
        packet(0x4C, 1),
        packet(0x5D, 3, 4, 7),
        packet(0x5D, 6, 4, *(byte for row in rows for byte in (7, *row))),
        packet(0x5D, 6, 5, 7, 7, 0),
        packet(0x5D, 6, 5, 7, 6, 1),
        packet(0x5D, 6, 4),
        packet(0x5D, 3, 5, 7),
        packet(0x5D, 3, 4, 7),
        packet(0x5D, 9, 4, 7),
        packet(*arm, 1),
        hover(kind, 0.3, 0.1, 40.0, 0.4),
        hover(kind, math.nan, 0.1, 40.0, 0.4),
        hover(15 - kind, 0.9, 0.1, 40.0, 0.4),
        hover(kind, 0.2, 0.1, -30.0, 0.4),
        hover(kind, 0.7, 0.1, -30.0, 0.4)[:-1],
        packet(0x7C, 0, 1),
        packet(*arm, 2),
        packet(*arm, 0, 0),
        packet(0x5D, 5),
        packet(*arm, 0),
        packet(*arm, 1),
        hover(kind, 0.5, 0.0, 10.0, 0.4),
        packet(0x7C, 0),
        packet(0x5C),
        packet(0x5C, *[3] * 30),
        packet(0x5C, *[3] * 31),
    ]
    said = []
    for step, payload in enumerate(told):
        now = 16777.0 + 0.05 * step
        board.take(payload, now)
        reports = [each.hex() for each in board.reports(now + 0.01, sensed(step))]
        said.append([reports, *(board.targets(now + late) for late in (0.0, 0.499, 0.5))])
    as_recorded(said)


def orders():
    for step, what in enumerate(
        [What.COMMAND, What.HAIL, What.ARM, *[What.COMMAND] * 4, What.STOP, What.HAIL, What.COMMAND]
    ):
        late = step == 5
        yield (
            step,
            Order(
                what,
                70000 + step,
                50.0 + 0.3 * step + (-0.01 if late else 0.1),
                0.1 * step,
                -0.2 * step,
            ),
        )


def test_a_crazyflie_is_told_and_heard_as_recorded(clock, as_recorded):
    link = CrtpLink([3], ["udp://127.0.0.1:19850"], chassis=CHASSIS, height=0.75)
    sent = []
    driver = SimpleNamespace(send_packet=lambda each: sent.append(bytes([each.header, *each.data])))
    vehicle = link._vehicles[3] = _Vehicle(driver, OdometryCounts(CHASSIS))
    board, heard = Crazyflie(0.5), []
    link._ask(vehicle, clock.now)
    for step in range(40):
        clock.now += 0.03
        for each in sent[len(heard) :]:
            board.take(each, clock.now)
            heard.append(each.hex())
        for each in board.reports(clock.now, sensed(step)):
            link.take(3, each)
    as_recorded([heard, vehicle.rows, vehicle.version, vehicle.size], "set up")
    as_recorded(link.telemetry(), "telemetry")
    said = []
    for step, order in orders():
        clock.now = 50.0 + 0.3 * step
        before = len(sent)
        link.transmit(3, order)
        for each in sent[before:]:
            board.take(each, clock.now)
        for each in board.reports(clock.now, sensed(40 + step // 2)):
            link.take(3, each)
        said.append([[each.hex() for each in sent[before:]], link.telemetry()[3]])
    as_recorded(said, "driven")
    as_recorded(link.health(), "health")


@pytest.mark.parametrize("key", [None, bytes(range(32))], ids=["open", "signed"])
def test_a_rover_is_told_and_heard_as_recorded(key, clock, as_recorded):
    link = MavlinkLink([7], ["127.0.0.1:14550"], counts_per_metre=900.0, key=key)
    rover, said = Rover(7, 0.35, counts_per_metre=900.0, key=key), []
    for step, order in orders():
        clock.now = 50.0 + 0.3 * step
        told = link.encode(7, order)
        rover.take(told, 0.3 * step)
        for each in rover.reports(0.3 * step + 0.02, sensed(step // 2, 11.123)):
            link.decode(7, each)
            told += each
        targets = [rover.targets(0.3 * step + late) for late in (0.0, 0.349, 0.35)]
        said.append([told.hex() if key is None else len(told), targets, link.telemetry().get(7)])
    as_recorded(said)


def test_a_rover_obeys_as_recorded(as_recorded):
    rover, station, said = Rover(7, 0.5, counts_per_metre=900.0), Packer(255, 190), []
    command, reader = dialect.MAVLink_command_long_message, Packer(9, 9)
    arm, mode, rate = (
        dialect.MAV_CMD_COMPONENT_ARM_DISARM,
        dialect.MAV_CMD_DO_SET_MODE,
        dialect.MAV_CMD_SET_MESSAGE_INTERVAL,
    )
    rest = (0.0,) * 5

    def speeds(speed, turn, frame=dialect.MAV_FRAME_BODY_NED, mask=1511):
        return dialect.MAVLink_set_position_target_local_ned_message(
            0, 7, 1, frame, mask, 0, 0, 0, speed, 0, 0, 0, 0, 0, 0, turn
        )

    for step, message in enumerate(
        [
            command(7, 1, rate, 0, 0, 200000, *rest),
            command(7, 1, rate, 0, 1, 500000, *rest),
            command(7, 1, rate, 0, 9000, 50000, *rest),
            command(7, 1, rate, 0, 9000, 0, *rest),
            command(7, 1, rate, 0, 33, 50000, *rest),
            command(8, 1, arm, 0, 1, 0, *rest),
            command(7, 1, mode, 0, 1, 15, *rest),
            command(7, 1, mode, 0, 1, 11, *rest),
            speeds(0.2, 0.1),
            command(7, 1, arm, 0, 1, 0, *rest),
            speeds(0.3, 0.4),
            command(7, 1, arm, 0, 1, 0, *rest),
            command(7, 1, mode, 0, 1, 15, *rest),
            speeds(0.5, 0.4, frame=dialect.MAV_FRAME_LOCAL_NED),
            speeds(0.6, 0.4, mask=1510),
            speeds(math.nan, 0.4),
            command(7, 1, arm, 0, 0, 0, *rest),
            command(7, 1, arm, 0, 0, 21196, *rest),
            command(7, 1, arm, 0, 1, 0, *rest),
            speeds(0.0, 0.0),
            command(7, 1, arm, 0, 0, 0, *rest),
            command(7, 1, dialect.MAV_CMD_NAV_LAND, 0, 1, 0, *rest),
            command(7, 1, mode, 0, 1, 4, *rest),
        ]
    ):
        now = 0.13 * step
        rover.take(station.pack(message), now)
        answers = [
            each.to_dict()
            for data in rover.reports(now, sensed(step, 11.5))
            for each in reader.unpack(data)
        ]
        said.append([*map(str, answers), rover.targets(now + 0.01)])
    as_recorded(said)


def test_a_board_answers_as_recorded(as_recorded):
    start = MODULUS - 900
    board, rng, said = UdpBoard(7, 0.2, boot=3, start=start), np.random.default_rng(6), []
    for step in range(160):
        now = 0.017 * step
        kind = OrderKind(int(rng.choice([1, 2, 2, 2, 2, 2, 3, 4, 4])))
        timed = kind in (OrderKind.COMMAND, OrderKind.ARM)
        ahead = int(rng.choice([-1, 0, 90, 100, 1000, 1001], p=[0.05, 0.1, 0.3, 0.3, 0.2, 0.05]))
        order = OrderDatagram(
            kind=kind,
            session=int(rng.choice([0, 9, 9, 9, 9, 9, 9, 10])),
            sequence=(MODULUS - 60 + step + int(rng.choice([0, 0, 0, -1, -3]))) % MODULUS,
            deadline=(round(1000 * now) + start + ahead) % MODULUS if timed else 0,
            speed=int(rng.integers(-500, 500)) if kind == OrderKind.COMMAND else 0,
            turn_rate=int(rng.integers(-500, 500)) if kind == OrderKind.COMMAND else 0,
            robot=int(rng.choice([7, 7, 7, 7, 7, 8])),
        )
        if rng.random() < 0.7:
            board.take(encode_order(order), now)
        targets = board.targets(now)
        reports = board.reports(now, sensed(step, 6.6 if step % 2 else 6.59))
        said.append([targets, board.state, *(each.hex() for each in reports)])
    as_recorded(said[::4] + said[-4:], "answers")
    numbers = [board._taken, board._refused, board._sequence]
    as_recorded([numbers, sum(bool(each[0]) for each in said)], "numbers")


def report(robot=7, sequence=1, clock=900, boot=3, **options):
    return ReportDatagram(
        **{
            "session": 1,
            "last_sequence": 5,
            "counts": (70, -80),
            "ranges": (100, 65535, 65534, 0),
            "battery": 7312,
            "hold": 12,
            "taken": 4,
            "refused": 1,
            "silence": 200,
            "state": RobotState.DRIVING,
            "flags": RobotFlag.LOW_BATTERY,
            **options,
            "robot": robot,
            "sequence": sequence % MODULUS,
            "clock": clock % MODULUS,
            "boot": boot,
        }
    )


def test_a_board_is_told_and_heard_as_recorded(clock, as_recorded):
    link, said = UdpLink([7], ["127.0.0.1:5000"]), []
    link.session = 0x04030201
    reports = [
        (-3, MODULUS - 200, 3, {}),
        (-1, MODULUS - 80, 3, {}),
        (-1, MODULUS - 30, 3, {}),
        (-2, MODULUS - 30, 3, {}),
        (0, 90, 3, {"silence": 201}),
        (2, 380, 3, {"silence": 0}),
        (3, 500, 3, {"silence": 1, "state": RobotState.IDLE}),
        (1, 20, 4, {}),
        (9, 900, 3, {}),
        (2, 290, 4, {"robot": 8}),
        (3, 600, 4, {"hold": 65535}),
    ]
    for step, order in orders():
        clock.now = 50.0 + 0.3 * step
        sent = link.encode(7, order).hex()
        sequence, time, boot, options = reports[step]
        try:
            link.decode(
                7, encode_report(report(sequence=sequence, clock=time, boot=boot, **options))
            )
            refused = ""
        except NoMessage as error:
            refused = str(error)
        said.append([sent, refused, link.telemetry().get(7), dict(link._slow)])
    as_recorded(said, "said")
    as_recorded(link.health(), "health")
    fast = Order(What.COMMAND, 1, clock.now, 40.0, -40.0)
    as_recorded(link.encode(7, fast).hex(), "too fast")


def turned(z, w, x=0.0, y=0.0):
    return Quaternion(x=x, y=y, z=z, w=w)


def test_headings_of_turns_are_as_recorded(as_recorded):
    place = Point(0.3, -0.7, 2.0)
    turns = [turned(0.6, 0.8), turned(-0.3, 0.5, 0.7, 0.4), turned(0.0, 0.9), turned(0.0, 0.901)]
    turns += [turned(0.0, 1.1), turned(0.0, 1.099), turned(0.65, 0.85, 0.1, -0.2)]
    as_recorded([planar(place, each) for each in turns])


@pytest.mark.parametrize("stamped", [False, True], ids=["plain", "stamped"])
def test_a_driver_answers_as_recorded(stamped, as_recorded):
    driver, said = Driver(0.5, stamped=stamped), []
    for step in range(14):
        twist = Twist(Vector3(x=0.1 * step, y=9.0), Vector3(x=5.0, z=-0.3 * step))
        if step == 6:
            twist.angular.z = math.inf
        message = TwistStamped(Header(Time(3, 7), "base"), twist) if stamped else twist
        now = 2.0 + 0.035 * step
        if step < 9:
            driver.take(message.serialize(), now)
        said.append(
            [
                *(each.hex()[:160] for each in driver.reports(now, sensed(step))),
                *(driver.targets(now + late) for late in (0.0, 0.3, 0.499, 0.5)),
            ]
        )
    driver.take(b"\x00\x00\x00\x00" + bytes(48), 9.0)
    driver.take(b"\x00\x01\x00\x00" + bytes(5), 9.0)
    as_recorded([said, driver.targets(9.0)], "said")
    (odometry,) = driver.reports(12.25, sensed(3))
    as_recorded(str(Odometry.deserialize(odometry)).split(", "), "odometry")


def odometry_at(stamp, x, y, heading, speed=0.0, rate=0.0):
    seconds, rest = divmod(stamp, 1)
    return Odometry(
        Header(Time(int(seconds), round(1e9 * rest)), "odom"),
        "base",
        PoseWithCovariance(Pose(Point(x, y), turned(math.sin(heading / 2), math.cos(heading / 2)))),
        TwistWithCovariance(Twist(Vector3(x=speed), Vector3(z=rate))),
    )


@pytest.mark.parametrize("stamped", [False, True], ids=["plain", "stamped"])
def test_a_driven_robot_is_told_and_heard_as_recorded(stamped, clock, as_recorded):
    link, written = DdsLink([4], ["/bot/"], chassis=CHASSIS, stamped=stamped), []
    writer = SimpleNamespace(write=lambda each: written.append(each.serialize().hex()))
    driven = link._driven[4] = _Driven(writer, None, OdometryCounts(CHASSIS))
    heard = [
        (1.2, 0.4, 0.1, 0.2, 0.0, 0.0, 1),
        (1.5, 0.45, 0.12, 0.3, 0.2, 0.0, 1),
        (1.5, 0.47, 0.13, 0.3, 0.2, 0.0, 1),
        (1.8, 0.5, 0.1, 0.3, 0.0, -0.3, 1),
        (2.1, 0.55, 0.1, 0.3, 0.011, 0.0, 1),
        (2.4, 0.6, 0.1, 0.3, 0.009, 0.009, 1),
        (2.7, 0.6, 0.1, math.nan, 0.2, 0.0, 1),
        (3.0, 0.6, 0.1, 0.3, 0.0, 0.0, 1),
        (3.3, 3.9, 0.1, 0.3, 0.0, 0.0, 1),
        (0.5, 0.0, 0.0, 0.0, 0.3, 0.0, 2),
    ]
    said = []
    for step, order in orders():
        clock.now = 50.0 + 0.3 * step
        before = len(written)
        link.transmit(4, order)
        *odometry, source = heard[step]
        link._take(4, driven, odometry_at(*odometry), source)
        said.append([written[before:], driven.last and driven.last.name, link.telemetry().get(4)])
    as_recorded(said)


def test_a_jump_is_farther_than_the_robot_can_have_gone(clock):
    link = DdsLink([4], ["bot"], chassis=CHASSIS)
    for beyond, known in ((-0.01, True), (0.01, False)):
        driven = link._driven[4] = _Driven(None, None, OdometryCounts(CHASSIS))
        link._take(4, driven, odometry_at(1.0, 0.2, 0.1, 0.0), 1)
        driven.last = What.ARM
        way = 2 * CHASSIS.top_speed * 0.5 + 0.1 + beyond
        link._take(4, driven, odometry_at(1.5, 0.2, 0.1 + way, 0.0), 1)
        assert (driven.last == What.ARM) is known
