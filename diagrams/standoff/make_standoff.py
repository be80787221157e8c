"""A pursuer that keeps its distance to an evader on a line: scenario, block diagram, and its runs.

The diagram is what a robot would run. Its runs are compared with the loop in closed form, to which
they converge as the sample time falls.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from pydrake.common import RandomDistribution, RandomGenerator
from pydrake.systems.analysis import Simulator
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

from ...systems.numerics.checked import Checked, NonNegativeSized, Sized
from ...systems.numerics.errors import (
    require,
    require_non_negative,
    require_positive,
    require_type,
)
from ...systems.numerics.standoff.loop import StandoffLoop, span, wanted_equilibrium
from ...systems.numerics.standoff.sampled_loop import SampledPid
from ...systems.standoff import BiasedRangeEstimator, StandoffClosedLoop, StandoffPid


@dataclass(frozen=True, kw_only=True)
class StandoffScenario(Checked):
    """A run of the block diagram. The pursuer starts at zero.

    Raises:
        InvalidInput: A number is out of its range.
    """

    loop: StandoffLoop = field(default_factory=StandoffLoop)
    sampled: SampledPid = field(default_factory=SampledPid)
    # Distance at the start [m].
    start: Sized = 0.1
    # Mean speed of the evader [m/s].
    evader_speed: Sized = 0.0
    # Amplitude of its sway about that [m/s].
    evader_sway: Sized = 0.0
    # Frequency of the sway [rad/s].
    sway_frequency: NonNegativeSized = 1.0
    # Whether the pursuer knows the evader's velocity.
    feed_forward: bool = True
    # Standard deviation of the estimate's noise, drawn anew at every sample [m].
    noise: NonNegativeSized = 0.0
    # Of the noise.
    seed: Annotated[int, require_non_negative] = 0
    # How many samples late the estimate comes.
    delay_samples: Annotated[int, require_non_negative] = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        whole = isinstance(self.delay_samples, int) and isinstance(self.seed, int)
        require(whole, "seed, delay_samples", "be integers", (self.seed, self.delay_samples))
        # Drake's generator takes no more.
        require(self.seed < 2**32, "seed", "be less than 2^32", self.seed)


def MakeStandoff(scenario: StandoffScenario) -> Diagram:
    """Evader -> estimator -> (delay) -> controller -> pursuer.

    Output ports, in the order in which data flows: `evader_velocity` [m/s], `evader_position` [m],
    `estimate` [m], as the controller sees it, `command` [m/s], `pursuer_position` [m].

    Use `standoff_context` for the context to start from.

    Raises:
        InvalidInput: `scenario` is no StandoffScenario.
    """
    require_type("scenario", scenario, StandoffScenario)
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


# A run whose distance is this many times that between the equilibria, or its start, is lost.
_LOST = 1e3


@dataclass(frozen=True, eq=False)
class StandoffRun:
    """What happened, at every sample.

    Attributes:
        times: Shape (n,) [s].
        evader, pursuer: Positions on the line, shape (n,) [m].
        estimate: Of the distance, as the controller saw it, shape (n,) [m].
        command: Speed of the pursuer until the next sample, shape (n,) [m/s].
        lost: Whether the run was ended because the distance grew beyond all bounds.
    """

    times: np.ndarray
    evader: np.ndarray
    pursuer: np.ndarray
    estimate: np.ndarray
    command: np.ndarray
    lost: bool

    @property
    def distance(self) -> np.ndarray:
        """True distance y, evader less pursuer, shape (n,) [m]."""
        return self.evader - self.pursuer


def run_standoff(scenario: StandoffScenario, duration: float) -> StandoffRun:
    """Simulate the block diagram for a duration [s].

    Raises:
        InvalidInput: The duration is not positive, the period is longer, or there is no
            equilibrium.
    """
    require_type("scenario", scenario, StandoffScenario)
    require_positive("duration", duration)
    period = scenario.sampled.period
    require(period <= duration, "period", f"be at most the duration, {duration:g} s", period)
    rest = wanted_equilibrium(scenario.loop).y
    bound = _LOST * max(span(scenario.loop), abs(scenario.start))
    diagram = MakeStandoff(scenario)
    simulator = Simulator(diagram, standoff_context(diagram, scenario))
    context = simulator.get_mutable_context()
    # Any: the stubs do not say what ports evaluate to.
    ports: list[Any] = [
        diagram.GetOutputPort(name)
        for name in ("evader_position", "pursuer_position", "estimate", "command")
    ]
    rows, times = [], []
    count = max(1, round(duration / scenario.sampled.period))
    lost = False
    for k in range(count + 1):
        time = k * scenario.sampled.period
        # Samples are taken at the start of a step, so these are the values just before one.
        simulator.AdvanceTo(time)
        row = [port.Eval(context)[0] for port in ports]
        lost = not abs(row[0] - row[1] - rest) < bound
        if lost:
            break
        times.append(time)
        rows.append(row)
    evader, pursuer, estimate, command = np.array(rows).T
    # The command that follows a sample is seen before the next one.
    command = np.append(command[1:], command[-1])
    return StandoffRun(np.array(times), evader, pursuer, estimate, command, lost)


def run_closed_loop(
    loop: StandoffLoop,
    start: float,
    duration: float,
    *,
    start_rate: float | None = None,
    period: float = 0.005,
) -> tuple[np.ndarray, np.ndarray]:
    """Simulate the plant in closed form.

    Args:
        loop: The closed loop.
        start: Distance at the start [m].
        duration: [s].
        start_rate: y' at the start of PI and PID [m/s]; by default with an empty integral.
        period: Between the results [s].

    Returns:
        Times and distances, each of shape (n,) [s], [m].

    Raises:
        InvalidInput: The start lies on a singularity.
    """
    require_positive("duration", duration)
    plant = StandoffClosedLoop(loop, start, start_rate)
    simulator = Simulator(plant)
    simulator.get_mutable_integrator().set_target_accuracy(1e-10)
    simulator.get_mutable_integrator().set_maximum_step_size(duration / 20)
    times = np.arange(max(1, round(duration / period)) + 1) * period
    distances = []
    for time in times.tolist():
        simulator.AdvanceTo(time)
        distances.append(plant.get_state_output_port().Eval(simulator.get_context())[0])
    return times, np.array(distances)


@dataclass(frozen=True, eq=False)
class Convergence:
    """How the block diagram approaches the closed form.

    Attributes:
        filter_times: Time constants tau of the derivative filter, falling, shape (n,) [s].
        errors: Largest difference in distance over the run, shape (n,) [m].
        order: Slope of log error over log time, between the last two.
    """

    filter_times: np.ndarray
    errors: np.ndarray
    order: float


def measure_convergence(
    loop: StandoffLoop,
    start: float,
    duration: float,
    filter_times: Sequence[float],
    *,
    samples_per_filter_time: int = 10,
) -> Convergence:
    """Compare block diagram and closed form while filter and sample time go to zero together.

    It converges, with order one, where 1 - K_D f' > 0. Elsewhere the filtered loop runs away: the
    closed form is not its limit.

    Args:
        loop: The closed loop.
        start: Distance at the start [m].
        duration: [s].
        filter_times: Falling, shape (n,) [s].
        samples_per_filter_time: Samples are so many times as frequent.

    Raises:
        InvalidInput: Filter times do not fall, or a number is out of its range.
    """
    times = np.asarray(filter_times, dtype=float)
    require(len(times) > 1, "filter_times", "be two at least", len(times))
    errors = []
    for filter_time in times.tolist():
        period = filter_time / samples_per_filter_time
        sampled = SampledPid(period=period, filter_time=filter_time)
        run = run_standoff(StandoffScenario(loop=loop, sampled=sampled, start=start), duration)
        _, ideal = run_closed_loop(loop, start, duration, period=period)
        errors.append(math.inf if run.lost else float(np.abs(run.distance - ideal).max()))
    order = math.log(errors[-2] / errors[-1]) / math.log(times[-2] / times[-1])
    return Convergence(times, np.array(errors), order)
