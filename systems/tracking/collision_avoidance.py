"""Commands of points and unicycles that keep robots off one another and out of walls."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_parts import read, state_vector
from ..numerics.errors import (
    require,
    require_non_negative,
    require_one_of,
    require_positive,
    require_whole,
)
from ..numerics.geometry.edge_index import index_regions
from ..numerics.geometry.world import World
from ..numerics.tracking.collision_avoidance import YIELDING_TIME, avoid
from ..numerics.tracking.collision_stop import (
    NEAR,
    still_waiting,
    stop_at_robots,
    stop_at_walls,
    take_turns,
)

# Rank of a team: it yields, is among equals, or has the right of way.
RANKS = (-1, 0, 1)


class CollisionAvoidance(LeafSystem):
    """Replaces velocities by similar ones with which agents touch no robot and no wall.

    Held for the period, the new velocities keep each agent that starts in free space inside it,
    and the bodies of all agents apart, at any speed and any period, also between samples: each
    agent uses up at most half of the gap to another, so the other team needs the same rule but no
    agreement. Before that rule is applied, agents turn aside for one another, yield to teammates
    and slide along walls; teammates that hold each other up take turns. An agent outside free space
    is led back to it. Waiting times and turns are discrete state, sampled with the period.

    .. pydrake_system::

        name: CollisionAvoidance
        input_ports:
        - position
        - velocity
        - other_position
        - right_of_way
        output_ports:
        - safe_velocity
        - deflection

    ==============  ====  ====  =====  ===========
    port            size  unit  frame  feedthrough
    ==============  ====  ====  =====  ===========
    position        2 N   m     world  -
    velocity        2 N   m/s   world  -
    other_position  2 M   m     world  -
    right_of_way    N     -     -      -
    safe_velocity   2 N   m/s   world  all
    deflection      N     m/s   -      all
    ==============  ====  ====  =====  ===========

    The port `other_position` exists if there are others. `right_of_way` exists with rank 1, and may
    be left open; it is 1 for robots that keep a promise. These keep their desired velocity, and are
    stopped only where a gap is used up; their teammates make room for them. `deflection` is the
    length of the difference between each safe velocity and the desired one.

    Source: the orange boundaries of Zhang 2014, 2.2.8, for walls; the rules are ours, see
    `numerics.tracking.collision_avoidance`.

    Args:
        regions: Where the agents' centres may be, from `shrink_world`.
        count: Number of agents N.
        period: For how long velocities are held: the plant's time step [s].
        top_speed: Of the agents, also when they turn aside or are pushed [m/s].
        radii: Of the bodies, one for all or one each [m]; 0 for points, which may meet.
        other_radii: Of the robots of other teams, shape (M,) [m].
        rank: 1 for a team to which the others yield, -1 for one that yields to them: it keeps away
            from them, and leaves the whole of a small gap to them; 0 among equals. Both teams need
            matching ranks.
        pace: Top speed of the team with the right of way, the same value for both teams; None:
            `top_speed` [m/s].

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(
        self,
        regions: Sequence[World],
        *,
        count: int,
        period: float,
        top_speed: float,
        radii: float | Sequence[float] = 0.0,
        other_radii: Sequence[float] = (),
        rank: int = 0,
        pace: float | None = None,
    ):
        super().__init__()
        require_whole("count", count, 1)
        require_positive("period", period)
        require_positive("top_speed", top_speed)
        require_one_of("rank", rank, RANKS)
        pace = float(top_speed if pace is None else pace)
        require_positive("pace", pace)
        self._rank, self._near, self._room = rank, NEAR * pace * period, YIELDING_TIME * pace
        self._region = index_regions("regions", regions)
        self._period, self._top_speed = float(period), float(top_speed)
        self._radii = body_radii("radii", radii, count)
        self._other_radii = body_radii("other_radii", other_radii, len(other_radii))
        self._position = self.DeclareVectorInputPort("position", 2 * count)
        self._velocity = self.DeclareVectorInputPort("velocity", 2 * count)
        if len(self._other_radii):
            self._others = self.DeclareVectorInputPort("other_position", 2 * len(other_radii))
        if rank == 1:
            self._first = self.DeclareVectorInputPort("right_of_way", count)
        # Waiting times and times left of turns [s], then last positions [m]: one vector is read and
        # written faster than three.
        state = np.concatenate([np.zeros(2 * count), np.full(2 * count, np.nan)])
        self._state = self.DeclareDiscreteState(state_vector(state))
        self._count = count
        self._takes_turns = count > 1 and self._radii.any()
        if self._takes_turns:
            self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._take_turns)
        self._safe = self.DeclareVectorOutputPort(
            "safe_velocity", 2 * count, self._calc_safe_velocity
        )
        self.DeclareVectorOutputPort("deflection", count, self._calc_deflection)

    def _take_turns(self, context, discrete_state):
        count, state = self._count, context.get_discrete_state(self._state).value()
        after = np.empty(4 * count)
        after[2 * count :] = position = read(self._position, context)
        waiting = still_waiting(
            state[:count],
            state[2 * count :],
            position,
            read(self._velocity, context),
            self._period,
        )
        after[count : 2 * count], after[:count] = take_turns(
            state[count : 2 * count],
            waiting,
            position,
            self._radii,
            self._other_positions(context),
            self._period,
        )
        discrete_state.set_value(self._state, after)

    def _other_positions(self, context):
        return read(self._others, context) if len(self._other_radii) else np.empty(0)

    def _who_goes_first(self, context):
        if self._rank == 1 and self._first.HasValue(context):
            return read(self._first, context) > 0.5
        return np.zeros(self._count, dtype=bool)

    def _calc_safe_velocity(self, context, output):
        velocity = avoid(
            *self._region,
            read(self._position, context),
            read(self._velocity, context),
            self._radii,
            self._other_positions(context),
            self._other_radii,
            context.get_discrete_state(self._state).value()[self._count : 2 * self._count],
            self._who_goes_first(context),
            self._rank,
            self._near,
            self._room,
            self._top_speed,
            self._period,
        )
        output.set_value(velocity)

    def _calc_deflection(self, context, output):
        change = np.asarray(self._safe.Eval(context)) - read(self._velocity, context)
        output.set_value(np.hypot(change[::2], change[1::2]))


