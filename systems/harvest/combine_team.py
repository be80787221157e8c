"""Combines at work."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require, require_positive
from ..numerics.harvest.field.combine_path import CombinePath
from ..numerics.harvest.field.pace.holds import Holds, pack_holds
from ..numerics.harvest.machines.combine import Combine
from ..numerics.harvest.machines.filling import COLUMNS, MODE, STATION, TANK
from ..numerics.harvest.machines.team import advance_team, pack_paths, poses_of


class CombineTeam(LeafSystem):
    """N combines drive along their paths, and their tanks fill and are emptied.

    tank' = density area' - r_u [a cart is alongside] - spilt', station' = speed; a combine whose
    tank is full stands until a cart comes, or spills, and one that would get too near to the one
    on its left waits. Loads are exact to the moment a tank is full or empty, whatever the period:
    cut = given + in the tank + spilt, to rounding.

    .. pydrake_system::

        name: CombineTeam
        input_ports:
        - alongside
        - room
        - halt
        output_ports:
        - pose
        - station
        - tank
        - mode
        - account
        - unloaded

    =========  ====  =========  =====
    port       size  unit       frame
    =========  ====  =========  =====
    alongside  N     -          -
    room       K     kg         -
    halt       N     -          -
    pose       3 N   m, m, rad  world
    station    N     m          path
    tank       N     kg         -
    mode       N     -          -
    account    8 N   m, kg, s   -
    unloaded   K     kg         -
    =========  ====  =========  =====

    `alongside` is the number of the cart that stands under a combine's auger, or -1; `room` what
    each cart can still take; `halt` is 1 for a combine that must not drive on; `pose` the middle of
    the header; `station` the way driven; `mode` a number in `machines.filling.MODES`; `account`
    the columns of that module, combine by combine;
    `unloaded` what each cart has taken over since the start.

    Source: Zhang 2014, 3.2.1 and 3.4; stopping and spilling are ours.

    Args:
        paths: Of the combines.
        combine: What they are like.
        density: Of the crop [kg/m^2].
        carts: Number of carts K.
        period: Time step [s].
        holds: Who waits for whom.
        begins: When each sets out, N times [s]; by default after its path's start delay.

    Raises:
        InvalidInput: A number is not positive, or there are no paths.
    """

    def __init__(
        self,
        paths: Sequence[CombinePath],
        combine: Combine,
        *,
        density: float,
        carts: int,
        period: float,
        holds: Sequence[Holds] = (),
        begins: Sequence[float] | None = None,
    ):
        super().__init__()
        require(len(paths) > 0, "paths", "be at least one", len(paths))
        require(carts > 0, "carts", "be at least 1", carts)
        require_positive("density", density)
        require_positive("period", period)
        self._combine, self._period = combine, float(period)
        self._paths, self._holds = pack_paths(paths, density), pack_holds(holds)
        waits = [path.start_delay / combine.speed for path in paths] if begins is None else begins
        self._begins = np.array(waits, dtype=float)
        count = len(paths)
        self._alongside = self.DeclareVectorInputPort("alongside", count)
        self._room = self.DeclareVectorInputPort("room", carts)
        self._halt = self.DeclareVectorInputPort("halt", count)
        self._account = self.DeclareDiscreteState(state_vector(np.zeros(COLUMNS * count)))
        self._unloaded = self.DeclareDiscreteState(state_vector(np.zeros(carts)))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._work)
        state = {self.discrete_state_ticket(self._account)}
        self.DeclareVectorOutputPort("pose", 3 * count, self._calc_pose, state)
        for name, column in (("station", STATION), ("tank", TANK), ("mode", MODE)):
            self.DeclareVectorOutputPort(name, count, self._column(column), state)
        self.DeclareStateOutputPort("account", self._account)
        self.DeclareStateOutputPort("unloaded", self._unloaded)

    def _accounts(self, context) -> np.ndarray:
        return context.get_discrete_state(self._account).value().reshape(-1, COLUMNS)

    def _work(self, context, discrete_state):
        accounts = self._accounts(context).copy()
        given = advance_team(
            accounts,
            self._paths,
            self._holds,
            self._begins,
            self._combine.speed,
            self._combine.capacity,
            self._combine.unload_rate,
            read(self._alongside, context),
            read(self._room, context),
            read(self._halt, context),
            self._combine.when_full == "spill",
            context.get_time(),
            self._period,
        )
        discrete_state.set_value(self._account, accounts.ravel())
        before = context.get_discrete_state(self._unloaded).value()
        discrete_state.set_value(self._unloaded, before + given)

    def _calc_pose(self, context, output):
        stations = self._accounts(context)[:, STATION]
        output.set_value(poses_of(self._paths, stations))

    def _column(self, column: int):
        def calc(context, output):
            output.set_value(self._accounts(context)[:, column])

        return calc
