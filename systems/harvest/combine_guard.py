"""Combines look out for carts."""

from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numerics.errors import require
from ..numerics.harvest.machines.cart import Cart
from ..numerics.harvest.routes.clearance import combines_to_halt, outline
from ..numerics.harvest.routes.ground import Traffic

# How far ahead a combine's driver looks [s], and what is left between it and a cart [m].
LOOK, GAP = 1.0, 0.5


class CombineGuard(LeafSystem):
    """Stops a combine before it would touch a cart.

    .. pydrake_system::

        name: CombineGuard
        input_ports:
        - station
        - state
        output_ports:
        - halt

    =======  ====  ================  =====
    port     size  unit              frame
    =======  ====  ================  =====
    station  N     m                 path
    state    4 K   m, m, rad, rad    world
    halt     N     -                 -
    =======  ====  ================  =====

    `halt` is 1 for a combine that has to stop.

    Source: ours.

    Args:
        traffic: The combines' paths.
        cart: What the carts are like.
        carts: Number of carts K.

    Raises:
        InvalidInput: There are no carts.
    """

    def __init__(self, traffic: Traffic, cart: Cart, *, carts: int):
        super().__init__()
        require(carts > 0, "carts", "be at least 1", carts)
        self._traffic, self._cart, self._outline = traffic, cart, outline(cart)
        combines = len(traffic.progress)
        self._station = self.DeclareVectorInputPort("station", combines)
        self._state = self.DeclareVectorInputPort("state", 4 * carts)
        self.DeclareVectorOutputPort("halt", combines, self._calc_halt)

    def _calc_halt(self, context, output):
        output.set_value(
            combines_to_halt(
                self._traffic._replace(progress=read(self._station, context)),
                self._outline,
                self._cart.length,
                self._cart.hitch_offset,
                read(self._state, context).reshape(-1, 4),
                LOOK,
                GAP,
            )
        )
