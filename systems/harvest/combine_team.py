"""Combines at work."""

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require_positive
from ..numerics.harvest.execution.fleet import pack_fleet
from ..numerics.harvest.execution.grain_flow import work_together
from ..numerics.harvest.execution.planned_work import PlannedWork
from ..numerics.harvest.execution.tracks import cutting_on, pack_tracks, poses_on
from ..numerics.harvest.machines.filling import COLUMNS, MODE, STATION, TANK


class CombineTeam(LeafSystem):
    """N combines drive along their paths, and their tanks fill and are emptied.

    tank' = density area' - r_u [a cart is alongside] - spilt'; a command says how far each gets in
    a period. Loads are exact to the moment a tank is full or empty, whatever the period: cut =
    given + in the tank + spilt, to rounding.

    .. pydrake_system::

        name: CombineTeam
        input_ports:
        - alongside
        - room
        - command
        output_ports:
        - pose
        - station
        - speed
        - tank
        - mode
        - cutting
        - account
        - unloaded

    =========  ====  =========  =====  ===========
    port       size  unit       frame  feedthrough
    =========  ====  =========  =====  ===========
    alongside  N     -          -      -
    room       K     kg         -      -
    command    2 N   m, m/s     path   -
    pose       3 N   m, m, rad  world  -
    station    N     m          path   -
    speed      N     m/s        path   -
    tank       N     kg         -      -
    mode       N     -          -      -
    cutting    N     -          -      -
    account    8 N   m, kg, s   -      -
    unloaded   K     kg         -      -
    =========  ====  =========  =====  ===========

    `alongside` is the number of the cart that stands under a combine's auger, or -1; `room` what
    each cart can still take; `command` station and speed at the end of the period, combine by
    combine; `pose` the middle of the header; `station` the way driven; `speed` that along the path,
    never negative; `mode` a number in `machines.filling.MODES`; `cutting` 1 while the header is
    down; `account` the columns of that module, combine by combine; `unloaded` what each cart has
    taken over since the start.

    Source: Zhang 2014, 3.2.1 and 3.4; stopping and spilling are ours.

    Args:
        work: What is planned.
        period: Time step [s].

    Raises:
        InvalidInput: The period is not positive.
    """

    def __init__(self, work: PlannedWork, *, period: float):
        super().__init__()
        require_positive("period", period)
        self._period = float(period)
        paths = [plan.path for plan in work.plans]
        self._tracks, self._ends = pack_tracks(paths), np.array([path.length for path in paths])
        self._fleet = pack_fleet(work)
        count, carts = len(work.plans), len(work.motions)
        self._alongside = self.DeclareVectorInputPort("alongside", count)
        self._room = self.DeclareVectorInputPort("room", carts)
        self._command = self.DeclareVectorInputPort("command", 2 * count)
        accounts = np.zeros((count, COLUMNS))
        accounts[:, STATION] = [plan.stations[0] for plan in work.plans]
        self._account = self.DeclareDiscreteState(state_vector(accounts.ravel()))
        self._speeds = self.DeclareDiscreteState(state_vector(np.zeros(count)))
        self._unloaded = self.DeclareDiscreteState(state_vector(np.zeros(carts)))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._work)
        state = {self.discrete_state_ticket(self._account)}
        self.DeclareVectorOutputPort("pose", 3 * count, self._calc_pose, state)
        self.DeclareVectorOutputPort("station", count, self._column(STATION), state)
        self.DeclareStateOutputPort("speed", self._speeds)
        self.DeclareVectorOutputPort("tank", count, self._column(TANK), state)
        self.DeclareVectorOutputPort("mode", count, self._column(MODE), state)
        self.DeclareVectorOutputPort("cutting", count, self._calc_cutting, state)
        self.DeclareStateOutputPort("account", self._account)
        self.DeclareStateOutputPort("unloaded", self._unloaded)

    def _accounts(self, context) -> np.ndarray:
        return context.get_discrete_state(self._account).value().reshape(-1, COLUMNS)

    def _work(self, context, discrete_state):
        accounts = self._accounts(context).copy()
        alongside = read(self._alongside, context).astype(int)
        room = read(self._room, context)
        given = np.zeros(len(room))
        command = read(self._command, context).reshape(-1, 2)
        work_together(
            self._fleet,
            accounts,
            np.ascontiguousarray(command[:, 0]),
            self._ends,
            alongside,
            room,
            given,
            self._period,
        )
        discrete_state.set_value(self._account, accounts.ravel())
        discrete_state.set_value(self._speeds, command[:, 1])
        before = context.get_discrete_state(self._unloaded).value()
        discrete_state.set_value(self._unloaded, before + given)

    def _calc_pose(self, context, output):
        stations = self._accounts(context)[:, STATION]
        output.set_value(poses_on(self._tracks, stations))

    def _calc_cutting(self, context, output):
        stations = self._accounts(context)[:, STATION]
        output.set_value(cutting_on(self._tracks, stations))

    def _column(self, column: int):
        def calc(context, output):
            output.set_value(self._accounts(context)[:, column])

        return calc
