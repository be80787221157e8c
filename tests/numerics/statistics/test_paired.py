"""Two strategies on the same runs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.statistics import paired_difference

SAMPLES = st.lists(st.tuples(st.floats(0.0, 100.0), st.floats(0.0, 100.0)), min_size=2, max_size=30)


def test_a_known_sample():
    """Student's sleep data (Biometrika 1908): hours gained with two drugs by ten patients."""
    first = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4]
    second = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0]
    found = paired_difference(first, second)
    assert found.mean == pytest.approx(1.58)
    assert found.p_value == pytest.approx(0.002833, abs=1e-6)
    assert (found.low, found.high) == pytest.approx((0.7001, 2.4599), abs=1e-4)
    assert found.effect == pytest.approx(1.58 / 1.2300, abs=1e-3)
    # Nine of ten gain more with the first, one as much with either.
    assert found.superiority == pytest.approx(0.95)
    assert found.sign_p == pytest.approx(2 * 0.5**9)


@settings(max_examples=25)
@given(SAMPLES)
def test_swapping_the_strategies_turns_the_answer_round(pairs):
    first, second = np.array(pairs).T
    there, back = paired_difference(first, second), paired_difference(second, first)
    assert back.mean == pytest.approx(-there.mean)
    assert (back.low, back.high) == pytest.approx((-there.high, -there.low))
    assert back.effect == pytest.approx(-there.effect)
    assert back.superiority == pytest.approx(1.0 - there.superiority)
    assert back.sign_p == pytest.approx(there.sign_p)
    assert back.p_value == pytest.approx(there.p_value)
    assert back.wilcoxon_p == pytest.approx(there.wilcoxon_p)


def test_pairing_finds_what_the_runs_own_spread_would_hide():
    rng = np.random.default_rng(0)
    runs = rng.uniform(0.0, 100.0, 50)
    found = paired_difference(runs + rng.normal(1.0, 1.0, 50), runs)
    assert found.low > 0.0
    assert max(found.p_value, found.wilcoxon_p, found.sign_p) < 1e-3


def test_the_same_times_are_no_difference():
    found = paired_difference([5.0, 7.0, 9.0], [5.0, 7.0, 9.0])
    assert (found.mean, found.low, found.high, found.effect) == (0.0, 0.0, 0.0, 0.0)
    assert found.p_value == found.wilcoxon_p == found.sign_p == 1.0
    assert found.superiority == 0.5


def test_false_alarms_are_as_rare_as_the_level_says():
    rng = np.random.default_rng(1)
    p_values = np.array(
        [paired_difference(*rng.exponential(30.0, (2, 25))).p_value for _ in range(400)]
    )
    assert 0.02 < (p_values < 0.05).mean() < 0.08


@pytest.mark.parametrize(("first", "second"), [([1.0], [1.0]), ([1.0, 2.0], [1.0])])
def test_what_is_not_paired_is_refused(first, second):
    with pytest.raises(InvalidInput, match="`first` must have two pairs or more"):
        paired_difference(first, second)


def test_what_is_not_finite_is_refused():
    with pytest.raises(InvalidInput, match="`first` must be finite"):
        paired_difference([1.0, np.inf], [1.0, 2.0])
