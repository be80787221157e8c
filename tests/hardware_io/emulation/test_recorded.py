"""Wheels that stand in, the air, and the module's frames do what is recorded."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.hardware_io.emulation import stand_in_laboratory
from sightfield.hardware_io.emulation.air import Air, AirSettings, Flight
from sightfield.hardware_io.emulation.emulated_radio import (
    ApiParser,
    SendRequest,
    XBeeModule,
    api_frame,
)
from sightfield.hardware_io.emulation.robot_body import (
    RobotBody,
    StandInWheels,
    sensor_voltages,
)
from sightfield.hardware_io.emulation.stand_in_laboratory import StandInLaboratory
from sightfield.systems.numerics.errors import SightfieldError
from sightfield.systems.numerics.geometry.world import make_world

BODY = RobotBody(
    radius=0.12, track_width=0.21, friction=0.05, time_constant=0.06, top_speed=0.7, battery=7.1
)


def test_wheels_turn_as_recorded(as_recorded):
    rng = np.random.default_rng(2)
    robots = StandInWheels(rng.uniform(-1, 1, (6, 3)), BODY)
    robots.sense[1] = (0.0, -1.0)
    rows = []
    for step in range(60):
        if step % 10 == 0:
            targets = rng.uniform([-0.9, -4], [0.9, 4], (6, 2)) * (step % 30 > 0)
            targets[2] *= 0.05
        robots.step(targets, 0.02)
        rows.append(robots.speeds.copy())
    as_recorded([np.array(rows), robots.poses, robots.odometry, robots.counts()])
    as_recorded([BODY.stopping_time(speed) for speed in (0.0, 0.3, -0.5)], "stopping")
    as_recorded([BODY.counts_per_metre, RobotBody()], "body")
    assert math.isinf(RobotBody(friction=0.0).stopping_time(0.3))


def test_voltages_of_the_sensors_are_as_recorded(as_recorded):
    as_recorded(sensor_voltages(np.array([0.0, 0.07, 0.2, 0.8]), 7.3))


def test_flights_arrive_as_recorded(as_recorded):
    air, found = Air(AirSettings(frame_loss=0.4, delay=0.03, jitter=0.05), 5), []
    for step in range(40):
        now = 0.01 * step
        flight = Flight(0, 1 + step % 3, bytes([step]), step % 2 == 0)
        air.cut = 15 < step < 20
        sent = air.send(flight, now)
        found.append([sent, *(each.payload[0] for each in air.arrivals(now))])
    as_recorded(found, "flights")
    as_recorded(air.next_arrival(), "next")


def test_what_is_kept_of_the_air_is_let_go_in_the_order_that_is_arranged():
    air = Air(AirSettings(frame_loss=1.0, delay=9.0), 0)
    flights = [Flight(0, 1, bytes([k]), False) for k in range(3)]
    assert not air.send(flights[0], 0.0)
    air.keep()
    assert all(air.send(each, 0.0) for each in flights)
    assert air.kept() == flights
    air.let_go(lambda sent: sent[::-1])
    assert air.next_arrival() == -math.inf
    assert air.arrivals(0.0) == flights[::-1]
    assert (air.kept(), air.next_arrival()) == ([], math.inf)


@pytest.mark.parametrize(
    ("settings", "good"),
    [
        ({"frame_loss": 1.0}, True),
        ({"frame_loss": 0.0, "rssi": 0}, True),
        ({"rssi": -255}, True),
        ({"delay": -0.001}, False),
        ({"jitter": -0.001}, False),
        ({"frame_loss": 1.001}, False),
        ({"frame_loss": -0.001}, False),
        ({"rssi": -256}, False),
        ({"rssi": 1}, False),
    ],
)
def test_settings_of_the_air_have_these_limits(settings, good):
    if good:
        assert AirSettings(**settings).rssi == settings.get("rssi", -48)
    else:
        with pytest.raises(ValueError, match="must be"):
            AirSettings(**settings)


def test_frames_on_the_line_are_as_recorded(as_recorded):
    module = XBeeModule(5)
    commands = [b"AP", b"HV", b"VR", b"SH", b"SL", b"NI", b"MY", b"CE", b"ID", b"CH", b"ni", b"XX"]
    answers = [module.take(api_frame(b"\x08\x03" + each))[0] for each in commands]
    answers.append(module.take(api_frame(b"\x09\x04NI"))[0])
    answers.append(module.take(api_frame(b"\x08\x00NI"))[0])
    answers.append(module.take(api_frame(b"\x08\x03NIother"))[0])
    answers.append(module.take(api_frame(b"\x08\x03N"))[0])
    as_recorded([each.hex() for each in answers], "answers")
    as_recorded(module.received(3, b"\x11~}", -61, True).hex(), "received")
    as_recorded(
        [module.report(SendRequest(8, 2, b"x"), each).hex() for each in (True, False)], "told"
    )
    head = bytes([0, 9]) + (0x0013A20040000002).to_bytes(8, "big") + b"\0"
    for size, taken in ((0, 0), (1, 1), (100, 1), (101, 0)):
        assert len(module.take(api_frame(head + bytes(size)))[1]) == taken


def test_frames_that_are_too_long_empty_or_damaged_are_passed_over():
    whole = api_frame(b"right")
    for length, found in ((128, 1), (129, 0)):
        assert len(list(ApiParser().take(api_frame(bytes(length))))) == found
    damaged = bytearray(api_frame(b"wrong"))
    damaged[-1] ^= 1
    assert list(ApiParser().take(bytes(damaged) + whole)) == [b"right"]
    assert list(ApiParser().take(b"~\x00\x00\xff" + whole)) == [b"right"]


class Board:
    """Drives for a while, and tells what it senses."""

    def __init__(self, k):
        self.k, self.taken, self.sensed = k, [], None

    def take(self, payload, now):
        self.taken.append((round(now, 6), payload))

    def targets(self, now):
        return (0.2 + 0.1 * self.k, 0.5) if 0.05 < now < 0.25 else None

    def reports(self, now, sensed):
        self.sensed = sensed
        return [bytes([self.k])]


class Line:
    """A wire over which one message comes, and on which reports are kept."""

    def __init__(self):
        self.coming, self.sent = [(1, b"go")], []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        """Nothing is held."""

    def receive(self):
        coming, self.coming = self.coming, []
        return coming

    def send(self, k, payload):
        self.sent.append((k, payload[0]))


def test_a_laboratory_steps_as_recorded(as_recorded):
    world = make_world([[0, 0], [3, 0], [3, 2], [0, 2]])
    line, starts = Line(), np.array([[0.4, 0.5, 3.0], [2.6, 1.7, 0.5]])
    lab = StandInLaboratory(
        [3, 8],
        starts,
        Board,
        line,
        air=AirSettings(delay=0.011, jitter=0.009),
        world=world,
        body=BODY,
    )
    looks = []
    for step in range(60):
        lab._step(0.01, 0.004 + 0.001 * (step % 3))
        if step % 6 == 5:
            seen = lab.snapshot()
            looks.append(
                [seen.time, seen.poses, seen.wheel_speeds, seen.still_since, seen.unpowered_since]
            )
            looks[-1].append(seen.lag)
    as_recorded(looks, "looks")
    as_recorded([[board.sensed, board.taken] for board in lab._boards], "boards")
    as_recorded([*line.sent[:8], len(line.sent)], "reports")
    lab.set_encoder(1, 0, -1)
    lab.place(0, np.array([1.0, 1.0, 0.0]))
    lab.reset_robot(1)
    while not lab._asked.empty():
        lab._asked.get()()
    assert lab._wheels.sense.tolist() == [[1, 1], [-1, 1]]
    assert lab._wheels.poses[0].tolist() == [1.0, 1.0, 0.0]
    assert lab._boards[1].sensed is None


@pytest.mark.parametrize(
    ("settings", "good"),
    [
        ({"radius": 0.0}, False),
        ({"friction": 0.0}, True),
        ({"friction": -0.1}, False),
        ({"battery": 0.0}, True),
        ({"battery": 10.0}, True),
        ({"battery": 10.01}, False),
        ({"battery": -0.01}, False),
    ],
)
def test_a_body_has_these_limits(settings, good):
    if good:
        assert RobotBody(**settings).track_width == 0.16
    else:
        with pytest.raises(ValueError, match="` must be"):
            RobotBody(**settings)


def test_a_laboratory_feels_its_walls_from_the_beginning():
    world, line = make_world([[0, 0], [3, 0], [3, 2], [0, 2]]), Line()
    done = []
    line.__class__ = type("Noted", (Line,), {"__exit__": lambda *_: done.append("closed")})
    lab = StandInLaboratory(
        [3], np.array([[0.2, 0.5, 3.1]]), Board, line, air=AirSettings(), world=world
    )
    lab._thread = SimpleNamespace(
        start=lambda: done.append("start"), join=lambda: done.append("join")
    )
    assert np.isinf(lab._ranges).all()
    with lab:
        assert lab._ranges.min() < 0.15
        assert done == ["start"]
        assert lab.snapshot().moment == lab._began > 0
    assert done == ["start", "join", "closed"]
    assert lab._leaving.is_set()


@pytest.mark.parametrize("starts", [np.zeros((2, 2)), np.zeros((1, 3)), np.full((2, 3), np.inf)])
def test_starts_of_a_laboratory_are_finite_poses(starts):
    with pytest.raises(ValueError, match="`starts` must"):
        StandInLaboratory([3, 8], starts, Board, Line(), air=AirSettings())


def test_a_laboratory_goes_on_in_steps_of_four_to_twenty_milliseconds(monkeypatch):
    clock = SimpleNamespace(now=7.0)
    monkeypatch.setattr(
        stand_in_laboratory,
        "time",
        SimpleNamespace(
            monotonic=lambda: clock.now,
            sleep=lambda duration: setattr(clock, "now", clock.now + duration + 1e-6),
        ),
    )
    lab = StandInLaboratory([3], np.zeros((1, 3)), Board, Line(), air=AirSettings())
    lab._began, steps = 7.0, []

    def step(dt, behind):
        steps.append((round(dt, 4), round(behind, 4)))
        lab._time += dt
        if len(steps) == 2:
            clock.now += 0.05
        if len(steps) == 6:
            lab._leaving.set()

    lab._step = step
    lab.place(0, np.ones(3))
    lab._run()
    assert steps == [
        (0.004, 0.004),
        (0.004, 0.004),
        (0.02, 0.05),
        (0.02, 0.03),
        (0.01, 0.01),
        (0.004, 0.004),
    ]
    assert lab.poses().tolist() == [[0, 0, 0]]
    assert lab._wheels.poses.tolist() == [[1, 1, 1]]

    def fail(dt, behind):
        raise RuntimeError("a wheel")

    lab._leaving.clear()
    lab._step = fail
    lab._run()
    with pytest.raises(SightfieldError, match="has failed: RuntimeError"):
        lab.time()
