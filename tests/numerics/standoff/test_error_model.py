"""The fitted error of the estimate: its parabola, its range, its units."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.standoff.loop import THESIS_ERROR, ErrorModel


@pytest.mark.parametrize("y_mm", [0.0, 100.0, 400.0, 1500.0])
def test_the_thesis_constants_are_its_millimetres_in_metres(y_mm):
    printed = 0.001062 * y_mm**2 - 0.7598 * y_mm + 137
    assert 1000 * THESIS_ERROR.error(y_mm / 1000) == pytest.approx(printed, abs=1e-9)


def test_the_calibrated_range_is_15_to_60_inches():
    distances = np.array([14.9, 15.1, 59.9, 60.1]) * 0.0254
    assert [THESIS_ERROR.covers(y) for y in distances] == [False, True, True, False]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"a": math.inf}, "`a` must be a finite number; got inf"),
        ({"b": math.nan}, "`b` must be a finite number; got nan"),
        ({"shortest": 2.0}, "`shortest` must be less than longest, 1.524; got 2.0"),
    ],
)
def test_a_useless_model_is_refused(parameters, message):
    with pytest.raises(InvalidInput) as caught:
        ErrorModel(**parameters)
    assert str(caught.value) == message
