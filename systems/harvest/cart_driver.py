"""Drivers of the carts: routes to where they are sent, and steering along them."""

import math

import numpy as np
from pydrake.systems.framework import LeafSystem, ValueProducer

from ..drake_types import AbstractValue, read, state_vector
from ..numerics.errors import require_positive
from ..numerics.harvest.driving.arriving import notice_arrival
from ..numerics.harvest.driving.deciding import choose_route, deliberate, patience_of, set_out
from ..numerics.harvest.driving.following import back_up, follow
from ..numerics.harvest.driving.foresight import seen_by, wish_of
from ..numerics.harvest.driving.memory import (
    AT_TRUCK,
    BACKING,
    BESIDE,
    DOING,
    EN_ROUTE,
    MEMORY,
    POINTS,
    SLOW,
    SPACING,
    STILL,
    STUCK,
    TARGET,
    TRAIL,
    WAY,
    last_control,
    note_move,
    note_task,
)
from ..numerics.harvest.driving.record import COLUMNS, ROUTES, note_route
from ..numerics.harvest.machines.cart import hitch_of
from ..numerics.harvest.machines.filling import BLOCKED, FULL
from ..numerics.harvest.routes.clearance import outline, outline_at
from ..numerics.harvest.routes.ground import Traffic
from ..numerics.harvest.routes.meeting import Lanes
from ..numerics.harvest.routes.others import FAR
from ..numerics.harvest.routes.planner import RoutePlanner
from ..numerics.harvest.strategies.serving import STAY

# For how long a combine that waits for others likely stands on [s].
STANDS = 60.0
# States of other carts foreseen for a route, and for the next step.
FORESEEN, SOON = 300, 5


