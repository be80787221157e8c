"""Trailers behind tractors, and times of paths, against small steps and closed forms."""

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.carts.cart_motion import (
    MOMENT,
    WAY,
    CartMotion,
    Moving,
    Passage,
    join_motions,
    plan_profile,
    plan_profile_back,
    standing_motion,
)
from sightfield.systems.numerics.harvest.machines import Cart
from sightfield.systems.numerics.harvest.paths import MachinePath, TimedPath
from sightfield.systems.numerics.planning.car_paths import dubins_between, dubins_paths


def drive(cart, start, end, begin, beta):
    """Dubins, from standing to standing."""
    path = dubins_paths(start, end, 6.0)[0]
    poses = path.poses(np.concatenate([[0.0], np.cumsum(np.abs(path.lengths))]))
    count = len(poses) - 1
    made = MachinePath(poses, np.ones(count), np.zeros(count, bool), np.zeros(count, int))
    top = np.sqrt(made.length)
    times = begin + np.array([0.0, top, 2 * top])
    timed = TimedPath(made, times, made.length * np.array([0, 0.5, 1]), np.array([0.0, top, 0.0]))
    return CartMotion(timed, cart, beta)


@pytest.mark.parametrize("hitch", [0.0, 0.8])
def test_a_bent_trailer_follows_its_hitch(integrated, hitch):
    cart = Cart(hitch_offset=hitch, length=4.5)
    first = drive(cart, (1.0, 2.0, 0.4), (30.0, -12.0, 3.4), 2.0, 0.5)
    stands = standing_motion(cart, first.last_pose, first.timed.end + 5.0, first.last_angle)
    second = drive(cart, tuple(first.last_pose), (-5.0, 8.0, 1.0), 30.0, first.last_angle)
    motion = join_motions([first, stands, second])
    times = np.linspace(0.0, motion.timed.end + 3.0, 300)
    _, trailer = motion.poses_at(times)
    truth = integrated(motion, times)
    np.testing.assert_allclose(trailer, truth, atol=4e-3)
    off = np.remainder(motion.last_angle - second.last_angle + np.pi, 2 * np.pi) - np.pi
    assert abs(off) < 2e-3
    assert motion.timed.pose_at(29.0) == pytest.approx(first.last_pose)


def test_dubins_paths_of_many_pairs_are_those_of_each():
    rng = np.random.default_rng(3)
    starts, ends = rng.uniform([-20, -20, -3], [20, 20, 3], (2, 60, 3))
    turns, lengths = dubins_between(starts, ends, 5.5)
    for k in range(60):
        one = dubins_paths(tuple(starts[k]), tuple(ends[k]), 5.5)[0]
        assert lengths[k].sum() == pytest.approx(one.length)
        assert tuple(turns[k]) in {one.turns} or one.length == pytest.approx(lengths[k].sum())


LENGTH = 120.0
STATIONS = np.linspace(0.0, LENGTH, int(LENGTH / WAY) + 1)
TOP = 5.0


def station_at(found, times):
    number = np.clip(np.searchsorted(found.times, times, side="right") - 1, 0, len(found.times) - 2)
    since = times - found.times[number]
    lasts = np.diff(found.times)[number]
    change = np.diff(found.speeds)[number]
    rate = np.divide(change, lasts, out=np.zeros(len(times)), where=lasts > 0)
    return found.stations[number] + since * (found.speeds[number] + rate * since / 2)


def check_accelerations(found, limit):
    lasting, ways = np.diff(found.times), np.diff(found.stations)
    moved = ways > 0
    rates = np.diff(found.speeds**2)[moved] / (2 * ways[moved])
    assert np.abs(rates).max() <= limit + 1e-9
    means = (found.speeds[1:] + found.speeds[:-1]) / 2
    np.testing.assert_allclose(ways, means * lasting, atol=1e-9)


def test_a_free_path_takes_what_accelerations_ask():
    limits = np.full(len(STATIONS), TOP)
    free = np.zeros((len(STATIONS), 800), dtype=bool)
    opens = np.full(len(STATIONS), -np.inf)
    found = plan_profile(Passage(STATIONS, limits, opens, free, 30.0), Moving(30.0, 1.5), 1.0)
    # From 1.5 m/s up to 5 m/s, then down to standing.
    ramps = (TOP - 1.5) + TOP
    way = (TOP**2 - 1.5**2) / 2 + TOP**2 / 2
    least = 30.0 + ramps + (LENGTH - way) / TOP
    assert least - 1e-9 <= found.times[-1] <= least + 1.5
    assert found.speeds[[0, -1]] == pytest.approx([1.5, 0.0])
    check_accelerations(found, 1.0)
    passage = Passage(STATIONS, limits, opens, free, 30.0)
    back = plan_profile_back(passage, Moving(90.0, 1.5), 1.0, 30.0)
    assert back.times[-1] == pytest.approx(90.0)
    assert back.speeds[[0, -1]] == pytest.approx([0.0, 1.5])
    assert back.times[-1] - back.times[0] == pytest.approx(found.times[-1] - 30.0, abs=1e-6)
    check_accelerations(back, 1.0)


@pytest.mark.parametrize("back", [False, True])
def test_what_is_closed_is_never_entered(back):
    limits = np.where(np.abs(STATIONS - 40) < 6, 2.0, TOP)
    times = 10.0 + MOMENT * np.arange(700)
    closed = np.zeros((len(STATIONS), len(times)), dtype=bool)
    # One crosses, and one comes along the path towards the cart, and turns off at 60 m.
    closed |= (np.abs(STATIONS[:, None] - 55) < 4) & (times > 15) & (times < 48)
    front = 110 - 1.2 * (times - 60)
    closed |= (np.abs(STATIONS[:, None] - front) < 6) & (front > 60)
    opens = np.where(STATIONS > 90, 30.0, -np.inf)
    if back:
        end = Moving(120.0, 1.5)
        found = plan_profile_back(Passage(STATIONS, limits, opens, closed, 10.0), end, 1.0, 10.0)
    else:
        found = plan_profile(Passage(STATIONS, limits, opens, closed, 10.0), Moving(10.0, 1.5), 1.0)
    assert len(found.times)
    check_accelerations(found, 1.0)
    fine = np.arange(found.times[0], found.times[-1], 0.02)
    at = station_at(found, fine)
    cell = np.round(at / WAY).astype(int)
    moment = np.round((fine - 10.0) / MOMENT).astype(int)
    assert not closed[cell, np.minimum(moment, len(times) - 1)].any()
    assert (fine >= opens[cell]).all()
    speeds = np.gradient(at, fine)
    assert (speeds <= limits[cell] + 0.35).all()
    # It waits for the one that crosses, but not for ever.
    assert found.times[-1] > 48.0 + 60 / TOP


def test_a_wall_says_how_far_it_goes():
    closed = np.zeros((len(STATIONS), 100), dtype=bool)
    closed[100:104] = True
    limits = np.full(len(STATIONS), TOP)
    opens = np.full(len(STATIONS), -np.inf)
    found = plan_profile(Passage(STATIONS, limits, opens, closed, 0.0), Moving(0.0, 1.5), 1.0)
    assert len(found.times) == 0
    assert found.reached == pytest.approx(49.5, abs=1.0)
