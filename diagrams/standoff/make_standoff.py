"""The stand-off loop as the block diagram that a robot would run."""

from typing import Any

import numpy as np
from pydrake.common import RandomDistribution, RandomGenerator
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, OutputPort
from pydrake.systems.primitives import (
    Adder,
    ConstantVectorSource,
    DiscreteTimeDelay,
    Gain,
    Integrator,
    RandomSource,
    Sine,
)

from ...systems.standoff.range_estimator import BiasedRangeEstimator
from ...systems.standoff.standoff_pid import StandoffPid
from .scenario import StandoffScenario


def MakeStandoff(scenario: StandoffScenario) -> Diagram:
    """Evader -> estimator -> (delay) -> controller -> pursuer.

    Output ports, in the order in which data flows: `evader_velocity` [m/s], `evader_position` [m],
    `estimate` [m], as the controller sees it, `command` [m/s], `pursuer_position` [m].

    Use `standoff_context` for the context to start from.
    """
    builder = DiagramBuilder()
    add = builder.AddNamedSystem
    velocity = _add_evader_velocity(builder, scenario)
    evader = add("evader", Integrator(1))
    pursuer = add("pursuer", Integrator(1))
    estimator = add("estimator", BiasedRangeEstimator(scenario.loop.error))
    controller = add("controller", StandoffPid(scenario.loop, scenario.sampled))
    builder.Connect(velocity, evader.get_input_port())
    builder.Connect(evader.get_output_port(), estimator.GetInputPort("evader_position"))
    builder.Connect(pursuer.get_output_port(), estimator.GetInputPort("pursuer_position"))
    builder.Connect(_add_noise(builder, scenario), estimator.GetInputPort("noise"))
    estimate = estimator.GetOutputPort("estimate")
    if scenario.delay_samples:
        # The controller samples before the delay line moves on, which is one sample by itself.
        steps = scenario.delay_samples - 1
        delay = add("delay", DiscreteTimeDelay(scenario.sampled.period, steps, 1))
        builder.Connect(estimate, delay.get_input_port())
        estimate = delay.get_output_port()
    builder.Connect(estimate, controller.GetInputPort("estimate"))
    if scenario.feed_forward:
        known = velocity
    else:
        known = add("no_feed_forward", _constant(0.0)).get_output_port()
    builder.Connect(known, controller.GetInputPort("feed_forward"))
    builder.Connect(controller.GetOutputPort("command"), pursuer.get_input_port())
    builder.ExportOutput(velocity, "evader_velocity")
    builder.ExportOutput(evader.get_output_port(), "evader_position")
    builder.ExportOutput(estimate, "estimate")
    builder.ExportOutput(controller.GetOutputPort("command"), "command")
    builder.ExportOutput(pursuer.get_output_port(), "pursuer_position")
    diagram = builder.Build()
    diagram.set_name("standoff")
    return diagram


def standoff_context(diagram: Diagram, scenario: StandoffScenario) -> Context:
    """A context at the start: the evader at its distance, the delay full of the first estimate."""
    context = diagram.CreateDefaultContext()
    # Seeds the noise; nothing else in the diagram is random.
    diagram.SetRandomContext(context, RandomGenerator(scenario.seed))
    evader = diagram.GetSubsystemByName("evader").GetMyMutableContextFromRoot(context)
    evader.SetContinuousState(_vector([scenario.start]))
    if scenario.delay_samples:
        first = scenario.start - float(scenario.loop.error.error(scenario.start))
        delay = diagram.GetSubsystemByName("delay").GetMyMutableContextFromRoot(context)
        delay.SetDiscreteState(_vector([first] * delay.get_discrete_state_vector().size()))
    return context


def _vector(values: list[float]) -> Any:
    """Numbers as Drake wants them; its stubs put the dtype of an array where its shape belongs."""
    return np.array(values)


def _constant(value: float) -> ConstantVectorSource:
    return ConstantVectorSource(_vector([value]))


def _add_evader_velocity(builder: DiagramBuilder, scenario: StandoffScenario) -> OutputPort:
    mean = builder.AddNamedSystem("evader_speed", _constant(scenario.evader_speed))
    if scenario.evader_sway == 0:
        return mean.get_output_port()
    sway = builder.AddNamedSystem(
        "evader_sway", Sine(scenario.evader_sway, scenario.sway_frequency, 0.0, 1)
    )
    both = builder.AddNamedSystem("evader_velocity", Adder(2, 1))
    builder.Connect(mean.get_output_port(), both.get_input_port(0))
    builder.Connect(sway.get_output_port(0), both.get_input_port(1))
    return both.get_output_port()


def _add_noise(builder: DiagramBuilder, scenario: StandoffScenario) -> OutputPort:
    if scenario.noise == 0:
        return builder.AddNamedSystem("no_noise", _constant(0.0)).get_output_port()
    source = builder.AddNamedSystem(
        "unit_noise", RandomSource(RandomDistribution.kGaussian, 1, scenario.sampled.period)
    )
    noise = builder.AddNamedSystem("noise", Gain(scenario.noise, 1))
    builder.Connect(source.get_output_port(), noise.get_input_port())
    return noise.get_output_port()
