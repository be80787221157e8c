"""Lands: which swaths each combine cuts, in which order, and which rings on its way to them."""

import numpy as np
from scipy.optimize import linear_sum_assignment

from ..turns.turn import turn_times
from .candidates import TURN_TIME, Candidate
from .driver import Driver, Gate, detours, drive_gate, find_gate, path_time, ring_groups
from .shared_rounds import share_ground
from .swaths import (
    OPEN,
    STANDS,
    Swath,
    SwathTimes,
    chain_swaths,
    left_neighbour,
    order_swaths,
    split_chain,
)

# Cost of driving a swath while crop stands on its left, where carts drive, as a part of the time
# that it takes [-].
CLOSED = 0.1

# How many times the swaths are divided into lands.
SHARINGS = 4


def drive_lands(drivers: list[Driver], candidate: Candidate, reach: float) -> list[list[int]]:
    """Drive all rings that are left and all swaths; return the numbers of each combine's swaths.

    Args:
        drivers: The combines, after the rounds.
        candidate: The way to cut the field.
        reach: How far a combine cuts until its tank is full [m].

    Raises:
        NoWay: One does not get to its work.
    """
    swaths = candidate.swaths
    groups = ring_groups(candidate.rounds)
    groups = [group for group in groups if group[0].number == len(candidate.rounds) - 1]
    gates = [find_gate(group, groups, swaths, drivers[0], drivers[0].roads) for group in groups]
    chain = chain_swaths(swaths)
    speeds = np.array([driver.combine.speed for driver in drivers])
    lengths = np.array([swaths[k].length for k in chain])
    times = lengths / speeds[:, None] + TURN_TIME
    for gate in gates:
        if gate.node is not None:
            times[:, chain.index(gate.node // 2)] += gate.length / speeds
    starts = np.array([path_time(driver.path, driver.combine) for driver in drivers])
    orders = _Orders(swaths, drivers, reach)
    lands = _share_lands(chain, times, starts, orders)
    shares: list[list[Gate]] = [[] for _ in drivers]
    for gate in gates:
        owners = [
            n for n, land in enumerate(lands) if gate.node is not None and gate.node // 2 in land
        ]
        away = [float(np.hypot(*(driver.pose - gate.start)[:2])) for driver in drivers]
        shares[owners[0] if owners else int(np.argmin(away))].append(gate)
    rests: list[list[int]] = []
    for number, (driver, land, mine) in enumerate(zip(drivers, lands, shares, strict=True)):
        mine.sort(key=lambda gate: gate.node is not None)
        for gate in mine:
            driver.go(gate.start)
            swath = None
            if gate.node is not None:
                swath = swaths[gate.node // 2].path(back=bool(gate.node % 2))
            drive_gate(driver, gate, swath, reach)
        done = {gate.node // 2 for gate in mine if gate.node is not None}
        land = [k for k in land if k not in done]
        if mine:
            order = order_swaths(_swath_times(swaths, land, done, driver, reach), number)
        else:
            # It still is where it was when the lands were shared.
            order = orders.best(number, land)[0]
        rests.append([2 * land[node // 2] + node % 2 for node in order])
    share_ground(drivers)
    for driver, order in zip(drivers, rests, strict=True):
        for node in order:
            swath = swaths[node // 2]
            driver.go(swath.pose(node % 2, outwards=False))
            driver.drive(swath.path(back=bool(node % 2)))
    return lands


class _Orders:
    """Orders of swaths in lands, from where the combines are; each is looked for once.

    Args:
        swaths: All of them.
        drivers: The combines.
        reach: How far a combine cuts until its tank is full [m].
    """

    def __init__(self, swaths: tuple[Swath, ...], drivers: list[Driver], reach: float) -> None:
        self.swaths, self.drivers, self._reach = swaths, drivers, reach
        self._known: dict[tuple[int, ...], tuple[list[int], float]] = {}

    def best(self, number: int, land: list[int]) -> tuple[list[int], float]:
        """Nodes of a land in order, and the time to get there and from swath to swath in it [s].

        Args:
            number: Of the combine.
            land: Numbers of its swaths.
        """
        if not land:
            return [], 0.0
        asked = number, *land
        if asked not in self._known:
            driver = self.drivers[number]
            times = _swath_times(self.swaths, land, set(), driver, self._reach)
            order = order_swaths(times, number)
            turning = times.first[order[0]] + times.between[order[:-1], order[1:]].sum()
            self._known[asked] = order, float(turning)
        return self._known[asked]


def _share_lands(
    chain: list[int], times: np.ndarray, starts: np.ndarray, orders: _Orders
) -> list[list[int]]:
    """The land of each combine, near to where it is, so that all end at nearly the same time.

    What a land takes is known only once its swaths are in order. The swaths are then divided again
    with these times; the division that ends first is kept.

    Args:
        chain: Numbers of swaths in order; lands are parts of it.
        times: Estimated for each swath of the chain, by the combine that cuts it, shape (N, m) [s].
        starts: When combines begin, shape (N,) [s].
        orders: Of swaths in lands.
    """
    drivers, swaths = orders.drivers, orders.swaths
    place = {k: number for number, k in enumerate(chain)}
    owners = np.arange(len(drivers))
    budgets = starts
    best: list[list[int]] = []
    earliest = np.inf
    for _ in range(SHARINGS):
        parts = [chain[part] for part in split_chain(times[owners], budgets[owners])]
        owners = _nearest_drivers(parts, drivers, swaths)
        lands = [parts[k] for k in np.argsort(owners)]
        reckoned = np.array(
            [own[[place[k] for k in land]].sum() for own, land in zip(times, lands, strict=True)]
        )
        ends = starts + reckoned
        for number, land in enumerate(lands):
            ends[number] += orders.best(number, land)[1] - TURN_TIME * len(land)
        if ends.max() < earliest:
            best, earliest = lands, float(ends.max())
        budgets = ends - reckoned
    return best


def _nearest_drivers(
    lands: list[list[int]], drivers: list[Driver], swaths: tuple[Swath, ...]
) -> np.ndarray:
    """Which combine takes each land, so that their ways there are short, shape (N,)."""
    away = np.zeros((len(lands), len(drivers)))
    for i, land in enumerate(lands):
        ends = np.array([swaths[k].ends for k in land]).reshape(-1, 2)
        for j, driver in enumerate(drivers):
            if len(ends):
                away[i, j] = np.hypot(*(ends - driver.pose[:2]).T).min()
    return np.asarray(linear_sum_assignment(away)[1])


def _swath_times(
    swaths: tuple[Swath, ...], land: list[int], done: set[int], driver: Driver, reach: float
) -> SwathTimes:
    """Times between the swaths of a land, and which of them open one another's left side."""
    combine = driver.combine
    mine = [swaths[k] for k in land]
    entries = np.array([s.pose(end, outwards=False) for s in mine for end in (0, 1)]).reshape(-1, 3)
    exits = np.array([s.pose(end, outwards=True) for s in mine for end in (1, 0)]).reshape(-1, 3)
    between = turn_times(exits[:, None], entries[None], combine)
    between = between + detours(exits, entries, driver)
    first = turn_times(driver.pose[None], entries, combine)
    first = first + detours(driver.pose[None], entries, driver)[0]
    number_of = {k: number for number, k in enumerate(land)} | dict.fromkeys([None, *done], OPEN)
    sides = [left_neighbour(swaths, k, back=back) for k in land for back in (False, True)]
    left = np.array([number_of.get(side, STANDS) for side in sides], dtype=np.int64)
    lengths = np.array([swath.length for swath in mine])
    closed = np.repeat(CLOSED * lengths / combine.speed, 2)
    return SwathTimes(between, first, left, closed, lengths / reach)
