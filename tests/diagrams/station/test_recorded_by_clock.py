"""What is done with robots that stand in is as recorded, by a clock that a test sets.

Nothing waits: whoever sleeps lets the laboratory go on by that time.
"""

from contextlib import contextmanager
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.diagrams.station import check, fault_campaign, kind_check, session
from sightfield.diagrams.station.check import identify
from sightfield.diagrams.station.fault_campaign import FAULTS, _Campaign, _Way
from sightfield.diagrams.station.hardware import Devices, FaultyPoses, Operator, swapped
from sightfield.diagrams.station.kind_check import check_kind
from sightfield.diagrams.station.session import drive_to_start
from sightfield.hardware_io.cameras import NoCamera
from sightfield.hardware_io.emulation import stand_in_laboratory
from sightfield.hardware_io.emulation.air import AirSettings
from sightfield.hardware_io.emulation.stand_in_laboratory import StandInLaboratory
from sightfield.hardware_io.kinds import udp_link
from sightfield.hardware_io.kinds.known_kinds import UDP
from sightfield.hardware_io.kinds.robot_kind import LATE, REORDERED, REPEATED, RobotFleet
from sightfield.hardware_io.kinds.udp_board import UdpBoard
from sightfield.hardware_io.kinds.udp_link import UdpLink
from sightfield.hardware_io.links import reporting_link, robot_link
from sightfield.hardware_io.links.reporting_link import NoMessage
from sightfield.hardware_io.mocap.pose_receiver import PoseReading
from sightfield.systems.numerics.errors import SightfieldError

STEP = 0.01


class Clock:
    """Takes the place of the module `time`; as it goes on, so does the laboratory."""

    def __init__(self):
        self.now, self.laboratory, self.meanwhile = 100.0, None, []

    def monotonic(self):
        return self.now

    def sleep(self, duration):
        end = self.now + max(duration, 1e-6) - 1e-9
        while self.now < end:
            self.now += STEP
            if self.laboratory is not None:
                self.laboratory._step(STEP, STEP)
            for act in self.meanwhile:
                act()


@pytest.fixture
def clock(monkeypatch):
    made = Clock()
    modules = (check, fault_campaign, kind_check, session, stand_in_laboratory)
    for module in (*modules, udp_link, reporting_link, robot_link):
        monkeypatch.setattr(module, "time", made)
    return made


class Changed:
    """A condition for which nobody waits in vain."""

    def __init__(self, clock):
        self._clock = clock

    def __enter__(self):
        return self

    def __exit__(self, *_):
        """Nobody else is there."""

    def notify_all(self):
        """Nobody waits."""

    def wait_for(self, predicate, patience):
        end = self._clock.now + patience
        while not predicate() and self._clock.now < end:
            self._clock.sleep(STEP)
        return predicate()


class Line:
    """Between a link and boards, without sockets."""

    def __init__(self):
        self.coming, self.link, self.sessions = [], None, 70

    def __enter__(self):
        return self

    def __exit__(self, *_):
        """Nothing is held."""

    def receive(self):
        coming, self.coming = self.coming, []
        return coming

    def send(self, k, payload):
        if self.link is not None:
            try:
                self.link.decode(self.link.robots[k], payload)
            except NoMessage:
                self.link.heard_nothing_of_use()


class NearLink(UdpLink):
    """Speaks by such a line."""

    def __init__(self, robots, line, clock):
        super().__init__(robots, [f"127.0.0.1:{5000 + robot}" for robot in robots])
        line.sessions += 1
        self.session, self._line, self._changed = line.sessions, line, Changed(clock)

    def connect(self):
        self._line.link = self
        self.heartbeat()

    def close(self):
        self._line.link = None

    def transmit(self, robot, order):
        data = self.encode(robot, order)
        if self._line.link is self:
            self._line.coming.append((self.robots.index(robot), data))


