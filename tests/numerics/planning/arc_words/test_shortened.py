"""Words whose durations are chosen anew to take the least time into a box."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.planning.arc_words.quickest import ArcWord, word_path
from sightfield.systems.numerics.planning.arc_words.shortened import (
    after,
    end_of,
    merged,
    shortened,
    shortest,
    with_more_switches,
)
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.trailer import Trailer

# Away from every neutral value.
CART = Trailer(speed=1.7, turn_rate=0.6, length=1.9, hitch_offset=0.4, reverse=True)
LEFT, STRAIGHT, RIGHT, BACK = (1.7, 0.6), (1.7, 0.0), (1.7, -0.6), (-1.7, 0.6)


def word(*arcs):
    controls, durations = zip(*arcs, strict=True)
    return ArcWord(np.array(controls), np.array(durations, dtype=float))


def test_the_end_of_a_word_is_that_of_its_path():
    start = np.array([3.0, -1.0, 0.4, 0.7])
    driven = word((LEFT, 1.1), (STRAIGHT, 0.7), (BACK, 0.9), (RIGHT, 2.0))
    end = word_path(CART, start, driven).states[-1]
    end[3] = math.remainder(end[3], math.tau)
    np.testing.assert_allclose(end_of(CART, start, driven), end, atol=1e-9)


def test_a_trailer_straight_behind_is_backed_up_straight_however_far():
    cart = Trailer(length=0.05, reverse=True)
    end = end_of(cart, (1.0, 2.0, 0.0, 0.0), ArcWord(np.array([[-1.0, 0.0]]), np.array([30.0])))
    np.testing.assert_allclose(end, [-29.0, 2.0, 0.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("offset", [-0.2, 0.0, 0.2])
def test_however_long_arcs_are_the_trailer_has_an_angle(offset):
    """A search for durations among walls tried 7e12; the thesis's trailer then had none."""
    trailer = Trailer(hitch_offset=offset)
    random = np.random.default_rng(8)
    for _ in range(200):
        controls = random.integers(0, 2, (12, 1)) * [2.0, 0.0] - [1.0, 0.0]
        controls[:, 1] = random.integers(-1, 2, 12)
        durations = 10 ** random.uniform(0, 18, 12)
        controls *= [trailer.speed, trailer.turn_rate]
        assert np.isfinite(end_of(trailer, [0, 0, 0, 0.3], ArcWord(controls, durations))).all()


def test_after_is_what_is_left():
    driven = word((LEFT, 1.0), (RIGHT, 2.0), (LEFT, 1.0))
    left = after(driven, 1.5)
    np.testing.assert_allclose(left.durations, [1.5, 1.0])
    np.testing.assert_array_equal(left.controls, [RIGHT, LEFT])
    assert not len(after(driven, 4.0).durations)
    start = (0.0, 0.0, 0.0, 0.0)
    half = end_of(CART, start, word((LEFT, 1.0), (RIGHT, 0.5)))
    np.testing.assert_allclose(end_of(CART, half, left), end_of(CART, start, driven), atol=1e-12)


def test_neighbours_that_are_alike_are_one():
    found = merged(word((LEFT, 1.0), (RIGHT, 0.0), (LEFT, 0.5), (RIGHT, 0.2)))
    np.testing.assert_allclose(found.durations, [1.5, 0.2])


def test_the_straight_to_a_box_ends_at_its_edge():
    goal = Goal(state=(4.0, 0.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
    found = shortened(Trailer(), (0.0, 0.0, 0.0, 0.0), word(((1.0, 0.0), 4.0)), goal)
    assert found.time == pytest.approx(3.8, abs=1e-5)
    end = end_of(Trailer(), (0, 0, 0, 0), found)
    assert goal.contains(end)


def test_a_point_is_met_exactly():
    start = (0.2, -0.3, 0.4, 0.1)
    driven = word((LEFT, 0.8), (RIGHT, 1.5), (STRAIGHT, 1.0), (LEFT, 0.7), (RIGHT, 0.6))
    x, y, theta, beta = end_of(CART, start, driven).tolist()
    goal = Goal(state=(x, y, theta, beta))
    found = shortened(CART, start, driven, goal)
    assert max(goal.miss(end_of(CART, start, found))) < 1e-5
    assert found.time <= driven.time + 1e-6


def test_no_durations_lead_a_straight_round_a_corner():
    goal = Goal(state=(4.0, 3.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
    assert shortened(Trailer(), (0.0, 0.0, 0.0, 0.0), word(((1.0, 0.0), 4.0)), goal) is None


@pytest.mark.parametrize("heading", [0.0, 2.5])
def test_with_more_switches_it_is_as_quick_as_the_programme(heading):
    """From two turns and a straight, though the optimum has a singular arc."""
    start = (1.0, 1.0, 0.0, 0.0)
    goal = Goal(state=(4.0, 4.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
    turned = Goal(state=(-7.0, 2.0, heading, 0.0), tolerance=THESIS_TOLERANCE)
    begun = turned.from_frame(goal.to_frame(start))
    first = word(((1.0, 1.0), 1.0), ((1.0, 0.0), 2.0), ((1.0, -1.0), 1.0))
    found = shortest(Trailer(), begun, with_more_switches(first, Trailer()), turned)
    assert found.time == pytest.approx(plan_by_casadi(Trailer(), start, goal).time, rel=5e-4)
    assert turned.contains(end_of(Trailer(), begun, found))
