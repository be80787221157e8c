"""Who sees whom among the obstacles, and when an evader is first seen by nobody."""

from collections.abc import Sequence

import numpy as np
from pydrake.common.containers import namedview
from pydrake.systems.framework import LeafSystem

from ..drake_parts import read, state_vector
from ..numerics.errors import require_positive, require_whole
from ..numerics.geometry.edge_index import build_edge_index
from ..numerics.geometry.segment_sight import build_corner_index
from ..numerics.geometry.sight_loss import first_loss
from ..numerics.geometry.team_sight import checked_radii
from ..numerics.geometry.world import World
from ..numerics.tracking.sight_state import observe, sight_size


class LineOfSight(LeafSystem):
    """Sight between two teams, and from each team to the corners of the obstacles.

    `sight` holds three blocks, 1 where the closed free region covers the line and else 0: which
    evader each pursuer sees (Np x Ne, row by row), which corner each pursuer sees (Np x K), which
    corner each evader sees (Ne x K). Corners are the reflex vertices of the world, in the order
    of `World.corners`; `split_sight` takes the blocks apart.

    With `body_radii` a pursuer does not see an evader either if the line passes through the
    interior of a third robot's round body. Corners are seen past bodies, which move on.

    .. pydrake_system::

        name: LineOfSight
        input_ports:
        - pursuer_position
        - evader_position
        output_ports:
        - sight

    ================  =====================  ====  =====  ===========
    port              size                   unit  frame  feedthrough
    ================  =====================  ====  =====  ===========
    pursuer_position  2 Np                   m     world  -
    evader_position   2 Ne                   m     world  -
    sight             Np Ne + Np K + Ne K    -     -      all
    ================  =====================  ====  =====  ===========

    Source: Zhang 2014, 2.2.1 and 2.2.3.

    Args:
        world: Whose obstacles block sight.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        body_radii: Of the robots, pursuers first, Np + Ne of them [m]; empty: bodies do not block
            sight.

    Raises:
        InvalidInput: A team is empty; there is not one radius for each robot, or one is negative.
    """

    def __init__(
        self, world: World, *, pursuers: int, evaders: int, body_radii: Sequence[float] = ()
    ):
        super().__init__()
        require_whole("pursuers", pursuers, 1)
        require_whole("evaders", evaders, 1)
        self._radii = checked_radii(body_radii, pursuers + evaders)
        self._index = build_edge_index(world)
        self._corners = build_corner_index(world, self._index)
        self._pursuers = self.DeclareVectorInputPort("pursuer_position", 2 * pursuers)
        self._evaders = self.DeclareVectorInputPort("evader_position", 2 * evaders)
        size = sight_size(pursuers, evaders, len(world.corners))
        self.DeclareVectorOutputPort("sight", size, self._calc_sight)

    def _calc_sight(self, context, output):
        pursuers, evaders = read(self._pursuers, context), read(self._evaders, context)
        output.set_value(observe(self._index, self._corners, pursuers, evaders, self._radii))


class SightLossMonitor(LeafSystem):
    """Locates the moment at which some evader is first seen by no pursuer.

    It samples positions, assumes straight motion between samples, and solves for the moment
    exactly. The loss is reported at the first sample after it; only this delay depends on the
    period. The first loss is kept.

    .. pydrake_system::

        name: SightLossMonitor
        input_ports:
        - pursuer_position
        - evader_position
        output_ports:
        - loss

    ================  ====  ====  =====  ===========
    port              size  unit  frame  feedthrough
    ================  ====  ====  =====  ===========
    pursuer_position  2 Np  m     world  -
    evader_position   2 Ne  m     world  -
    loss              2     s, -  -      -
    ================  ====  ====  =====  ===========

    `loss` holds the time of loss, infinite before a loss, and the evader's number, or -1.

    Source: Zhang 2014, 2.2.1 (tracking time).

    Args:
        world: Whose obstacles block sight.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        period: Sampling period [s].
        body_radii: Of the robots, pursuers first, Np + Ne of them [m]: a line of sight is blocked
            also by the round body of a third robot; empty: bodies do not block sight.

    Raises:
        InvalidInput: The period is not positive; there is not one radius for each robot, or one
            is negative.
    """

    def __init__(
        self,
        world: World,
        *,
        pursuers: int,
        evaders: int,
        period: float,
        body_radii: Sequence[float] = (),
    ):
        super().__init__()
        require_positive("period", period)
        self._radii = checked_radii(body_radii, pursuers + evaders)
        self._index = build_edge_index(world)
        self._pursuers = self.DeclareVectorInputPort("pursuer_position", 2 * pursuers)
        self._evaders = self.DeclareVectorInputPort("evader_position", 2 * evaders)
        self._loss = self.DeclareDiscreteState(state_vector(np.array([np.inf, -1.0])))
        # The last sample: its time (NaN before the first), pursuers, evaders.
        last = np.zeros(1 + 2 * (pursuers + evaders))
        last[0] = np.nan
        self._last = self.DeclareDiscreteState(state_vector(last))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)
        self.DeclareStateOutputPort("loss", self._loss)

    def _sample(self, context, discrete_state):
        pursuers, evaders = read(self._pursuers, context), read(self._evaders, context)
        sample = np.empty(1 + len(pursuers) + len(evaders))
        split = 1 + len(pursuers)
        sample[0], sample[1:split], sample[split:] = context.get_time(), pursuers, evaders
        if context.get_discrete_state(self._loss).value()[0] == np.inf:
            last = context.get_discrete_state(self._last).value()
            if np.isnan(last[0]):
                last = sample
            fraction, evader = first_loss(
                self._index, last[1:split], pursuers, last[split:], evaders, self._radii
            )
            if evader >= 0:
                loss = LossState(np.empty(2))
                loss.time = last[0] + fraction * (sample[0] - last[0])
                loss.evader = evader
                discrete_state.set_value(self._loss, loss[:])
        discrete_state.set_value(self._last, sample)


LossState = namedview("LossState", ["time", "evader"])
