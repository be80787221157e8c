"""What the emulator is told, byte by byte, and how its laboratory keeps up with the clock."""

import math
import struct
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.hardware_io.emulation import laboratory
from sightfield.hardware_io.emulation.laboratory import EmulatedLaboratory
from sightfield.hardware_io.emulation.robot_body import RobotBody, sensor_voltages
from sightfield.hardware_io.emulation.robot_cores import (
    CoresReport,
    EmulationError,
    RobotCores,
)
from sightfield.systems.numerics.errors import InvalidInput, SightfieldError
from sightfield.systems.numerics.geometry.world import make_world

BODY = RobotBody(radius=0.11, battery=7.2)
STARTS = np.array([[0.5, 0.5, 0.1], [1.5, 1.2, -2.0]])
ANSWER = struct.Struct("=10dH")


class Pipe:
    """Takes the place of the emulator: keeps what is written, and answers as it is told."""

    def __init__(self, cores):
        self.written, self.coming, self.flushes = b"", b"", 0
        cores._process = SimpleNamespace(stdin=self, stdout=self)
        cores._write, cores._read = self.write, self.read

    def write(self, data, *, flush=False):
        self.written += data
        self.flushes += flush

    def read(self, count):
        found, self.coming = self.coming[:count], self.coming[count:]
        return found

    def answer(self, *numbers, serial=b""):
        self.coming += ANSWER.pack(*numbers, len(serial)) + serial


@pytest.fixture
def cores():
    made = RobotCores((3, 8), STARTS, body=BODY)
    made.pipe = Pipe(made)
    return made


def test_what_the_emulator_is_told(cores):
    cores.place(1, np.array([0.1, 0.2, 0.3]))
    cores.set_encoder(0, 1, -1)
    cores.jump(1, 70000)
    cores.set_sensors(0, np.array([0.1, 0.2, 0.3, 0.4]), 7.0)
    expected = b"p" + struct.pack("=B3d", 1, 0.1, 0.2, 0.3)
    expected += b"e" + struct.pack("=BBb", 0, 1, -1)
    expected += b"j" + struct.pack("=BI", 1, 70000)
    volts = sensor_voltages(np.array([0.1, 0.2, 0.3, 0.4]), 7.0)
    expected += b"v" + struct.pack("=B5d", 0, *volts)
    assert cores.pipe.written == expected
    cores.pipe.written = b""
    data = bytes(range(256)) * 9
    cores.send(1, data)
    first = b"u" + struct.pack("=BH", 1, 2048) + data[:2048]
    assert cores.pipe.written == first + b"u" + struct.pack("=BH", 1, 256) + data[2048:]


def test_a_long_stretch_is_gone_through_in_tenths_of_a_second(cores):
    ends = []
    step = cores._step

    def counted(serial):
        ends.append(cores.time)
        cores.pipe.answer(1.0, 2.0, 3.0, 0.1, 0.2, len(ends), 7.0, math.inf, 1.0, 1.0, serial=b"a")
        cores.pipe.answer(4.0, 5.0, 6.0, 0.3, 0.4, -len(ends), 8.0, 9.0, 0.0, 1.0)
        return step(serial)

    cores._step = counted
    report = cores.advance(0.25)
    assert ends == pytest.approx([0.1, 0.2, 0.25])
    assert cores.pipe.flushes == 3
    assert report.time == 0.25
    assert report.poses.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert report.wheel_speeds.tolist() == [[0.1, 0.2], [0.3, 0.4]]
    # The greatest of the whole stretch, and never below zero.
    assert report.top_power.tolist() == [3.0, 0.0]
    assert report.still_since.tolist() == [7.0, 8.0]
    assert report.unpowered_since.tolist() == [math.inf, 9.0]
    assert report.lit.tolist() == [True, False]
    assert report.serial == (b"aaa", b"")
    cores.advance(0.0)
    assert ends[3:] == [0.25]
    for duration in (-0.1, math.nan):
        with pytest.raises(InvalidInput, match="`duration`"):
            cores.advance(duration)


def test_a_processor_that_died_is_named(cores):
    numbers = (0.0,) * 9
    cores.pipe.answer(*numbers, 1.0)
    cores.pipe.answer(*numbers, 0.0)
    with pytest.raises(EmulationError, match=r"processor of robot 8 died at 0\.050 s"):
        cores.advance(0.05)


@pytest.mark.parametrize(
    ("robots", "starts"),
    [
        (range(33), np.zeros((33, 3))),
        ((3, 8), np.zeros((3, 3))),
        ((3, 8), np.zeros((2, 2))),
        ((3, 8), np.full((2, 3), np.nan)),
    ],
)
def test_robots_that_cannot_be_emulated_are_refused(robots, starts):
    with pytest.raises(InvalidInput, match="` must"):
        RobotCores(robots, starts)
    assert RobotCores(range(32), np.zeros((32, 3))).time == 0.0


