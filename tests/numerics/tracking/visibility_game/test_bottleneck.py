"""The bottleneck matching, against every matching there is."""

from itertools import product

import numpy as np
import pytest

from sightfield.systems.numerics.tracking.visibility_game.bottleneck import (
    bottleneck,
    certificate,
    covered,
    is_longer,
    with_helpers,
)


def matchings(worth):
    """All ways to give pursuers different evaders that they see, or none."""
    n, m = worth.shape
    for targets in product(range(-1, m), repeat=n):
        chosen = [j for j in targets if j >= 0]
        if len(set(chosen)) == len(chosen) and all(
            worth[i, j] > 0 for i, j in enumerate(targets) if j >= 0
        ):
            yield np.array(targets)


def value(targets, worth):
    """How many pairs, the least worth, and the total."""
    pairs = [worth[i, j] for i, j in enumerate(targets) if j >= 0]
    return (len(pairs), min(pairs, default=0.0), sum(pairs))


@pytest.mark.parametrize(("n", "m"), [(1, 1), (2, 2), (3, 3), (4, 3), (2, 4), (4, 4)])
@pytest.mark.parametrize("hidden", [0.0, 0.3, 0.7])
def test_no_matching_has_a_greater_least_worth(n, m, hidden):
    rng = np.random.default_rng([n, m, int(10 * hidden)])
    for _ in range(25):
        worth = rng.integers(1, 12, (n, m)) * (rng.random((n, m)) >= hidden).astype(float)
        best = max(value(targets, worth) for targets in matchings(worth))
        assert value(bottleneck(worth), worth) == pytest.approx(best)


def test_a_spare_pursuer_goes_to_the_weakest_pair():
    worth = np.array([[9.0, 0.0], [0.0, 3.0], [4.0, 2.0]])
    assert with_helpers(bottleneck(worth), worth, np.full((3, 2), np.inf)).tolist() == [0, 1, 1]


def test_an_evader_that_nobody_is_spared_for_gets_the_one_that_is_there_soonest():
    worth = np.array([[9.0, 8.0], [0.0, 0.0], [0.0, 0.0]])
    steps = np.array([[np.inf, np.inf], [7.0, 5.0], [2.0, 3.0]])
    # The other one follows: the second evader is still the weakest.
    assert with_helpers(np.array([0, -1, -1]), worth, steps).tolist() == [0, 1, 1]
    worth[2] = [5.0, 0.0]
    assert with_helpers(np.array([0, -1, -1]), worth, steps).tolist() == [0, 1, 1]
    worth[1] = [0.0, 0.5]
    assert with_helpers(np.array([0, -1, -1]), worth, steps).tolist() == [0, 1, 1]
    # Where there is no way it waits.
    worth[1:] = 0.0
    assert with_helpers(np.array([0, -1, -1]), worth, np.full((3, 2), np.inf)).tolist() == [
        0,
        -1,
        -1,
    ]


def test_a_pursuer_that_sees_nobody_has_no_evader():
    assert bottleneck(np.array([[0.0, 0.0], [1.0, 2.0]])).tolist() == [-1, 1]
    assert bottleneck(np.zeros((2, 2))).tolist() == [-1, -1]


def test_the_certificate_is_the_least_time_of_the_best_watchers():
    times = np.array([[4.0, 1.0], [np.inf, 2.0], [1.0, 3.0]])
    assert certificate(np.array([0, 1, 1]), times) == 3.0
    assert certificate(np.array([0, 0, 1]), times) == 3.0
    assert certificate(np.array([1, 0, -1]), times) == 1.0
    assert certificate(np.array([0, -1, -1]), times) == 0.0


def test_a_change_has_to_be_worth_a_tenth_and_a_step():
    assert is_longer(12.1, 10.0, 1.0)
    assert not is_longer(11.9, 10.0, 1.0)
    assert is_longer(np.inf, 10.0, 1.0)
    assert not is_longer(np.inf, np.inf, 1.0)


def test_an_evader_is_covered_by_a_pursuer_of_its_own():
    visible = np.array([[True, True], [False, False]])
    assert covered(np.array([0, 1]), visible) == 1
    assert covered(np.array([1, 1]), visible) == 1
    assert covered(np.array([-1, 0]), visible) == 0