def body_radii(name: str, radii: float | Sequence[float], count: int) -> np.ndarray:
    """Radii of `count` bodies, a single number standing for all; shape (count,) [m].

    Args:
        name: Name of the parameter in error messages.
        radii: One for all or one each, shape (count,) [m].
        count: Number of bodies.

    Raises:
        InvalidInput: A radius is negative, or the number of radii is wrong.
    """
    each = np.broadcast_to(radii, count) if np.ndim(radii) == 0 else np.array(radii, dtype=float)
    require(each.shape == (count,), name, f"have {count} entries", np.shape(radii))
    for radius in each:
        require_non_negative(name, float(radius))
    return each.astype(float)


class CollisionStop(LeafSystem):
    """Slows robots that would come too near to a wall or to another robot, and lets them turn.

    A wheeled robot cannot slide: its speed is reduced and its turn rate kept, so that it turns in
    place until its way is clear. It makes the last part of a turn away from a wall faster, as soon
    as the top turn rate allows a step along the wall. Held for the period, the new commands keep
    each robot of a DifferentialDriveTeam with the same limits and time step in free space, and the
    bodies of all robots apart: each uses up at most half of the gap to another, so the others need
    the same rule but no agreement.

    .. pydrake_system::

        name: CollisionStop
        input_ports:
        - pose
        - command
        - other_position
        - right_of_way
        output_ports:
        - safe_command
        - deflection

    ==============  ====  ==========  =====  ===========
    port            size  unit        frame  feedthrough
    ==============  ====  ==========  =====  ===========
    pose            3 N   m, m, rad   world  -
    command         2 N   m/s, rad/s  robot  -
    other_position  2 M   m           world  -
    right_of_way    N     -           -      -
    safe_command    2 N   m/s, rad/s  robot  all
    deflection      N     m/s         -      all
    ==============  ====  ==========  =====  ===========

    The port `other_position` exists if there are others. `right_of_way` exists with rank 1, and may
    be left open; it is 1 for robots to which teammates leave the whole of a small gap. `deflection`
    is the absolute difference between each robot's safe speed and the commanded one.

    Source: the orange boundaries of Zhang 2014, 2.2.8, for walls; the rules are ours.

    Args:
        regions: Where the robots' centres may be, from `shrink_world`; empty: everywhere.
        count: Number of robots N.
        top_speed: [m/s].
        top_turn_rate: [rad/s].
        period: For how long commands are held: the plant's time step [s].
        horizon: Shortest time in which half of a gap to a robot may be used up, longer than a
            command takes to have its effect [s]. None: the period, as in a simulation without
            delay.
        radii: Of the bodies, one for all or one each [m]; 0 for points, which may meet.
        other_radii: Of the robots of other teams, shape (M,) [m].
        rank, pace: See `CollisionAvoidance`.

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(
        self,
        regions: Sequence[World] = (),
        *,
        count: int,
        top_speed: float,
        top_turn_rate: float,
        period: float,
        horizon: float | None = None,
        radii: float | Sequence[float] = 0.0,
        other_radii: Sequence[float] = (),
        rank: int = 0,
        pace: float | None = None,
    ):
        super().__init__()
        require_whole("count", count, 1)
        require_positive("top_speed", top_speed)
        require_positive("top_turn_rate", top_turn_rate)
        require_positive("period", period)
        horizon = period if horizon is None else horizon
        require(horizon >= period, "horizon", f"be at least the period of {period} s", horizon)
        require_one_of("rank", rank, RANKS)
        pace = float(top_speed if pace is None else pace)
        require_positive("pace", pace)
        self._rank, self._near = rank, NEAR * pace * horizon
        self._regions = [index_regions("regions", regions)] if regions else []
        self._limits = np.array([top_speed, top_turn_rate], dtype=float)
        self._period, self._horizon = float(period), float(horizon)
        self._radii = body_radii("radii", radii, count)
        self._other_radii = body_radii("other_radii", other_radii, len(other_radii))
        self._pose = self.DeclareVectorInputPort("pose", 3 * count)
        self._command = self.DeclareVectorInputPort("command", 2 * count)
        if len(self._other_radii):
            self._others = self.DeclareVectorInputPort("other_position", 2 * len(other_radii))
        if rank == 1:
            self._first = self.DeclareVectorInputPort("right_of_way", count)
        self._safe = self.DeclareVectorOutputPort(
            "safe_command", 2 * count, self._calc_safe_command
        )
        self.DeclareVectorOutputPort("deflection", count, self._calc_deflection)

    def _calc_safe_command(self, context, output):
        others = read(self._others, context) if len(self._other_radii) else np.empty(0)
        poses, commands = read(self._pose, context), read(self._command, context)
        if self._regions:
            commands = stop_at_walls(*self._regions[0], poses, commands, self._limits, self._period)
        command = stop_at_robots(
            poses,
            commands,
            self._limits,
            self._period,
            self._horizon,
            self._radii,
            others,
            self._other_radii,
            self._who_goes_first(context),
            self._rank,
            self._near,
        )
        output.set_value(command)

    def _who_goes_first(self, context):
        if self._rank == 1 and self._first.HasValue(context):
            return read(self._first, context) > 0.5
        return np.zeros(len(self._radii), dtype=bool)

    def _calc_deflection(self, context, output):
        change = np.asarray(self._safe.Eval(context)) - read(self._command, context)
        output.set_value(np.abs(change[::2]))
