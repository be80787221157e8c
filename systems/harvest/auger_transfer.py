"""Which combine pours into which cart."""

from pydrake.systems.framework import LeafSystem

from ..drake_types import read
from ..numeric_parameters import NumericParameters
from ..numerics.errors import require, require_positive
from ..numerics.harvest.machines.alongside import pair_up
from ..numerics.harvest.machines.cart import Cart
from ..numerics.harvest.machines.filling import STANDS


class AugerTransfer(LeafSystem):
    """Lets grain flow only while a cart's trailer really is in an auger's reach.

    A cart is alongside while the middle of its box is within a stated distance of the place at
    `reach` to the left of the combine, and points the combine's way; see
    `numerics.harvest.machines.alongside`. Of a combine and a cart that want nothing from one
    another nothing flows.

    .. pydrake_system::

        name: AugerTransfer
        input_ports:
        - pose
        - state
        - wanted
        - mode
        output_ports:
        - alongside

    =========  ====  ================  =====  ===========
    port       size  unit              frame  feedthrough
    =========  ====  ================  =====  ===========
    pose       3 N   m, m, rad         world  -
    state      4 K   m, m, rad, rad    world  -
    wanted     K     -                 -      -
    mode       N     -                 -      -
    alongside  N     -                 -      all
    =========  ====  ================  =====  ===========

    `wanted` is the combine that each cart is to empty now, or -1; `alongside` the cart that each
    combine pours into, or -1. Numeric parameters: `reach`.

    Source: Zhang 2014, 3.2.1 (the auger is on the left); the tolerances are ours.

    Args:
        combines: Number of combines N.
        carts: Number of carts K.
        cart: What the carts are like.
        reach: Of the auger, from the combine's middle to the middle of the box [m].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(self, *, combines: int, carts: int, cart: Cart, reach: float):
        super().__init__()
        require(combines > 0, "combines", "be at least 1", combines)
        require(carts > 0, "carts", "be at least 1", carts)
        require_positive("reach", reach)
        self._cart = cart
        self.parameters = NumericParameters(self, reach=reach)
        self._pose = self.DeclareVectorInputPort("pose", 3 * combines)
        self._state = self.DeclareVectorInputPort("state", 4 * carts)
        self._wanted = self.DeclareVectorInputPort("wanted", carts)
        self._mode = self.DeclareVectorInputPort("mode", combines)
        self.DeclareVectorOutputPort("alongside", combines, self._calc_alongside)

    def _calc_alongside(self, context, output):
        output.set_value(
            pair_up(
                read(self._pose, context).reshape(-1, 3),
                read(self._state, context).reshape(-1, 4),
                read(self._wanted, context),
                STANDS[read(self._mode, context).astype(int)],
                self._cart.length,
                self._cart.hitch_offset,
                self.parameters(context).reach,
            )
        )