class Laboratory(StandInLaboratory):
    """Goes on with the clock alone."""

    def snapshot(self):
        return self._snapshot

    def place(self, k, pose):
        self._wheels.poses[k] = pose

    def set_encoder(self, k, wheel, sense):
        self._wheels.sense[k, wheel] = sense

    def reset_robot(self, k):
        self._boards[k] = self._make_board(k)


def laboratory_of(clock, robots, starts, line, make_board, air=None):
    made = Laboratory(robots, starts, make_board, line, air=air or AirSettings(delay=0.005))
    made._began, clock.laboratory = clock.now, made
    return made


def kind_with(board, clock, recognises=frozenset({LATE, REPEATED, REORDERED})):
    line = Line()

    @contextmanager
    def stand_in(fleet, around):
        def make(k):
            return board(fleet.robots[k], around.silence, boot=round(1000 * clock.now), start=7)

        yield laboratory_of(clock, fleet.robots, around.starts, line, make, around.air), fleet

    return replace(
        UDP,
        stand_in=stand_in,
        link=lambda fleet: NearLink(fleet.robots, line, clock),
        recognises=recognises,
    )


def test_the_trials_of_a_kind_say_what_is_recorded(clock, as_recorded):
    found = check_kind(kind_with(UdpBoard, clock))
    as_recorded([[each.name, each.passed, each.words] for each in found])


@pytest.mark.parametrize(
    "board",
    ["Runaway", "Forgetful", "Timeless", "Stubborn", "Mute", "Reversed", "Lame", "Eager"],
)
def test_robots_that_do_not_do_what_they_have_to_fail_as_recorded(
    board, ill_board, clock, as_recorded, monkeypatch
):
    monkeypatch.setattr(kind_check, "_PATIENCE", 0.7)
    found = check_kind(kind_with(ill_board(board), clock))
    as_recorded([[each.name, each.passed, each.words] for each in found])


def test_a_kind_that_recognises_nothing_is_tried_as_recorded(clock, ill_board, as_recorded):
    timeless = kind_with(ill_board("Timeless"), clock, frozenset())
    found = check_kind(timeless, ["late messages", "stop", "close"])
    as_recorded([[each.name, each.passed, each.words] for each in found])


class Cameras:
    """See the robots of the laboratory now."""

    def __init__(self, laboratory, clock):
        self._laboratory, self._clock, self.hidden = laboratory, clock, []

    def read(self):
        poses = self._laboratory.poses()
        stamps = np.full(len(poses), self._clock.now)
        stamps[self.hidden] = -np.inf
        return PoseReading(poses.copy(), stamps)

    def close(self):
        """Nothing is held."""


@pytest.fixture
def floor(load_laboratory, clock):
    """The six robots of the laboratory, armed: scenario, game and devices."""
    scenario, game = load_laboratory("radio.kind=udp")
    starts = np.concatenate([game.pursuer_starts, game.evader_starts])
    line, robots = Line(), tuple(scenario.robots)
    made = laboratory_of(
        clock, robots, starts, line, lambda k: UdpBoard(robots[k], 0.2, boot=5 + k, start=9)
    )
    link = NearLink(RobotFleet(robots=robots).robots, line, clock)
    link.connect()
    assert link.arm(timeout=2.0) == robots
    devices = Devices(poses=Cameras(made, clock), radio=link, camera=NoCamera(), laboratory=made)
    return scenario, game, devices, starts


def test_robots_drive_to_their_starts_as_recorded(floor, clock, as_recorded):
    scenario, game, devices, starts = floor
    devices.laboratory.place(0, np.array([*starts[3, :2], 1.0]))
    devices.laboratory.place(3, np.array([*starts[0, :2], 0.0]))
    devices.laboratory.place(4, starts[4] - [0.1, 0.0, 0.3])
    devices.laboratory.place(5, starts[5] + [0.05, 0.0, 0.0])
    devices.laboratory.place(1, starts[1] + [0.04, 0.0, 0.11])
    clock.sleep(0.05)
    driven = list(drive_to_start(scenario, game, devices))
    as_recorded([[each.name, each.aside] for each in driven], "driven")
    as_recorded([each.way for each in driven], "ways", relative=1e-4)
    as_recorded(devices.laboratory.poses(), "poses", relative=1e-4)
    as_recorded(clock.now, "until", relative=1e-3)


