"""Words drawn at random, for carts whose best ways resemble no path of a car."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.planning.arc_words.candidates import (
    car_words,
    keeps_limit,
    quickest_words,
)
from sightfield.systems.numerics.planning.arc_words.drawn_words import NEAR, drawn_words
from sightfield.systems.numerics.planning.arc_words.shortened import end_of
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.polished.planner import plan_polished
from sightfield.systems.numerics.planning.trailer import Trailer

# A trailer of six turning radii, beside its goal and turned away from it.
LONG = Trailer(speed=4.35, turn_rate=2.417, length=11.08, hitch_offset=-2.597, reverse=True)
BESIDE = (7.205, -7.465, -0.252, 0.022)
BOX = Goal(state=(6.511, -8.372, -1.433, 0.0), tolerance=(0.36, 0.36, 0.251, 0.251))


def quickest(trailer, start, goal, words):
    def allowed(word):
        return len(word.durations) > 0 and keeps_limit(trailer, start, word)

    return quickest_words(trailer, start, words, goal, allowed)[0]


def test_a_long_trailer_is_parked_sooner_than_by_any_path_of_a_car():
    by_car = quickest(LONG, BESIDE, BOX, car_words(LONG, BESIDE, BOX))
    drawn = quickest(LONG, BESIDE, BOX, drawn_words(LONG, BESIDE, BOX))
    assert BOX.contains(end_of(LONG, BESIDE, drawn))
    assert drawn.time < 0.99 * by_car.time


def test_a_polished_plan_knows_of_them():
    plan = plan_polished(LONG, BESIDE, BOX)
    assert plan.converged
    drawn = quickest(LONG, BESIDE, BOX, drawn_words(LONG, BESIDE, BOX))
    assert plan.time <= drawn.time * (1 + 1e-6)


@pytest.mark.parametrize("width", [0.0, 0.2, math.inf])
def test_they_end_where_they_should_each_in_an_order_of_its_own(width):
    cart = Trailer(length=2.0, hitch_offset=0.4, reverse=True)
    goal = Goal(state=(1.0, 2.0, 0.7, 0.2), tolerance=(0.1, 0.1, width, width))
    start = (4.0, -3.0, 2.5, 2.2)
    words = drawn_words(cart, start, goal, count=1000)
    assert len(words) > 3
    for word in words:
        assert max(goal.miss(end_of(cart, start, word))) <= 1.1 * NEAR
    assert len({word.controls.tobytes() for word in words}) == len(words)
    times = [word.time for word in words]
    assert times == sorted(times)


def test_they_are_the_same_every_time_and_in_every_unit():
    cart = Trailer(length=2.0, hitch_offset=0.4, reverse=True)
    scaled = Trailer(speed=6.0, turn_rate=2.0, length=6.0, hitch_offset=1.2, reverse=True)
    start = np.array([2.0, 1.0, 0.3, 0.5])
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=(0.2, 0.2, 0.3, 0.3))
    wide = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=(0.6, 0.6, 0.3, 0.3))
    words = drawn_words(cart, start, goal, count=1000)
    again = drawn_words(cart, start, goal, count=1000)
    others = drawn_words(scaled, start * [3.0, 3.0, 1.0, 1.0], wide, count=1000)
    assert [word.time for word in again] == [word.time for word in words]
    assert [2 * word.time for word in others] == pytest.approx([word.time for word in words])


def test_a_cart_that_cannot_reverse_never_does():
    cart = Trailer(length=3.0)
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=(0.2, 0.2, 0.3, 0.3))
    words = drawn_words(cart, (1.0, 2.0, 1.0, 0.3), goal, count=1000)
    assert words
    assert all((word.controls[:, 0] > 0).all() for word in words)
