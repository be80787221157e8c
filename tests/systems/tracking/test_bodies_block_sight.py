"""Systems that are told the robots' radii see no evader past a third robot."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.tracking.line_of_sight import LineOfSight, SightLossMonitor

WORLD = make_world([[0, 0], [4, 0], [4, 4], [0, 4]])
SIZES = {"pursuers": 1, "evaders": 2}
RADII = [0.1, 0.1, 0.2]
VIEWER, TARGET = [0.5, 2.0], [3.5, 2.0]


def sight(third, **options):
    """Which of the two evaders the pursuer sees."""
    system = LineOfSight(WORLD, **SIZES, **options)
    context = system.CreateDefaultContext()
    system.GetInputPort("pursuer_position").FixValue(context, VIEWER)
    system.GetInputPort("evader_position").FixValue(context, [*TARGET, *third])
    return system.GetOutputPort("sight").Eval(context).tolist()


def test_an_evader_hides_behind_another():
    assert sight([2.0, 2.1], body_radii=RADII) == [0, 1]
    assert sight([2.0, 2.3], body_radii=RADII) == [1, 1]


def test_without_radii_robots_are_points():
    assert sight([2.0, 2.1]) == [1, 1]


def loss(period, **options):
    """What the monitor says of 4 s in which one evader drives between the other and its viewer."""
    builder = DiagramBuilder()
    monitor = builder.AddSystem(SightLossMonitor(WORLD, **SIZES, period=period, **options))
    across = np.array([[*TARGET, 2.0, 3.9], [*TARGET, 2.0, 0.1]]).T
    way = PiecewisePolynomial.FirstOrderHold([0.0, 4.0], across)
    evaders = builder.AddSystem(TrajectorySource(way))
    pursuers = builder.AddSystem(ConstantVectorSource(VIEWER))
    builder.Connect(evaders.get_output_port(), monitor.GetInputPort("evader_position"))
    builder.Connect(pursuers.get_output_port(), monitor.GetInputPort("pursuer_position"))
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(4.1)
    context = monitor.GetMyContextFromRoot(simulator.get_context())
    return monitor.GetOutputPort("loss").Eval(context).tolist()


# In the longest of these steps the body has come and gone.
@pytest.mark.parametrize("period", [0.01, 0.3, 2.0, 4.0])
def test_the_moment_of_loss_behind_a_body_is_that_of_its_rim_at_every_period(period):
    # 0.95 m/s from y = 3.9 down to 0.2 above the line.
    assert loss(period, body_radii=RADII) == [pytest.approx(1.7 / 0.95, abs=1e-6), 0.0]


def test_without_radii_nothing_is_lost():
    assert loss(0.3) == [np.inf, -1.0]


@pytest.mark.parametrize("radii", [[0.1, 0.1], [0.1, 0.1, -0.2]])
def test_radii_that_fit_no_team_are_refused(radii):
    with pytest.raises(InvalidInput, match="`body_radii"):
        LineOfSight(WORLD, **SIZES, body_radii=radii)
    with pytest.raises(InvalidInput, match="`body_radii"):
        SightLossMonitor(WORLD, **SIZES, period=0.1, body_radii=radii)


@pytest.mark.parametrize("count", ["2", 1.5, True, 0])
@pytest.mark.parametrize("team", ["pursuers", "evaders"])
def test_teams_are_whole_numbers_of_robots(team, count):
    with pytest.raises(InvalidInput, match=f"`{team}` must be a whole number of at least 1"):
        LineOfSight(WORLD, **SIZES | {team: count})
