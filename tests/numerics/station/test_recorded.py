"""What the station concludes from random poses, reports and signs is as recorded."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.station.channel import (
    Channel,
    empty_flight,
    freshness,
    received,
    send,
)
from sightfield.systems.numerics.station.motion_checks import (
    Chassis,
    check_motion,
    forgiven,
    no_motion,
    wheel_ways,
    with_sent,
)
from sightfield.systems.numerics.station.pose_checks import (
    FloorWatch,
    PoseLimits,
    check_poses,
    no_poses,
)
from sightfield.systems.numerics.station.supervision import (
    WORDS,
    Reason,
    Signs,
    SupervisionRules,
    no_supervision,
    supervise,
    transitions,
    view_is_gone,
)

CHASSIS = Chassis(track_width=0.19, counts_per_metre=2500.0, top_speed=0.5, report_delay=0.04)
COUNT, PERIOD = 5, 0.05


def test_a_channel_is_as_recorded(as_recorded):
    channel = Channel(period=0.04, delay=0.07, jitter=0.09, dropout=0.25, quantum=0.03, seed=5)
    flight, found = empty_flight(channel, np.array([[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]])), []
    for tick in range(20):
        flight = send(channel, flight, tick, np.full((3, 2), 0.113 * tick) + np.array([0.0, 1.0]))
        found.append(received(flight, 0.04 * tick + 0.013))
    as_recorded([channel.slots, *map(list, zip(*found, strict=True))])


def test_what_is_fresh_has_the_age_of_the_limit_at_most():
    valid, ages = freshness(2.0, np.array([1.75, 1.7499, 2.5, -np.inf]), 0.25)
    assert valid.tolist() == [1.0, 0.0, 1.0, 0.0]
    assert ages.tolist() == [0.25, pytest.approx(0.2501), 0.0, np.inf]


def drive(ticks, seed, upset):
    """The faults of robots that drive by noisy commands, and whose signs `upset` spoils."""
    rng = np.random.default_rng(seed)
    memory, poses = no_motion(COUNT), rng.uniform(-1, 1, (COUNT, 3))
    ways, counts, report = np.zeros((COUNT, 2)), np.zeros((COUNT, 2)), np.full(COUNT, np.inf)
    commands, found, kept = np.zeros((COUNT, 2)), [], []
    for tick in range(ticks):
        if tick % 12 == 0:
            commands = rng.uniform([-0.1, -1.5], [0.35, 1.5], (COUNT, 2))
        now = PERIOD * tick
        step = PERIOD * commands.copy()
        signs = {"good": np.ones(COUNT, bool), "stamps": np.full(COUNT, now - 0.011)}
        upset(tick, step, signs, counts)
        middle = poses[:, 2] + 0.5 * step[:, 1]
        before = poses.copy()
        poses += np.column_stack(
            [step[:, 0] * np.cos(middle), step[:, 0] * np.sin(middle), step[:, 1]]
        )
        ways += wheel_ways(CHASSIS, before, poses)
        if tick % 2 == 0:
            heard = rng.random(COUNT) < 0.9
            moved = np.where(heard[:, None], CHASSIS.counts_per_metre * ways, counts)
            counts, report = np.floor(moved), np.where(heard, now, report)
        memory, faults = check_motion(
            CHASSIS,
            memory,
            time=now,
            period=PERIOD,
            poses=poses + rng.normal(0, [0.001, 0.001, 0.003], poses.shape),
            pose_ages=now - signs["stamps"],
            counts=counts * signs.get("sense", 1.0),
            ages=now - report + 0.02 if tick else np.full(COUNT, np.inf),
            good=signs["good"],
            stamps=signs["stamps"],
        )
        memory = with_sent(CHASSIS, memory, commands)
        if tick == 70:
            memory = forgiven(memory)
        found.append("".join(map(str, faults.astype(int))))
        if tick % 20 == 19:
            kept.append(memory)
    return found, kept


def held_up(tick, step, signs, counts):
    if tick > 20:
        step[1] = 0.0
    if 30 < tick < 50:
        step[2] *= 0.1
    signs["good"][3] = tick % 7 > 0
    signs["stamps"][4] -= 0.05 * (tick % 3)


def miscounted(tick, step, signs, counts):
    signs["sense"] = np.array([[1, 1], [1, -1], [0, 1], [1.2, 1.2], [1, 0.7]])
    if tick % 11 == 0:
        signs["good"][0] = False


@pytest.mark.parametrize("upset", [held_up, miscounted])
def test_motion_is_judged_as_recorded(upset, as_recorded):
    found, kept = drive(100, 3, upset)
    as_recorded(found, "faults")
    as_recorded(kept, "memory", relative=1e-5)


def test_poses_are_judged_as_recorded(as_recorded):
    limits = PoseLimits(
        top_speed=0.4,
        top_turn_rate=2.0,
        bounds=(-1.0, -0.5, 1.5, 1.2),
        margin=0.2,
        jump=0.05,
        flip=0.4,
    )
    rng = np.random.default_rng(7)
    poses = rng.uniform([-1, -0.5, -3], [1.5, 1.2, 3], (8, 3))
    memory, found = no_poses(poses), []
    for tick in range(60):
        way = rng.uniform(0, 0.03, 8) * np.array([0.5, 0.7, 0.9, 1.0, 1.3, 0.6, 0.8, 2.0])
        poses[:, :2] += np.column_stack([way * np.cos(poses[:, 2]), way * np.sin(poses[:, 2])])
        poses[:, 2] += rng.uniform(-0.3, 0.3, 8)
        told = poses.copy()
        told[tick % 8] += rng.choice([0.0, 0.06, 0.09, 1.0], 3)
        valid, late = rng.random(8) < 0.9, 0.05 * (rng.random(8) < 0.2)
        if 30 < tick < 40:
            valid[:3] = False
        memory = check_poses(limits, memory, told, 0.05 * tick - late, valid)
        found.append("".join(f"{int(each):x}" for each in memory.verdicts))
    as_recorded(found, "verdicts")
    as_recorded(memory, "memory")


def test_a_pose_may_lie_off_by_the_margin_and_jump_by_what_is_allowed_and_no_more():
    limits = PoseLimits(top_speed=0.4, top_turn_rate=2.0, bounds=(0.0, 0.0, 2.0, 3.0), margin=0.25)
    start = np.array([[1.0, 1.0, 0.5]])

    def verdict(pose, after=0.25, seen=True):
        memory = no_poses(start)
        if seen:
            memory = check_poses(limits, memory, start, np.array([1.0]), np.array([True]))
        pose, stamps = np.array([pose]), np.array([1.0 + after])
        return Reason(int(check_poses(limits, memory, pose, stamps, np.array([True])).verdicts[0]))

    for pose, beyond in (((-0.25, 1, 0), (-1e-9, 0, 0)), ((1, 3.25, 0), (0, 1e-9, 0))):
        assert verdict(pose, seen=False) == Reason.NONE
        assert verdict(np.add(pose, beyond), seen=False) == Reason.OUTSIDE
    way, turn = 1.2 * 0.4 * 0.25 + 0.06, 1.2 * 2.0 * 0.25 + 0.5
    assert verdict((1.0 + way - 1e-9, 1.0, 0.5)) == Reason.NONE
    assert verdict((1.0 + way + 1e-9, 1.0, 0.5)) == Reason.JUMP
    assert verdict((1.0, 1.0, 0.5 + turn - 1e-9)) == Reason.NONE
    assert verdict((1.0, 1.0, 0.5 - turn - 1e-9)) == Reason.FLIP
    # After half a second a robot that is not seen has braked.
    assert verdict((1.0 + 1.2 * 0.4 * 0.5 + 0.059, 1.0, 0.5), after=9.0) == Reason.NONE
    assert verdict((1.0 + 1.2 * 0.4 * 0.5 + 0.061, 1.0, 0.5), after=9.0) == Reason.JUMP


def test_the_floor_is_watched_as_recorded(as_recorded):
    world = make_world([[0, 0], [3, 0], [3, 2], [0, 2]], [[[1, 1], [1.5, 1], [1.2, 1.6]]])
    watch = FloorWatch(world, np.array([0.1, 0.2, 0.15, 0.1]), 0.03)
    rng = np.random.default_rng(3)
    found = [watch.breaches(rng.uniform([-0.1, -0.1], [1.5, 1.2], (4, 2))) for _ in range(40)]
    as_recorded(["".join(f"{int(each):x}" for each in faults) for faults in found])
    # Two may come as near as their radii and the slack tell.
    near = np.array([[0.5, 0.5], [0.5 + 0.271, 0.5], [2.0, 0.5], [2.0, 0.5 + 0.219]])
    assert watch.breaches(near).tolist() == [0, 0, Reason.SPACING, Reason.SPACING]
    assert not FloorWatch(world, np.array([0.1]), 0.03).breaches(np.array([[0.0701, 0.5]])).any()
    assert FloorWatch(world, np.array([0.1]), 0.03).breaches(np.array([[0.0699, 0.5]])).any()


@pytest.mark.parametrize(
    "rules",
    [
        SupervisionRules(),
        SupervisionRules(
            cleared_by_operator=("fence", "reset", "jump"), silent_after=0.6, view="go_on"
        ),
    ],
    ids=["usual", "strict"],
)
def test_robots_are_supervised_as_recorded(rules, as_recorded):
    rng, memory, found = np.random.default_rng(9), no_supervision(6), []
    for tick in range(120):
        rare = rng.random((6, 6)) < 0.06
        signs = Signs(
            time=0.05 * tick,
            valid=(rng.random(6) < (0.97 if tick > 3 else 0.4)).astype(float),
            pose_faults=np.where(rare[0], rng.integers(7, 11, 6), 0).astype(float),
            motion_faults=np.where(rare[1], rng.integers(11, 13, 6), 0).astype(float),
            floor_faults=np.where(rare[2], rng.integers(13, 15, 6), 0).astype(float),
            robot_states=np.where(rare[3], rng.integers(-1, 5, 6), 2).astype(float),
            robot_flags=np.where(rare[4], rng.integers(0, 32, 6), 0).astype(float),
            ages=np.where(rare[5], rng.uniform(0, 1.5, 6), 0.02),
            mode=float(rng.choice([1.0, 1.0, 1.0, 1.0, 0.0]) if tick < 110 else -1.0),
            cleared=bool(tick % 23 == 22),
            view_age=float(rng.choice([0.1, 0.1, 0.1, 0.1, 1.0, 1.1, np.nan])),
        )
        memory, decision = supervise(rules, memory, signs)
        rows = (decision.standings, decision.reasons, decision.arm_again)
        found.append(
            " ".join(
                "".join(f"{int(e):x}" if e < 16 else "ghi"[int(e) - 16] for e in row)
                for row in rows
            )
        )
    as_recorded(found, "decisions")
    as_recorded([*memory, rules.staying], "memory")


def test_what_changes_is_told_as_recorded(as_recorded):
    names, rng, before, told = ("one", "two", "three"), np.random.default_rng(1), None, []
    for _ in range(25):
        standing = rng.integers(-1, 4, 3).astype(float)
        now = (standing, np.where(standing > 1, rng.integers(0, 19, 3), 0).astype(float))
        if rng.random() < 0.2:
            now = (np.full(3, 2.0), np.full(3, 13.0))
        if rng.random() < 0.2 and before is not None:
            now = before
        told.append([list(each) for each in transitions(names, before, now)])
        before = now
    as_recorded(told)
    as_recorded({reason.name: words for reason, words in WORDS.items()}, "words")


def test_a_view_is_gone_after_a_second_or_when_it_was_never_there():
    assert view_is_gone(np.array([0.0, 1.0, 1.001, np.nan, np.inf])).tolist() == [
        *[False] * 2,
        *[True] * 3,
    ]


@pytest.mark.parametrize(
    "make",
    [
        lambda: Channel(period=0.0009),
        lambda: Channel(delay=-0.1),
        lambda: Channel(delay=59.0, jitter=1.001),
        lambda: Channel(dropout=1.001),
        lambda: Channel(seed=-1),
        lambda: Chassis(track_width=0.0),
        lambda: SupervisionRules(silent_after=0.0),
        lambda: SupervisionRules(cleared_by_operator=("fire",)),
        lambda: SupervisionRules(view="look away"),
        lambda: PoseLimits(top_speed=0.0, top_turn_rate=1.0, bounds=(0.0, 0.0, 1.0, 1.0)),
    ],
)
def test_what_is_no_station_is_refused(make):
    with pytest.raises(InvalidInput, match="` must"):
        make()


def test_what_is_just_a_channel_is_not_refused():
    assert Channel(period=0.001).slots == 1
    assert Channel(period=0.5, delay=59.0, jitter=1.0, dropout=1.0).slots == 121
