"""Runs of the stand-off loop, as a block diagram and in closed form, and how they converge."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.systems.analysis import Simulator

from ...systems.numerics.errors import require, require_positive
from ...systems.numerics.standoff.equilibria import span, wanted_equilibrium
from ...systems.numerics.standoff.loop import StandoffLoop
from ...systems.numerics.standoff.sampled_pid import SampledPid
from ...systems.standoff.closed_loop import StandoffClosedLoop
from .make_standoff import MakeStandoff, standoff_context
from .scenario import StandoffScenario

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
        InvalidInput: The duration is not positive, or there is no equilibrium.
    """
    require_positive("duration", duration)
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
