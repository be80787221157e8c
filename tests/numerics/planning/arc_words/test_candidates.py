"""Words into a box for any cart, found without a table."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.planning.arc_words.candidates import (
    car_words,
    keeps_limit,
    quickest_words,
)
from sightfield.systems.numerics.planning.arc_words.quickest import ArcWord
from sightfield.systems.numerics.planning.arc_words.shortened import end_of
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.lower_bound import lower_bound
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
