"""The feedback on a table, and the cart that it drives."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.solve import solve_value_function
from sightfield.systems.planning import TractorTrailer, ValueFunctionFeedback


@pytest.fixture(scope="module")
def value():
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=(0.4, 0.4, 0.55, 0.55))
    return solve_value_function(Trailer(), goal, StateGrid.of_step(0.4))


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


class LateAndNoisy(LeafSystem):
    """The state as it was a period ago, with noise."""

    def __init__(self, first, period, noise, seed):
        super().__init__()
        self._rng, self._noise = np.random.default_rng(seed), noise
        self._true = self.DeclareVectorInputPort("true", 4)
        measured = self.DeclareDiscreteState(first)
        self.DeclareStateOutputPort("measured", measured)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._measure)

    def _measure(self, context, state):
        state.set_value(self._true.Eval(context) + self._noise * self._rng.normal(size=4))


def test_the_cart_arrives_by_late_and_noisy_measurements(value):
    rng = np.random.default_rng(6)
    for seed, start in enumerate(rng.uniform([-3, -3, -3, -1], [3, 3, 3, 1], (4, 4))):
        builder = DiagramBuilder()
        cart = builder.AddSystem(TractorTrailer(Trailer(), start))
        noise = np.array([0.005, 0.005, 0.009, 0.009])
        sensor = builder.AddSystem(LateAndNoisy(start, 0.05, noise, seed))
        feedback = builder.AddSystem(ValueFunctionFeedback(value, period=0.05, delay=0.05))
        builder.Connect(cart.GetOutputPort("state"), sensor.GetInputPort("true"))
        builder.Connect(sensor.GetOutputPort("measured"), feedback.GetInputPort("state"))
        builder.Connect(feedback.GetOutputPort("control"), cart.GetInputPort("control"))
        simulator = Simulator(builder.Build())
        integrator = simulator.get_mutable_integrator()
        integrator.set_fixed_step_mode(True)
        integrator.set_maximum_step_size(0.05)
        simulator.AdvanceTo(25.0)
        # It has stopped in the box.
        context = cart.GetMyContextFromRoot(simulator.get_context())
        state = context.get_continuous_state_vector().CopyToVector()
        assert value.goal.contains(state)
        control = cart.get_control_input_port().Eval(context)
        np.testing.assert_array_equal(control, [0, 0])


def test_which_word_it_follows_is_in_the_context(value):
    system = ValueFunctionFeedback(value)
    context = system.CreateDefaultContext()
    system.GetInputPort("state").FixValue(context, [-2.0, -2.0, -0.5, 0.0])
    simulator = Simulator(system, context)
    simulator.AdvanceTo(0.2)
    twin = context.Clone()
    controls = [system.GetOutputPort("control").Eval(each) for each in (context, twin)]
    np.testing.assert_array_equal(*controls)
    word = context.get_abstract_state(0).get_value().word
    assert word.time > 1
    # What it follows is not the system's: another context begins afresh.
    assert system.CreateDefaultContext().get_abstract_state(0).get_value().word is None


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"period": 0.0}, "period"),
        ({"delay": -0.1}, "delay"),
        ({"margin": 1.0}, "margin"),
        ({"trust": 0.0}, "trust"),
    ],
)
def test_bad_options_are_refused(value, options, name):
    with pytest.raises(InvalidInput, match=name):
        ValueFunctionFeedback(value, **options)
