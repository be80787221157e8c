"""How soon the policy of a table arrives: undisturbed, and in closed loop with noise and delay."""

import math
import os
import time

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.footprint import (
    covering_discs,
    deepest_overlap,
    path_overlap,
)
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.planners.from_table import grid_within
from sightfield.systems.numerics.planning.planners.polished import plan_polished
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.obstacles import room_of
from sightfield.systems.numerics.planning.value_function.policy import inside, roll_out
from sightfield.systems.numerics.planning.value_function.solve import (
    open_field_table,
    solve_value_function,
)
from sightfield.systems.planning import TractorTrailer, ValueFunctionFeedback

pytestmark = pytest.mark.benchmarks

SEED = int(os.environ.get("SEED", "20261"))
STARTS = int(os.environ.get("STARTS", "200"))
GOAL = Goal(state=(4.0, 4.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
README = (1.0, 1.0, 0.0, 0.0)
CART = Trailer()
THESIS, FINE = 0.2, 0.1
# A measurement each period, one period old when it is used; its standard deviations.
PERIOD = 0.05
# Of the integrator in a period; walls are looked at after each.
STEPS = 5
NOISE = np.array([0.005, 0.005, math.radians(0.5), math.radians(0.5)])
PATIENCE = 60.0
# Among walls: where in the bounds of a world x and y, headings and angles begin; room at a start.
LIMITS = ((0, math.pi, 1.0), (2, -math.pi, -1.0))
ROOM = 0.05


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
    """When the cart is first in the box, and its states at every step until it stops."""
    builder = DiagramBuilder()
    cart = builder.AddSystem(TractorTrailer(CART, start))
    sensor = builder.AddSystem(Measurement(seed, start))
    feedback = builder.AddSystem(ValueFunctionFeedback(value, period=PERIOD, delay=PERIOD))
    builder.Connect(cart.GetOutputPort("state"), sensor.GetInputPort("true"))
    builder.Connect(sensor.GetOutputPort("measured"), feedback.GetInputPort("state"))
    builder.Connect(feedback.GetOutputPort("control"), cart.GetInputPort("control"))
    simulator = Simulator(builder.Build())
    simulator.get_mutable_integrator().set_fixed_step_mode(True)
    simulator.get_mutable_integrator().set_maximum_step_size(PERIOD / STEPS)
    root = simulator.get_context()
    arrived, states = math.inf, [np.array(start)]
    for step in range(1, round(PATIENCE / PERIOD)):
        for part in range(1, STEPS + 1):
            simulator.AdvanceTo((step - 1 + part / STEPS) * PERIOD)
            state = cart.GetMyContextFromRoot(root).get_continuous_state_vector()
            states.append(state.CopyToVector())
        if inside(value, states[-1]):
            arrived = min(arrived, step * PERIOD)
        control = feedback.GetOutputPort("control").Eval(feedback.GetMyContextFromRoot(root))
        if arrived < math.inf and not control.any():
            break
    return arrived, np.array(states)


def test_in_closed_loop():
    value = table(THESIS)
    late, misses = [], []
    for seed, start in enumerate(starts()):
        arrived, states = closed_loop(value, start, seed)
        late.append(arrived / roll_out(value, start).path.times[-1] - 1)
        misses.append(max(GOAL.miss(states[-1])))
    print(
        f"\nin closed loop, held for {PERIOD:g} s and as late, {STARTS} starts: "
        f"{np.isfinite(late).sum()} arrive, {np.median(late):.1%} later (median), "
        f"{np.mean(np.array(late) > 0.1):.0%} of them by more than a tenth; "
        f"{np.mean(np.array(misses) == 0):.0%} stop in the box"
    )


def fields():
    """A headland, a wall that stands free, and standing crop: each a world and a goal."""
    crop = [(0, 3.8), (8.5, 3.8), (8.5, 4.2), (0, 4.2)]
    wall = [(1.3, 1.5), (1.7, 1.5), (1.7, 7), (1.3, 7)]
    for world, state in (
        (make_world([(0, 0), (12, 0), (12, 5), (0, 5)]), (9.0, 3.5, math.pi, 0.0)),
        (make_world([(-5, -5), (11, -5), (11, 11), (-5, 11)], [wall]), (6.0, 3.0, 0.0, 0.0)),
        (make_world([(0, 0), (12, 0), (12, 8), (0, 8)], [crop]), (6.0, 5.4, math.pi, 0.0)),
    ):
        yield world, Goal(state=state, tolerance=THESIS_TOLERANCE)


def walled_starts(value, world, count):
    """States at random that are clear of walls, from which the table knows a way."""
    rng = np.random.default_rng(SEED)
    low, high = ([*world.bounds[k : k + 2], -way, -bend] for k, way, bend in LIMITS)
    while count:
        start = rng.uniform(low, high)
        if room_of(value.walls, start) > ROOM and np.isfinite(value.interpolated(start)):
            count -= 1
            yield start


def test_among_walls():
    discs = covering_discs(CART)
    arrived, losses, depths, seconds = 0, [], [], []
    errors: dict[str, list[float]] = {}
    in_loop, late, loop_depths = 0, [], []
    for world, goal in fields():
        value, finer = (
            solve_value_function(CART, goal, grid_within(world, CART, goal, step), obstacles=world)
            for step in (THESIS, FINE)
        )
        for seed, start in enumerate(walled_starts(value, world, STARTS // 10)):
            began = time.process_time()
            driven = roll_out(value, start)
            seconds.append(time.process_time() - began)
            arrived += driven.arrived and bool(goal.contains(driven.path.states[-1]))
            depths.append(path_overlap(world, discs, driven.path, CART))
            beside = [driven.path] if len(driven.path.controls) else None
            other = plan_by_casadi(CART, start, goal, seeds=beside, obstacles=world)
            best = other.time if other.converged else math.inf
            time_driven = driven.path.times[-1]
            least = min(best, time_driven)
            losses.append(time_driven / least - 1)
            for name, time_to_go in (
                ("time to go", value.time_to_go),
                ("interpolated", value.interpolated),
                ("time to go, finer", finer.time_to_go),
                ("interpolated, finer", finer.interpolated),
            ):
                errors.setdefault(name, []).append(abs(float(time_to_go(start)) / least - 1))
            at, states = closed_loop(value, start, seed)
            in_loop += bool(goal.contains(states[-1]))
            late.append(at / time_driven - 1)
            loop_depths.append(deepest_overlap(world, discs, states))
    print(
        f"\nthe way down the table among walls, {len(losses)} starts: {arrived} arrive, "
        f"{np.mean(losses):.3%} above what the programme makes of it (mean), {max(losses):.3%} at "
        f"most, {max(depths):.1e} m in a wall at most; {np.median(seconds):.2f} CPU s; "
        + "; ".join(
            f"{name} off by {np.mean(each):.3%} (mean), {np.median(each):.3%} (median), "
            f"{max(each):.2%} (largest)"
            for name, each in errors.items()
        )
        + "\n"
        f"in closed loop {in_loop} stop in the box, {np.median(late):.1%} later (median), "
        f"{np.sum(np.array(loop_depths) > 0)} of them touch a wall, {max(loop_depths):.1e} m deep"
    )
