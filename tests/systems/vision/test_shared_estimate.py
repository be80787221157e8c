"""What pursuers together know of evaders."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.vision.shared_estimate import SharedEstimate

WORLD = make_world([[0, 0], [4, 0], [4, 3], [0, 3]])
SIZES = {"cameras": 2, "evaders": 1, "speed": 0.1, "period": 0.1}


def test_it_joins_its_cameras_estimates_when_they_are_due():
    system = SharedEstimate([WORLD], **SIZES, delay=0.05)
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    for i, spot in enumerate(([1.0, 1.0], [1.2, 1.0])):
        system.GetInputPort(f"position_{i}").FixValue(context, np.array(spot))
        system.GetInputPort(f"covariance_{i}").FixValue(context, 0.01 * np.eye(2).ravel())
        system.GetInputPort(f"valid_{i}").FixValue(context, np.array([1.0]))

    def known():
        return system.GetOutputPort("evader_known").Eval(context)[0]

    simulator.AdvanceTo(0.04)
    assert known() == 0
    assert (system.GetOutputPort("evader_position").Eval(context) < 0).all()
    simulator.AdvanceTo(0.06)
    assert known() == 1
    position = system.GetOutputPort("evader_position").Eval(context)
    np.testing.assert_allclose(position, [1.1, 1.0], atol=1e-12)
    covariance = system.GetOutputPort("evader_covariance").Eval(context)
    np.testing.assert_allclose(covariance, 0.005 * np.eye(2).ravel(), atol=1e-12)
    # Out of sight it is remembered, and less certain.
    for i in range(2):
        system.GetInputPort(f"valid_{i}").FixValue(context, np.array([0.0]))
    simulator.AdvanceTo(0.5)
    position = system.GetOutputPort("evader_position").Eval(context)
    np.testing.assert_allclose(position, [1.1, 1.0], atol=1e-12)
    assert system.GetOutputPort("evader_covariance").Eval(context)[0] > 0.005


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"cameras": 0}, "`cameras` must be positive; got 0"),
        ({"evaders": 0}, "`evaders` must be positive; got 0"),
        ({"period": 0.0}, "`period` must be positive; got 0.0"),
        ({"delay": -1.0}, "`delay` must be zero or positive; got -1.0"),
    ],
)
def test_numbers_out_of_range_are_refused(change, message):
    with pytest.raises(InvalidInput, match=message):
        SharedEstimate([WORLD], **{**SIZES, **change})
