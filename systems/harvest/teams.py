"""Combines at work, grain carts with what is in them, and the augers between them."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_parts import NumericParameters, read, state_vector
from ..numerics.errors import require, require_positive
from ..numerics.harvest.execution.fleet import cutting_on, pack_fleet, pack_tracks, poses_on
from ..numerics.harvest.execution.planned_work import PlannedWork
from ..numerics.harvest.execution.unloading import work_together
from ..numerics.harvest.machines import (
    COLUMNS,
    MODE,
    STANDS,
    STATION,
    TANK,
    Cart,
    drive_team,
    hitch_of,
    pair_up,
)


class CombineTeam(LeafSystem):
    """N combines drive along their paths, and their tanks fill and are emptied.

    tank' = density area' - r_u [a cart is alongside] - spilt'; a command gives station and speed at
    the end of a period. The moments at which a tank is full or empty are exact, whatever the
    period: cut = given + in the tank + spilt, up to rounding.

    .. pydrake_system::

        name: CombineTeam
        input_ports:
        - alongside
        - room
        - asked
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
    asked      K     kg         -      -
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
    each cart can still take, `asked` what it is to take in its visit; `command` station and speed
    at the end of the period, combine by combine; `pose` the middle of the header; `station` the
    distance along the path, `speed` its rate, never negative; `mode` a number in `machines.MODES`;
    `cutting` 1 while the header is down; `account` the columns of that module, combine by combine;
    `unloaded` what each cart has taken over since the start.

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
        self._asked = self.DeclareVectorInputPort("asked", carts)
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
        room = np.minimum(read(self._room, context), read(self._asked, context))
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
        cart: Dimensions and limits of all carts.
        starts: x, y, theta, beta of each, shape (K, 4).
        truck_rate: Rate at which a cart is emptied into its truck [kg/s].
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
        # The errors of a reversing trailer double every 0.7 lengths: steps are short enough that a
        # cart that retraces its way stays on it for 20 lengths.
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


class AugerTransfer(LeafSystem):
    """Lets grain flow only while a cart's trailer really is under an auger.

    A cart is alongside while the middle of its box is within a tolerance of the point at `reach` to
    the left of the combine, and its trailer points in the combine's direction; see
    `numerics.harvest.machines`. Grain flows to a cart only from the combine that `wanted` names.
    `mode` is a combine's, a number in `machines.MODES`: it says whether the combine stands.

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
