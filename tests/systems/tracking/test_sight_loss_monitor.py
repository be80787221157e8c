"""The monitor of a running game says when sight was lost, whatever its period."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.tracking.line_of_sight import SightLossMonitor

WORLD = make_world([[0, 0], [4, 0], [4, 4], [0, 4]], [[[1, 1], [2, 1], [2, 2], [1, 2]]])

# Seconds at which someone turns; at constant speed in between.
TURNS = [0.0, 1.0, 2.0, 3.0, 4.0]
WALKER = [[0.5, 0.5], [1.5, 0.5], [1.5, 0.0], [1.5, 0.0], [1.5, 0.0]]
# Sees none but the evader beside it: the box is in the way.
GUARD = [[0.2, 1.5]] * 5
GUARDED = [[0.2, 2.5]] * 5
# Goes behind the box, comes back into sight, and goes behind it again.
HIDING = [[3.5, 0.5], [3.0, 1.5], [2.0, 1.5], [3.0, 1.5], [2.0, 1.5]]

# At 1 + s the walker is at (1.5, 0.5 - s/2) and the evader at (3 - s, 1.5); the corner (2, 1) lies
# between them when (1.5 - s) (1 + s) = 1 + s/2, that is, s^2 = 1/2.
LOSS = 1.0 + np.sqrt(0.5)


def watch(period, until, pursuers=(WALKER, GUARD), evaders=(GUARDED, HIDING), start=0.0):
    """What the monitor says at some time of the movers' game [s, -]."""
    builder = DiagramBuilder()
    sizes = {"pursuers": len(pursuers), "evaders": len(evaders)}
    monitor = builder.AddSystem(SightLossMonitor(WORLD, **sizes, period=period))
    for port, movers in (("pursuer_position", pursuers), ("evader_position", evaders)):
        way = PiecewisePolynomial.FirstOrderHold(TURNS, np.hstack(movers).T)
        source = builder.AddSystem(TrajectorySource(way))
        builder.Connect(source.get_output_port(), monitor.GetInputPort(port))
    simulator = Simulator(builder.Build())
    simulator.get_mutable_context().SetTime(start)
    simulator.AdvanceTo(until)
    context = monitor.GetMyContextFromRoot(simulator.get_context())
    return monitor.GetOutputPort("loss").Eval(context).tolist()


# Each takes a sample at every turn, and none at the moment of loss.
@pytest.mark.parametrize("period", [0.02, 0.2, 0.25, 1.0])
def test_the_same_motion_is_lost_at_the_same_moment_at_every_period(period):
    assert watch(period, 2.1) == [pytest.approx(LOSS, abs=1e-6), 1.0]
    first = watch(period, 2.1, evaders=(HIDING, GUARDED))
    assert first == [pytest.approx(LOSS, abs=1e-6), 0.0]


def test_a_loss_is_told_at_the_first_sample_after_it():
    assert watch(0.25, 1.74) == [np.inf, -1.0]
    assert watch(0.25, 1.76) == [pytest.approx(LOSS, abs=1e-6), 1.0]


def test_the_first_loss_stays_when_there_are_more():
    assert watch(0.25, 4.1) == watch(0.25, 2.1)
    # One that begins to watch later sees the second: from (1.5, 0) past (2, 1) to (2.25, 1.5).
    again = watch(0.25, 4.1, start=2.5)
    assert again == [pytest.approx(3.75, abs=1e-6), 1.0]


def test_nobody_is_lost_whom_somebody_else_still_sees():
    lookout = [[3.5, 3.5]] * 5
    assert watch(0.25, 4.1, pursuers=[WALKER, GUARD, lookout]) == [np.inf, -1.0]


@pytest.mark.parametrize("start", [0.0, 0.5])
def test_an_evader_that_nobody_sees_at_first_is_lost_when_the_watch_begins(start):
    assert watch(0.25, start + 0.6, pursuers=[GUARD], start=start) == [start, 1.0]


def test_a_period_of_nothing_is_refused():
    with pytest.raises(InvalidInput, match="`period` must be positive; got 0"):
        SightLossMonitor(WORLD, pursuers=1, evaders=1, period=0.0)
