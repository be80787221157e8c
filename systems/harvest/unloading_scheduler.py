"""The sequential strategy: carts serve their combines in turn."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require, require_positive
from ..numerics.harvest.schedule.timetable import Visit
from ..numerics.harvest.strategies.serving import (
    MEMORY,
    STAY,
    TASK,
    may_start,
    next_in_turn,
    visit_rows,
)
from .sight import declare_sight, read_sight


class UnloadingScheduler(LeafSystem):
    """Sends each cart to its combines by a timetable, and lets it go when a tank is empty.

    A cart neither begins to unload nor leaves before its timetable says so, unless the combine
    stands full or has finished; it never leaves a tank that is not empty while it has room. Late
    carts catch up while the plan has waits.

    .. pydrake_system::

        name: UnloadingScheduler
        input_ports:
        - tank
        - mode
        - alongside
        - load
        - room
        output_ports:
        - task
        - wanted

    =========  ====  ====  =====
    port       size  unit  frame
    =========  ====  ====  =====
    tank       N     kg    -
    mode       N     -     -
    alongside  N     -     -
    load       K     kg    -
    room       K     kg    -
    task       K     -     -
    wanted     K     -     -
    =========  ====  ====  =====

    `task` is the combine that each cart is to be beside, -2 for its truck, or -1 to stay; `wanted`
    the combine that it may empty now, or -1. `alongside` must come from the same step's poses.

    Source: Zhang 2014, 3.4 (sequential strategy).

    Args:
        visits: Of each cart, in order, K sequences.
        combines: Number of combines N.
        capacity: Of a tank [kg].
        period: Between two decisions [s].

    Raises:
        InvalidInput: There is no cart, or a number is not positive.
    """

    def __init__(
        self,
        visits: Sequence[Sequence[Visit]],
        *,
        combines: int,
        capacity: float,
        period: float,
    ):
        super().__init__()
        require(len(visits) > 0, "visits", "be given for at least one cart", len(visits))
        require_positive("capacity", capacity)
        require_positive("period", period)
        carts = len(visits)
        self._rows = [visit_rows(each) for each in visits]
        self._capacity = float(capacity)
        declare_sight(self, combines, carts)
        memory = np.zeros((carts, MEMORY))
        memory[:, TASK] = STAY
        self._memory = self.DeclareDiscreteState(state_vector(memory.ravel()))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._decide)
        remembered = {self.discrete_state_ticket(self._memory)}
        self.DeclareVectorOutputPort("task", carts, self._calc_task, remembered)
        seen = {
            self.input_port_ticket(self.GetInputPort("mode").get_index()),
            self.time_ticket(),
        }
        self.DeclareVectorOutputPort("wanted", carts, self._calc_wanted, remembered | seen)

    def _remembered(self, context) -> np.ndarray:
        return context.get_discrete_state(self._memory).value().reshape(-1, MEMORY)

    def _decide(self, context, discrete_state):
        sight = read_sight(self, context)
        after = [
            next_in_turn(k, memory, self._rows[k], sight, self._capacity)
            for k, memory in enumerate(self._remembered(context))
        ]
        discrete_state.set_value(self._memory, np.concatenate(after))

    def _calc_task(self, context, output):
        output.set_value(self._remembered(context)[:, TASK])

    def _calc_wanted(self, context, output):
        mode = read(self.GetInputPort("mode"), context)
        time = context.get_time()
        output.set_value(
            [
                memory[TASK] if may_start(memory, rows, mode, time) else STAY
                for memory, rows in zip(self._remembered(context), self._rows, strict=True)
            ]
        )
