"""Lands and rounds: who cuts which swaths in which order, and which arcs of the headland."""

import numpy as np
from scipy.optimize import linear_sum_assignment

from ..field.field import Field
from ..turns.turn import turn_times
from .candidates import TURN_TIME, Candidate
from .driver import (
    Driver,
    Gate,
    NoWay,
    detours,
    drive_gate,
    find_gate,
    lay_out_roads,
    path_time,
    ring_groups,
)
from .rounds import Arc, bay_shifts, come_ahead, drive_arc, line_up, split_loops
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


def drive_rounds(
    drivers: list[Driver], candidate: Candidate, field: Field, reach: float, *, adjacent: bool
) -> None:
    """Drive all rounds, each split into arcs for all combines, or each by one combine in turn.

    Args:
        drivers: The combines.
        candidate: The way to cut the field.
        field: The field.
        reach: How far a combine cuts until its tank is full [m].
        adjacent: Whether each round is driven by one combine.

    Raises:
        NoWay: The margin is too narrow, or one does not get to its work.
    """
    count, combine = len(drivers), drivers[0].combine
    wide = len(bay_shifts(drivers[0].ground)) > 0
    if adjacent:
        if count > 1 and not wide:
            raise NoWay("combines on adjacent rounds begin side by side on the margin: too narrow")
        line_up(drivers, candidate.rounds[0][0])
    begun: list[Arc] = []
    for number, loops in enumerate(candidate.rounds):
        outer = [loop for loop in loops if not loop.hole]
        if not outer:
            continue
        corners = number == 0 and (not wide or (count == 1 and len(outer[0].corners) > 0))
        team = drivers if not adjacent else [drivers[number % count]]
        preferred = None if number == 0 else np.array([driver.pose for driver in team])
        if adjacent and count > 1 and begun:
            come_ahead(team[0], begun, count, field.polygon)
            preferred = np.array([team[0].pose])
        if number > 0 and count == 1 and len(outer[0].corners):
            corners = True
        speeds = np.array([driver.combine.speed for driver in team])
        arcs = split_loops(outer, speeds, team[0].ground, preferred=preferred, corners=corners)
        begun.append(arcs[0])
        for driver, mine in zip(team, _share_arcs(team, arcs), strict=True):
            for arc in mine:
                drive_arc(driver, arc)
        share_ground(drivers)
        roads = lay_out_roads(
            candidate.region, [(number + 1) * combine.header_width / 2], combine.turning_radius
        )
        for driver in drivers:
            driver.roads = roads
        if number + 1 < len(candidate.rounds):
            _drive_early_rings(drivers, candidate, number, reach)


def _drive_early_rings(
    drivers: list[Driver], candidate: Candidate, number: int, reach: float
) -> None:
    """Drive rings whose outermost is of this round: the next one goes round their holes too."""
    groups = ring_groups(candidate.rounds)
    lanes = [loop for loop in candidate.rounds[number] if not loop.hole]
    for group in groups:
        if group[0].number == number:
            gate = find_gate(group, groups, (), drivers[0], lanes)
            away = [float(np.hypot(*(driver.pose - gate.start)[:2])) for driver in drivers]
            driver = drivers[int(np.argmin(away))]
            driver.go(gate.start)
            drive_gate(driver, gate, None, reach)
    share_ground(drivers)


def _share_arcs(drivers: list[Driver], arcs: list[Arc]) -> list[list[Arc]]:
    """Arcs of each combine: one that is near; those left over go to whoever has least to drive.

    At first combines are nowhere yet: then the faster ones drive the longer arcs.
    """
    speeds = np.array([driver.combine.speed for driver in drivers])
    if not drivers[0].paths:
        shares: list[list[Arc]] = [[] for _ in drivers]
        ranked = np.argsort(-speeds, kind="stable")
        if np.ptp(speeds) > 0.0:
            arcs = sorted(arcs, key=lambda arc: arc.begin - arc.end)
        for k, arc in enumerate(arcs):
            shares[ranked[k % len(drivers)]].append(arc)
        return shares
    away = np.array(
        [
            [np.hypot(*(arc.loop.pose(arc.begin) - driver.pose)[:2]) for arc in arcs]
            for driver in drivers
        ]
    )
    shares = [[] for _ in drivers]
    chosen = linear_sum_assignment(away)
    for who, which in zip(*chosen, strict=True):
        shares[who].append(arcs[which])
    for which in set(range(len(arcs))) - set(chosen[1].tolist()):
        lasting = [sum(arc.end - arc.begin for arc in mine) for mine in shares]
        shares[int(np.argmin(lasting / speeds))].append(arcs[which])
    return shares


def share_ground(drivers: list[Driver]) -> None:
    """Mark for all combines what any of them has cut."""
    cells = np.logical_and.reduce([driver.ground.crop.cells for driver in drivers])
    for driver in drivers:
        driver.ground.crop.cells[:] = cells
