"""Outside its calibration an estimate that holds its error makes other equilibria."""

import numpy as np
import pytest

from sightfield.systems.numerics.standoff.loop import ErrorModel, StandoffLoop, held_equilibria


def test_the_thesis_loop_rests_outside_its_calibration():
    near, middle, far = held_equilibria(StandoffLoop())
    # With the error of 15 inches held, the bias all but vanishes.
    assert near.y == pytest.approx(0.2016772, abs=1e-6)
    assert (near.stable, near.calibrated) == (True, False)
    assert middle.y == pytest.approx(1.4360983, abs=1e-6)
    assert (middle.stable, middle.calibrated) == (False, True)
    # A pursuer that lost its way settles here, and takes it for 0.2 m.
    assert far.y == pytest.approx(1.6456405, abs=1e-6)
    assert (far.stable, far.calibrated) == (True, False)


@pytest.mark.parametrize("reference", [-0.5, 0.2, 0.45, 0.58])
def test_held_equilibria_are_all_sign_changes_of_the_held_miss(reference):
    loop = StandoffLoop(reference=reference)
    y = np.linspace(-3, 3, 600_001)
    model = loop.error
    # Held at its end values outside the calibrated range.
    miss = model.error(np.clip(y, model.shortest, model.longest)) - y + reference
    change = np.flatnonzero(np.diff(np.sign(miss)))
    found = held_equilibria(loop)
    np.testing.assert_allclose([each.y for each in found], y[change], atol=2e-5)
    assert [each.stable for each in found] == [miss[k] > 0 for k in change]


def test_an_equilibrium_at_the_end_of_the_range_is_one_and_not_two():
    # f(y) = y^2 - 1.5 y + 0.3125 has its roots at 0.25 and 1.25, without rounding.
    error = ErrorModel(a=1.0, b=-0.5, c=0.0, shortest=0.25, longest=2.0)
    found = held_equilibria(StandoffLoop(controller="PI", error=error, reference=0.3125))
    assert [(each.y, each.calibrated) for each in found] == [
        (0.25, True),
        (1.25, True),
        (3.3125, False),
    ]
