"""Information is what a picture takes from the uncertainty, on average."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.network.evolution import (
    Acquaintances,
    EvolutionLimits,
    Iteration,
    choose_new,
    entropy,
    estimated_acceptance,
    expected_information,
    interest,
    strangers,
    update_tallies,
)


def brute_force(belief, view):
    """Mutual information of the cell and the outcome, from their joint distribution."""
    joint = np.zeros((belief.size, belief.size + 1))
    for cell in range(belief.size):
        joint[cell, cell] = belief[cell] * view[cell]
        joint[cell, -1] = belief[cell] * (1 - view[cell])
    product = joint.sum(axis=1, keepdims=True) * joint.sum(axis=0, keepdims=True)
    some = joint > 0
    return float((joint[some] * np.log(joint[some] / product[some])).sum())


weights = st.lists(st.floats(0.01, 1), min_size=2, max_size=6)


@given(weights, st.data())
def test_it_is_the_mutual_information_of_place_and_picture(values, data):
    belief = np.array(values) / sum(values)
    size = len(values)
    view = np.array(data.draw(st.lists(st.floats(0, 1), min_size=size, max_size=size)))
    got = expected_information(belief, view)
    assert got == pytest.approx(brute_force(belief, view), abs=1e-9)
    assert 0 <= got <= entropy(belief) + 1e-12


def test_a_picture_that_shows_everything_tells_everything_and_one_that_shows_nothing_nothing():
    belief = np.full(8, 1 / 8)
    assert expected_information(belief, np.ones(8)) == pytest.approx(math.log(8))
    assert expected_information(belief, np.zeros(8)) == pytest.approx(0)


def test_where_the_evader_cannot_be_there_is_nothing_to_learn():
    belief = np.array([0.5, 0.5, 0.0, 0.0])
    assert expected_information(belief, np.array([0.0, 0.0, 1.0, 1.0])) == pytest.approx(0)


def test_the_agent_that_sees_more_and_accepts_sooner_is_more_interesting():
    belief = np.full(4, 0.25)
    views = np.array([[1, 0, 0, 0], [1, 1, 0, 0], [1, 1, 0, 0]], dtype=float)
    score = interest(belief, views, np.array([0.5, 0.5, 0.1]), patience=1)
    assert score[1] > score[0] > 0
    assert score[1] > score[2]
    assert score[2] == pytest.approx(expected_information(belief, views[2]) * (1 - 0.9**2))
    known = choose_new(strangers(3), EvolutionLimits(requests=1), score.tolist())
    assert known[1] == (1,)


def test_tallies_count_iterations_asked_and_give_laplaces_estimate():
    tallies = np.zeros((3, 2))
    assert estimated_acceptance(tallies).tolist() == [0.5, 0.5, 0.5]
    done = Iteration(Acquaintances((-1, 4, -2), (0, 1, 2)), asked=(0, 1), requests_sent=2)
    tallies = update_tallies(tallies, done)
    assert tallies.tolist() == [[1, 0], [0, 1], [0, 0]]
    assert estimated_acceptance(tallies) == pytest.approx([2 / 3, 1 / 3, 1 / 2])


@pytest.mark.parametrize(
    ("belief", "view", "name"),
    [
        ([0.5, 0.4], [1.0, 1.0], "belief"),
        ([1.5, -0.5], [1.0, 1.0], "belief"),
        ([0.5, 0.5], [1.0], "view"),
        ([0.5, 0.5], [1.0, 2.0], "view"),
    ],
)
def test_what_is_no_probability_is_refused(belief, view, name):
    with pytest.raises(InvalidInput, match=f"`{name}`"):
        expected_information(np.array(belief), np.array(view))
