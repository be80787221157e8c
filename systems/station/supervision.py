"""Systems that watch robots, and decide which of them may run.

They check whether poses can be believed, compare motion with commands and encoders, and find robots
that leave the floor or overlap.
"""

from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydrake.systems.framework import LeafSystem, ValueProducer

from ..drake_parts import AbstractValue, read, state_vector
from ..numerics.errors import require, require_non_negative, require_positive, require_whole
from ..numerics.geometry.world import World
from ..numerics.station.motion_checks import (
    Chassis,
    MotionMemory,
    check_motion,
    forgiven,
    no_motion,
    with_sent,
)
from ..numerics.station.pose_checks import FloorWatch, PoseLimits, PoseMemory, check_poses, no_poses
from ..numerics.station.supervision import (
    Decision,
    Signs,
    Standing,
    SupervisionRules,
    SupervisorMemory,
    no_supervision,
    supervise,
)

Record = TypeVar("Record", bound=tuple)


class KeptRecord(Generic[Record]):
    """One discrete state for each array of a record.

    Args:
        system: Whose states they are; they are declared at once.
        initial: The record before the first tick, a NamedTuple of arrays of any shape.
    """

    def __init__(self, system: LeafSystem, initial: Record) -> None:
        self._make: Any = type(initial)
        self._shapes = [part.shape for part in initial]
        self._states = [system.DeclareDiscreteState(state_vector(part.ravel())) for part in initial]

    def read(self, context: Any) -> Record:
        """The record as it was left at the last tick.

        Args:
            context: Of the system.
        """
        return self._make(
            *(
                context.get_discrete_state(state).value().reshape(shape)
                for state, shape in zip(self._states, self._shapes, strict=True)
            )
        )

    def write(self, discrete_state: Any, record: Record) -> None:
        """Leave a record for the next tick.

        Args:
            discrete_state: That an update is given.
            record: Arrays of the same shapes.
        """
        for state, value in zip(self._states, record, strict=True):
            discrete_state.set_value(state, np.asarray(value).ravel())


