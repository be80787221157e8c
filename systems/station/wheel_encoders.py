"""Encoders of simulated robots."""

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require, require_positive
from ..numerics.station.motion_checks import Chassis, wheel_ways


class WheelEncoders(LeafSystem):
    """Counts how far the wheels of robots have turned.

    .. pydrake_system::

        name: WheelEncoders
        input_ports:
        - pose
        output_ports:
        - counts

    ======  ====  =========  =====  ===========
    port    size  unit       frame  feedthrough
    ======  ====  =========  =====  ===========
    pose    3 N   m, m, rad  world  -
    counts  2 N   -          -      -
    ======  ====  =========  =====  ===========

    Left and right wheel of each robot; ahead counts are positive.

    Source: the robots of Zhang 2014, 2.2.8; the model is ours.

    Args:
        chassis: Wheels of the robots.
        starts: Poses at which counting begins, shape (N, 3).
        period: Between looks at the poses [s].

    Raises:
        InvalidInput: The starts have another shape, or the period is not positive.
    """

    def __init__(self, chassis: Chassis, starts: ArrayLike, *, period: float):
        super().__init__()
        require_positive("period", period)
        poses = np.array(starts, dtype=float)
        require(poses.ndim == 2 and poses.shape[1] == 3, "starts", "be (N, 3)", poses.shape)
        self._chassis = chassis
        self._pose = self.DeclareVectorInputPort("pose", poses.size)
        self._before = self.DeclareDiscreteState(state_vector(poses.ravel()))
        self._ways = self.DeclareDiscreteState(state_vector(np.zeros(2 * len(poses))))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._turn)
        depends = {self.discrete_state_ticket(self._ways)}
        self.DeclareVectorOutputPort("counts", 2 * len(poses), self._calc_counts, depends)

    def _turn(self, context, discrete_state):
        before = context.get_discrete_state(self._before).value().reshape(-1, 3)
        poses = read(self._pose, context).reshape(-1, 3)
        ways = context.get_discrete_state(self._ways).value()
        step = wheel_ways(self._chassis, before, poses).ravel()
        discrete_state.set_value(self._ways, ways + step)
        discrete_state.set_value(self._before, poses.ravel())

    def _calc_counts(self, context, output):
        ways = context.get_discrete_state(self._ways).value()
        output.set_value(np.floor(self._chassis.counts_per_metre * ways))
