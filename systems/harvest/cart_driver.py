"""Drivers of the carts: routes to where they are sent, and steering along them."""

import math

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require_positive
from ..numerics.harvest.machines.cart import hitch_of
from ..numerics.harvest.machines.filling import BLOCKED, FULL, STANDING_MODES
from ..numerics.harvest.routes.clearance import gap_to_combines, outline, outline_at
from ..numerics.harvest.routes.driver_memory import (
    AT_TRUCK,
    BACK,
    BACKING,
    BESIDE,
    DEPART,
    DOING,
    EN_ROUTE,
    FAILS,
    LANE,
    MEMORY,
    NEWEST,
    OLDEST,
    POINTS,
    RESTING,
    RETRY,
    SPACING,
    STUCK,
    TARGET,
    TRAIL,
    WAY,
    evenly,
)
from ..numerics.harvest.routes.driving import backs_into, follow, will_be_met
from ..numerics.harvest.routes.ground import Traffic
from ..numerics.harvest.routes.meeting import Lanes
from ..numerics.harvest.routes.planner import Route, RoutePlanner
from ..numerics.harvest.strategies.serving import STAY, TRUCK

# Between two tries to find a route, and how long something may be in the way before another
# route is looked for [s].
AGAIN, PATIENCE = 4.0, 10.0
# How near to its lane a cart has found it; how near a combine is if a cart without a route backs
# up [m]; after how many tries it does so anyhow.
FOUND, WEDGED, HOPELESS = 5.0, 8.0, 3
# For how long a combine that waits for others is expected to stand on, and how soon one would be
# where a cart without a route gives way [s].
STANDS, IN_THE_WAY = 60.0, 60.0