class CartDriver(LeafSystem):
    """Plans a route to each task, drives it, and keeps beside the combine.

    On the way the cart keeps its full speed; beside a combine it follows the lane of the loop at
    the combine's speed, v = v_c + (gap to its place) / 2 s. It stops before standing crop, before
    combines and before other carts, and looks for another route if that lasts. Routes are planned
    one after the other, each clear of where the other carts are going to be by then; carts beside
    a combine come first, then those of lower numbers. One that finds no route, and stands where
    somebody will come, gets aside; one that cannot do that either backs up the way it came,
    control by control.

    .. pydrake_system::

        name: CartDriver
        input_ports:
        - task
        - state
        - station
        - mode
        - alongside
        output_ports:
        - control
        - emptying
        - doing
        - routes

    =========  ====  ================  =======
    port       size  unit              frame
    =========  ====  ================  =======
    task       K     -                 -
    state      4 K   m, m, rad, rad    world
    station    N     m                 path
    mode       N     -                 -
    alongside  N     -                 -
    control    2 K   m/s, rad/s        tractor
    emptying   K     -                 -
    doing      K     -                 -
    routes     4500  -, s, s           -
    =========  ====  ================  =======

    `task` is what a scheduler says; `emptying` is 1 while a cart stands at its truck; `doing` is
    0 resting, 1 on its way, 2 beside a combine, 3 at its truck, 4 backing up; `routes` has three
    numbers of each route so far: a number in `driving.record.KINDS`, the time on the way, and the
    least time that any path could take.

    Source: Zhang 2014, 3.5 (time-optimal paths); the rest is ours.

    Args:
        planner: Plans routes.
        lanes: Beside the combines.
        traffic: The combines' paths and speed, at time 0.
        trucks: Where each cart stands at its truck: x, y, theta of the tractor, shape (K, 3).
        reach: Of the augers, from a combine's middle to its lane [m].
        period: Time step [s].

    Raises:
        InvalidInput: The reach or the period is not positive.
    """

    def __init__(
        self,
        planner: RoutePlanner,
        lanes: Lanes,
        traffic: Traffic,
        trucks: np.ndarray,
        *,
        reach: float,
        period: float,
    ):
        super().__init__()
        require_positive("reach", reach)
        require_positive("period", period)
        self._planner, self._lanes, self._traffic = planner, lanes, traffic
        self._means = {"planner": planner, "lanes": lanes, "reach": float(reach)}
        self._trucks = np.array(trucks, dtype=float)
        self._period = float(period)
        self._outline, self._hitch = outline(planner.cart), hitch_of(planner.cart)
        carts, combines = len(self._trucks), len(lanes.of)
        self._task = self.DeclareVectorInputPort("task", carts)
        self._state = self.DeclareVectorInputPort("state", 4 * carts)
        self._station = self.DeclareVectorInputPort("station", combines)
        self._mode = self.DeclareVectorInputPort("mode", combines)
        self._alongside = self.DeclareVectorInputPort("alongside", combines)
        memory = np.zeros((carts, MEMORY))
        memory[:, TARGET], memory[:, SPACING] = STAY, 1.0
        memory[:, [STUCK, STILL]] = math.inf
        self._memory = self.DeclareDiscreteState(state_vector(memory.ravel()))
        self._lines = self.DeclareDiscreteState(state_vector(np.zeros(carts * POINTS * 3)))
        self._trails = self.DeclareDiscreteState(state_vector(np.zeros(carts * TRAIL * 2)))
        self._routes = self.DeclareDiscreteState(state_vector(np.zeros(COLUMNS * ROUTES)))
        # Steps and decisions need the moves of one instant.
        moves = ValueProducer(lambda: AbstractValue.Make([]), self._calc_moves)
        self._moves = self.DeclareCacheEntry("moves", moves)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._decide)
        remembered = {self.discrete_state_ticket(self._memory)}
        self.DeclareVectorOutputPort("control", 2 * carts, self._calc_control)
        self.DeclareVectorOutputPort("emptying", carts, self._calc_emptying, remembered)
        self.DeclareVectorOutputPort("doing", carts, self._calc_doing, remembered)
        self.DeclareStateOutputPort("routes", self._routes)

    def _remembered(self, context) -> np.ndarray:
        return context.get_discrete_state(self._memory).value().reshape(-1, MEMORY)

    def _traffic_now(self, context) -> Traffic:
        now = context.get_time()
        modes = read(self._mode, context)
        # One that is full stands until a cart comes, and one that waits for others a while.
        stands = np.where(modes == FULL, math.inf, np.where(modes == BLOCKED, STANDS, 0.0))
        waits = np.maximum(self._traffic.waits - now, stands)
        return self._traffic._replace(
            progress=read(self._station, context), waits=waits, time=float(now)
        )

    def _moves_at(self, context) -> list[tuple[float, float, float, bool]]:
        return self._moves.Eval(context)  # type: ignore[return-value]  # the stubs say object

    def _calc_moves(self, context, output):
        """Speed, turn rate, way and whether it is stopped, of every cart."""
        traffic, modes = self._traffic_now(context), read(self._mode, context)
        states = read(self._state, context).reshape(-1, 4)
        lines = context.get_discrete_state(self._lines).value().reshape(-1, POINTS, 3)
        trails = context.get_discrete_state(self._trails).value().reshape(-1, TRAIL, 2)
        memories, planner = self._remembered(context), self._planner
        moves = []
        for k, memory in enumerate(memories):
            if memory[DOING] not in (EN_ROUTE, BESIDE, BACKING):
                moves.append((0.0, 0.0, memory[WAY], False))
                continue
            seen = seen_by(k, memories, lines, states, self._lanes, traffic, SOON, FAR)
            if memory[DOING] == BACKING:
                control, way = last_control(memory, trails[k]), memory[WAY]
                around = planner.ground, seen, self._outline, self._hitch, states[k]
                moves.append(back_up(*around, control, way, self._period))
                continue
            line, spacing, wish = wish_of(
                memory, lines[k], self._lanes, traffic, modes, self._period
            )
            moves.append(
                follow(
                    line,
                    spacing,
                    states[k],
                    memory[WAY],
                    wish,
                    planner.cart.turning_radius,
                    self._hitch,
                    self._outline,
                    planner.ground,
                    seen,
                    self._period,
                )
            )
        output.set_value(moves)

    def _outline_of(self, state: np.ndarray) -> np.ndarray:
        return outline_at(self._outline, self._hitch.length, self._hitch.hitch_offset, state)

    def _calc_control(self, context, output):
        output.set_value(np.array([move[:2] for move in self._moves_at(context)]).ravel())

    def _calc_emptying(self, context, output):
        output.set_value((self._remembered(context)[:, DOING] == AT_TRUCK).astype(float))

    def _calc_doing(self, context, output):
        output.set_value(self._remembered(context)[:, DOING])

    def _decide(self, context, discrete_state):
        memories = self._remembered(context).copy()
        lines = context.get_discrete_state(self._lines).value().reshape(-1, POINTS, 3)
        states = read(self._state, context).reshape(-1, 4)
        tasks, alongside = read(self._task, context), read(self._alongside, context)
        traffic, begins = self._traffic_now(context), self._traffic.waits
        trails = context.get_discrete_state(self._trails).value().reshape(-1, TRAIL, 2).copy()
        for k, move in enumerate(self._moves_at(context)):
            memory, state = memories[k], states[k]
            note_move(memory, trails[k], *move, traffic.time)
            note_task(memory, tasks[k], traffic.time)
            notice_arrival(memory, state, self._lanes, traffic)
            pours = abs(move[0]) < SLOW and (alongside == k).any()
            patience = patience_of(k, len(memories))
            looks, goes = deliberate(memory, self._lanes, traffic, patience=patience, pours=pours)
            if not looks:
                continue
            seen = seen_by(k, memories, lines, states, self._lanes, traffic, FORESEEN)
            placed, truck = self._outline_of(state), self._trucks[k]
            route = choose_route(
                memory, state, placed, seen, goes=goes, truck=truck, begins=begins, **self._means
            )
            if route is not None:
                lines = lines.copy()
                lines[k] = set_out(memory, route)
                discrete_state.set_value(self._lines, lines.ravel())
                record = discrete_state.value(self._routes)
                record = note_route(record, route, self._planner.cart)
                discrete_state.set_value(self._routes, record)
        discrete_state.set_value(self._trails, trails.ravel())
        discrete_state.set_value(self._memory, memories.ravel())
