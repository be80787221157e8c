"""Feedback down a table of times to go."""

from pydrake.systems.framework import LeafSystem

from ..drake_types import AbstractValue, read
from ..numeric_parameters import NumericParameters
from ..numerics.errors import require, require_non_negative, require_positive
from ..numerics.planning.value_function.policy import AT_REST, Following, follow
from ..numerics.planning.value_function.value_function import ValueFunction


class ValueFunctionFeedback(LeafSystem):
    """Drives the cart down its time to go, and stops it in the goal box.

    It follows the best word of held controls that the table knows of, chooses the durations anew
    when what is measured would no longer lead into the box, and takes another word when that does
    not help: see `numerics.planning.value_function.policy`. Which word it follows is part of its
    state, so that it does not waver between two that take as long. Where the table promises nothing
    (off the grid, out of reach) the cart stops.

    .. pydrake_system::

        name: ValueFunctionFeedback
        input_ports:
        - state
        output_ports:
        - control

    =======  ====  ================  =======  ===========
    port     size  unit              frame    feedthrough
    =======  ====  ================  =======  ===========
    state    4     m, m, rad, rad    world    -
    control  2     m/s, rad/s        tractor  all
    =======  ====  ================  =======  ===========

    `state` holds x, y, theta, beta; `control` v, omega, held for a period. Defined for double. The
    word, the controls given last and where the cart is taken to be are an abstract state, updated
    once a period. Numeric parameters: `margin`, `trust`.

    Source: in place of Zhang 2014, (3.20), whose sign alone leads into loops.

    Args:
        value: The table.
        period: For how long a control is held [s].
        delay: From the moment of which `state` is until `control` acts [s].
        margin: Part of the goal box's half-widths by which to keep off its edge, in [0, 1), so
            that an error of the measurement does not lead past it.
        trust: Weight of a measurement against where those before it and the controls say that the
            cart is, in (0, 1]; 1: no filter.

    Raises:
        InvalidInput: The period is not positive, the delay negative, the margin or the trust out
            of range.
    """

    def __init__(
        self,
        value: ValueFunction,
        *,
        period: float = 0.05,
        delay: float = 0.0,
        margin: float = 0.1,
        trust: float = 0.3,
    ):
        super().__init__()
        require_positive("period", period)
        require_non_negative("delay", delay)
        require(0 <= margin < 1, "margin", "lie in [0, 1)", margin)
        require(0 < trust <= 1, "trust", "lie in (0, 1]", trust)
        self._value, self._period, self._delay = value, period, delay
        self.parameters = NumericParameters(self, margin=margin, trust=trust)
        self._state = self.DeclareVectorInputPort("state", 4)
        self._following = self.DeclareAbstractState(AbstractValue.Make(AT_REST))
        self.DeclareVectorOutputPort("control", 2, self._calc_control)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._update)

    def get_state_input_port(self):
        """The cart's x, y, theta, beta, size 4 [m], [m], [rad], [rad]."""
        return self._state

    def get_control_output_port(self):
        """v, omega, size 2 [m/s], [rad/s]."""
        return self.GetOutputPort("control")

    def _next(self, context) -> Following:
        margin, trust = self.parameters(context)
        return follow(
            self._value,
            context.get_abstract_state(self._following).get_value(),
            read(self._state, context),
            period=self._period,
            delay=self._delay,
            margin=margin,
            trust=trust,
        )

    def _update(self, context, state):
        state.get_mutable_abstract_state(self._following).set_value(self._next(context))

    def _calc_control(self, context, output):
        following = context.get_abstract_state(self._following).get_value()
        # Before the first update it is what that will say.
        following = following if len(following.given) else self._next(context)
        output.SetFromVector(following.control)
