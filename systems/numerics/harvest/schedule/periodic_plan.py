"""Periodic plans of a round by linear programming, for fleets of any make, as timetables.

With the cart beside each combine for the durations s_i, and travel times d_i between, the load
that visit i finds is r_f times the time since the cart left that combine; it is linear in the
s_i. Tanks and cart set bounds, and so every question about the round is a linear programme:
the longest and the shortest period, and how much slower the cart could drive. For equal
combines the answers are those of (3.1) to (3.10).

Where a cart that empties every tank has no plan, it may leave grain behind, for its next visit:
because it is full, or because another combine needs it sooner.
"""

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linprog

from ...errors import require
from .fleet import Fleet, Round

Vector = NDArray[np.float64]

# Tolerance by which answers of linear programmes may miss a bound.
ACCURACY = 1e-9


@dataclass(frozen=True)
class Visit:
    """A cart's stay beside one combine.

    Attributes:
        combine: Its number.
        arrive: The cart is there [s].
        start_unloading: Grain flows [s].
        emptied: The tank is empty, or as empty as the plan or the cart's room makes it [s].
        leave: The cart drives off [s]; from `emptied` on the tank stays as it is.
        load_at_start: Of the tank, when unloading starts [kg].
        taken: Grain that the cart took over [kg].
        by_truck: Whether the cart drives by the truck next.
        cart: The cart's number.
    """

    combine: int
    arrive: float
    start_unloading: float
    emptied: float
    leave: float
    load_at_start: float
    taken: float
    by_truck: bool = False
    cart: int = 0

    @property
    def wait(self) -> float:
        """How long the cart stays with an emptied combine, t_n of the thesis [s]."""
        return self.leave - self.emptied


@dataclass(frozen=True)
class LoadLine:
    """A load over time, linear between breakpoints and constant beyond them.

    Attributes:
        times: Breakpoints in order, (m,) [s].
        loads: What is held then, (m,) [kg].
    """

    times: NDArray[np.float64]
    loads: NDArray[np.float64]

    def __call__(self, times: ArrayLike) -> NDArray[np.float64]:
        """The load at any times, of their shape [kg]."""
        return np.interp(np.asarray(times, dtype=np.float64), self.times, self.loads)


@dataclass(frozen=True)
class Timetable:
    """Visits in order of their start, and loads.

    Attributes:
        visits: Of all carts.
        tanks: Load of each combine's tank, (N,).
        carts: Load of each cart, (K,).
        lost: Grain that ran over at each combine, (N,) [kg].
        overflows: When each tank that ran over first did so: combine to time [s].
    """

    visits: tuple[Visit, ...]
    tanks: tuple[LoadLine, ...]
    carts: tuple[LoadLine, ...]
    lost: tuple[float, ...]
    overflows: dict[int, float]

    def of_cart(self, cart: int) -> tuple[Visit, ...]:
        """The visits of one cart, in order."""
        return tuple(visit for visit in self.visits if visit.cart == cart)


class Aim(Enum):
    """What a plan makes as large as it can."""

    FULL_TANKS = "full tanks"  # the longest period: the cart drives least, as in the thesis
    EARLY = "early"  # the shortest period: the tanks stay as empty as they can


