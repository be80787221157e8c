"""The on-demand strategy, for comparison: a cart goes where a tank is fullest."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import state_vector
from ..numerics.errors import require, require_positive
from ..numerics.harvest.strategies.serving import MEMORY, STAY, TASK, most_urgent
from .sight import declare_sight, read_sight


class OnDemandScheduler(LeafSystem):
    """Sends each free cart to the fullest tank that calls and that no other cart goes to.

    .. pydrake_system::

        name: OnDemandScheduler
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

    Ports mean what they mean in `UnloadingScheduler`; here a cart may unload whenever it can.

    Source: ours; what farmers do by radio.

    Args:
        combines: Number of combines N.
        carts: Number of carts K.
        capacity: Of a tank [kg].
        threshold: Part of a tank from which on a combine calls.
        period: Between two decisions [s].

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(
        self, *, combines: int, carts: int, capacity: float, threshold: float, period: float
    ):
        super().__init__()
        require(combines > 0, "combines", "be at least 1", combines)
        require(carts > 0, "carts", "be at least 1", carts)
        require_positive("capacity", capacity)
        require(0 < threshold <= 1, "threshold", "lie above 0 and up to 1", threshold)
        require_positive("period", period)
        self._capacity, self._threshold = float(capacity), float(threshold)
        declare_sight(self, combines, carts)
        memory = np.zeros((carts, MEMORY))
        memory[:, TASK] = STAY
        self._memory = self.DeclareDiscreteState(state_vector(memory.ravel()))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._decide)
        remembered = {self.discrete_state_ticket(self._memory)}
        for name in ("task", "wanted"):
            self.DeclareVectorOutputPort(name, carts, self._calc_task(name), remembered)

    def _remembered(self, context) -> np.ndarray:
        return context.get_discrete_state(self._memory).value().reshape(-1, MEMORY)

    def _decide(self, context, discrete_state):
        sight = read_sight(self, context)
        memory = self._remembered(context).copy()
        for k in range(len(memory)):
            others = [int(each) for j, each in enumerate(memory[:, TASK]) if j != k]
            memory[k] = most_urgent(k, memory[k], others, sight, self._capacity, self._threshold)
        discrete_state.set_value(self._memory, memory.ravel())

    def _calc_task(self, name: str):
        def calc(context, output):
            tasks = self._remembered(context)[:, TASK]
            output.set_value(tasks if name == "task" else np.maximum(tasks, STAY))

        return calc
