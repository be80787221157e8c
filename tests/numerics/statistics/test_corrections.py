"""Many tests at once."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.statistics import holm

PROBABILITIES = st.lists(st.floats(0.0, 1.0), max_size=20)


def test_a_case_by_hand():
    np.testing.assert_allclose(holm([0.01, 0.04, 0.03]), [0.03, 0.06, 0.06])


@given(PROBABILITIES)
def test_rejecting_by_adjusted_values_is_holms_procedure(raw):
    """Step down while p_(k) (m - k + 1) <= alpha, and stop at the first that is not."""
    adjusted, alpha, rejected = holm(raw), 0.05, set()
    for step, k in enumerate(sorted(range(len(raw)), key=lambda k: raw[k])):
        if raw[k] * (len(raw) - step) > alpha:
            break
        rejected.add(k)
    # Equal values share one fate.
    assert {raw[k] for k in np.flatnonzero(adjusted <= alpha)} == {raw[k] for k in rejected}


@given(PROBABILITIES)
def test_it_lies_between_no_correction_and_bonferronis(raw):
    adjusted = holm(raw)
    assert (adjusted >= np.array(raw)).all()
    assert (adjusted <= np.minimum(len(raw) * np.array(raw), 1.0) + 1e-12).all()


def test_what_is_no_probability_is_refused():
    with pytest.raises(InvalidInput, match="`p_values` must be probabilities"):
        holm([0.5, 1.5])