@dataclass(frozen=True)
class PeriodicPlan:
    """A round with times, repeated for ever; time 0 is the start of its first visit.

    Attributes:
        fleet: The combines.
        round: The visits.
        period: Time after which a cart repeats all [s]; if several carts make the round, each comes
            to a combine an equal part of it after the one before.
        starts: Of unloading, (V,) [s].
        emptied: When the tank is as empty as it gets, (V,) [s].
        leaves: When the cart leaves, (V,) [s].
        loads_at_start: Of the tank that each visit finds, (V,) [kg].
        taken: What the cart takes over in each visit, (V,) [kg].
        left_over: What it leaves in the tank, (V,) [kg].
    """

    fleet: Fleet
    round: Round
    period: float
    starts: tuple[float, ...]
    emptied: tuple[float, ...]
    leaves: tuple[float, ...]
    loads_at_start: tuple[float, ...]
    taken: tuple[float, ...]
    left_over: tuple[float, ...]

    @property
    def waits(self) -> tuple[float, ...]:
        """How long the cart stays with each combine after unloading it, (V,) [s]."""
        return tuple(leave - empty for leave, empty in zip(self.leaves, self.emptied, strict=True))

    @property
    def stagger(self) -> tuple[float, ...]:
        """When each combine, empty, begins to cut, so that all repeats from the start, (N,) [s].

        Relative to time 0; infinite for combines that the round does not serve.
        """
        begins = [math.inf] * self.fleet.size
        for visit in reversed(range(self.round.size)):
            combine = self.round.combines[visit]
            filling = self.loads_at_start[visit] / self.fleet.fill_rates[combine]
            begins[combine] = self.starts[visit] - filling
        return tuple(begins)


def plan_round(
    fleet: Fleet,
    round_: Round,
    fill: float = 1.0,
    aim: Aim = Aim.FULL_TANKS,
    period: float | None = None,
) -> PeriodicPlan | None:
    """The periodic plan of a round, or None if there is none.

    Among the plans that are as good, waits are as even as they can be.

    Args:
        fleet: The combines.
        round_: The visits.
        fill: Part of each tank, and of the cart, that the plan uses; above 0 up to 1.
        aim: Which of the possible periods is taken; the longest if the shortest is zero.
        period: This period instead [s].

    Raises:
        InvalidInput: The fill is not above 0 and up to 1.
    """
    require(0 < fill <= 1, "fill", "lie above 0 and up to 1", fill)
    if _is_alone(round_):
        return _plan_alone(fleet, round_, fill, period)
    for leaves_grain in (False, True):
        plan = _plan(_Model(fleet, round_, fill, leaves_grain), aim, period)
        if plan is not None:
            return plan
    return None


def _plan(model: "_Model", aim: Aim, period: float | None) -> PeriodicPlan | None:
    """The plan of one model."""
    if period is None:
        signs = (-1.0,) if aim is Aim.FULL_TANKS else (1.0, -1.0)
        found = [model.solve(sign * model.period_row) for sign in signs]
        # Where nothing is driven, visits of no length to empty tanks solve all equations.
        periods = [model.period_of(best) for best in found if best is not None]
        period = next((each for each in periods if each > ACCURACY * model.time_unit), None)
        if period is None:
            return None
    even = model.solve_evenly(period)
    return None if even is None else model.plan_of(even)


def travel_scale_max(fleet: Fleet, round_: Round, fill: float = 1.0) -> float:
    """The largest factor on all travel times with which the round has a plan.

    Infinite if nothing is to be driven; negative or less than 1: as it is, it has none. Minus
    infinity if even driving in no time does not help.

    Args:
        fleet: The combines.
        round_: The visits.
        fill: Part of each tank, and of the cart, that the plan uses.
    """
    if _is_alone(round_) or not any(round_.travel_times):
        possible = plan_round(fleet, round_, fill) is not None
        return math.inf if possible else -math.inf
    best = _Model(fleet, round_, fill, leaves_grain=True).solve_scale()
    return -math.inf if best is None else best


def _is_alone(round_: Round) -> bool:
    """Whether a cart stands by one combine and has nowhere else to go."""
    return set(round_.combines) == {round_.combines[0]} and round_.truck is None


def _plan_alone(fleet: Fleet, round_: Round, fill: float, period: float | None) -> PeriodicPlan:
    """One combine, one cart: it comes when the tank is full, and goes when it is empty.

    In a shorter period it comes earlier, in a longer one it stays for longer.
    """
    combine = round_.combines[0]
    rate, net = fleet.fill_rates[combine], fleet.net_rate(combine)
    load = fill * fleet.capacities[combine]
    if period is None:
        period = load / net + load / rate
    load = min(load, period / (1.0 / net + 1.0 / rate))
    leave = max(period - load / rate, load / net)
    return PeriodicPlan(
        fleet=fleet,
        round=round_,
        period=period,
        starts=(0.0,),
        emptied=(load / net,),
        leaves=(leave,),
        loads_at_start=(load,),
        taken=(load + rate * leave,),
        left_over=(0.0,),
    )


