"""Words of three pieces in any gears, driven, and against Dubins and Reeds-Shepp paths."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.machines import Combine
from sightfield.systems.numerics.harvest.paths import MachinePath, fastest_profile
from sightfield.systems.numerics.harvest.turns.turn import turn_times
from sightfield.systems.numerics.harvest.turns.words import (
    WORD_COUNT,
    driving_time,
    write_words,
)
from sightfield.systems.numerics.planning.car_paths import CarPath, dubins_paths, reeds_shepp_paths

TURNS = [(a, b, c) for a in (1, -1) for b in (0, -a) for c in ((1, -1) if b == 0 else (a,))]


def words_to(x, y, theta):
    turns, lengths = np.full((WORD_COUNT, 3), 9.0), np.full((WORD_COUNT, 3), 9.0)
    count = write_words(x, y, theta, turns, lengths)
    return turns[:count].astype(int), lengths[:count]


def driven(turns, lengths):
    path = CarPath((0.0, 0.0, 0.0), tuple(map(int, turns)), tuple(map(float, lengths)), 1.0)
    return path.end


def test_every_word_leads_to_the_pose():
    rng = np.random.default_rng(1)
    for _ in range(200):
        x, y, theta = rng.uniform(-4, 4), rng.uniform(-4, 4), rng.uniform(-7, 7)
        for turns, lengths in zip(*words_to(x, y, theta), strict=True):
            end = driven(turns, lengths)
            assert end[:2] == pytest.approx((x, y), abs=1e-9)
            assert math.remainder(end[2] - theta, math.tau) == pytest.approx(0, abs=1e-9)
            assert (np.abs(lengths)[turns != 0] < math.tau).all()


@pytest.mark.parametrize("turns", TURNS)
def test_any_three_pieces_in_any_gears_are_among_the_words_to_their_end(turns):
    rng = np.random.default_rng(2)
    for _ in range(100):
        lengths = rng.uniform(0.01, math.tau - 0.01, 3) * rng.choice([1, -1], 3)
        turned, found = words_to(*driven(turns, lengths))
        alike = (turned == turns).all(axis=1)
        assert np.abs(found[alike] - lengths).max(axis=1).min() < 1e-6


def test_at_most_64_words_and_from_a_pose_to_itself_none_has_a_length():
    rng = np.random.default_rng(3)
    counts = [len(words_to(*rng.uniform(-2, 2, 3))[0]) for _ in range(500)]
    assert max(counts) == WORD_COUNT
    _, lengths = words_to(0.0, 0.0, 0.0)
    assert np.abs(lengths).sum(axis=1).min() == 0


def test_the_shortest_forward_words_are_those_of_dubins():
    rng = np.random.default_rng(4)
    for _ in range(300):
        pose = (rng.uniform(-5, 5), rng.uniform(-5, 5), rng.uniform(-3, 3))
        _, lengths = words_to(*pose)
        forwards = lengths[(lengths >= 0).all(axis=1)]
        shortest = dubins_paths((0.0, 0.0, 0.0), pose, 1.0)[0].length
        assert forwards.sum(axis=1).min() == pytest.approx(shortest)


def test_shortest_paths_of_reeds_and_shepp_in_three_pieces_are_among_the_words():
    rng = np.random.default_rng(5)
    seen = 0
    for _ in range(300):
        pose = (rng.uniform(-5, 5), rng.uniform(-5, 5), rng.uniform(-3, 3))
        shortest = reeds_shepp_paths((0.0, 0.0, 0.0), pose, 1.0)[0]
        least = np.abs(words_to(*pose)[1]).sum(axis=1).min()
        assert least >= shortest.length - 1e-9
        if len(shortest.turns) == 3:
            seen += 1
            assert least == pytest.approx(shortest.length)
    assert seen > 80


@pytest.mark.parametrize("gears", [(1, 1), (1, -1), (-1, 1), (0, 1), (1, 0), (0, 0)])
def test_driving_times_are_those_of_the_fastest_speed_profile(gears):
    rng = np.random.default_rng(6)
    speed, acceleration, run = 1.7, 0.4, 30.0
    for _ in range(60):
        lengths = rng.uniform(0.1, 9.0, 3) * rng.choice([1, -1], 3)
        lengths[1] *= rng.choice([0, 1])
        # Straights in the gears before and after, on which it drives at full speed at first.
        ways = np.concatenate([[gears[0] * run], lengths, [gears[1] * run]])
        ways = ways[ways != 0]
        poses = np.zeros((len(ways) + 1, 3))
        poses[1:, 0] = np.cumsum(ways)
        none = np.zeros(len(ways), dtype=int)
        path = MachinePath(poses, np.sign(ways).astype(int), none.astype(bool), none)
        timed = fastest_profile(path, speed, acceleration)
        # On those, where there are any, it gets from standing to full speed, and back.
        expected = timed.end - (run / speed + speed / acceleration / 2) * np.abs(gears).sum()
        assert driving_time(lengths, 3, speed, acceleration, *gears) == pytest.approx(expected)


def test_the_quickest_word_trades_way_against_stops():
    start, goal = np.array([3.0, -2.0, 0.3]), np.array([[5.0, 1.5, 2.9], [30.0, 1.0, 0.2]])
    radius, speed = 5.5, 1.4
    combine = Combine(turning_radius=radius, speed=speed)
    for acceleration in (0.05, 0.5, 20.0):
        times = turn_times(start, goal, replace(combine, acceleration=acceleration))
        for end, time in zip(goal, times, strict=True):
            c, s = math.cos(start[2]), math.sin(start[2])
            x, y = np.array([[c, s], [-s, c]]) @ (end - start)[:2] / radius
            each = [
                driving_time(radius * lengths, 3, speed, acceleration, 1, 1)
                for lengths in words_to(x, y, end[2] - start[2])[1]
            ]
            assert time == pytest.approx(min(each))
            assert time <= dubins_paths(start, end, radius)[0].length / speed + 1e-9
    # Stops that cost nothing leave the shortest way, dear ones the shortest forwards.
    quick = turn_times(start, goal[:1], replace(combine, acceleration=1e9))
    dear = turn_times(start, goal[:1], replace(combine, acceleration=1e-3))
    assert dear == pytest.approx(dubins_paths(start, goal[0], radius)[0].length / speed)
    assert quick < 0.8 * dear
