"""Grain carts: tractors with trailers, and what is in them."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numeric_parameters import NumericParameters
from ..numerics.errors import require, require_positive
from ..numerics.harvest.machines.cart import Cart, hitch_of
from ..numerics.harvest.machines.towing import drive_team


class GrainCartTeam(LeafSystem):
    """K tractors with trailers, each with a load that grows as a combine pours and ends in a truck.

    x' = v cos(theta), y' = v sin(theta), theta' = omega,
    beta' = omega - (v sin(beta) - M omega cos(beta)) / L, the equations of `TractorTrailer`, with
    the control held and integrated by Runge-Kutta steps of order 4; load = received - delivered.
    Controls beyond the bounds are clipped.

    .. pydrake_system::

        name: GrainCartTeam
        input_ports:
        - control
        - received
        - emptying
        output_ports:
        - state
        - load
        - room
        - delivered

    =========  ====  ================  =======  ===========
    port       size  unit              frame    feedthrough
    =========  ====  ================  =======  ===========
    control    2 K   m/s, rad/s        tractor  -
    received   K     kg                -        -
    emptying   K     -                 -        -
    state      4 K   m, m, rad, rad    world    -
    load       K     kg                -        received
    room       K     kg                -        received
    delivered  K     kg                -        -
    =========  ====  ================  =======  ===========

    `received` counts what each cart has got since the start, `delivered` what it has given to its
    truck; `emptying` is 1 while it stands at the truck; `room` is what it can still take.
    Numeric parameters: `truck_rate`.

    Source: Zhang 2014, 3.2.2; loads are ours.

    Args:
        cart: What the carts are like.
        starts: x, y, theta, beta of each, shape (K, 4).
        truck_rate: At which a cart is emptied into its truck [kg/s].
        period: Time step [s].

    Raises:
        InvalidInput: There is no cart, a start is not four numbers, or a number is not positive.
    """

    def __init__(
        self,
        cart: Cart,
        starts: Sequence[Sequence[float]] | np.ndarray,
        *,
        truck_rate: float,
        period: float,
    ):
        super().__init__()
        states = np.array(starts, dtype=float)
        shaped = states.ndim == 2 and states.shape[1] == 4 and len(states) > 0
        require(shaped, "starts", "be (x, y, theta, beta) of each cart", starts)
        require_positive("truck_rate", truck_rate)
        require_positive("period", period)
        self._cart, self._hitch = cart, hitch_of(cart)
        self._trailer = cart.trailer
        self._period = float(period)
        self.parameters = NumericParameters(self, truck_rate=truck_rate)
        # A trailer that is backed up doubles its errors every 0.7 lengths: steps are so short that
        # a cart that retraces its way stays on it for 20 lengths.
        self._substeps = max(1, int(np.ceil(40 * period * cart.speed / cart.length)))
        count = len(states)
        self._control = self.DeclareVectorInputPort("control", 2 * count)
        self._received = self.DeclareVectorInputPort("received", count)
        self._emptying = self.DeclareVectorInputPort("emptying", count)
        self._state = self.DeclareDiscreteState(state_vector(states.ravel()))
        self._delivered = self.DeclareDiscreteState(state_vector(np.zeros(count)))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._move)
        self.DeclareStateOutputPort("state", self._state)
        grain = {
            self._received.ticket(),
            self.discrete_state_ticket(self._delivered),
        }
        self.DeclareVectorOutputPort("load", count, self._calc_load, grain)
        self.DeclareVectorOutputPort("room", count, self._calc_room, grain)
        self.DeclareStateOutputPort("delivered", self._delivered)

    def _load(self, context) -> np.ndarray:
        delivered = context.get_discrete_state(self._delivered).value()
        return read(self._received, context) - delivered

    def _move(self, context, discrete_state):
        moved = drive_team(
            context.get_discrete_state(self._state).value(),
            read(self._control, context),
            self._cart.speed,
            self._trailer.turn_rate,
            self._hitch,
            self._period,
            self._substeps,
        )
        discrete_state.set_value(self._state, moved)
        most = self.parameters(context).truck_rate * self._period
        flow = np.minimum(most, self._load(context))
        given = np.where(read(self._emptying, context) > 0.5, flow, 0.0)
        before = context.get_discrete_state(self._delivered).value()
        discrete_state.set_value(self._delivered, before + given)

    def _calc_load(self, context, output):
        output.set_value(self._load(context))

    def _calc_room(self, context, output):
        output.set_value(np.maximum(self._cart.capacity - self._load(context), 0.0))
