"""Robots that do not move as they are told, or whose encoders see another motion."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require, require_positive
from ..numerics.station.motion_checks import (
    Chassis,
    MotionMemory,
    check_motion,
    forgiven,
    no_motion,
    with_sent,
)
from .kept_record import KeptRecord


class MotionCheck(LeafSystem):
    """Compares commands, encoders and motion capture.

    .. pydrake_system::

        name: MotionCheck
        input_ports:
        - pose
        - valid
        - stamp
        - pose_age
        - pose_fault
        - sent_command
        - counts
        - age
        - starts_said
        output_ports:
        - fault

    ============  ====  ==========  =====  ====================
    port          size  unit        frame  feedthrough
    ============  ====  ==========  =====  ====================
    pose          3 N   m, m, rad   world  -
    valid         N     -           -      -
    stamp         N     s           -      -
    pose_age      N     s           -      -
    pose_fault    N     -           -      -
    sent_command  2 N   m/s, rad/s  robot  -
    counts        2 N   -           -      -
    age           N     s           -      -
    starts_said   1     -           -      -
    fault         N     -           -      all but sent_command
    ============  ====  ==========  =====  ====================

    `stamp` is when a pose was seen, by the clock of the motion capture, and `pose_age` how long ago
    that is. `counts` and their `age` are of the last report of each robot. `fault` is a number of
    Reason: ODOMETRY, NOT_FOLLOWING, or 0; it does not depend on what is sent at the same tick,
    which depends on it. Each time the operator says start, of which `starts_said` is the number,
    all is forgiven.

    Source: ours; see `check_motion`.

    Args:
        chassis: Wheels of the robots.
        count: Number of robots N.
        period: Between ticks [s].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(self, chassis: Chassis, count: int, *, period: float):
        super().__init__()
        require(count > 0, "count", "be positive", count)
        require_positive("period", period)
        self._chassis, self._period = chassis, float(period)
        self._pose = self.DeclareVectorInputPort("pose", 3 * count)
        self._valid = self.DeclareVectorInputPort("valid", count)
        self._stamp = self.DeclareVectorInputPort("stamp", count)
        self._pose_age = self.DeclareVectorInputPort("pose_age", count)
        self._pose_fault = self.DeclareVectorInputPort("pose_fault", count)
        self._sent = self.DeclareVectorInputPort("sent_command", 2 * count)
        self._counts = self.DeclareVectorInputPort("counts", 2 * count)
        self._age = self.DeclareVectorInputPort("age", count)
        self._said = self.DeclareVectorInputPort("starts_said", 1)
        self._memory = KeptRecord(self, no_motion(count))
        self._heard = self.DeclareDiscreteState(state_vector(np.zeros(1)))
        self._number = self.DeclareDiscreteState(state_vector(np.array([-1.0])))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._keep)
        sent = self._sent.get_index()
        others = [k for k in range(self.num_input_ports()) if k != sent]
        depends = {self.get_input_port(k).ticket() for k in others}
        depends |= {self.all_state_ticket()}
        self.DeclareVectorOutputPort("fault", count, self._calc_fault, depends)

    def _checked(self, context, time: float) -> tuple[MotionMemory, np.ndarray]:
        memory = self._memory.read(context)
        if read(self._said, context)[0] > context.get_discrete_state(self._heard).value()[0]:
            memory = forgiven(memory)
        believed = read(self._pose_fault, context) < 0.5
        return check_motion(
            self._chassis,
            memory,
            time=time,
            period=self._period,
            poses=read(self._pose, context).reshape(-1, 3),
            good=(read(self._valid, context) > 0.5) & believed,
            stamps=read(self._stamp, context),
            pose_ages=read(self._pose_age, context),
            counts=read(self._counts, context).reshape(-1, 2),
            ages=read(self._age, context),
        )

    def _tick(self, context) -> int:
        """Number of the last tick, -1 before the first: all that is known was known then."""
        return round(context.get_discrete_state(self._number).value()[0])

    def _keep(self, context, discrete_state):
        # At a tick, inputs are those of the tick before; before the first there was none.
        before = self._tick(context)
        discrete_state.set_value(self._number, np.array([before + 1.0]))
        if before < 0:
            return
        memory, _ = self._checked(context, before * self._period)
        sent = read(self._sent, context).reshape(-1, 2)
        self._memory.write(discrete_state, with_sent(self._chassis, memory, sent))
        discrete_state.set_value(self._heard, read(self._said, context))

    def _calc_fault(self, context, output):
        output.set_value(self._checked(context, self._tick(context) * self._period)[1])
