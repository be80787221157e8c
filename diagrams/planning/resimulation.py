"""Driving a planned path's controls through the Drake plant, to see where they really lead."""

from dataclasses import dataclass

import numpy as np
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from ...systems.numerics.planning.goal import Goal
from ...systems.numerics.planning.plan import TrailerPath, require_path
from ...systems.numerics.planning.trailer import Trailer, control_excess
from ...systems.planning.tractor_trailer import TractorTrailer

ACCURACY = 1e-11
# The integrator's own longest step, in times that a turn by one radian takes.
LONGEST_STEP = 0.1


@dataclass(frozen=True, eq=False)
class Resimulation:
    """Where a path's controls lead.

    Attributes:
        path: The path that was driven, at the times of the planned one.
        final_state: x, y, theta, beta [m], [m], [rad], [rad].
        goal_miss: How far it is outside the goal's box, entry by entry.
        control_excess: By how much the planned controls leave the bounds, which the plant keeps
            [m/s or rad/s].
        jackknife_excess: By how much |beta| exceeds the limit at a sample [rad].
        drift: Largest distance between a planned state and the driven one, in any entry
            [m or rad].
    """

    path: TrailerPath
    final_state: tuple[float, float, float, float]
    goal_miss: tuple[float, float, float, float]
    control_excess: float
    jackknife_excess: float
    drift: float

    @property
    def violation(self) -> float:
        """The largest of what is outside the goal and beyond the bounds."""
        return max(*self.goal_miss, self.control_excess, self.jackknife_excess)


def resimulate(trailer: Trailer, path: TrailerPath, goal: Goal) -> Resimulation:
    """Drive the plant from the path's first state with its controls, each held to the next time.

    Args:
        trailer: Parameters.
        path: At least two samples; states other than the first only serve to find the drift.
        goal: What was to be reached.

    Raises:
        InvalidInput: The path has not two samples at increasing times.
    """
    require_path(path)
    plant = TractorTrailer(trailer, path.states[0])
    simulator = Simulator(plant)
    ResetIntegratorFromFlags(simulator, "runge_kutta5", LONGEST_STEP / trailer.turn_rate)
    simulator.get_mutable_integrator().set_target_accuracy(ACCURACY)
    context = simulator.get_mutable_context()
    driven = np.empty((len(path.times), 4))
    driven[0] = path.states[0]
    for k, held in enumerate(path.controls):
        # A change of the input between steps, not within one, costs the integrator nothing.
        plant.get_control_input_port().FixValue(context, held)
        simulator.AdvanceTo(path.times[k + 1] - path.times[0])
        driven[k + 1] = context.get_continuous_state_vector().CopyToVector()
    x, y, theta, beta = map(float, driven[-1])
    bent = np.abs(np.remainder(driven[:, 3] + np.pi, 2 * np.pi) - np.pi)
    return Resimulation(
        path=TrailerPath(path.times, driven, path.controls),
        final_state=(x, y, theta, beta),
        goal_miss=goal.miss(driven[-1]),
        control_excess=control_excess(path.controls, trailer),
        jackknife_excess=float(max(bent.max() - trailer.jackknife, 0.0)),
        drift=float(np.abs(driven - path.states).max()),
    )
