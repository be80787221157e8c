"""An assignment that is held lives in the Context, and is left when it is broken."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.assignment.holding import HOLDS, is_broken
from sightfield.systems.tracking.assignment import Assignment
from sightfield.systems.tracking.line_of_sight import LineOfSight

WORLD = make_world(
    [[0, 0], [6, 0], [6, 6], [0, 6]],
    [[[1, 1], [2, 1.2], [1.8, 2], [1.1, 1.9]], [[3.5, 3], [4.5, 3.2], [4.2, 4.5], [3.4, 4.1]]],
)
SIZES = {"pursuers": 3, "evaders": 3}
PERIOD, SECONDS, STEPS = 0.1, 20.0, 180
NEAR = [0.5, 0.5, 0.7, 0.5, 0.9, 0.5]


def walks(seed):
    """Where robots of a team are, wandering without regard to anything."""
    rng = np.random.default_rng(seed)
    stops = rng.uniform(0.2, 5.8, (6, 15))
    return PiecewisePolynomial.FirstOrderHold(np.linspace(0.0, SECONDS, 15), stops)


def make_watch(seed, hold, **options):
    """A diagram of wandering teams, who sees whom in it, and who is assigned to whom."""
    builder = DiagramBuilder()
    sight = builder.AddNamedSystem("sight", LineOfSight(WORLD, **SIZES))
    assignment = builder.AddNamedSystem(
        "assignment", Assignment(WORLD, **SIZES, hold=hold, period=PERIOD, **options)
    )
    for k, name in enumerate(("pursuer_position", "evader_position")):
        walk = builder.AddNamedSystem(f"{name}_walk", TrajectorySource(walks([seed, k])))
        for system in (sight, assignment):
            builder.Connect(walk.get_output_port(), system.GetInputPort(name))
    builder.Connect(sight.GetOutputPort("sight"), assignment.GetInputPort("sight"))
    builder.ExportOutput(sight.GetOutputPort("sight"), "sight")
    builder.ExportOutput(assignment.GetOutputPort("assignment"), "assignment")
    return builder.Build()


def samples(simulator, steps):
    """Who sees whom, (steps, 3, 3) bool, and the assignment, (steps, 3), period by period."""
    diagram, context = simulator.get_system(), simulator.get_context()
    seen, held = [], []
    begun = context.get_time()
    for k in range(1, steps + 1):
        simulator.AdvanceTo(begun + k * PERIOD)
        sight = diagram.GetOutputPort("sight").Eval(context)
        seen.append(sight[:9].reshape(3, 3) > 0.5)
        held.append(diagram.GetOutputPort("assignment").Eval(context).astype(int))
    return np.array(seen), np.array(held)


@pytest.mark.parametrize("seed", range(4))
def test_what_is_held_changes_only_when_it_is_broken(seed):
    seen, held = samples(Simulator(make_watch(seed, "until_lost")), STEPS)
    changes = (held[1:] != held[:-1]).any(axis=1)
    breaks = [is_broken(now, before) for now, before in zip(seen[1:], held[:-1], strict=True)]
    assert not (changes & ~np.array(breaks)).any()
    assert changes.sum() > 3
    # The rule by itself would have changed its mind more often.
    _, free = samples(Simulator(make_watch(seed, "none")), STEPS)
    assert changes.sum() < (free[1:] != free[:-1]).any(axis=1).sum()


@pytest.mark.parametrize("hold", HOLDS)
@pytest.mark.parametrize("options", [{}, {"rule": "hungarian_max"}, {"radio_range": 2.0}])
def test_every_evader_that_is_assigned_is_in_sight(hold, options):
    seen, held = samples(Simulator(make_watch(7, hold, **options)), STEPS)
    k, i = np.nonzero(held >= 0)
    assert len(k) > STEPS
    assert seen[k, i, held[k, i]].all()


@pytest.mark.parametrize("hold", ["until_lost", "cost"])
@pytest.mark.parametrize("seed", range(3))
def test_a_run_resumed_from_a_copy_of_its_context_repeats(hold, seed):
    diagram = make_watch(seed, hold)
    simulator = Simulator(diagram)
    simulator.AdvanceTo(7.3)
    copy = simulator.get_context().Clone()
    seen, held = samples(simulator, 80)
    seen_again, held_again = samples(Simulator(diagram, copy), 80)
    np.testing.assert_array_equal(seen_again, seen)
    np.testing.assert_array_equal(held_again, held)


def test_what_is_held_is_state():
    # Two runs that differ in nothing but what was held differ in what is assigned.
    diagram = make_watch(0, "until_lost")
    system = diagram.GetSubsystemByName("assignment")
    found = []
    for held in ([0, 1, 2], [1, 0, 2]):
        context = diagram.CreateDefaultContext()
        for name, place in (("pursuer_position", NEAR), ("evader_position", NEAR[::-1])):
            system.GetInputPort(name).FixValue(system.GetMyContextFromRoot(context), place)
        everything = np.ones(system.GetInputPort("sight").size())
        own = system.GetMyContextFromRoot(context)
        system.GetInputPort("sight").FixValue(own, everything)
        own.SetDiscreteState(held)
        found.append(system.GetOutputPort("assignment").Eval(own).tolist())
    assert found == [[0, 1, 2], [1, 0, 2]]


@pytest.mark.parametrize("hold", ["until_lost", "cost"])
def test_nothing_can_be_held_without_a_period(hold):
    with pytest.raises(InvalidInput, match=f"`period` must be positive to hold {hold}; got 0"):
        Assignment(WORLD, **SIZES, hold=hold)


def test_an_unknown_hold_is_refused():
    with pytest.raises(InvalidInput, match="`hold` must be one of none, until_lost, cost; got x"):
        Assignment(WORLD, **SIZES, hold="x", period=0.1)
