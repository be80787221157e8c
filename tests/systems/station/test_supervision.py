"""Robots with the laboratory's delays, their faults, and how soon the supervisor holds them."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.station.motion_checks import (
    Chassis,
    check_motion,
    forgiven,
    no_motion,
    wheel_speeds,
    with_sent,
)
from sightfield.systems.numerics.station.pose_checks import PoseLimits, check_poses, no_poses
from sightfield.systems.numerics.station.supervision import (
    Reason,
    Signs,
    Standing,
    SupervisionRules,
    no_supervision,
    supervise,
    transitions,
)

CHASSIS = Chassis()
LIMITS = PoseLimits(top_speed=0.3, top_turn_rate=3.0, bounds=(-50.0, -50.0, 50.0, 50.0))
PERIOD, COUNT = 0.05, 4
# Of the model: 10 ms steps, wheels that lag by 60 ms, air of 50 ms that loses a tenth of the
# frames, reports five times a second, and poses that are some tenths of a millimetre off.
STEP, LAG, AIR, LOSS, REPORTS = 0.01, 0.06, 0.05, 0.1, 0.2
# Wheels that hear nothing for so long stop [s].
SILENCE = 0.17


class Floor:
    """Robots on a floor without walls, supervised.

    Args:
        seed: Of commands, losses and noise.
        fault: What goes wrong with robot 0 (robots 0 and 1 if bodies are swapped), "" for nothing.
        moment: When [s].
        clear_at: When the operator says start [s].
        rules: Of the supervisor.
    """

    def __init__(self, seed, fault="", moment=np.inf, *, clear_at=np.inf, rules=None):
        self.random: Any = np.random.default_rng(seed)
        self.fault, self.moment, self.clear_at = fault, moment, clear_at
        self.rules = rules or SupervisionRules()
        starts = np.zeros((COUNT, 3))
        starts[:, 0] = 2.0 * np.arange(COUNT)
        starts[:, 2] = self.random.uniform(-np.pi, np.pi, COUNT)
        self.poses, self.wheels = starts.copy(), np.zeros((COUNT, 2))
        self.ways = np.zeros((COUNT, 2))
        self.heard = np.full(COUNT, -np.inf)
        self.obeyed = np.zeros((COUNT, 2))
        self.air, self.reports = [], []
        self.counts, self.stamps = np.zeros((COUNT, 2)), np.full(COUNT, -np.inf)
        self.states = np.full(COUNT, -1.0)
        self.phase = self.random.uniform(0, REPORTS, COUNT)
        self.wanted = np.zeros((COUNT, 2))
        self.known = no_poses(starts)
        self.motion, self.kept = no_motion(COUNT), no_supervision(COUNT)
        # What the motion capture says of a body that stands still for it.
        self.stuck: np.ndarray | None = None
        self.held, self.history, self.running = {}, [], 0

    def measured(self, time):
        """Poses as the motion capture tells them, and which are valid."""
        noise = self.random.normal(0, 1, (COUNT, 3)) * (3e-4, 3e-4, 1e-3)
        poses, valid = self.poses + noise, np.ones(COUNT, bool)
        if time < self.moment:
            return poses, valid
        if self.fault == "swap":
            poses[[0, 1]] = poses[[1, 0]]
        elif self.fault == "flip":
            poses[0, 2] += np.pi
        elif self.fault == "jump":
            poses[0, 0] += 1.0
        elif self.fault == "outside":
            poses[0, :2] = 1e6
        elif self.fault == "nan":
            poses[0] = np.nan
        elif self.fault == "frozen":
            valid[:] = False
        elif self.fault == "stuck":
            self.stuck = poses[0].copy() if self.stuck is None else self.stuck
            poses[0] = self.stuck
        return poses, valid

    def drive(self, time):
        """Let a step pass."""
        for item in [each for each in self.air if each[0] <= time]:
            self.air.remove(item)
            _, robot, command = item
            self.heard[robot], self.obeyed[robot] = time, command
        obeyed = np.where((time - self.heard < SILENCE)[:, np.newaxis], self.obeyed, 0.0)
        wanted = wheel_speeds(CHASSIS, obeyed)
        if self.fault == "reset" and time >= self.moment:
            wanted[0] = 0.0
        if self.fault == "dead motors" and time >= self.moment:
            wanted[0] = 0.0
        self.wheels += STEP / LAG * (wanted - self.wheels)
        ways = STEP * self.wheels
        self.poses[:, 2] += (ways[:, 1] - ways[:, 0]) / CHASSIS.track_width
        ahead = ways.mean(axis=1)
        self.poses[:, 0] += ahead * np.cos(self.poses[:, 2])
        self.poses[:, 1] += ahead * np.sin(self.poses[:, 2])
        counted = ways.copy()
        if time >= self.moment:
            if self.fault == "dead encoder":
                counted[0, 0] = 0.0
            elif self.fault == "reversed encoder":
                counted[0, 0] *= -1
        self.ways += counted
        for k in np.flatnonzero((time - self.phase) % REPORTS < STEP - 1e-9):
            state = 2.0
            if time >= self.moment and k == 0:
                state = {"reset": 0.0, "foreign stop": 4.0}.get(self.fault, 2.0)
            counts = np.floor(CHASSIS.counts_per_metre * self.ways[k])
            if not (self.fault == "silent" and time >= self.moment and k == 0):
                self.reports.append((time + AIR, k, counts, state))
        for item in [each for each in self.reports if each[0] <= time]:
            self.reports.remove(item)
            self.stamps[item[1]], self.counts[item[1]], self.states[item[1]] = (
                item[0],
                item[2],
                item[3],
            )

    def tick(self, time):
        """What the station does at a tick."""
        change = self.random.random(COUNT) < 0.08
        speeds = self.random.uniform(-0.05, 0.3, COUNT) * (self.random.random(COUNT) < 0.7)
        turns = self.random.uniform(-3, 3, COUNT) * (self.random.random(COUNT) < 0.5)
        self.wanted[change] = np.stack([speeds, turns], axis=1)[change]
        poses, valid = self.measured(time)
        cleared = self.clear_at <= time < self.clear_at + PERIOD - 1e-9
        if cleared:
            never = np.full(COUNT, -np.inf)
            self.known = self.known._replace(stamps=never, looked=never)
            self.motion = forgiven(self.motion)
        stamps = np.full(COUNT, time - 0.005)
        self.known = check_poses(LIMITS, self.known, poses, stamps, valid)
        self.motion, faults = check_motion(
            CHASSIS,
            self.motion,
            time=time,
            period=PERIOD,
            poses=self.known.poses,
            good=valid & (self.known.verdicts == 0),
            stamps=stamps,
            pose_ages=time - stamps,
            counts=self.counts,
            ages=time - self.stamps,
        )
        self.kept, decision = supervise(
            self.rules,
            self.kept,
            Signs(
                time=time,
                valid=valid.astype(float),
                pose_faults=self.known.verdicts,
                motion_faults=faults,
                floor_faults=np.zeros(COUNT),
                robot_states=self.states,
                robot_flags=np.zeros(COUNT),
                ages=time - self.stamps,
                mode=1.0,
                cleared=cleared,
                view_age=0.0,
            ),
        )
        go = decision.standings == Standing.RUNNING
        sent = np.where(go[:, np.newaxis], self.wanted, 0.0)
        self.motion = with_sent(CHASSIS, self.motion, sent)
        self.history.append((time, decision))
        for k in np.flatnonzero(~go):
            self.held.setdefault(int(k), (time, Reason(int(decision.reasons[k]))))
        for late in (0.0, 0.5 * PERIOD):
            for k in range(COUNT):
                if self.random.random() >= LOSS:
                    self.air.append((time + late + AIR, k, sent[k]))

    def run(self, seconds):
        """Let so much time pass [s]; returns itself."""
        for step in range(round(seconds / STEP)):
            if step % round(PERIOD / STEP) == 0:
                self.tick(step * STEP)
            self.drive(step * STEP)
        return self


@pytest.mark.parametrize("seed", range(6))
def test_nobody_is_held_without_a_reason(seed):
    assert Floor(seed).run(8.0).held == {}


@pytest.mark.parametrize(
    ("fault", "reason", "soon"),
    [
        ("swap", Reason.JUMP, 0.05),
        ("flip", Reason.FLIP, 0.05),
        ("jump", Reason.JUMP, 0.05),
        ("outside", Reason.OUTSIDE, 0.05),
        ("nan", Reason.OUTSIDE, 0.05),
        ("frozen", Reason.NOT_SEEN, 0.05),
        ("reset", Reason.RESET, 0.3),
        ("foreign stop", Reason.FOREIGN_STOP, 0.3),
        ("silent", Reason.SILENT, 1.3),
    ],
)
def test_a_robot_with_a_fault_is_held_and_the_others_go_on(fault, reason, soon):
    for seed in range(3):
        moment = 2.0 + 0.37 * seed
        floor = Floor(seed, fault, moment).run(moment + soon + 0.3)
        affected = {"swap": {0, 1}, "frozen": set(range(COUNT))}.get(fault, {0})
        assert set(floor.held) == affected
        when, why = floor.held[0]
        if fault == "reset" and why == Reason.NOT_FOLLOWING:
            # Its pose says so before its report does.
            why = Reason(int(floor.history[-1][1].reasons[0]))
        assert why == reason
        assert moment <= when <= moment + soon + 1e-9


def steady(fault, moment, seconds, speed=0.2, **options):
    """A floor on which everybody drives straight on at a speed [m/s]."""
    floor = Floor(5, fault, moment, **options)
    floor.wanted[:, 0] = speed
    source = np.random.default_rng(1)
    # Commands stay as they are, and a tenth of the frames is lost.
    floor.random = SimpleNamespace(
        normal=source.normal,
        uniform=source.uniform,
        random=lambda size=None: np.ones(size) if size else source.random(),
    )
    return floor.run(seconds)


@pytest.mark.parametrize("speed", [0.09, 0.2, 0.3])
def test_a_body_that_stands_still_for_the_cameras_alone_is_held_within_decimetres(speed):
    for moment in (2.0, 2.13, 2.27):
        floor = steady("stuck", moment, moment + 3.0, speed)
        assert set(floor.held) == {0}
        when, why = floor.held[0]
        assert why in (Reason.NOT_FOLLOWING, Reason.ODOMETRY)
        assert when - moment < 0.45
        # It is not tried again: its encoders tell that it moved.
        assert floor.history[-1][1].reasons[0] == Reason.ODOMETRY
        assert floor.stuck is not None
        stood = floor.stuck[:2] - floor.poses[0, :2]
        assert np.hypot(*stood) < 0.15


def test_ticks_that_come_late_are_no_fault_of_a_robots():
    """Every eighth tick comes 0.3 s late, while robots drive on at full speed."""
    random, memory, moment = np.random.default_rng(4), no_motion(1), 10.0
    for tick in range(400):
        moment += 0.3 if tick % 8 == 0 else random.uniform(0.9, 1.1) * PERIOD
        seen, measured = moment - 0.01, 0.2 * np.floor((moment - CHASSIS.report_delay) / 0.2)
        way = 0.3 * (measured - 10.0)
        memory, faults = check_motion(
            CHASSIS,
            memory,
            time=tick * PERIOD,
            period=PERIOD,
            poses=np.array([[0.3 * (seen - 10.0), 0.0, 0.0]]),
            good=np.ones(1, bool),
            stamps=np.array([seen]),
            pose_ages=np.array([0.01]),
            counts=np.full((1, 2), round(way * CHASSIS.counts_per_metre)),
            ages=np.array([moment - measured - CHASSIS.report_delay]),
        )
        memory = with_sent(CHASSIS, memory, np.array([[0.3, 0.0]]))
        assert faults[0] == Reason.NONE


@pytest.mark.parametrize("speed", [0.1, 0.3])
def test_robots_that_stopped_by_themselves_since_a_tick_was_late_are_not_blamed(speed):
    """After each second a tick comes 0.4 s late; robots stand by then, and take 0.2 s to start."""
    memory, moment, way, began = no_motion(1), 10.0, 0.0, 10.0
    for tick in range(400):
        late = tick % 20 == 0
        step = 0.4 if late else PERIOD
        # They go on by the last command for 0.14 s, and after the pause start late.
        driven = 0.14 if late else min(PERIOD, max(moment + PERIOD - began, 0.0))
        moment, way = moment + step, way + speed * driven
        began = moment + 0.2 if late else began
        memory, faults = check_motion(
            CHASSIS,
            memory,
            time=tick * PERIOD,
            period=PERIOD,
            poses=np.array([[way, 0.0, 0.0]]),
            good=np.ones(1, bool),
            stamps=np.array([moment - 0.01]),
            pose_ages=np.array([0.01]),
            counts=np.zeros((1, 2)),
            ages=np.full(1, np.inf),
        )
        memory = with_sent(CHASSIS, memory, np.array([[speed, 0.0]]))
        assert faults[0] == Reason.NONE


def check_rarely(dead, seconds):
    """Reasons of a robot that goes to and fro twice a second, and is looked at every 0.3 s."""
    random, memory, reasons = np.random.default_rng(8), no_motion(1), []

    def way(time):
        return 0.03 * time + 0.3 * np.sin(4 * np.pi * time) / (4 * np.pi)

    moment = 0.0
    for tick in range(round(seconds / 0.3)):
        moment += random.uniform(0.2, 0.4)
        measured = 0.05 * np.floor((moment - CHASSIS.report_delay) / 0.05)
        counted = way(measured) * CHASSIS.counts_per_metre
        memory, faults = check_motion(
            CHASSIS,
            memory,
            time=tick * PERIOD,
            period=PERIOD,
            poses=np.array([[way(moment - 0.01), 0.0, 0.0]]),
            good=np.ones(1, bool),
            stamps=np.array([moment - 0.01]),
            pose_ages=np.array([0.01]),
            counts=np.array([[0.0 if dead else round(counted), round(counted)]]),
            ages=np.array([moment - measured - CHASSIS.report_delay]),
        )
        reasons.append(int(faults[0]))
    return reasons


def test_encoders_of_robots_that_a_busy_machine_sees_rarely_are_compared_with_care():
    assert set(check_rarely(dead=False, seconds=60)) == {Reason.NONE}
    assert check_rarely(dead=True, seconds=3)[-1] == Reason.ODOMETRY


@pytest.mark.parametrize("turns_after", np.arange(0.15, 0.35, 0.02))
def test_a_wheel_that_reverses_between_two_reports_was_fast_though_it_has_gone_nowhere(turns_after):
    """A robot at rest turns at once at full rate, and back; frames take 0.05 s in the air."""
    airtime, rest, speed = 0.05, 0.8, -0.08

    def pose(time):
        since = max(time - rest, 0.0)
        return np.array([speed * since, 0.0, 3.0 * (abs(since - turns_after) - turns_after)])

    for phase in np.arange(0.0, 0.2, 0.01):
        memory = no_motion(1)
        for moment in np.arange(0.0, rest + 0.6, PERIOD):
            # Reports are told every 0.2 s; it is known when they come.
            known = moment - airtime - CHASSIS.report_delay
            told = 0.2 * np.floor((known - phase) / 0.2) + phase
            forward, _, heading = pose(told)
            ways = forward + 0.5 * CHASSIS.track_width * heading * np.array([-1, 1])
            memory, faults = check_motion(
                CHASSIS,
                memory,
                time=moment,
                period=PERIOD,
                poses=pose(moment - 0.01)[None],
                good=np.ones(1, bool),
                stamps=np.array([moment - 0.01]),
                pose_ages=np.array([0.01]),
                counts=np.rint(ways * CHASSIS.counts_per_metre)[None],
                ages=np.array([known - told]),
            )
            memory = with_sent(CHASSIS, memory, np.array([[speed, 0.0]]))
            assert faults[0] != Reason.ODOMETRY


@pytest.mark.parametrize("fault", ["dead encoder", "reversed encoder"])
@pytest.mark.parametrize("speed", [0.02, 0.05, 0.09, 0.2, 0.3])
def test_encoders_that_tell_another_motion_are_noticed_however_slow_the_robot_is(fault, speed):
    for moment in (2.0, 2.13, 2.27):
        floor = steady(fault, moment, moment + 0.1 / speed + 1.0, speed)
        when, why = floor.held[0]
        assert (set(floor.held), why) == ({0}, Reason.ODOMETRY)
        # Some centimetres of way, and two reports.
        assert when - moment < 0.04 / speed + 0.45


def test_a_reset_just_after_start_is_not_answered_once_the_robot_has_said_that_it_is_armed():
    rules = SupervisionRules(cleared_by_operator=("reset",))
    memory, asked = decide(rules, cleared=True, robot_states=np.array([0.0, 0.0]))
    # Robot 0 has been armed meanwhile, robot 1 still says that it was not.
    told = {"ages": np.zeros(2), "robot_states": np.array([1.0, 0.0])}
    memory, between = decide(rules, memory, time=5.4, **told)
    _, after = decide(rules, memory, time=5.6, **{**told, "robot_states": np.zeros(2)})
    assert asked.arm_again.tolist() == [1.0, 1.0]
    assert between.arm_again.tolist() == [0.0, 1.0]
    assert after.arm_again.tolist() == [0.0, 1.0]


def test_a_robot_whose_motors_are_dead_is_tried_three_times():
    floor = steady("dead motors", 2.0, 8.0)
    reasons = [int(decision.reasons[0]) for _, decision in floor.history]
    begins = np.flatnonzero(np.diff(reasons) == Reason.NOT_FOLLOWING)
    assert (set(floor.held), len(begins)) == ({0}, 3)
    assert reasons[-1] == Reason.NOT_FOLLOWING


def test_a_hold_clears_by_itself_or_by_the_operator_as_the_rules_say():
    itself = Floor(0, "flip", 2.0)
    operators = Floor(0, "flip", 2.0, rules=SupervisionRules(cleared_by_operator=("flip",)))
    told = Floor(
        0, "flip", 2.0, rules=SupervisionRules(cleared_by_operator=("flip",)), clear_at=3.0
    )
    for floor in (itself, operators, told):
        floor.run(2.5)
        floor.fault = ""
    standings = []
    for floor in (itself, operators, told):
        for step in range(250, 350):
            if step % 5 == 0:
                floor.tick(step * STEP)
            floor.drive(step * STEP)
        standings.append(int(floor.history[-1][1].standings[0]))
    assert standings == [Standing.RUNNING, Standing.HELD, Standing.RUNNING]


def signs(**others):
    """Of two robots that have nothing the matter, at 5 s."""
    none, two = np.zeros(2), np.full(2, 2.0)
    well = Signs(5.0, np.ones(2), none, none, none, two, none, np.full(2, 0.1), 1.0, False, 0.0)
    return well._replace(**others)


def decide(rules=None, memory=None, **others):
    return supervise(rules or SupervisionRules(), memory or no_supervision(2), signs(**others))


@pytest.mark.parametrize(
    ("sign", "standing", "reason"),
    [
        ({}, Standing.RUNNING, Reason.NONE),
        ({"mode": 0.0}, Standing.ARMED, Reason.NONE),
        ({"mode": -1.0}, Standing.HELD, Reason.OPERATOR_STOP),
        ({"robot_flags": np.array([1.0, 1.0])}, Standing.HELD, Reason.LOW_BATTERY),
        ({"robot_flags": np.array([8.0, 16.0])}, Standing.HELD, Reason.MOTOR),
        ({"robot_flags": np.array([2.0, 4.0])}, Standing.RUNNING, Reason.NONE),
        ({"robot_states": np.full(2, 3.0)}, Standing.HELD, Reason.DEAF),
        ({"ages": np.full(2, 1.1)}, Standing.LOST, Reason.SILENT),
        ({"floor_faults": np.full(2, 13.0)}, Standing.HELD, Reason.FENCE),
        ({"view_age": 1.1}, Standing.HELD, Reason.VIEW),
        ({"view_age": np.nan}, Standing.HELD, Reason.VIEW),
    ],
)
def test_what_is_made_of_a_sign(sign, standing, reason):
    _, decision = decide(**sign)
    assert decision.standings.tolist() == [standing] * 2
    assert decision.reasons.tolist() == [reason] * 2


def test_without_the_view_robots_go_on_where_the_rules_say_so():
    _, decision = decide(SupervisionRules(view="go_on"), view_age=9.0)
    assert decision.standings.tolist() == [Standing.RUNNING] * 2


def test_a_robot_that_somebody_else_stopped_is_armed_again_on_the_operators_word_alone():
    stopped = {"robot_states": np.array([4.0, 2.0])}
    memory, decision = decide(**stopped)
    assert decision.arm_again.tolist() == [False, False]
    memory, decision = decide(memory=memory, time=5.05, cleared=True, **stopped)
    assert decision.arm_again.tolist() == [True, False]
    assert decision.standings.tolist() == [Standing.HELD, Standing.RUNNING]
    memory, decision = decide(memory=memory, time=5.1)
    assert decision.standings.tolist() == [Standing.RUNNING] * 2
    # While the operator's own stop stands, nobody is armed.
    _, decision = decide(memory=memory, time=5.15, mode=-1.0, **stopped)
    assert not decision.arm_again.any()


def test_a_robot_that_was_reset_is_armed_again_at_once_where_the_rules_say_so():
    reset = {"robot_states": np.array([0.0, 2.0])}
    assert decide(**reset)[1].arm_again.tolist() == [True, False]
    kept = SupervisionRules(cleared_by_operator=("reset",))
    assert not decide(kept, **reset)[1].arm_again.any()


def test_each_change_is_told_once_and_what_is_the_same_of_all_together():
    names = ["a", "b"]

    def numbers(first, second):
        return np.array([first, second], float), np.array([0.0, 0.0])

    running, one = numbers(1, 1), (np.array([2.0, 1.0]), np.array([8.0, 0.0]))
    assert [tuple(each) for each in transitions(names, None, running)] == [("", "running", False)]
    assert transitions(names, running, running) == []
    told = transitions(names, running, one)
    assert [tuple(each) for each in told] == [("a", "held: its pose jumped", True)]


def test_a_reason_that_is_none_is_refused():
    with pytest.raises(InvalidInput, match="cleared_by_operator"):
        SupervisionRules(cleared_by_operator=("bad luck",))
