"""Pursuers that run along the pursuit fields and keep near their evaders."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.tracking.pursuit_laws import ModifiedField

SIZES = {"pursuers": 2, "evaders": 3, "top_speed": 0.3}


def velocity_of(system):
    context = system.CreateDefaultContext()
    values = {
        "pursuer_position": [0, 0, 1, 1],
        "evader_position": [0, 2, 5, 1, 1, -4],
        "assignment": [1, -1],
        "field_velocity": [0, 0.2, 0.1, 0],
    }
    for name, value in values.items():
        system.GetInputPort(name).FixValue(context, np.array(value, dtype=float))
    return system.GetOutputPort("velocity").Eval(context)


def test_the_weight_shares_the_velocity_between_field_and_pull():
    pull = 0.3 * np.array([5, 1]) / math.hypot(5, 1)
    for weight in (0.0, 0.5, 1.0):
        velocity = velocity_of(ModifiedField(**SIZES, weight=weight))
        expected = weight * np.array([0, 0.2]) + (1 - weight) * pull
        np.testing.assert_allclose(velocity, [*expected, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"weight": 1.1}, r"`weight` must lie in \[0, 1\]; got 1.1"),
        ({"weight": math.nan}, "`weight` must be a finite number; got nan"),
        ({"top_speed": 0.0}, "`top_speed` must be positive; got 0.0"),
        ({"stand_off": -1.0}, "`stand_off` must be zero or positive; got -1.0"),
        ({"fade": 0.0}, "`fade` must be positive; got 0.0"),
    ],
)
def test_numbers_out_of_range_are_refused(change, message):
    with pytest.raises(InvalidInput, match=message):
        ModifiedField(**{**SIZES, "weight": 0.5, **change})
