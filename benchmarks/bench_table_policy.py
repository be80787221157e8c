"""How soon the policy of a table arrives: undisturbed, and in closed loop with noise and delay."""

import math
import time

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.polished.planner import plan_polished
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.rollout import roll_out
from sightfield.systems.numerics.planning.value_function.tables import open_field_table
from sightfield.systems.planning import TractorTrailer, ValueFunctionFeedback

pytestmark = pytest.mark.benchmarks

SEED, STARTS = 20261, 200
GOAL = Goal(state=(4.0, 4.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
README = (1.0, 1.0, 0.0, 0.0)
CART = Trailer()
THESIS, FINE = 0.2, 0.1
# A measurement each period, one period old when it is used; its standard deviations.
PERIOD = 0.05
NOISE = np.array([0.005, 0.005, math.radians(0.5), math.radians(0.5)])
PATIENCE = 60.0


def starts():
    rng = np.random.default_rng(SEED)
    return rng.uniform([0, 0, -np.pi, -1.5], [8, 8, np.pi, 1.5], (STARTS, 4))


def table(step):
    return open_field_table(CART, README, GOAL, step)


def test_undisturbed():
    coarse, fine = table(THESIS), table(FINE)
    losses, gains, seconds, arrived = [], [], [], 0
    for start in starts():
        began = time.process_time()
        driven = roll_out(coarse, start)
        seconds.append(time.process_time() - began)
        arrived += driven.arrived and bool(GOAL.contains(driven.path.states[-1]))
        best = plan_polished(CART, start, GOAL, value=coarse).time
        losses.append(driven.path.times[-1] / best - 1)
        gains.append(roll_out(fine, start).path.times[-1] / driven.path.times[-1] - 1)
    readme = [roll_out(value, README).path.times[-1] for value in (coarse, fine)]
    print(
        f"\nthe way down the table, {STARTS} starts: {arrived} arrive, {np.mean(losses):+.4%} of "
        f"the polished time (mean), {np.median(losses):+.4%} (median), {min(losses):+.3%} to "
        f"{max(losses):+.3%}; {np.median(seconds):.3f} CPU s; at half the step "
        f"{np.mean(gains):+.4%} (mean), {min(gains):+.3%} to {max(gains):+.3%}; from (1, 1, 0, 0) "
        f"{readme[0]:.5f} s and {readme[1]:.5f} s"
    )


class Measurement(LeafSystem):
    """The state as it was a period ago, with noise; at first as it is."""

    def __init__(self, seed, first):
        super().__init__()
        self._rng = np.random.default_rng(seed)
        self._input = self.DeclareVectorInputPort("true", 4)
        measured = self.DeclareDiscreteState(first)
        self.DeclareStateOutputPort("measured", measured)
        self.DeclarePeriodicDiscreteUpdateEvent(PERIOD, 0.0, self._update)

    def _update(self, context, state):
        state.set_value(self._input.Eval(context) + NOISE * self._rng.normal(size=4))


def closed_loop(value, start, seed):
    """When the cart is first in the box, and how far outside of it it stops at last."""
    builder = DiagramBuilder()
    cart = builder.AddSystem(TractorTrailer(CART, start))
    sensor = builder.AddSystem(Measurement(seed, start))
    feedback = builder.AddSystem(ValueFunctionFeedback(value, period=PERIOD, delay=PERIOD))
    builder.Connect(cart.GetOutputPort("state"), sensor.GetInputPort("true"))
    builder.Connect(sensor.GetOutputPort("measured"), feedback.GetInputPort("state"))
    builder.Connect(feedback.GetOutputPort("control"), cart.GetInputPort("control"))
    simulator = Simulator(builder.Build())
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    simulator.get_mutable_integrator().set_maximum_step_size(PERIOD / 5)
    root = simulator.get_context()
    arrived, state = math.inf, np.array(start)
    for step in range(1, round(PATIENCE / PERIOD)):
        simulator.AdvanceTo(step * PERIOD)
        state = cart.GetMyContextFromRoot(root).get_continuous_state_vector().CopyToVector()
        if GOAL.contains(state):
            arrived = min(arrived, step * PERIOD)
        control = feedback.GetOutputPort("control").Eval(feedback.GetMyContextFromRoot(root))
        if arrived < math.inf and not control.any():
            break
    return arrived, max(GOAL.miss(state))


def test_in_closed_loop():
    value = table(THESIS)
    late, misses = [], []
    for seed, start in enumerate(starts()):
        arrived, miss = closed_loop(value, start, seed)
        late.append(arrived / roll_out(value, start).path.times[-1] - 1)
        misses.append(miss)
    print(
        f"\nin closed loop, held for {PERIOD:g} s and as late, {STARTS} starts: "
        f"{np.isfinite(late).sum()} arrive, {np.median(late):.1%} later (median), "
        f"{np.mean(np.array(late) > 0.1):.0%} of them by more than a tenth; "
        f"{np.mean(np.array(misses) == 0):.0%} stop in the box"
    )
