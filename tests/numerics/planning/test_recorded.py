"""Paths of a car, bounds, discs and gains for carts away from neutral values are as recorded."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.car_paths import (
    CarPath,
    dubins_between,
    dubins_lengths,
    dubins_paths,
    reeds_shepp_lengths,
    reeds_shepp_paths,
)
from sightfield.systems.numerics.planning.footprint import (
    covering_discs,
    deepest_overlap,
    overlaps_along,
    signed_distance,
)
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.lower_bound import lower_bound, word_families
from sightfield.systems.numerics.planning.path_tracking import make_path_tracker, tracking_control
from sightfield.systems.numerics.planning.plan import driven_path
from sightfield.systems.numerics.planning.trailer import Trailer

CART = Trailer(speed=1.3, turn_rate=0.8, length=1.7, hitch_offset=0.35, reverse=True)
ROOM = [(0.0, 0.0), (9.0, -0.5), (9.5, 6.0), (0.5, 6.5)]
TRIANGLE = [(4.0, 2.0), (5.5, 2.5), (4.2, 4.0)]


def random_poses(count, seed):
    return np.random.default_rng(seed).uniform([-4, -4, -7], [4, 4, 7], (count, 3))


@pytest.mark.parametrize("paths", [dubins_paths, reeds_shepp_paths])
def test_every_word_of_a_car_is_as_recorded(paths, as_recorded):
    told = []
    for end in random_poses(25, seed=31):
        found = paths((0.3, -0.2, 0.7), end, 1.3)
        told.append([" ".join(each.word for each in found), [each.lengths for each in found[:6]]])
    as_recorded([words for words, _ in told], "words")
    as_recorded([np.concatenate(lengths) for _, lengths in told], "lengths")


def test_lengths_of_many_paths_of_a_car_are_as_recorded(as_recorded):
    starts, ends = random_poses(300, seed=32), random_poses(300, seed=33)
    as_recorded(dubins_between(starts, ends, 1.3), "between")
    as_recorded(dubins_lengths((0.3, -0.2, 0.7), ends, 1.3), "forwards")
    as_recorded(reeds_shepp_lengths((0.3, -0.2, 0.7), ends, 1.3), "with reverse")


def test_poses_before_the_start_and_beyond_the_end_are_those_there_as_recorded(as_recorded):
    path = CarPath((1.0, 2.0, 0.5), (1, 0, -1, 1), (1.0, -2.0, 0.5, -0.7), 2.0)
    poses = path.poses([-1.0, 0.0, 0.4, 1.9, 3.2, 4.0, 4.2, 5.0])
    np.testing.assert_array_equal(poses[0], path.start)
    np.testing.assert_array_equal(poses[-1], path.end)
    as_recorded(poses)


@pytest.mark.parametrize("reverse", [False, True])
def test_families_of_words_are_as_recorded(reverse, as_recorded):
    told = [
        [*each.turns, *each.coefficients.ravel(), *each.fixed, *np.minimum(each.limits, 9.0)]
        for each in word_families(reverse)
    ]
    as_recorded([np.array(each) for each in told])


@pytest.mark.parametrize(("reverse", "tolerance"), [(False, 1e-3), (True, 0.03)])
def test_bounds_are_as_recorded(reverse, tolerance, as_recorded):
    cart = Trailer(speed=1.3, turn_rate=0.8, reverse=reverse)
    rng = np.random.default_rng(34)
    told = []
    for widths in (
        (0.0, 0.0, 0.0, 0.0),
        (0.4, 0.2, 0.3, 0.1),
        (0.0, 0.3, 0.0, 0.0),
        (1.0, 0.0, math.inf, 0.0),
        (0.5, 0.7, 1.1, math.inf),
    ):
        for _ in range(2):
            start, end = rng.uniform([-3, -3, -4, -1], [3, 3, 4, 1], (2, 4)).tolist()
            told.append(lower_bound(cart, start, Goal(state=end, tolerance=widths), tolerance))
    as_recorded(told)


def test_where_many_paths_are_as_short_the_bound_is_as_recorded(as_recorded):
    goal = Goal(state=(3.0, 2.0, 1.9, 0.0), tolerance=(math.inf, math.inf, 0.1, 0.0))
    told = [
        lower_bound(Trailer(reverse=each), (0.2, 0.1, 0.3, 0.0), goal) for each in (True, False)
    ]
    as_recorded(told)


def test_depths_along_a_path_are_as_recorded(as_recorded):
    world, discs = make_world(ROOM, [TRIANGLE]), covering_discs(CART, 0.7)
    as_recorded(discs, "discs")
    pieces = [(1.3, 0.8, 1.1), (1.3, 0.0, 1.7), (-1.3, -0.5, 0.9)]
    path = driven_path(CART, (2.5, 2.0, 0.4, -0.6), pieces, 0.31)
    as_recorded([path.times, path.states, path.controls], "path")
    as_recorded(overlaps_along(world, discs, path, CART), "depths")
    states = np.random.default_rng(35).uniform([-1, -1, -3, -2], [10, 7, 3, 2], (40, 4))
    as_recorded([deepest_overlap(world, discs, each[None]) for each in states], "at poses")
    as_recorded(signed_distance(world, states[:, :2]), "distances")


def test_gains_and_what_they_make_of_errors_are_as_recorded(as_recorded):
    pieces = [(1.3, 0.5, 1.1), (1.3, -0.2, 0.7), (-1.3, -0.3, 0.8)]
    path = driven_path(CART, (2.5, 2.0, 0.4, -0.6), pieces, 0.23)
    tracker = make_path_tracker(CART, path, (1.7, 0.6, 2.2, 0.4))
    as_recorded([tracker.gains, tracker.path.times, tracker.duration], "gains")
    rng = np.random.default_rng(36)
    told = []
    for progress in rng.uniform(-0.1, 2.7, 40):
        k = int(np.searchsorted(tracker.path.times, progress).clip(max=len(tracker.gains)))
        state = tracker.path.states[k] + rng.normal(0.0, 0.12, 4)
        control, rate = tracking_control(tracker, state, progress)
        told.append([*control, rate])
    as_recorded(told, "controls")
    assert np.ptp(np.array(told)[:, 2]) > 0.5
