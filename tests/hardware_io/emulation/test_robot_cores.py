"""Firmware and runner are built once, and what is missing is named with its package.

The real firmware drives, stops, senses and recovers, on processors in simavr.
"""

import shutil
import signal
import subprocess
from contextlib import contextmanager

import numpy as np
import pytest

from sightfield.hardware_io.emulation import robot_cores
from sightfield.hardware_io.emulation.emulated_radio import ApiParser, api_frame
from sightfield.hardware_io.emulation.robot_cores import (
    EmulationError,
    MissingTool,
    RobotCores,
    ToolchainError,
    firmware_path,
    runner_path,
)
from sightfield.hardware_io.kinds.xbee_frames import (
    Acknowledgement,
    Arm,
    Command,
    Entry,
    Form,
    Heartbeat,
    RobotFlag,
    RobotState,
    Stop,
    Telemetry,
    decode,
    encode,
)
from sightfield.systems.numerics.errors import InvalidInput


def test_without_a_compiler_the_line_to_type_is_said(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(MissingTool, match="avr-gcc is not installed: sudo apt-get install gcc-avr"):
        firmware_path()
    with pytest.raises(MissingTool, match="cc is not installed: sudo apt-get install gcc"):
        runner_path()


@pytest.mark.usefixtures("emulator")
def test_a_build_is_kept_until_its_sources_change(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    first = firmware_path()
    made = first.stat().st_mtime_ns
    assert firmware_path() == first
    assert first.stat().st_mtime_ns == made

    changed = tmp_path / "firmware"
    shutil.copytree(robot_cores.FIRMWARE, changed)
    monkeypatch.setattr(robot_cores, "FIRMWARE", changed)
    robot = (changed / "robot.h").read_text()
    (changed / "robot.h").write_text(robot.replace("170U", "160U"))
    assert firmware_path() != first

    (changed / "main.c").write_text("int main(void) { return nothing; }\n")
    with pytest.raises(ToolchainError, match=r"robot.elf cannot be built: main\.c"):
        firmware_path()


pytestmark = pytest.mark.usefixtures("emulator")

SESSION = 1


class Team:
    """Robots with a station that is always heard."""

    def __init__(self, cores: RobotCores) -> None:
        self.cores, self.sequence = cores, 0
        self.parsers = [ApiParser() for _ in cores.robots]
        self.said: list[list] = [[] for _ in cores.robots]

    def send(self, make, **fields) -> None:
        self.sequence += 1
        frame = make(session=SESSION, sequence=self.sequence, **fields)
        packet = api_frame(bytes([0x80, *bytes(8), 40, 2]) + encode(frame))
        for k in range(len(self.cores.robots)):
            self.cores.send(k, packet)

    def advance(self, duration: float):
        report = self.cores.advance(duration)
        for k, stream in enumerate(report.serial):
            frames = self.parsers[k].take(stream)
            self.said[k] += [decode(frame[11:]) for frame in frames]
        return report

    def drive(self, velocities, duration: float, form: Form = Form.TWIST):
        """Command [m/s] and [rad/s], or wheels, at 20 Hz."""
        milli = np.rint(1000 * np.asarray(velocities, dtype=float)).astype(int)
        rows = zip(self.cores.robots, milli, strict=True)
        entries = tuple(Entry(robot, int(a), int(b)) for robot, (a, b) in rows)
        for _ in range(round(duration / 0.05)):
            self.send(Command, form=form, age=0, entries=entries)
            report = self.advance(0.05)
        return report

    def last(self, k: int) -> Telemetry:
        return [each for each in self.said[k] if isinstance(each, Telemetry)][-1]


@contextmanager
def armed_team(count: int, **options):
    with RobotCores(range(1, count + 1), np.zeros((count, 3)), **options) as cores:
        team = Team(cores)
        team.advance(0.1)
        team.send(Arm)
        team.advance(0.05)
        yield team


def test_wheels_reach_the_speeds_they_are_told():
    speeds = np.array([[0.3, 0.3], [0.1, -0.1], [-0.4, -0.2], [0.05, 0.6]])
    with armed_team(4) as team:
        report = team.drive(speeds, 1.5, Form.WHEELS)
        assert report.wheel_speeds == pytest.approx(speeds, abs=0.006)
        told = np.array([team.last(k).speeds for k in range(4)]) / 1000
        assert told == pytest.approx(speeds, abs=0.01)


@pytest.mark.parametrize("phase", [0.0, 0.0004, 0.0007])
def test_a_wheel_follows_a_step_within_a_third_of_a_second(phase):
    with armed_team(1) as team:
        team.advance(phase)
        fastest = max(team.drive([[0.3, 0.0]], 0.05).wheel_speeds[0, 0] for _ in range(7))
        assert fastest < 0.36
        assert team.drive([[0.3, 0.0]], 0.05).wheel_speeds[0] == pytest.approx([0.3] * 2, rel=0.05)


def test_a_robot_drives_the_circle_that_its_twist_describes():
    with armed_team(1) as team:
        before = team.drive([[0.3, 1.0]], 1.0).poses[0]
        # Half a turn later it has gone the diameter of a circle of radius v / omega, sideways.
        after = team.drive([[0.3, 1.0]], 3.15).poses[0]
        turned = after[2] - before[2]
        chord = 2 * 0.3 * np.sin(0.5 * turned)
        assert turned == pytest.approx(3.15, abs=0.03)
        assert np.hypot(*(after - before)[:2]) == pytest.approx(chord, abs=0.01)


def test_encoders_count_the_way():
    with armed_team(1) as team:
        team.drive([[0.2, 0.0]], 1.0)
        report = team.advance(0.6)
        metres = np.array(team.last(0).counts) / team.cores.body.counts_per_metre
        assert metres == pytest.approx([report.poses[0, 0]] * 2, abs=0.001)


@pytest.mark.parametrize("phase", [0.0, 0.013, 0.031])
def test_every_robot_stands_within_300_ms_of_silence_from_any_speed(phase):
    # Top speed, usual speed, a turn on the spot, backwards.
    speeds = [[0.6, 0.6], [0.3, 0.3], [0.6, -0.6], [-0.6, -0.4]]
    with armed_team(4) as team:
        team.drive(speeds, 0.5, Form.WHEELS)
        team.advance(phase)
        entries = tuple(Entry(k + 1, *(int(1000 * v) for v in speeds[k])) for k in range(4))
        team.send(Command, form=Form.WHEELS, age=0, entries=entries)
        silence = team.advance(0.02).time
        report = team.advance(0.6)
        assert (report.still_since - silence < 0.3).all()
        assert (report.unpowered_since - silence < 0.2).all()
        assert {team.last(k).state for k in range(4)} == {RobotState.LOST}


def test_what_a_full_line_has_no_room_for_is_dropped_and_the_robot_lives():
    with armed_team(1) as team:
        entries = (Entry(1, 300, 0),)
        for _ in range(300):
            team.send(Command, form=Form.TWIST, age=0, entries=entries)
        team.advance(1.5)
        assert team.drive([[0.1, 0.0]], 0.5).wheel_speeds[0] == pytest.approx([0.1] * 2, rel=0.1)


def test_a_robot_that_was_not_armed_does_not_move():
    with RobotCores([1], np.zeros((1, 3))) as cores:
        team = Team(cores)
        team.advance(0.1)
        report = team.drive([[0.3, 0.0]], 0.5)
        assert (report.poses == 0).all()
        assert team.last(0).state == RobotState.DISARMED


def test_an_emergency_stop_holds_until_the_robot_is_armed():
    with armed_team(1) as team:
        team.drive([[0.5, 0.0]], 0.5)
        team.send(Stop)
        stopped = team.drive([[0.5, 0.0]], 0.5)
        assert stopped.still_since[0] < stopped.time - 0.3
        assert team.last(0).state == RobotState.STOPPED
        (answer,) = (a for a in team.said[0] if isinstance(a, Acknowledgement) and a.kind == 3)
        assert answer.state == RobotState.STOPPED
        team.send(Arm)
        team.advance(0.02)
        assert team.drive([[0.5, 0.0]], 0.5).wheel_speeds[0] == pytest.approx([0.5, 0.5], abs=0.02)


def test_a_processor_that_runs_astray_is_reset_and_the_robot_waits():
    listing = subprocess.run(
        ["avr-nm", firmware_path()], capture_output=True, text=True, check=True
    )
    # An endless loop, with interrupts off.
    (address,) = (
        int(line.split()[0], 16)
        for line in listing.stdout.splitlines()
        if line.endswith(" __stop_program")
    )
    with armed_team(1) as team:
        team.drive([[0.3, 0.0]], 0.5)
        team.cores.jump(0, address)
        report = team.drive([[0.3, 0.0]], 0.8)
        assert report.still_since[0] < report.time - 0.4
        assert team.last(0).state == RobotState.DISARMED
        assert RobotFlag.WATCHDOG_RESET in team.last(0).flags


@pytest.mark.parametrize("speed", [0.1, 0.3, -0.5])
@pytest.mark.parametrize(
    ("wheel", "sense", "flag"),
    [(0, 0, RobotFlag.LEFT_STALLED), (1, -1, RobotFlag.RIGHT_STALLED)],
)
def test_a_wheel_whose_encoder_fails_cuts_the_motors_until_the_robot_is_armed(
    speed, wheel, sense, flag
):
    with armed_team(1) as team:
        team.drive([[speed, 0.0]], 0.6)
        team.cores.set_encoder(0, wheel, sense)
        # Its error first has to raise the power of a slow wheel.
        report = team.drive([[speed, 0.0]], 0.3)
        assert (report.unpowered_since - 0.75 <= 0.2).all()
        report = team.drive([[speed, 0.0]], 0.3)
        assert (report.wheel_speeds == 0).all()
        assert flag in team.last(0).flags
        team.cores.set_encoder(0, wheel, 1)
        assert (team.drive([[speed, 0.0]], 0.2).wheel_speeds == 0).all()
        team.send(Arm)
        report = team.drive([[speed, 0.0]], 0.5)
        assert report.wheel_speeds[0] == pytest.approx([speed, speed], abs=0.03)
        assert flag not in team.last(0).flags


def blinks(team, send, seconds=2.0):
    """How often the lamp goes on while something is sent, and for which part of the time."""
    lit = []
    for _ in range(round(seconds / 0.05)):
        send()
        lit += [team.advance(0.01).lit[0] for _ in range(5)]
    lit = np.array(lit)
    return (lit[1:] & ~lit[:-1]).sum(), lit.mean()


def test_the_lamp_tells_what_a_robot_does():
    def nothing():
        """Is sent."""

    with RobotCores([1], np.zeros((1, 3))) as cores:
        team = Team(cores)
        for first, send, times, part, state in (
            (None, nothing, 1, 0.025, RobotState.DISARMED),
            (Arm, lambda: team.drive([[0.2, 0.0]], 0.05), 0, 1.0, RobotState.DRIVING),
            (None, lambda: team.send(Heartbeat), 2, 0.5, RobotState.IDLE),
            (None, nothing, 4, 0.1, RobotState.LOST),
            (Stop, nothing, 10, 0.5, RobotState.STOPPED),
        ):
            if first is not None:
                team.send(first)
            # What comes before has its effect yet.
            team.advance(0.3)
            seen, lit = blinks(team, send)
            assert team.last(0).state == state
            assert abs(seen - times) <= 1
            assert lit == pytest.approx(part, abs=0.06 if times == 0 else 0.03), state


def test_ranges_and_battery_come_through_the_converter():
    ranges = np.array([0.0, 0.05, 0.2, 0.39])
    with armed_team(1) as team:
        team.cores.set_sensors(0, ranges, 7.2)
        team.advance(0.5)
        assert np.array(team.last(0).ranges) / 1000 == pytest.approx(ranges, abs=0.01)
        assert team.last(0).battery == pytest.approx(7200, abs=15)
        assert RobotFlag.LOW_BATTERY not in team.last(0).flags
        team.cores.set_sensors(0, np.full(4, 2.0), 6.4)
        team.advance(0.5)
        assert team.last(0).ranges == (400, 400, 400, 400)
        assert RobotFlag.LOW_BATTERY in team.last(0).flags


def test_the_same_calls_give_the_same_run():
    def run():
        with armed_team(2) as team:
            report = team.drive([[0.3, 1.0], [0.1, -2.0]], 0.6)
            return report.poses, report.serial

    (first, first_said), (second, second_said) = run(), run()
    assert (first == second).all()
    assert first_said == second_said


def test_what_cannot_be_emulated_is_refused():
    with pytest.raises(InvalidInput, match="`robots` must be a whole number 0 to 254"):
        RobotCores([255], np.zeros((1, 3)))
    with pytest.raises(InvalidInput, match=r"`starts` must have shape \(2, 3\)"):
        RobotCores([1, 2], np.zeros((1, 3)))
    with pytest.raises(EmulationError, match="not running"):
        RobotCores([1], np.zeros((1, 3))).advance(0.1)
    with armed_team(1) as team, pytest.raises(InvalidInput, match="`duration`"):
        team.cores.advance(-1.0)


def test_an_emulator_that_dies_is_an_error():
    with armed_team(1) as team:
        team.cores.send(9, b"x")
        with pytest.raises(EmulationError, match="has ended: no such robot"):
            team.cores.advance(0.1)


@pytest.mark.timeout(60)
@pytest.mark.parametrize("number", [signal.SIGSTOP, signal.SIGKILL])
def test_an_emulator_that_answers_no_more_is_an_error(number):
    def go_on(cores):
        while True:
            cores.send(0, bytes(2048))
            cores.advance(0.01)

    with RobotCores([1], np.zeros((1, 3))) as cores:
        assert cores._process is not None
        cores._process.send_signal(number)
        with pytest.raises(EmulationError, match="the emulator has"):
            go_on(cores)