def test_who_is_there_is_told_to_within_a_few_centimetres(floor):
    scenario, game, devices, starts = floor
    ground = session._Floor(scenario, game, devices)
    for off, there in ((0.0449, True), (0.0451, False)):
        assert ground.is_there(2, starts + np.array([0.0, off, 0.0])) is there
    for turn, there in ((0.119, True), (-0.119, True), (0.121, False), (-0.121, False)):
        assert ground.is_there(2, starts + np.array([0.0, 0.0, turn])) is there


def test_a_way_to_a_start_that_is_taken_is_none(floor):
    scenario, game, devices, starts = floor
    ground = session._Floor(scenario, game, devices)
    radius = max(*scenario.radii, 0.1)
    for off, found in ((2 * radius + 0.001, True), (2 * radius - 0.001, False)):
        poses = starts.copy()
        goal = starts[1, :2].copy()
        poses[1, :2] = goal + np.array([off, 0.0])
        poses[0, :2] = goal - [0.5, 0.0]
        assert ground.route(0, poses, goal).found is found


def test_robots_that_are_not_seen_do_not_drive(floor):
    scenario, game, devices, _ = floor
    ground = session._Floor(scenario, game, devices)
    devices.poses.hidden = [1, 4]
    with pytest.raises(SightfieldError, match=r"not seen: \['pursuer1', 'evader1'\]"):
        ground.poses()


def test_robots_turn_to_show_who_they_are_as_recorded(floor, as_recorded):
    scenario, _, devices, _ = floor
    poses = FaultyPoses(devices.poses)
    poses.spoil(swapped(1, 4))
    found = list(identify(scenario, replace(devices, poses=poses)))
    as_recorded([each.words for each in found])


def test_faults_of_a_campaign_happen_as_recorded(floor, clock, as_recorded):
    _, game, devices, _ = floor
    poses, operator = FaultyPoses(devices.poses), Operator(running=False)
    names = [name for name in FAULTS if "radio" not in name]
    campaign = _Campaign(game, poses, devices.laboratory, operator, names, 3, 1.0)
    due = [0.0]
    velocities = np.array([[0.2, 0.4 * k - 1.0] for k in range(6)])

    def drive():
        campaign._now = clock.now - 100.0
        if clock.now < due[0]:
            return
        due[0] = clock.now + 0.05
        # Whoever is seen elsewhere than it is stands.
        seen, true = poses.read().poses, devices.laboratory.poses()
        wrong = np.abs(seen - true).max(axis=1) > 0.1
        running = operator.mode == 1.0 and not wrong.any()
        devices.radio.send_commands(velocities * running)

    clock.meanwhile.append(drive)
    campaign._run()
    assert campaign._failure is None
    as_recorded(
        [
            [each.fault, each.robots, each.time, each.until, each.rest, each.visible]
            for each in campaign.moments
        ],
        relative=1e-4,
    )


def test_a_fault_shows_when_its_wheels_have_gone_two_centimetres():
    laboratory = SimpleNamespace(time=1.0, speeds=np.array([[0.0, 0.0], [0.1, -0.3]]))
    laboratory.snapshot = lambda: SimpleNamespace(
        time=laboratory.time, wheel_speeds=laboratory.speeds
    )
    way = _Way(laboratory, 1, (0,))
    assert way.visible == np.inf
    for step, visible in ((0.1, np.inf), (0.099, np.inf), (0.002, 0.201), (0.3, 0.201)):
        laboratory.time += step
        way.look()
        assert way.visible == pytest.approx(visible)
    assert _Way(laboratory, 0, ()).visible == 0.0
