"""The pursuer: plans a route to the evader's estimated position, and follows it."""

import math
from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_parts import read, state_vector
from ..numerics.errors import require_positive
from ..numerics.geometry.edge_index import build_edge_index, index_regions
from ..numerics.geometry.world import World
from ..numerics.social.routes.infrared import InfraredRing, infrared_ranges
from ..numerics.social.routes.motion import (
    FollowingLaw,
    deviation,
    drive_towards,
    progress_along,
)
from ..numerics.social.routes.shortest_route import RouteGraph, shortest_route

# Entries of the state before the route's points: time stamp of the location it leads to, arc length
# reached, side on which it passes others, time without progress, position of the robot that blocked
# the way and until when that counts, and the number of points.
_LOCATED, _ARC, _SIDE, _STUCK, _BLOCK_X, _BLOCK_Y, _UNTIL, _CORNERS, _POINTS = range(9)
# Time without progress after which it looks for another way, and time for which it then avoids the
# blocking robot [s].
_PATIENCE, _MEMORY = 2.0, 10.0
# Least progress along the route that counts [m].
_PROGRESS = 1e-3


class RoutePursuer(LeafSystem):
    """Drives to the evader's estimated position by the shortest way, round robots in its way.

    A new route is planned (Algorithm 4) whenever the evader is located anew, when a deviation has
    led out of sight of the old route, and after some time behind a robot that does not move away.
    Before the first location the pursuer rests; near the end of its route it waits for the next.

    .. pydrake_system::

        name: RoutePursuer
        input_ports:
        - pose
        - infrared
        - evader_position
        - located_at
        output_ports:
        - command
        - route

    ===============  ====  ==========  =====  ===========
    port             size  unit        frame  feedthrough
    ===============  ====  ==========  =====  ===========
    pose             3     m, m, rad   world  -
    infrared         ring  m           robot  -
    evader_position  2     m           world  -
    located_at       1     s           -      -
    command          2     m/s, rad/s  robot  all
    route            2 K   m           world  all
    ===============  ====  ==========  =====  ===========

    `located_at` is when the picture was taken from which the evader's position comes, negative
    before the first. `route` holds the corners still to be passed, the robot's place first, the
    last one repeated; K is three more than the graph has nodes.

    Source: Zhang 2014, Algorithm 4 and 2.3.4.3.

    Args:
        graph: Route graph among the obstacles, grown for the pursuer.
        world: World whose walls its sensors measure.
        regions: Where its centre may be: slightly larger than the regions of `graph`.
        law: How it follows its route.
        ring: Where its sensors look.
        radius: Of every robot [m].
        period: For how long a command is held [s].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(
        self,
        graph: RouteGraph,
        world: World,
        regions: Sequence[World],
        *,
        law: FollowingLaw,
        ring: InfraredRing,
        radius: float,
        period: float,
    ):
        super().__init__()
        require_positive("radius", radius)
        require_positive("period", period)
        self._graph, self._law, self._ring = graph, law, ring
        self._bearings = np.array(ring.bearings)
        self._edges, self._radius = build_edge_index(world).edges, float(radius)
        self._index = index_regions("regions", regions)
        self._room, self._period = len(graph.nodes) + 3, float(period)
        self._pose = self.DeclareVectorInputPort("pose", 3)
        self._infrared = self.DeclareVectorInputPort("infrared", ring.count)
        self._evader = self.DeclareVectorInputPort("evader_position", 2)
        self._located = self.DeclareVectorInputPort("located_at", 1)
        initial = np.zeros(_POINTS + 2 * self._room)
        initial[_LOCATED] = -1.0
        self._plan = self.DeclareDiscreteState(state_vector(initial))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._advance)
        self.DeclareVectorOutputPort("command", 2, self._calc_command)
        self.DeclareVectorOutputPort("route", 2 * self._room, self._calc_route)

    def get_pose_input_port(self):
        """Of the pursuer, size 3 [m], [m], [rad]."""
        return self._pose

    def get_command_output_port(self):
        """Speed and turn rate, size 2 [m/s], [rad/s]."""
        return self.GetOutputPort("command")

    def get_route_output_port(self):
        """Corners still to be passed [m]."""
        return self.GetOutputPort("route")

    def _planned(self, context, position: np.ndarray) -> np.ndarray:
        """The plan for the present location: the old one, or with a new route if that is needed."""
        plan = np.array(context.get_discrete_state(self._plan).value())
        located = float(read(self._located, context)[0])
        if located < 0.0:
            return plan
        if located == plan[_LOCATED] and plan[_CORNERS] > 0:
            route = self._route_of(plan)
            ahead = self._law.lookahead
            if progress_along(self._index, route, position, plan[_ARC], ahead).in_sight:
                return plan
        route = self._way(position, read(self._evader, context), plan, context.get_time())
        plan[_LOCATED], plan[_ARC], plan[_SIDE] = located, 0.0, 0.0
        plan[_CORNERS] = len(route)
        plan[_POINTS:] = np.vstack(
            [route, np.tile(route[-1], (self._room - len(route), 1))]
        ).ravel()
        return plan

    def _way(
        self, position: np.ndarray, goal: np.ndarray, plan: np.ndarray, time: float
    ) -> np.ndarray:
        """The shortest route round the robot that blocked the way lately, if there is one."""
        if time < plan[_UNTIL]:
            distance = 2 * self._radius + self._law.passing_gap
            block = plan[_BLOCK_X : _BLOCK_Y + 1]
            around = shortest_route(self._graph, position, goal, avoid=block, distance=distance)
            if around.found:
                return around.points
        return shortest_route(self._graph, position, goal).points

    @staticmethod
    def _route_of(plan: np.ndarray) -> np.ndarray:
        return plan[_POINTS:].reshape(-1, 2)[: int(plan[_CORNERS])]

    def _decide(self, context) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The next state, the command, and the corners still to be passed."""
        pose = read(self._pose, context)
        position = pose[:2]
        plan = self._planned(context, position)
        if plan[_CORNERS] == 0:
            return plan, np.zeros(2), position.reshape(1, 2)
        law, index, route = self._law, self._index, self._route_of(plan)
        now = progress_along(index, route, position, plan[_ARC], law.lookahead)
        if now.arc >= plan[_ARC] + _PROGRESS:
            plan[_ARC], plan[_STUCK] = now.arc, 0.0
        else:
            plan[_STUCK] += self._period
        passed = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(route, axis=0).T))])
        left = np.vstack([position, route[passed > now.arc]])
        if now.rest <= law.stand_off or np.hypot(*(now.aim - position)) < 1e-6:
            plan[_STUCK] = 0.0
            return plan, np.zeros(2), left
        wish = math.atan2(*(now.aim - position)[::-1])
        expected = infrared_ranges(self._edges, pose.reshape(1, 3), self._radius, self._ring)[0]
        ranges = read(self._infrared, context)
        if plan[_STUCK] > _PATIENCE:
            self._note_block(plan, pose, ranges, expected, context.get_time())
        direction, plan[_SIDE] = deviation(
            law,
            self._ring,
            index,
            pose,
            wish,
            ranges,
            expected,
            self._radius,
            plan[_SIDE],
        )
        return plan, drive_towards(law, float(pose[2]), direction), left

    def _note_block(
        self,
        plan: np.ndarray,
        pose: np.ndarray,
        ranges: np.ndarray,
        expected: np.ndarray,
        now: float,
    ) -> None:
        """Remember the nearest robot as a block, and request a new route for the next step."""
        plan[_STUCK] = 0.0
        felt = np.where(ranges < expected, ranges, np.inf)
        nearest = float(felt.min())
        if math.isfinite(nearest):
            # A robot with equal ranges in two cones lies between them.
            bearing = float(pose[2]) + float(np.mean(self._bearings[felt < nearest + 1e-3]))
            away = nearest + 2 * self._radius
            plan[_BLOCK_X] = pose[0] + away * math.cos(bearing)
            plan[_BLOCK_Y] = pose[1] + away * math.sin(bearing)
            plan[_UNTIL] = now + _MEMORY
            plan[_CORNERS] = 0

    def _advance(self, context, discrete_state):
        discrete_state.set_value(self._plan, self._decide(context)[0])

    def _calc_command(self, context, output):
        output.set_value(self._decide(context)[1])

    def _calc_route(self, context, output):
        output.set_value(self._padded(self._decide(context)[2]))

    def _padded(self, points: np.ndarray) -> np.ndarray:
        """Points with the last one repeated up to the port's size, shape (2 K,)."""
        rest = np.tile(points[-1], (max(self._room - len(points), 0), 1))
        return np.vstack([points, rest])[: self._room].ravel()