class CartDriver(LeafSystem):
    """Plans a route to each task, drives it, and keeps beside the combine.

    On the way the cart keeps its full speed; beside a combine it follows the lane of the loop at
    the combine's speed, v = v_c + (gap to its place) / 2 s. It stops before standing crop, before
    combines and before carts of lower numbers, and looks for another route if that lasts. One that
    finds none, and stands where a combine will come, gives way to its truck; one that cannot do
    that either backs up the way it came, control by control.

    .. pydrake_system::

        name: CartDriver
        input_ports:
        - task
        - state
        - station
        - mode
        output_ports:
        - control
        - emptying
        - doing

    ========  ====  ================  =======
    port      size  unit              frame
    ========  ====  ================  =======
    task      K     -                 -
    state     4 K   m, m, rad, rad    world
    station   N     m                 path
    mode      N     -                 -
    control   2 K   m/s, rad/s        tractor
    emptying  K     -                 -
    doing     K     -                 -
    ========  ====  ================  =======

    `task` is what a scheduler says; `emptying` is 1 while a cart stands at its truck; `doing` is
    0 resting, 1 on its way, 2 beside a combine, 3 at its truck, 4 backing up.

    Source: Zhang 2014, 3.5 (time-optimal paths); the rest is ours.

    Args:
        planner: Plans routes.
        lanes: Beside the combines.
        traffic: The combines' paths and speed, at time 0.
        trucks: Where each cart stands at its truck: x, y, theta of the tractor, shape (K, 3).
        period: Time step [s].

    Raises:
        InvalidInput: The period is not positive.
    """

    def __init__(
        self,
        planner: RoutePlanner,
        lanes: Lanes,
        traffic: Traffic,
        trucks: np.ndarray,
        *,
        period: float,
    ):
        super().__init__()
        require_positive("period", period)
        self._planner, self._lanes, self._traffic = planner, lanes, traffic
        self._trucks = np.array(trucks, dtype=float)
        self._period = float(period)
        self._outline, self._hitch = outline(planner.cart), hitch_of(planner.cart)
        carts, combines = len(self._trucks), len(lanes.of)
        self._task = self.DeclareVectorInputPort("task", carts)
        self._state = self.DeclareVectorInputPort("state", 4 * carts)
        self._station = self.DeclareVectorInputPort("station", combines)
        self._mode = self.DeclareVectorInputPort("mode", combines)
        memory = np.zeros((carts, MEMORY))
        memory[:, TARGET], memory[:, STUCK], memory[:, SPACING] = STAY, math.inf, 1.0
        self._memory = self.DeclareDiscreteState(state_vector(memory.ravel()))
        self._lines = self.DeclareDiscreteState(state_vector(np.zeros(carts * POINTS * 3)))
        self._trails = self.DeclareDiscreteState(state_vector(np.zeros(carts * TRAIL * 2)))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._decide)
        remembered = {self.discrete_state_ticket(self._memory)}
        self.DeclareVectorOutputPort("control", 2 * carts, self._calc_control)
        self.DeclareVectorOutputPort("emptying", carts, self._calc_emptying, remembered)
        self.DeclareVectorOutputPort("doing", carts, self._calc_doing, remembered)

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

    def _moves(self, context) -> list[tuple[float, float, float, bool]]:
        """Speed, turn rate, way and whether it is stopped, of every cart."""
        traffic, modes = self._traffic_now(context), read(self._mode, context)
        states = read(self._state, context).reshape(-1, 4)
        lines = context.get_discrete_state(self._lines).value().reshape(-1, POINTS, 3)
        outlines = [self._outline_of(state) for state in states]
        trails = context.get_discrete_state(self._trails).value().reshape(-1, TRAIL, 2)
        moves = []
        for k, memory in enumerate(self._remembered(context)):
            if memory[DOING] == BACKING:
                moves.append(self._back(memory, trails[k], states[k], traffic))
                continue
            line, spacing, wish = self._wish(memory, lines[k], traffic, modes)
            others = np.concatenate([np.empty((0, 2)), *outlines[:k]])
            moves.append(
                follow(
                    line,
                    spacing,
                    states[k],
                    memory[WAY],
                    wish,
                    self._planner.cart.turning_radius,
                    self._hitch,
                    self._outline,
                    self._planner.ground,
                    traffic,
                    others,
                    self._period,
                )
                if memory[DOING] in (EN_ROUTE, BESIDE)
                else (0.0, 0.0, memory[WAY], False)
            )
        return moves

    def _back(
        self, memory: np.ndarray, trail: np.ndarray, state: np.ndarray, traffic: Traffic
    ) -> tuple[float, float, float, bool]:
        """The last control of the trail the other way round: the trailer retraces its way too."""
        v, omega = -trail[int(memory[NEWEST] - 1) % TRAIL]
        if backs_into(traffic, self._outline, self._hitch, state, v, omega, self._period):
            return 0.0, 0.0, memory[WAY], True
        return v, omega, memory[WAY] + v * self._period, False

    def _outline_of(self, state: np.ndarray) -> np.ndarray:
        return outline_at(self._outline, self._hitch.length, self._hitch.hitch_offset, state)

    def _wish(
        self, memory: np.ndarray, line: np.ndarray, traffic: Traffic, modes: np.ndarray
    ) -> tuple[np.ndarray, float, float]:
        """The line that a cart follows, its spacing, and the speed that it would drive at."""
        if memory[DOING] == EN_ROUTE:
            if traffic.time < memory[DEPART] - 1e-9:
                return line, memory[SPACING], 0.0
            left = memory[SPACING] * (POINTS - 1) - memory[WAY]
            return line, memory[SPACING], min(self._planner.cart.speed, left / self._period)
        if memory[DOING] != BESIDE:
            return line, 1.0, 0.0
        combine, number = int(memory[TARGET]), int(memory[LANE])
        speed = 0.0 if modes[combine] in STANDING_MODES else traffic.speed
        station = float(traffic.progress[combine])
        wish = self._lanes.speed_beside(combine, number, station, speed, memory[WAY])
        return self._lanes.of[combine][number].points, 1.0, wish

    def _calc_control(self, context, output):
        output.set_value(np.array([move[:2] for move in self._moves(context)]).ravel())

    def _calc_emptying(self, context, output):
        output.set_value((self._remembered(context)[:, DOING] == AT_TRUCK).astype(float))

    def _calc_doing(self, context, output):
        output.set_value(self._remembered(context)[:, DOING])

    def _decide(self, context, discrete_state):
        memories = self._remembered(context).copy()
        lines = context.get_discrete_state(self._lines).value()
        states = read(self._state, context).reshape(-1, 4)
        tasks = read(self._task, context)
        traffic, now = self._traffic_now(context), context.get_time()
        trails = context.get_discrete_state(self._trails).value().reshape(-1, TRAIL, 2).copy()
        for k, (v, omega, way, stopped) in enumerate(self._moves(context)):
            memory = memories[k]
            memory[WAY] = way
            if v > 0.0:
                trails[k, int(memory[NEWEST]) % TRAIL] = v, omega
                memory[NEWEST] += 1
                memory[OLDEST] = max(memory[OLDEST], memory[NEWEST] - TRAIL)
            elif v < 0.0:
                memory[NEWEST] -= 1
            memory[STUCK] = min(memory[STUCK], now) if stopped else math.inf
            if memory[TARGET] != tasks[k]:
                memory[TARGET], memory[DOING], memory[RETRY] = tasks[k], RESTING, now
            self._arrive(memory, states[k], traffic)
            done = memory[WAY] <= 0.0 or memory[NEWEST] <= memory[OLDEST]
            if memory[DOING] == BACKING and (done or now - memory[STUCK] > PATIENCE):
                memory[DOING] = RESTING
            lasting = memory[DOING] in (EN_ROUTE, BESIDE) and now - memory[STUCK] > PATIENCE
            if (memory[DOING] == RESTING or lasting) and now >= memory[RETRY]:
                route = self._route(k, memory, states[k], traffic)
                if route is None and self._is_in_the_way(states[k], traffic):
                    route = self._planner.plan(traffic, states[k], now, self._at_truck(k))
                memory[FAILS] = 0 if route is not None else memory[FAILS] + 1
                memory[RETRY] = now + AGAIN * min(1 + memory[FAILS], 5)
                if route is None and self._is_wedged(memory, states[k], traffic):
                    memory[DOING], memory[WAY] = BACKING, BACK
                if route is not None:
                    memory[DOING], memory[WAY], memory[STUCK] = EN_ROUTE, 0.0, math.inf
                    memory[DEPART] = route.depart
                    line, memory[SPACING] = evenly(route)
                    lines = lines.copy()
                    lines[3 * POINTS * k : 3 * POINTS * (k + 1)] = line.ravel()
                    discrete_state.set_value(self._lines, lines)
        discrete_state.set_value(self._trails, trails.ravel())
        discrete_state.set_value(self._memory, memories.ravel())

    def _arrive(self, memory: np.ndarray, state: np.ndarray, traffic: Traffic) -> None:
        """Notice the end of a way, or of a lane."""
        station = float(traffic.progress[max(target := int(memory[TARGET]), 0)])
        numbers = self._lanes.numbers_at(target, station) if target >= 0 else []
        if memory[DOING] == EN_ROUTE and memory[WAY] >= memory[SPACING] * (POINTS - 1) - 0.5:
            if target == TRUCK:
                memory[DOING] = AT_TRUCK
            elif numbers:
                memory[WAY], gap, memory[LANE] = self._lanes.nearest(target, station, state)
                memory[DOING] = BESIDE if gap < FOUND else RESTING
            else:
                memory[DOING] = RESTING
        elif memory[DOING] == BESIDE and memory[LANE] not in numbers:
            memory[DOING] = RESTING

    def _route(
        self, cart: int, memory: np.ndarray, state: np.ndarray, traffic: Traffic
    ) -> Route | None:
        if (target := int(memory[TARGET])) == STAY:
            return None
        at_truck = [self._at_truck(cart)]
        ways = at_truck if target == TRUCK else self._lanes.meetings(traffic, target)
        routes = (self._planner.plan(traffic, state, traffic.time, each) for each in ways)
        return next(filter(None, routes), None)

    def _at_truck(self, cart: int):
        return lambda time: self._trucks[cart]

    def _is_wedged(self, memory: np.ndarray, state: np.ndarray, traffic: Traffic) -> bool:
        """Whether a cart has no way forward, for a combine that is near or for long."""
        if memory[TARGET] == STAY or memory[NEWEST] <= memory[OLDEST]:
            return False
        near = gap_to_combines(traffic, self._outline_of(state), traffic.time)
        return near < WEDGED or memory[FAILS] >= HOPELESS

    def _is_in_the_way(self, state: np.ndarray, traffic: Traffic) -> bool:
        """Whether a combine would run into a cart that stays where it is."""
        waits = np.maximum(self._traffic.waits - traffic.time, 0.0)
        return will_be_met(traffic._replace(waits=waits), self._outline_of(state), IN_THE_WAY)
