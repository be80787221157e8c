"""Bang-bang feedback on a table of times to go."""

from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.planning.value_function.rollout import bang_bang, look_ahead
from ..numerics.planning.value_function.value_function import ValueFunction


class ValueFunctionFeedback(LeafSystem):
    """Turns the cart the way that its time to go falls, and stops it in the goal box.

    omega = -W sgn(du/dtheta + du/dbeta), W the bound of the turn rate and u the interpolated
    table; v is the speed of the table's trailer. Where the sign is zero, or the cart may reverse,
    the control is the one whose long steps promise the least time. Where the table promises
    nothing (off the grid, out of reach) the cart stops.

    .. pydrake_system::

        name: ValueFunctionFeedback
        input_ports:
        - state
        output_ports:
        - control

    =======  ====  ================  =======
    port     size  unit              frame
    =======  ====  ================  =======
    state    4     m, m, rad, rad    world
    control  2     m/s, rad/s        tractor
    =======  ====  ================  =======

    `state` holds x, y, theta, beta; `control` v, omega. Defined for double. The control jumps, so
    hold it (`ZeroOrderHold`) for a small part of the time between theta nodes on its way to a
    plant: an integrator with error control would chatter along its switches.

    Source: Zhang 2014, (3.20).

    Args:
        value: The table.
    """

    def __init__(self, value: ValueFunction):
        super().__init__()
        self._value = value
        self._state = self.DeclareVectorInputPort("state", 4)
        self.DeclareVectorOutputPort("control", 2, self._calc_control)

    def _calc_control(self, context, output):
        state = read(self._state, context)
        to_go = self._value.time_to_go(state)
        if not 0 < to_go < float("inf"):
            output.SetFromVector([0.0, 0.0])
            return
        trailer = self._value.trailer
        omega = 0.0 if trailer.reverse else bang_bang(self._value, state)
        control = (trailer.speed, omega) if omega else look_ahead(self._value, state)
        output.SetFromVector(control)