class PoseGate(LeafSystem):
    """Passes on poses that robots can have driven to; in place of others, the last one believed.

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
    often the operator has said start: after each start, any pose within the world is believed.
    Inputs are held from tick to tick.

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
    which depends on it. Each time the operator says start, which `starts_said` counts, all faults
    are forgiven.

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
        require_whole("count", count, 1)
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


class FloorGuard(LeafSystem):
    """Says which robots are off the floor or overlap, by more than a slack for control errors.

    .. pydrake_system::

        name: FloorGuard
        input_ports:
        - pose
        output_ports:
        - fault

    =====  ====  =========  =====  ===========
    port   size  unit       frame  feedthrough
    =====  ====  =========  =====  ===========
    pose   3 N   m, m, rad  world  -
    fault  N     -          -      all
    =====  ====  =========  =====  ===========

    `fault` is a number of Reason: FENCE, SPACING, or 0.

    Source: ours.

    Args:
        world: The floor.
        radii: Of the robots, shape (N,) [m].
        slack: By how much a robot may be nearer to a wall, or to another, than its radius [m].

    Raises:
        InvalidInput: There are no robots, or the slack is negative.
    """

    def __init__(self, world: World, radii: ArrayLike, *, slack: float):
        super().__init__()
        sizes = np.asarray(radii, dtype=float)
        require(sizes.ndim == 1 and len(sizes) > 0, "radii", "be of one robot at least", sizes)
        require_non_negative("slack", slack)
        self._floor = FloorWatch(world, sizes, slack)
        self._pose = self.DeclareVectorInputPort("pose", 3 * len(sizes))
        self.DeclareVectorOutputPort("fault", len(sizes), self._calc_fault)

    def _calc_fault(self, context, output):
        places = read(self._pose, context).reshape(-1, 3)[:, :2]
        output.set_value(self._floor.breaches(places))


# Inputs of one number for each robot.
_OF_ROBOTS = (
    "valid",
    "pose_fault",
    "motion_fault",
    "floor_fault",
    "robot_state",
    "robot_flags",
    "age",
)


class _Now(NamedTuple):
    decision: Decision
    clock: float


_NOTHING = _Now(Decision(np.zeros(0), np.zeros(0), np.zeros(0)), 0.0)


class RobotSupervisor(LeafSystem):
    """Decides whether each robot is armed, running, held or lost, and counts the running ticks.

    .. pydrake_system::

        name: RobotSupervisor
        input_ports:
        - valid
        - pose_fault
        - motion_fault
        - floor_fault
        - robot_state
        - robot_flags
        - age
        - mode
        - starts_said
        - view_age
        output_ports:
        - standing
        - reason
        - go
        - arm_again
        - clock

    ============  ====  ====  =====  ===========
    port          size  unit  frame  feedthrough
    ============  ====  ====  =====  ===========
    valid         N     -     -      -
    pose_fault    N     -     -      -
    motion_fault  N     -     -      -
    floor_fault   N     -     -      -
    robot_state   N     -     -      -
    robot_flags   N     -     -      -
    age           N     s     -      -
    mode          1     -     -      -
    starts_said   1     -     -      -
    view_age      1     s     -      -
    standing      N     -     -      all
    reason        N     -     -      all
    go            N     -     -      all
    arm_again     N     -     -      all
    clock         1     s     -      all
    ============  ====  ====  =====  ===========

    `standing` is a number of Standing, `reason` one of Reason; `go` is 1 for robots that run.
    `robot_state` and `robot_flags` are what a robot reports, -1 and 0 before, and `age` is that of
    the report. `arm_again` is 1 for robots that are to be armed again. `clock` is the time for
    which robots have run: each tick at which one runs stands for the period before it, the first
    tick for nothing.

    Source: ours.

    Args:
        rules: What to do about what is noticed.
        count: Number of robots N.
        period: Between ticks [s].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(self, rules: SupervisionRules, count: int, *, period: float):
        super().__init__()
        require_whole("count", count, 1)
        require_positive("period", period)
        self._rules, self._period = rules, float(period)
        self._ports = {name: self.DeclareVectorInputPort(name, count) for name in _OF_ROBOTS}
        self._mode = self.DeclareVectorInputPort("mode", 1)
        self._said = self.DeclareVectorInputPort("starts_said", 1)
        self._view_age = self.DeclareVectorInputPort("view_age", 1)
        self._memory = KeptRecord(self, no_supervision(count))
        self._heard = self.DeclareDiscreteState(state_vector(np.zeros(1)))
        self._ticks = self.DeclareDiscreteState(state_vector(np.zeros(1)))
        self._number = self.DeclareDiscreteState(state_vector(np.array([-1.0])))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._keep)
        # Every output port shows a part of this.
        now = ValueProducer(lambda: AbstractValue.Make(_NOTHING), self._calc_now)
        self._now = self.DeclareCacheEntry("now", now)
        self.DeclareVectorOutputPort("standing", count, self._calc_standing)
        self.DeclareVectorOutputPort("reason", count, self._calc_reason)
        self.DeclareVectorOutputPort("go", count, self._calc_go)
        self.DeclareVectorOutputPort("arm_again", count, self._calc_arm_again)
        self.DeclareVectorOutputPort("clock", 1, self._calc_clock)

    def _tick(self, context) -> int:
        """Number of the last tick, -1 before the first: all that is known was known then."""
        return round(context.get_discrete_state(self._number).value()[0])

    def _decided(self, context, tick: int) -> tuple[SupervisorMemory, Decision]:
        memory = self._memory.read(context)
        values = {name: read(port, context) for name, port in self._ports.items()}
        heard = context.get_discrete_state(self._heard).value()[0]
        signs = Signs(
            time=tick * self._period,
            valid=values["valid"],
            pose_faults=values["pose_fault"],
            motion_faults=values["motion_fault"],
            floor_faults=values["floor_fault"],
            robot_states=values["robot_state"],
            robot_flags=values["robot_flags"],
            ages=values["age"],
            mode=float(read(self._mode, context)[0]),
            cleared=bool(read(self._said, context)[0] > heard),
            view_age=float(read(self._view_age, context)[0]),
        )
        return supervise(self._rules, memory, signs)

    def _ran(self, decision: Decision, tick: int) -> bool:
        """Whether a tick counts as one at which robots ran."""
        return tick > 0 and bool((decision.standings == Standing.RUNNING).any())

    def _keep(self, context, discrete_state):
        # At a tick, inputs are those of the tick before; before the first there was none.
        tick = self._tick(context)
        discrete_state.set_value(self._number, np.array([tick + 1.0]))
        if tick < 0:
            return
        memory, decision = self._decided(context, tick)
        self._memory.write(discrete_state, memory)
        discrete_state.set_value(self._heard, read(self._said, context))
        ticks = context.get_discrete_state(self._ticks).value() + self._ran(decision, tick)
        discrete_state.set_value(self._ticks, ticks)

    def _calc_now(self, context, cached):
        tick = self._tick(context)
        decision = self._decided(context, tick)[1]
        ticks = context.get_discrete_state(self._ticks).value()[0] + self._ran(decision, tick)
        cached.set_value(_Now(decision, self._period * ticks))

    def _now_of(self, context) -> _Now:
        now: Any = self._now.Eval(context)
        return now

    def _calc_standing(self, context, output):
        output.set_value(self._now_of(context).decision.standings.astype(float))

    def _calc_reason(self, context, output):
        output.set_value(self._now_of(context).decision.reasons.astype(float))

    def _calc_go(self, context, output):
        standings = self._now_of(context).decision.standings
        output.set_value((standings == Standing.RUNNING).astype(float))

    def _calc_arm_again(self, context, output):
        output.set_value(self._now_of(context).decision.arm_again.astype(float))

    def _calc_clock(self, context, output):
        output.set_value(np.array([self._now_of(context).clock]))
