"""What should not happen, and how idle everybody was."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require_positive
from ..numerics.harvest.machines.cart import Cart, hitch_of
from ..numerics.harvest.machines.watching import RECORD, watch
from ..numerics.harvest.routes.clearance import outline
from ..numerics.harvest.routes.ground import Ground, Traffic


class HarvestMonitor(LeafSystem):
    """Checks in every step that no cart is over crop or at a combine, and counts idle time.

    .. pydrake_system::

        name: HarvestMonitor
        input_ports:
        - station
        - state
        - control
        - alongside
        - emptying
        output_ports:
        - record

    =========  =====  ================  =======
    port       size   unit              frame
    =========  =====  ================  =======
    station    N      m                 path
    state      4 K    m, m, rad, rad    world
    control    2 K    m/s, rad/s        tractor
    alongside  N      -                 -
    emptying   K      -                 -
    record     4 + K  -, m, s           -
    =========  =====  ================  =======

    `record` holds the number of steps in which a cart was over standing crop or out of bounds; the
    least distances so far of a cart from a combine, of two carts and of two combines [m]; and of
    each cart the time for which it stood without being filled or emptied [s].

    Source: ours.

    Args:
        ground: Raster of the crop.
        traffic: The combines' paths.
        cart: What the carts are like.
        carts: Number of carts K.
        period: Time step [s].

    Raises:
        InvalidInput: The period is not positive.
    """

    def __init__(self, ground: Ground, traffic: Traffic, cart: Cart, *, carts: int, period: float):
        super().__init__()
        require_positive("period", period)
        self._ground, self._traffic, self._period = ground, traffic, float(period)
        self._outline, self._hitch = outline(cart), hitch_of(cart)
        combines = len(traffic.progress)
        self._ports = [
            self.DeclareVectorInputPort(name, size)
            for name, size in (
                ("station", combines),
                ("state", 4 * carts),
                ("control", 2 * carts),
                ("alongside", combines),
                ("emptying", carts),
            )
        ]
        record = np.zeros(RECORD + carts)
        record[1:RECORD] = np.inf
        self._record = self.DeclareDiscreteState(state_vector(record))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._watch)
        self.DeclareStateOutputPort("record", self._record)

    def _watch(self, context, discrete_state):
        station, state, control, alongside, emptying = (read(p, context) for p in self._ports)
        traffic = self._traffic._replace(progress=station, time=float(context.get_time()))
        record = context.get_discrete_state(self._record).value().copy()
        watch(
            record,
            self._ground,
            traffic,
            self._outline,
            self._hitch,
            state.reshape(-1, 4),
            control.reshape(-1, 2),
            alongside,
            emptying,
            self._period,
        )
        discrete_state.set_value(self._record, record)
