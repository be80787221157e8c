"""Coverage: paths of combines that cut a whole field."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from ...errors import NoPlan, require, require_one_of
from ..field.field import Field
from ..machines import Combine, size_of
from ..paths import MachinePath
from ..turns.ground import Footprint, Ground
from ..turns.turn import combine_footprint, turn_times
from .candidates import (
    MOST_COMBINES,
    TURN_TIME,
    Candidate,
    Passes,
    find_candidates,
    park,
    start_in_bay,
)
from .cut_ground import WITHIN, CutGround, covered_area
from .driver import (
    Driver,
    Gate,
    NoWay,
    detours,
    drive_gate,
    find_gate,
    lay_out_roads,
    ring_groups,
    stop_time,
)
from .loops import crop_to_offset
from .precedence import MOST_UNDER_BODIES, CropPrecedence, can_finish, find_precedence
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

# Patterns of coverage.
PATTERNS = ("lands", "thesis")

# How many sound ways to cut a field are compared, how many of a number of rounds are tried before
# others, and how many are tried at most.
BUILT = 3
FOREMOST = 4
MOST_TRIED = 24

# Margins that are tried where there is none, to tell whether one would do [m].
WIDER = (6.0, 12.0, 24.0)

# Least share of the crop that a plan cuts, and the same with three holes and more, or where nothing
# else is found [-].
LEAST_COVERAGE = 0.995
LEAST_COVERAGE_AT_ALL = 0.985

# A path's curvature at most, times the least radius of turns: polylines along arcs turn a little
# more sharply [-].
SHARPER = 1.1

# What it costs to drive a swath while crop stands on its left, where carts drive, as a part of the
# time that it takes [-].
CLOSED = 0.1

# How often lands are shared out.
SHARINGS = 4


@dataclass(frozen=True, eq=False)
class CoveragePaths:
    """Paths of all combines that together cut a field.

    Attributes:
        paths: Of the combines.
        precedence: What must be cut before.
        area: Of the crop [m^2].
        covered_area: Of the crop that is cut [m^2].
        times: Estimates of when each combine has driven its path, without waiting, shape (N,) [s].
        off_paths: Whether each begins, and ends, farther than a gap from all other paths, shape
            (N, 2).
    """

    paths: tuple[MachinePath, ...]
    precedence: CropPrecedence
    area: float
    covered_area: float
    times: np.ndarray
    off_paths: np.ndarray

    @property
    def coverage(self) -> float:
        """Share of the crop that is cut, in [0, 1]."""
        return self.covered_area / self.area

    @property
    def length(self) -> float:
        """Way of all combines [m]."""
        return sum(path.length for path in self.paths)


def find_coverages(
    field: Field, combines: Sequence[Combine], *, pattern: str = "lands", reach: float = np.inf
) -> Iterator[CoveragePaths]:
    """Ways to cut a whole field: the first BUILT that were found, the quickest first, then others.

    Args:
        field: The field.
        combines: They, of one size.
        pattern: "lands": rounds in arcs, then a land of swaths for each combine; "thesis": rounds
            from the perimeter inwards, combines on adjacent ones (Zhang 2014, Figure 3.8).
        reach: How far a combine cuts until its tank is full [m].

    Raises:
        InvalidInput: A value is out of its range.
        NoPlan: There is none.
    """
    size = size_of(combines)
    require_one_of("pattern", pattern, PATTERNS)
    require(
        size.header_width > size.width,
        "header_width",
        f"be larger than the body's width of {size.width:g} m",
        size.header_width,
    )
    faults: list[tuple[bool, str]] = []
    every = _sound_coverages(field, combines, pattern, reach, faults)
    first = sorted(itertools.islice(every, BUILT), key=lambda coverage: coverage.times.max())
    if not first:
        told = [f" ({fault})" for _, fault in sorted(faults, key=lambda each: each[0])[:1]]
        raise NoPlan(
            f"`field` must have room for {len(combines)} combines with headers of "
            f"{size.header_width:g} m and turns of {size.turning_radius:g} m; "
            f"got {field.area / 1e4:.2f} ha with a margin of {field.margin:g} m"
            + "".join(told)
            + _wider_margin(field, combines, pattern, reach)
        )
    yield from first
    yield from every


def _wider_margin(field: Field, combines: Sequence[Combine], pattern: str, reach: float) -> str:
    """Which margin would do where this one does not, in words; empty if none does."""
    for margin in WIDER:
        if margin > field.margin:
            wider = replace(field, margin=margin)
            if next(_sound_coverages(wider, combines, pattern, reach, []), None) is not None:
                return f"; a margin of {margin:g} m would do"
    return ""


def _sound_coverages(
    field: Field,
    combines: Sequence[Combine],
    pattern: str,
    reach: float,
    faults: list[tuple[bool, str]],
) -> Iterator[CoveragePaths]:
    """Coverages that do what they should, one by one; those that leave more crop come last.

    `faults` is told what is wrong with others, after whether they cannot even be driven: of those
    that can, it tells more.
    """
    size = size_of(combines)
    region = crop_to_offset(field, size)
    ground = CutGround.of(field, combines[0])
    candidates = find_candidates(field, region, ground, inwards=pattern == "thesis")
    bare, footprint = Ground(field.ground.buffer(-WITHIN)), combine_footprint(size)
    sharpest = SHARPER / size.turning_radius
    least = LEAST_COVERAGE_AT_ALL if len(field.obstacles) >= 3 else LEAST_COVERAGE
    patchy = []
    for candidate in _spread(candidates):
        try:
            plan = _build(field, combines, candidate, ground, reach, adjacent=pattern == "thesis")
        except NoWay as fault:
            faults.append((True, str(fault)))
            continue
        wrong = _what_is_wrong(plan, bare, footprint, sharpest)
        if wrong:
            faults.append((False, wrong))
        elif plan.coverage < least:
            patchy.append(plan)
        else:
            yield plan
    yield from sorted(patchy, key=lambda plan: -plan.coverage)


def _what_is_wrong(plan: CoveragePaths, bare: Ground, footprint: Footprint, sharpest: float) -> str:
    """Why a plan will not do; empty if it will.

    Args:
        plan: The plan.
        bare: What combines keep to.
        footprint: Of each.
        sharpest: Curvature of paths, at most [1/m].
    """
    if plan.coverage < LEAST_COVERAGE_AT_ALL:
        return f"{plan.coverage:.1%} would be cut"
    if not can_finish(plan.precedence):
        return "combines would wait for one another"
    under = plan.precedence.crop_under_bodies / plan.area
    if under > MOST_UNDER_BODIES:
        return f"bodies would drive over {under:.2%} of the crop"
    if not all(bare.admits(path, footprint) for path in plan.paths):
        return "combines would leave the ground"
    if any(np.abs(path.curvatures).max(initial=0.0) > sharpest for path in plan.paths):
        return "combines would turn too sharply"
    return ""


def _spread(candidates: list[Candidate]) -> list[Candidate]:
    """The same, with no more than FOREMOST of a number of rounds before those of other numbers."""
    places: dict[int, int] = {}
    turns = []
    for candidate in candidates:
        place = places.get(len(candidate.rounds), 0)
        places[len(candidate.rounds)] = place + 1
        turns.append(place // FOREMOST)
    order = sorted(range(len(candidates)), key=lambda k: turns[k])
    return [candidates[k] for k in order][:MOST_TRIED]


def _build(
    field: Field,
    combines: Sequence[Combine],
    candidate: Candidate,
    uncut: CutGround,
    reach: float,
    *,
    adjacent: bool,
) -> CoveragePaths:
    size = size_of(combines)
    width = size.header_width
    depths = [len(candidate.rounds) * width / 2, width / 2]
    roads = lay_out_roads(candidate.region, depths, size.turning_radius)
    if not roads:
        raise NoWay("no room for a round")
    drivers = [Driver(uncut.copy_for(combine), []) for combine in combines]
    _drive_rounds(drivers, candidate, field, reach, adjacent=adjacent)
    for driver in drivers:
        driver.roads = roads
    lands = _drive_swaths(drivers, candidate, reach)
    off_paths = _wait_off_paths(field, uncut, drivers, candidate, lands)
    paths = tuple(driver.path for driver in drivers)
    covered = covered_area(field, paths, size)
    each = zip(paths, combines, strict=True)
    times = np.array([driving_time(path, combine) for path, combine in each])
    precedence = find_precedence(field, paths, size)
    return CoveragePaths(paths, precedence, field.area, covered, times, off_paths)


def driving_time(path: MachinePath, combine: Combine) -> float:
    """Time to drive a path, with a stop at each change of gear [s]."""
    return path.length / combine.speed + (len(path.cusps) + 1) * stop_time(combine)


def _drive_rounds(
    drivers: list[Driver], candidate: Candidate, field: Field, reach: float, *, adjacent: bool
) -> None:
    """Drive all rounds, each in arcs of all combines, or each by one of them in turn."""
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
        _share_ground(drivers)
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
    """Rings whose outermost is of this round: the next round goes round their holes too."""
    groups = ring_groups(candidate.rounds)
    lanes = [loop for loop in candidate.rounds[number] if not loop.hole]
    for group in groups:
        if group[0].number == number:
            gate = find_gate(group, groups, (), drivers[0], lanes)
            away = [float(np.hypot(*(driver.pose - gate.start)[:2])) for driver in drivers]
            driver = drivers[int(np.argmin(away))]
            driver.go(gate.start)
            drive_gate(driver, gate, None, reach)
    _share_ground(drivers)


def _share_arcs(drivers: list[Driver], arcs: list[Arc]) -> list[list[Arc]]:
    """Which arcs each combine drives: the nearest; what is left over goes to who has least.

    At first none is nearest: then the quicker ones drive the longer arcs.
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


