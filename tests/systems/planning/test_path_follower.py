"""The path follower and the tractor-trailer in one diagram."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from sightfield.systems.numerics.planning.path_tracking import tracking_error
from sightfield.systems.numerics.planning.plan import driven_path
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.planning import PathFollower, TractorTrailer

CART = Trailer(reverse=True)


@pytest.mark.parametrize(
    "pieces",
    [[(1, 0.4, 3), (1, -0.3, 2), (1, 0, 4)], [(-1, 0, 9)], [(1, 0.3, 3), (-1, 0, 3), (1, 0, 4)]],
    ids=["forward", "backward", "with cusps"],
)
@pytest.mark.parametrize("disturbance", [(0, 0, 0, 0), (-0.2, 0.3, -0.2, 0.2)])
def test_a_disturbed_cart_comes_back_and_stops_at_the_end(pieces, disturbance):
    path = driven_path(CART, (0, 0, 0, 0), pieces)
    builder = DiagramBuilder()
    cart = builder.AddNamedSystem("cart", TractorTrailer(CART, path.states[0] + disturbance))
    follower = builder.AddNamedSystem("follower", PathFollower(CART, path))
    builder.Connect(cart.get_state_output_port(), follower.get_state_input_port())
    builder.Connect(follower.get_control_output_port(), cart.get_control_input_port())
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(path.times[-1] + 2)
    context = simulator.get_context()
    follower_context = follower.GetMyContextFromRoot(context)
    assert follower.GetOutputPort("progress").Eval(follower_context) >= path.times[-1]
    np.testing.assert_array_equal(follower.GetOutputPort("control").Eval(follower_context), 0)
    state = cart.get_state_output_port().Eval(cart.GetMyContextFromRoot(context))
    assert np.abs(tracking_error(state, path.states[-1])).max() < 0.03