class Cores:
    """Takes the place of the emulation in a laboratory."""

    def __init__(self):
        self.time, self.told, self.robots = 0.0, [], (3, 8)

    def report(self):
        poses, none = STARTS + np.array([self.time, 0.0, 0.0]), np.zeros(2)
        return CoresReport(
            self.time, poses, poses[:, :2], none, none + 1, none + 2, none > 0, (b"x", b"")
        )

    def advance(self, duration):
        self.told.append(("advance", round(duration, 6)))
        self.time += duration
        return self.report()

    def send(self, k, data):
        self.told.append(("send", k, data))

    def set_sensors(self, k, ranges, battery):
        self.told.append(("sensors", k, *np.round(ranges, 6).tolist(), battery))

    def place(self, *words):
        self.told.append(("place", *words))

    set_encoder = jump = place


@pytest.fixture
def lab(monkeypatch):
    """A function of options: a laboratory of two robots by a clock that its sleep sets."""
    clock = SimpleNamespace(now=10.0)

    def sleep(duration):
        assert 0 < duration <= 0.002
        clock.now += duration + 0.0001

    monkeypatch.setattr(
        laboratory, "time", SimpleNamespace(monotonic=lambda: clock.now, sleep=sleep)
    )

    def make(**options):
        made = EmulatedLaboratory((3, 8), STARTS, body=BODY, **options)
        made._cores, made.clock = Cores(), clock
        made._report, made._began = made._cores.report(), 10.0
        made.heard = []

        def exchange(time, serial):
            made.heard.append((round(time, 6), serial))
            if len(made.heard) == 60:
                made._leaving.set()
            return [b"", b"told"]

        made._radio = SimpleNamespace(exchange=exchange, air=SimpleNamespace(cut=False))
        return made

    return make


def test_a_laboratory_keeps_up_with_the_clock_and_feels_twenty_times_a_second(lab):
    world = make_world([[0, 0], [2, 0], [2, 2], [0, 2]])
    made = lab(world=world)
    made.place(1, "pose")
    made.set_encoder(0, 1, -1)
    made.reset_robot(1)
    made._run()
    told = made._cores.told
    assert told[:3] == [("place", 1, "pose"), ("place", 0, 1, -1), ("place", 1, 0)]
    assert [each for each in told if each[0] == "send"] == [("send", 1, b"told")] * 60
    steps = [each[1] for each in told if each[0] == "advance"]
    assert all(0.002 <= each <= 0.01 for each in steps)
    assert made._cores.time == pytest.approx(made.clock.now - 10.0, abs=0.0021)
    felt = [each for each in told if each[0] == "sensors"]
    assert len(felt) == 2 * (1 + int(made.heard[-1][0] / 0.05))
    assert made.heard[0] == (0.0, (b"x", b""))


def test_a_laboratory_that_is_behind_goes_five_steps_at_once_and_says_so(lab):
    made = lab()
    made._step(0.05)
    assert made._cores.told[-1] == ("advance", 0.01)
    assert made.snapshot().lag == pytest.approx(0.048)
    made._step(0.002)
    assert made._cores.told[-1] == ("advance", 0.002)
    seen = made.snapshot()
    assert (seen.lag, seen.time, seen.moment) == (0.0, 0.012, 10.012)
    assert made.wheel_speeds().tolist() == seen.wheel_speeds.tolist()
    assert (seen.still_since.tolist(), seen.unpowered_since.tolist()) == ([1, 1], [2, 2])
    assert made.cut_radio() == made.time() == 0.012
    assert made.air.cut is True
    made.restore_radio()
    assert made.air.cut is False


def test_ranges_are_set_where_there_is_no_world(lab):
    made = lab()
    made._feel()
    assert made._cores.told == []
    ranges = np.arange(8.0).reshape(2, 4)
    made.set_infrared(ranges)
    made._feel()
    assert made._cores.told == [
        ("sensors", 0, 0.0, 1.0, 2.0, 3.0, 7.2),
        ("sensors", 1, 4.0, 5.0, 6.0, 7.0, 7.2),
    ]
    for wrong in (ranges[:1], -ranges):
        with pytest.raises(InvalidInput, match="`ranges` must"):
            made.set_infrared(wrong)
    with pytest.raises(InvalidInput, match="`world` must be None"):
        lab(world=make_world([[0, 0], [2, 0], [2, 2]])).set_infrared(ranges)


def test_what_fails_in_the_laboratory_fails_for_whoever_looks(lab):
    made = lab()

    def fail(*_):
        raise SightfieldError("the emulator has ended")

    made._radio.exchange = fail
    made._run()
    with pytest.raises(SightfieldError, match="the emulator has ended"):
        made.snapshot()
    closed = lab()
    closed._report = None
    with pytest.raises(SightfieldError, match="the laboratory is closed"):
        closed.time()
