"""The bang-bang feedback on a table, and the cart that it drives."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import Grid
from sightfield.systems.numerics.planning.value_function.solve import solve_value_function
from sightfield.systems.planning.tractor_trailer import TractorTrailer
from sightfield.systems.planning.value_function_feedback import ValueFunctionFeedback


@pytest.fixture(scope="module")
def value():
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=(0.4, 0.4, 0.55, 0.55))
    return solve_value_function(Trailer(), goal, Grid.of_step(0.4))


def control(value, state):
    system = ValueFunctionFeedback(value)
    context = system.CreateDefaultContext()
    system.GetInputPort("state").FixValue(context, state)
    return system.GetOutputPort("control").Eval(context)


def test_it_turns_towards_the_goal(value):
    np.testing.assert_array_equal(control(value, [-2, -2, -0.5, 0]), [1, 1])
    np.testing.assert_array_equal(control(value, [-2, 2, 0.5, 0]), [1, -1])


def test_it_drives_straight_on_when_the_goal_is_ahead(value):
    np.testing.assert_array_equal(control(value, [-2, 0, 0, 0]), [1, 0])


def test_it_stops_at_the_goal_and_where_nothing_is_promised(value):
    np.testing.assert_array_equal(control(value, [0.1, 0, 0, 0]), [0, 0])
    np.testing.assert_array_equal(control(value, [90, 0, 0, 0]), [0, 0])


def test_the_cart_arrives(value):
    builder = DiagramBuilder()
    start = [-3.0, -1.5, 0.3, 0.4]
    cart = builder.AddSystem(TractorTrailer(Trailer(), start))
    feedback = builder.AddSystem(ValueFunctionFeedback(value))
    builder.Connect(cart.GetOutputPort("state"), feedback.GetInputPort("state"))
    builder.Connect(feedback.GetOutputPort("control"), cart.GetInputPort("control"))
    simulator = Simulator(builder.Build())
    integrator = simulator.get_mutable_integrator()
    integrator.set_fixed_step_mode(True)
    integrator.set_maximum_step_size(0.05)
    promised = float(value.time_to_go(start))
    simulator.AdvanceTo(1.5 * promised)
    state = simulator.get_context().get_continuous_state_vector().CopyToVector()
    # Within a step of the box, in which it stops.
    assert max(value.goal.miss(state)) < 0.06
