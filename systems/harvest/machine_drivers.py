"""Drivers of combines and carts, who follow a plan."""

import numpy as np
from pydrake.systems.framework import LeafSystem, ValueProducer

from ..drake_parts import AbstractValue, read, state_vector
from ..numerics.errors import require_positive
from ..numerics.harvest.execution.advance import Disturbance, drive_on, pace_of
from ..numerics.harvest.execution.fleet import at_trucks, lateness, pack_fleet, pack_tracks, steer
from ..numerics.harvest.execution.orders import Orders, find_orders
from ..numerics.harvest.execution.planned_work import PlannedWork
from ..numerics.harvest.execution.unloading import wanted_at
from ..numerics.harvest.machines import COLUMNS


class MachineDrivers(LeafSystem):
    """N combines and K carts drive as planned: on time if they can, else in the plan's order.

    Each period every machine drives as far as `numerics.harvest.execution.advance` allows: no
    farther than its plan, its path and its disturbances permit, and so that it can still stop
    before places that it must not enter yet. Combines are told their stations; carts are steered
    along their paths, v = (s' - s) / period, omega from the path's arc and the cross-track errors.

    .. pydrake_system::

        name: MachineDrivers
        input_ports:
        - station
        - speed
        - account
        - state
        - alongside
        - room
        - load
        output_ports:
        - command
        - control
        - wanted
        - asked
        - emptying
        - late

    =========  ======  ================  =======  ======================
    port       size    unit              frame    feedthrough
    =========  ======  ================  =======  ======================
    station    N       m                 path     -
    speed      N       m/s               path     -
    account    8 N     m, kg, s          -        -
    state      4 K     m, m, rad, rad    world    -
    alongside  N       -                 -        -
    room       K       kg                -        -
    load       K       kg                -        -
    command    2 N     m, m/s            path     all but state
    control    2 K     m/s, rad/s        tractor  all
    wanted     K       -                 -        station, account, room
    asked      K       kg                -        station, account, room
    emptying   K       -                 -        load
    late       N + K   s                 -        station
    =========  ======  ================  =======  ======================

    `station`, `speed` and `account` are the outputs of `CombineTeam`, `state`, `room` and `load` of
    `GrainCartTeam`, `alongside` of `AugerTransfer`. `command` holds, combine by combine, station
    and speed at the end of the period; `wanted` is the combine that each cart is to empty now, or
    -1, `asked` the mass that it is still to take from it; `emptying` is 1 while a cart with grain
    stands at its truck; `late` is how long ago each machine should have been where it is now.

    Source: ours.

    Args:
        work: The planned work.
        disturbance: Disturbances of the plan; by default none.
        orders: Who waits for whom; found from the plan by default.
        period: Time step [s].

    Raises:
        InvalidInput: The period is not positive.
    """

    def __init__(
        self,
        work: PlannedWork,
        *,
        period: float,
        disturbance: Disturbance | None = None,
        orders: Orders | None = None,
    ):
        super().__init__()
        require_positive("period", period)
        self._period = float(period)
        self._fleet = pack_fleet(work)
        self._orders = find_orders(work) if orders is None else orders
        self._pace = pace_of(Disturbance() if disturbance is None else disturbance)
        self._across_most = float(work.cart.lateral_acceleration)
        self._tracks = pack_tracks([motion.timed.path for motion in work.motions])
        count, carts = len(work.plans), len(work.motions)
        self._count = count
        self._station = self.DeclareVectorInputPort("station", count)
        self._speed = self.DeclareVectorInputPort("speed", count)
        self._account = self.DeclareVectorInputPort("account", COLUMNS * count)
        self._state = self.DeclareVectorInputPort("state", 4 * carts)
        self._alongside = self.DeclareVectorInputPort("alongside", count)
        self._room = self.DeclareVectorInputPort("room", carts)
        self._load = self.DeclareVectorInputPort("load", carts)
        # Stations of carts, then their speeds.
        self._carts = self.DeclareDiscreteState(state_vector(np.zeros(2 * carts)))
        moves = ValueProducer(lambda: AbstractValue.Make(np.zeros(1)), self._calc_moves)
        # All but the carts' states, by which they are steered.
        decided = {
            port.ticket()
            for port in (
                self._station,
                self._speed,
                self._account,
                self._alongside,
                self._room,
                self._load,
            )
        }
        decided |= {self.discrete_state_ticket(self._carts), self.time_ticket()}
        self._moves = self.DeclareCacheEntry("moves", moves, decided)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._drive)
        self.DeclareVectorOutputPort("command", 2 * count, self._calc_command, decided)
        self.DeclareVectorOutputPort("control", 2 * carts, self._calc_control)
        placed = {
            self.discrete_state_ticket(self._carts),
            *(port.ticket() for port in (self._station, self._account, self._room)),
        }
        visits = ValueProducer(lambda: AbstractValue.Make(np.zeros((2, 1))), self._calc_visits)
        self._visits = self.DeclareCacheEntry("visits", visits, placed)
        self.DeclareVectorOutputPort("wanted", carts, self._calc_wanted, placed)
        self.DeclareVectorOutputPort("asked", carts, self._calc_asked, placed)
        parked = {
            self.discrete_state_ticket(self._carts),
            self._load.ticket(),
            self.time_ticket(),
        }
        self.DeclareVectorOutputPort("emptying", carts, self._calc_emptying, parked)
        self.DeclareVectorOutputPort(
            "late",
            count + carts,
            self._calc_late,
            {
                self.discrete_state_ticket(self._carts),
                self._station.ticket(),
                self.time_ticket(),
            },
        )

    def _driven(self, context) -> np.ndarray:
        """Stations and then speeds of the carts, shape (2 K,)."""
        return context.get_discrete_state(self._carts).value()

    def _calc_moves(self, context, output):
        """Stations and then speeds of all machines after the period, shape (2 N + 2 K,)."""
        output.set_value(
            drive_on(
                self._fleet,
                self._orders,
                self._pace,
                read(self._station, context),
                read(self._speed, context),
                read(self._account, context),
                read(self._alongside, context),
                read(self._room, context),
                read(self._load, context),
                self._driven(context),
                context.get_time(),
                self._period,
            )
        )

    def _after(self, context) -> np.ndarray:
        return self._moves.Eval(context)  # type: ignore[return-value]  # the stubs say object

    def _drive(self, context, discrete_state):
        after = self._after(context).reshape(2, -1)
        discrete_state.set_value(self._carts, after[:, self._count :].ravel())

    def _calc_command(self, context, output):
        output.set_value(self._after(context).reshape(2, -1)[:, : self._count].T.ravel())

    def _calc_control(self, context, output):
        half = len(self._after(context)) // 2
        after = self._after(context)[self._count : half]
        driven = self._driven(context)[: half - self._count]
        state = read(self._state, context).reshape(-1, 4)
        output.set_value(steer(self._tracks, state, driven, after, self._period, self._across_most))

    def _calc_visits(self, context, output):
        """Combine that each cart is to empty, and mass it is still to take, shape (2, K)."""
        found = wanted_at(
            self._fleet,
            self._orders.ties,
            read(self._station, context),
            read(self._account, context),
            read(self._room, context),
            self._driven(context),
        )
        output.set_value(np.stack(found))

    def _visits_now(self, context) -> np.ndarray:
        return self._visits.Eval(context)  # type: ignore[return-value]  # the stubs say object

    def _calc_wanted(self, context, output):
        output.set_value(self._visits_now(context)[0])

    def _calc_asked(self, context, output):
        output.set_value(self._visits_now(context)[1])

    def _calc_emptying(self, context, output):
        load = read(self._load, context)
        output.set_value(
            at_trucks(self._fleet, self._driven(context)[: len(load)], load, context.get_time())
        )

    def _calc_late(self, context, output):
        station, driven = read(self._station, context), self._driven(context)
        stations = np.concatenate([station, driven[: len(driven) // 2]])
        output.set_value(lateness(self._fleet, stations, context.get_time()))