def _share_ground(drivers: list[Driver]) -> None:
    """What one has cut is cut for all from here on."""
    cells = np.logical_and.reduce([driver.ground.crop.cells for driver in drivers])
    for driver in drivers:
        driver.ground.crop.cells[:] = cells


def _wait_off_paths(
    field: Field,
    uncut: CutGround,
    drivers: list[Driver],
    candidate: Candidate,
    lands: list[list[int]],
) -> np.ndarray:
    if len(drivers) > MOST_COMBINES:
        raise NoWay(f"no more than {MOST_COMBINES} combines are told apart")
    passes = Passes(field, drivers[0].combine)
    for machine, driver in enumerate(drivers):
        passes.add(driver.path, machine)
    off_paths = np.zeros((len(drivers), 2), dtype=bool)
    for machine, driver in enumerate(drivers):
        off_paths[machine, 0] = start_in_bay(driver, uncut, passes, machine)
    parked: list[np.ndarray] = []
    for machine, (driver, land) in enumerate(zip(drivers, lands, strict=True)):
        swaths = [candidate.swaths[k] for k in land]
        off_paths[machine, 1] = park(driver, passes, machine, swaths, parked)
        parked.append(driver.pose)
    return off_paths


def _drive_swaths(drivers: list[Driver], candidate: Candidate, reach: float) -> list[list[int]]:
    """Drive all rings that are left and all swaths; the swaths of each combine, by number."""
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
    starts = np.array([driving_time(driver.path, driver.combine) for driver in drivers])
    lands = _share_lands(chain, times, starts, drivers, swaths, reach)
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
        order = order_swaths(_swath_times(swaths, land, done, driver, reach), number)
        rests.append([2 * land[node // 2] + node % 2 for node in order])
    _share_ground(drivers)
    for driver, order in zip(drivers, rests, strict=True):
        for node in order:
            swath = swaths[node // 2]
            driver.go(swath.pose(node % 2, outwards=False))
            driver.drive(swath.path(back=bool(node % 2)))
    return lands


def _share_lands(
    chain: list[int],
    times: np.ndarray,
    starts: np.ndarray,
    drivers: list[Driver],
    swaths: tuple[Swath, ...],
    reach: float,
) -> list[list[int]]:
    """The land of each combine, near to where it is, so that all end at nearly the same time.

    What a land takes is known once its swaths are in order; where that is not what was reckoned
    with, lands are shared out anew.

    Args:
        chain: Swaths, of which lands are parts.
        times: That are reckoned with for each of the chain, by who cuts it, shape (N, m) [s].
        starts: When combines begin, shape (N,) [s].
        drivers: The combines.
        swaths: All of them.
        reach: How far a combine cuts until its tank is full [m].
    """
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
        for number, (land, driver) in enumerate(zip(lands, drivers, strict=True)):
            turning = _turning_time(swaths, land, driver, number, reach)
            ends[number] += turning - TURN_TIME * len(land)
        if ends.max() < earliest:
            best, earliest = lands, float(ends.max())
        budgets = ends - reckoned
    return best


def _turning_time(
    swaths: tuple[Swath, ...], land: list[int], driver: Driver, seed: int, reach: float
) -> float:
    """What it takes to get to a land from where a combine is, and from swath to swath [s]."""
    if not land:
        return 0.0
    times = _swath_times(swaths, land, set(), driver, reach)
    order = order_swaths(times, seed)
    return float(times.first[order[0]] + times.between[order[:-1], order[1:]].sum())


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
