"""The matching of small teams is the Hungarian one."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.tracking.assignment.matching import match_pairs, match_small


def worth(targets, risk, visible):
    """How many pairs, and their total risk."""
    pairs = [(i, j) for i, j in enumerate(targets) if j >= 0]
    assert all(visible[pair] for pair in pairs)
    assert len({j for _, j in pairs}) == len(pairs)
    return len(pairs), sum(risk[pair] for pair in pairs)


@pytest.mark.parametrize("greatest", [False, True])
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 6), m=st.integers(1, 6))
def test_it_matches_as_the_matching_of_any_teams_does(greatest, seed, n, m):
    rng = np.random.default_rng(seed)
    visible = rng.random((n, m)) < rng.choice([0.3, 0.7, 1.0])
    risk = np.where(visible, rng.uniform(0.0, 10.0 ** rng.integers(-2, 7), (n, m)), 0.0)
    small = worth(match_small(risk, visible, greatest), risk, visible)
    any_size = worth(match_pairs(risk, visible, maximise=greatest), risk, visible)
    assert small == pytest.approx(any_size, rel=1e-9)


@pytest.mark.parametrize("greatest", [False, True])
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 4), m=st.integers(1, 3))
def test_no_other_choice_is_better(greatest, seed, n, m):
    rng = np.random.default_rng(seed)
    visible, risk = rng.random((n, m)) < 0.6, rng.uniform(0.1, 9.0, (n, m))
    count, total = worth(match_small(risk, visible, greatest), risk, visible)
    for targets in itertools.product(range(-1, m), repeat=n):
        pairs = [(i, j) for i, j in enumerate(targets) if j >= 0]
        if all(visible[pair] for pair in pairs) and len({j for _, j in pairs}) == len(pairs):
            other = sum(risk[pair] for pair in pairs)
            assert len(pairs) <= count
            if len(pairs) == count:
                assert (other <= total + 1e-9) if greatest else (other >= total - 1e-9)


@pytest.mark.parametrize(
    ("cost", "visible", "message"),
    [
        (
            np.zeros((2, 3)),
            np.ones((2, 2), bool),
            r"`visible` must have the shape of cost, \(2, 3\)",
        ),
        (np.zeros(3), np.ones(3, bool), r"`cost` must be a table of rows and columns"),
        (np.array([[1.0, np.nan]]), np.ones((1, 2), bool), "`cost` must be finite"),
    ],
)
def test_what_is_no_table_of_pairs_is_refused(cost, visible, message):
    with pytest.raises(InvalidInput, match=message):
        match_pairs(cost, visible)
