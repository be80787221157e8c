"""Decides which robots may run."""

from typing import Any, NamedTuple

import numpy as np
from pydrake.systems.framework import LeafSystem, ValueProducer

from ..drake_types import AbstractValue, read, state_vector
from ..numerics.errors import require, require_positive
from ..numerics.station.reasons import Standing
from ..numerics.station.supervision import (
    Decision,
    Signs,
    SupervisionRules,
    SupervisorMemory,
    no_supervision,
    supervise,
)
from .kept_record import KeptRecord

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
    """Makes of each robot that it is armed, running, held or lost, and counts the running ticks.

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
        require(count > 0, "count", "be positive", count)
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
        # Every port tells a part of it.
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
        """Whether a tick counts."""
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
