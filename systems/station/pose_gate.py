"""Poses that can be believed."""

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require, require_positive
from ..numerics.station.pose_checks import PoseLimits, PoseMemory, check_poses, no_poses
from .kept_record import KeptRecord


class PoseGate(LeafSystem):
    """Passes on poses that robots can have driven to, and of the others the last that was believed.

    .. pydrake_system::

        name: PoseGate
        input_ports:
        - pose
        - valid
        - stamp
        - starts_said
        output_ports:
        - believed_pose
        - fault

    =============  ====  =========  =====  ===========
    port           size  unit       frame  feedthrough
    =============  ====  =========  =====  ===========
    pose           3 N   m, m, rad  world  -
    valid          N     -          -      -
    stamp          N     s          -      -
    starts_said    1     -          -      -
    believed_pose  3 N   m, m, rad  world  all
    fault          N     -          -      all
    =============  ====  =========  =====  ===========

    `fault` is a number of Reason: why the last pose is not believed, or 0. `starts_said` is how
    often the operator has said start: with each time any pose within the world is believed. Inputs
    are held from tick to tick.

    Source: ours.

    Args:
        limits: What a robot can do.
        starts: Poses to go on with until a robot is seen, shape (N, 3).
        period: Between ticks [s].

    Raises:
        InvalidInput: The starts have another shape, or the period is not positive.
    """

    def __init__(self, limits: PoseLimits, starts: ArrayLike, *, period: float):
        super().__init__()
        require_positive("period", period)
        poses = np.array(starts, dtype=float)
        require(poses.ndim == 2 and poses.shape[1] == 3, "starts", "be (N, 3)", poses.shape)
        count = len(poses)
        self._limits, self._period = limits, float(period)
        self._pose = self.DeclareVectorInputPort("pose", 3 * count)
        self._valid = self.DeclareVectorInputPort("valid", count)
        self._stamp = self.DeclareVectorInputPort("stamp", count)
        self._said = self.DeclareVectorInputPort("starts_said", 1)
        self._memory = KeptRecord(self, no_poses(poses))
        self._heard = self.DeclareDiscreteState(state_vector(np.zeros(1)))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._keep)
        self.DeclareVectorOutputPort("believed_pose", 3 * count, self._calc_believed_pose)
        self.DeclareVectorOutputPort("fault", count, self._calc_fault)

    def _checked(self, context) -> PoseMemory:
        memory = self._memory.read(context)
        if read(self._said, context)[0] > context.get_discrete_state(self._heard).value()[0]:
            never = np.full(len(memory.stamps), -np.inf)
            memory = memory._replace(stamps=never, looked=never)
        poses = read(self._pose, context).reshape(-1, 3)
        valid = read(self._valid, context) > 0.5
        return check_poses(self._limits, memory, poses, read(self._stamp, context), valid)

    def _keep(self, context, discrete_state):
        # At a tick, inputs are those of the tick before; before the first there was none.
        if context.get_time() <= 0.5 * self._period:
            return
        self._memory.write(discrete_state, self._checked(context))
        discrete_state.set_value(self._heard, read(self._said, context))

    def _calc_believed_pose(self, context, output):
        output.set_value(self._checked(context).poses.ravel())

    def _calc_fault(self, context, output):
        output.set_value(self._checked(context).verdicts)
