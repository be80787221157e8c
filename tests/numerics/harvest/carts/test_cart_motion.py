"""Trailers behind tractors, against the velocity of the hitch integrated in small steps."""

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.carts.cart_motion import (
    CartMotion,
    join_motions,
    standing_motion,
)
from sightfield.systems.numerics.harvest.machines.cart import Cart
from sightfield.systems.numerics.harvest.paths.machine_path import TRANSIT, MachinePath
from sightfield.systems.numerics.harvest.paths.timed_path import TimedPath
from sightfield.systems.numerics.planning.car_paths import dubins_between, dubins_paths


def drive(cart, start, end, begin, beta):
    """Dubins, from standing to standing."""
    path = dubins_paths(start, end, 6.0)[0]
    poses = path.poses(np.concatenate([[0.0], np.cumsum(np.abs(path.lengths))]))
    count = len(poses) - 1
    made = MachinePath(poses, np.ones(count), np.zeros(count, bool), np.full(count, TRANSIT))
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
