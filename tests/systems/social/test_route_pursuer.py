"""The pursuer on its way, as a system."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import (
    ConstantVectorSource,
    Demultiplexer,
    LogVectorOutput,
    Multiplexer,
    VectorLogSink,
)

from sightfield.systems.numerics.geometry.world import World, make_world
from sightfield.systems.numerics.social.routes.infrared import InfraredRing
from sightfield.systems.numerics.social.routes.motion import FollowingLaw
from sightfield.systems.numerics.social.routes.shortest_route import (
    build_route_graph,
    rounded_regions,
)
from sightfield.systems.social.common_robots import CrowdGuard, InfraredSensors
from sightfield.systems.social.route_pursuer import RoutePursuer
from sightfield.systems.tracking.agent_team import DifferentialDriveTeam

PERIOD, RADIUS, RING = 0.05, 0.1, InfraredRing()
LIMITS = {"top_speed": 0.2, "top_turn_rate": 3.0}
# Two ways from west to east: 0.5 m wide in the south, and a longer one in the north.
ROOM = make_world([[0, 0], [4, 0], [4, 3], [0, 3]], [[[1, 0.5], [3, 0.5], [3, 2.2], [1, 2.2]]])


class Walk:
    """A pursuer, and others that stand still, for some time.

    Attributes:
        system: The pursuer.
        simulator: Of all.
    """

    def __init__(self, world: World, starts: list[list[float]], goal, located: float) -> None:
        count = len(starts)
        builder = DiagramBuilder()
        add, connect = builder.AddSystem, builder.Connect
        team = add(DifferentialDriveTeam(starts, time_step=PERIOD, **LIMITS))
        sensors = add(InfraredSensors(world, count=count, radius=RADIUS, ring=RING))
        guard = add(
            CrowdGuard(count=count, ring=RING, margin=0.01, period=PERIOD, top_turn_rate=3.0)
        )
        self.system = add(
            RoutePursuer(
                build_route_graph(rounded_regions(world, 0.145)),
                world,
                rounded_regions(world, 0.13),
                law=FollowingLaw(stand_off=0.1),
                ring=RING,
                radius=RADIUS,
                period=PERIOD,
            )
        )
        split = self.split(builder, team.GetOutputPort("pose"), [3, 3 * (count - 1)])
        felt = self.split(builder, sensors.GetOutputPort("infrared"), [4, 4 * (count - 1)])
        connect(team.GetOutputPort("pose"), sensors.GetInputPort("pose"))
        connect(sensors.GetOutputPort("infrared"), guard.GetInputPort("infrared"))
        connect(split, self.system.GetInputPort("pose"))
        connect(felt, self.system.GetInputPort("infrared"))
        commands = self.joined(builder, self.system.GetOutputPort("command"), 2 * (count - 1))
        connect(commands, guard.GetInputPort("command"))
        connect(guard.GetOutputPort("safe_command"), team.GetInputPort("command"))
        self._sink: VectorLogSink = LogVectorOutput(split, builder, PERIOD)
        self._diagram = builder.Build()
        self.simulator = Simulator(self._diagram)
        self.locate(goal, located)

    @staticmethod
    def split(builder, port, sizes):
        parts = builder.AddSystem(Demultiplexer([size for size in sizes if size]))
        builder.Connect(port, parts.get_input_port())
        return parts.get_output_port(0)

    @staticmethod
    def joined(builder, port, rest):
        if rest == 0:
            return port
        whole = builder.AddSystem(Multiplexer([port.size(), rest]))
        still = builder.AddSystem(ConstantVectorSource(np.zeros(rest)))
        builder.Connect(port, whole.get_input_port(0))
        builder.Connect(still.get_output_port(), whole.get_input_port(1))
        return whole.get_output_port()

    def locate(self, goal, located: float) -> None:
        """Say where the evader is, and since when that is known."""
        context = self.system.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        self.system.GetInputPort("evader_position").FixValue(context, goal)
        self.system.GetInputPort("located_at").FixValue(context, [located])

    def track(self, until: float) -> np.ndarray:
        """Poses of the pursuer up to a time [s], shape (T, 3)."""
        self.simulator.AdvanceTo(until)
        return self._sink.FindLog(self.simulator.get_context()).data().T

    def route(self) -> np.ndarray:
        """Corners still to be passed, without repetitions."""
        context = self.system.GetMyContextFromRoot(self.simulator.get_context())
        points = self.system.GetOutputPort("route").Eval(context).reshape(-1, 2)
        return points[np.append(True, (np.diff(points, axis=0) != 0).any(axis=1))]


def test_before_the_first_location_it_rests():
    walk = Walk(ROOM, [[0.5, 0.25, 0.0]], [np.nan, np.nan], -1.0)
    track = walk.track(2.0)
    np.testing.assert_array_equal(track, np.tile(track[0], (len(track), 1)))
    np.testing.assert_array_equal(walk.route(), [[0.5, 0.25]])


def test_it_takes_the_shortest_way_and_stops_before_its_end():
    walk = Walk(ROOM, [[0.5, 1.2, 1.0]], [3.5, 1.2], 0.0)
    track = walk.track(30.0)
    assert track[:, 1].min() < 0.4
    assert track[:, 1].max() < 1.3
    assert np.hypot(*(track[-1, :2] - [3.5, 1.2])) == pytest.approx(0.1, abs=0.02)
    np.testing.assert_array_equal(track[-20:], np.tile(track[-1], (20, 1)))


def test_a_new_location_is_a_new_route():
    walk = Walk(ROOM, [[0.5, 1.2, 1.0]], [3.5, 0.25], 0.0)
    walk.track(3.0)
    np.testing.assert_allclose(walk.route()[-1], [3.5, 0.25])
    walk.locate([0.5, 2.7], 3.0)
    track = walk.track(20.0)
    np.testing.assert_allclose(walk.route()[-1], [0.5, 2.7])
    assert np.hypot(*(track[-1, :2] - [0.5, 2.7])) < 0.13


def test_it_deviates_round_a_robot_and_returns_to_its_route():
    hall = make_world([[0, 0], [4, 0], [4, 2], [0, 2]])
    walk = Walk(hall, [[0.5, 1.0, 0.0], [2.0, 1.02, 0.0]], [3.5, 1.0], 0.0)
    track = walk.track(25.0)
    aside = np.abs(track[:, 1] - 1.0)
    assert aside.max() > 0.15
    assert np.hypot(*(track[:, :2] - [2.0, 1.02]).T).min() > 2 * RADIUS
    assert aside[track[:, 0] > 3.2].max() < 0.03
    assert np.hypot(*(track[-1, :2] - [3.5, 1.0])) < 0.13


def test_a_robot_that_does_not_go_away_is_passed_by_another_way():
    walk = Walk(ROOM, [[0.5, 0.25, 0.0], [2.0, 0.25, 0.0]], [3.5, 0.6], 0.0)
    track = walk.track(60.0)
    assert np.hypot(*(track[:, :2] - [2.0, 0.25]).T).min() > 2 * RADIUS
    # Up to the robot, then back and round by the north.
    assert track[:, 0][track[:, 1] < 0.4].max() > 1.3
    assert track[:, 1].max() > 2.3
    assert np.hypot(*(track[-1, :2] - [3.5, 0.6])) < 0.13