class _Model:
    """The linear programme; its unknowns are V loads, V waits, and V amounts that are left over.

    They are in units of a tank and of the time that one takes to fill. Row by row: load_i = what
    was left over + r_f (sum of stays and ways since the cart last left that combine), where a stay
    is (load - left over) / (r_u - r_f) + wait, and a way by the truck takes in addition as long as
    the grain of its block takes to unload.
    """

    def __init__(self, fleet: Fleet, round_: Round, fill: float, leaves_grain: bool) -> None:
        self.fleet, self.round = fleet, round_
        size = round_.size
        numbers = list(round_.combines)
        self._load_unit = np.array([fleet.capacities[n] for n in numbers])
        self.time_unit = max(fleet.filling_time(n) for n in numbers)
        rates = np.array([fleet.fill_rates[n] for n in numbers])
        net = np.array([fleet.net_rate(n) for n in numbers])
        eye, none = np.eye(size), np.zeros((size, size))
        loads = np.hstack([eye * self._load_unit[:, None], none, none])
        left = np.hstack([none, none, eye * self._load_unit[:, None]])
        self._waits = np.hstack([none, eye * self.time_unit, none])
        self._stays = (loads - left) / net[:, None] + self._waits
        self._taken = loads - left + rates[:, None] * self._stays
        # Ways: constant part, part that grows with what the truck gets, part that a scale acts on.
        self._ways = np.zeros((size, 3 * size))
        self._stops = np.zeros(size)
        self._driven = np.array(round_.travel_times)
        # No more is left than was there.
        rows = [(left - loads) / self._load_unit[:, None]]
        truck = round_.truck
        if truck is not None:
            for visit in np.flatnonzero(round_.trips):
                grain = self._taken[round_.block(int(visit))].sum(axis=0)
                self._ways[visit] = grain / truck.unload_rate
                self._stops[visit] = truck.stop_time
                rows.append(grain[None, :] / (fill * truck.cart_capacity))
        self._rows = np.vstack(rows)
        self._limits = np.append(np.zeros(size), np.ones(len(self._rows) - size))
        # What has passed since the cart last left the combine of each visit: a row of ones.
        since = np.zeros((size, size))
        since_ways = np.zeros((size, size))
        before = np.zeros((size, size))
        for visit in range(size):
            for back in range(1, round_.previous(visit) + 1):
                since_ways[visit, (visit - back) % size] += 1.0
                if back < round_.previous(visit):
                    since[visit, (visit - back) % size] += 1.0
            before[visit, (visit - round_.previous(visit)) % size] = 1.0
        if round_.carts > 1:
            # Since the cart before left: an equal part of the round, less the stay itself.
            since = np.full((size, size), 1.0 / round_.carts) - np.eye(size)
            since_ways = np.full((size, size), 1.0 / round_.carts)
        unit = (rates / self._load_unit)[:, None]
        self._equal = (loads - before @ left) / self._load_unit[:, None] - unit * (
            since @ self._stays + since_ways @ self._ways
        )
        self._since_ways = unit * since_ways
        self._equal_stops = self._since_ways @ self._stops
        self._equal_driven = self._since_ways @ self._driven
        tank, wait = (0.0, fill), (0.0, None)
        kept = (0.0, fill if leaves_grain else 0.0)
        self._bounds: list[tuple[float | None, float | None]] = [
            *[tank] * size,
            *[wait] * size,
            *[kept] * size,
        ]
        self.period_row = (self._stays + self._ways).sum(axis=0) / self.time_unit
        self._period_rest = float(self._stops.sum() + self._driven.sum())

    def period_of(self, unknowns: Vector) -> float:
        return float(self.period_row @ unknowns) * self.time_unit + self._period_rest

    def solve(self, cost: Vector) -> Vector | None:
        """The unknowns of least cost at the travel times as they are."""
        return _optimum(
            cost,
            self._rows,
            self._equal,
            self._equal_stops + self._equal_driven,
            self._bounds,
            self._limits,
        )

    def solve_scale(self) -> float | None:
        """The largest factor on all travel times."""
        equal = np.hstack([self._equal, -self._equal_driven[:, None]])
        rows = np.hstack([self._rows, np.zeros((len(self._rows), 1))])
        cost = np.zeros(equal.shape[1])
        cost[-1] = -1.0
        bounds = [*self._bounds, (None, None)]
        best = _optimum(cost, rows, equal, self._equal_stops, bounds, self._limits)
        return None if best is None else float(best[-1])

    def solve_evenly(self, period: float) -> Vector | None:
        """The unknowns with a given period that make the shortest wait as long as it can be."""
        size = self.round.size
        equal = np.vstack([self._equal, self.period_row])
        equal = np.hstack([equal, np.zeros((size + 1, 1))])
        right = (period - self._period_rest) / self.time_unit
        sides = np.append(self._equal_stops + self._equal_driven, right)
        # least - wait_i <= 0 beside the other rows.
        least = np.hstack([-self._waits / self.time_unit, np.ones((size, 1))])
        others = np.hstack([self._rows, np.zeros((len(self._rows), 1))])
        cost = np.append(np.zeros(3 * size), -1.0)
        limits = np.append(np.zeros(size), self._limits)
        best = _optimum(
            cost, np.vstack([least, others]), equal, sides, [*self._bounds, (0.0, None)], limits
        )
        return None if best is None else best[:-1]

    def plan_of(self, unknowns: Vector) -> PeriodicPlan:
        """The plan in [s] and [kg]; loads follow from the rest without the solver's tolerance."""
        size = self.round.size
        rest = np.maximum(unknowns[size:], 0.0)
        sides = self._equal_stops + self._equal_driven - self._equal[:, size:] @ rest
        exact = np.concatenate([np.linalg.lstsq(self._equal[:, :size], sides)[0], rest])
        if not np.allclose(exact, unknowns, rtol=0, atol=1e-6):
            # Nothing is driven and nothing waited: loads are only known up to a factor.
            exact = unknowns
        stays, loads = self._stays @ exact, exact[:size] * self._load_unit
        ways = self._driven + self._stops + self._ways @ exact
        starts = np.concatenate([[0.0], np.cumsum(stays + ways)[:-1]])
        leaves = starts + stays
        return PeriodicPlan(
            fleet=self.fleet,
            round=self.round,
            period=float((stays + ways).sum()),
            starts=tuple(starts.tolist()),
            emptied=tuple((leaves - self._waits @ exact).tolist()),
            leaves=tuple(leaves.tolist()),
            loads_at_start=tuple(loads.tolist()),
            taken=tuple((self._taken @ exact).tolist()),
            left_over=tuple((exact[2 * size :] * self._load_unit).tolist()),
        )


def _optimum(
    cost: Vector,
    rows: Vector,
    equal: Vector,
    sides: Vector,
    bounds: list[tuple[float | None, float | None]],
    limits: Vector | None = None,
) -> Vector | None:
    """The x of least cost @ x with rows @ x <= limits and equal @ x = sides, or None.

    Args:
        cost: Shape (n,).
        rows: Of inequalities, shape (m, n); m may be 0.
        equal: Rows of equations, shape (k, n).
        sides: Their right sides, shape (k,).
        bounds: Least and greatest value of each unknown, n pairs; None: no bound.
        limits: Right sides of the inequalities, shape (m,); None: ones.
    """
    answer = linprog(
        cost,
        A_ub=rows if len(rows) else None,
        b_ub=(np.ones(len(rows)) if limits is None else limits) if len(rows) else None,
        A_eq=equal,
        b_eq=sides,
        bounds=bounds,
        method="highs",
        options={"primal_feasibility_tolerance": ACCURACY, "dual_feasibility_tolerance": ACCURACY},
    )
    return np.asarray(answer.x) if answer.status == 0 else None
