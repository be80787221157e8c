"""Words of arcs that lead to a goal."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.planning.extremals.arcs import singular_samples, turning_arc
from sightfield.systems.numerics.planning.extremals.word_solver import ARCS, solve_words

START = (0.0, 0.0, 0.0, 0.1)


def solved(word, seed, goal):
    words = np.zeros((1, ARCS))
    words[0, : len(word)] = word
    seeds = np.zeros((1, ARCS + 1))
    seeds[0, : len(seed)] = seed
    lengths = np.array([len(word)])
    answers, errors = solve_words(words, lengths, seeds, np.array(START), np.array(goal), 40)
    return answers[0, : len(word) + 1], errors[0]


def test_a_word_of_four_turns_is_found_again():
    state = START
    durations = (0.7, 3.9, 1.1, 0.5)
    for turn, t in zip((1.0, -1.0, 1.0, -1.0), durations, strict=True):
        state = turning_arc(*state, 1.0, turn, t)
    answer, error = solved((1, -1, 1, -1), (0.8, 3.8, 1.2, 0.4), state)
    assert error < 1e-9
    assert answer[:4] == pytest.approx(durations, abs=1e-8)


def test_a_word_around_a_singular_arc_is_found_again_up_to_whole_turns():
    state = turning_arc(*START, 1.0, 1.0, 0.9)
    sample = singular_samples(np.array(state), -0.1, 1.0, np.array([1.3]))[0]
    x, y, theta, beta, _ = sample
    x, y, theta, beta = turning_arc(x, y, theta, beta, 1.0, -1.0, 0.6)
    goal = (x, y, theta + math.tau, beta - math.tau)
    answer, error = solved((1, 0, -1), (1.0, 1.2, 0.7, 0.0), goal)
    assert error < 1e-9
    assert answer == pytest.approx([0.9, 1.3, 0.6, -0.1], abs=1e-8)


def test_what_cannot_be_reached_is_missed():
    _, error = solved((1, -1, 1, -1), (0.8, 3.8, 1.2, 0.4), (50.0, 0.0, 0.0, 0.0))
    assert error > 1


def test_no_arc_is_driven_backwards():
    behind = turning_arc(*START, 1.0, 1.0, -0.5)
    answer, error = solved((1, 0, -1), (0.1, 0.1, 0.1, 0.0), behind)
    assert np.all(answer[:3] >= 0)
    assert error > 1e-3
