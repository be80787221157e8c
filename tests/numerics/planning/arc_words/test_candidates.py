"""Words into a goal box without a table: of a car, and drawn at random."""

import math
from collections import Counter

import numpy as np
import pytest

from sightfield.systems.numerics.planning.arc_words import candidates
from sightfield.systems.numerics.planning.arc_words.candidates import (
    KEPT_ALIKE,
    NEAR,
    car_words,
    drawn_words,
    keeps_limit,
    quickest_words,
)
from sightfield.systems.numerics.planning.arc_words.quickest import ArcWord
from sightfield.systems.numerics.planning.arc_words.shortened import end_of
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.lower_bound import lower_bound
from sightfield.systems.numerics.planning.planners import polished
from sightfield.systems.numerics.planning.trailer import Trailer

# Two metres of radius, and a trailer of 0.3 m that lies within the box's beta on every turn.
SHORT = Trailer(speed=3.0, turn_rate=1.5, length=0.3, hitch_offset=-0.06)
FAR = (70.0, -55.0, 2.1, 0.4)
BOX = Goal(state=(3.0, -2.0, 2.5, 0.0), tolerance=(0.4, 0.4, 0.251, 0.251))


def best(trailer, start, goal):
    local, centred = goal.to_frame(start), goal.centred
    words = car_words(trailer, local, centred)
    return quickest_words(trailer, local, words, centred, lambda _: True)[0]


def test_a_short_trailer_takes_no_more_time_to_a_far_box_than_a_car():
    word = best(SHORT, FAR, BOX)
    assert BOX.contains(end_of(SHORT, FAR, word))
    bound = lower_bound(SHORT, FAR, BOX)
    assert bound <= word.time <= (1 + 1e-3) * bound


@pytest.mark.parametrize("reverse", [False, True])
def test_a_jackknifed_cart_of_any_scale_takes_as_long(reverse):
    cart = Trailer(length=0.8, hitch_offset=0.2, reverse=reverse)
    scaled = Trailer(speed=6.0, turn_rate=2.0, length=2.4, hitch_offset=0.6, reverse=reverse)
    units = np.array([3.0, 3.0, 1.0, 1.0])
    start, width = np.array([-4.0, 1.0, 0.3, 2.4]), (0.2, 0.2, 0.251, 0.251)
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=width)
    wide = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=(0.6, 0.6, 0.251, 0.251))
    word, other = best(cart, start, goal), best(scaled, units * start, wide)
    assert goal.contains(end_of(cart, start, word))
    assert other.time == pytest.approx(word.time / 2, rel=1e-6)


def test_a_word_that_folds_the_trailer_beyond_its_limit_is_not_allowed():
    cart = Trailer(jackknife=0.5)
    turn = ArcWord(np.array([[1.0, 1.0]]), np.array([math.pi / 2]))
    assert not keeps_limit(cart, (0.0, 0.0, 0.0, 0.0), turn)
    assert keeps_limit(Trailer(jackknife=1.0), (0.0, 0.0, 0.0, 0.0), turn)
    # No farther than it is already.
    straight = ArcWord(np.array([[1.0, 0.0]]), np.array([2.0]))
    assert keeps_limit(cart, (0.0, 0.0, 0.0, 1.2), straight)


# A trailer of six turning radii, beside its goal and turned away from it.
LONG = Trailer(speed=4.35, turn_rate=2.417, length=11.08, hitch_offset=-2.597, reverse=True)
BESIDE = (7.205, -7.465, -0.252, 0.022)
DRAWN_BOX = Goal(state=(6.511, -8.372, -1.433, 0.0), tolerance=(0.36, 0.36, 0.251, 0.251))


def quickest(trailer, start, goal, words):
    def allowed(word):
        return len(word.durations) > 0 and keeps_limit(trailer, start, word)

    return quickest_words(trailer, start, words, goal, allowed)[0]


def test_a_long_trailer_is_parked_sooner_than_by_any_path_of_a_car():
    by_car = quickest(LONG, BESIDE, DRAWN_BOX, car_words(LONG, BESIDE, DRAWN_BOX))
    drawn = quickest(LONG, BESIDE, DRAWN_BOX, drawn_words(LONG, BESIDE, DRAWN_BOX))
    assert DRAWN_BOX.contains(end_of(LONG, BESIDE, drawn))
    assert drawn.time < 0.99 * by_car.time


def test_a_polished_plan_knows_of_them(monkeypatch):
    # A quarter of them, and none that end anywhere, from which it may be found as well.
    monkeypatch.setattr(candidates, "KEPT", 10)
    monkeypatch.setattr(polished, "paths_by_chance", lambda *question: [])
    # A table would take longer than all the rest.
    monkeypatch.setattr(polished, "open_field_table", lambda *question: None)
    plan = polished.plan_polished(LONG, BESIDE, DRAWN_BOX)
    assert plan.converged
    drawn = quickest(LONG, BESIDE, DRAWN_BOX, drawn_words(LONG, BESIDE, DRAWN_BOX))
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


def test_ways_around_and_over_to_the_other_side_are_kept_beside_quicker_ones():
    cart = Trailer(length=0.74, hitch_offset=0.19)
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=(0.2, 0.2, 0.25, 0.25))
    start = (3.0, -1.0, -0.3, -2.83)
    words = drawn_words(cart, start, goal)
    ends = np.array([end_of(cart, start, word) for word in words])
    theta, beta = np.rint(ends[:, 2:] / (2 * math.pi)).T
    assert set(beta) >= {-1.0, 0.0}
    assert len(set(theta)) > 1
    wound = Counter(zip(theta, beta, strict=True))
    assert max(wound.values()) <= KEPT_ALIKE
    orders = {
        (*each, word.controls.tobytes()) for *each, word in zip(theta, beta, words, strict=True)
    }
    assert len(orders) == len(words)


def test_far_goals_are_met_by_long_trailers():
    """Where a turn that is off by little is off by far at the end."""
    cart = Trailer(length=3.46, hitch_offset=0.5)
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=(0.2, 0.2, 0.25, 0.25))
    words = drawn_words(cart, (110.0, -70.0, 2.0, -1.4), goal)
    assert len(words) > 5
    assert words[0].time > 130.0


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
