"""The plan of a harvest: paths that cut the field, and times and visits of all machines."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, islice
from typing import NamedTuple

import numpy as np
import shapely

from ...errors import (
    InvalidInput,
    NoPlan,
    require,
    require_finite,
    require_positive,
    require_type,
    require_whole,
)
from ..carts.cart_plan import CartPlan, Failure, Stop, Supply, ended
from ..carts.visits import serve_combines
from ..coverage.plan_coverage import BUILT, CoveragePaths, find_coverages
from ..coverage.precedence import crop_under_bodies, find_precedence
from ..field.field import Field
from ..field.yield_map import YieldMap, mean_density
from ..machines import Cart, Combine, CombineSize, combine_outline, size_of
from ..paths import TimedPath
from ..timing.sweep import grid_stations, sweep_of
from ..timing.timed_drive import Journey
from ..timing.timetable import MachineTimetable, Standstill, time_machines, with_stops
from ..trucks import TruckFleet

# If combines wait for no more than this part of their time, they wait for slivers of crop as well.
LITTLE_WAITING = 0.03
# Largest share of the crop that bodies may drive over, at the planned times, because nobody waits
# for it; the audit, which finds as much, allows 0.002 [-].
MOST_TRODDEN = 0.0019
# Parts of the crop that bodies may still drive over which are given up for slivers, tried in this
# order: less if more would be too much at the planned times.
SLIVERS = (1.0, 0.5, 0.25)
# How many plans of the combines are tried, where carts cannot serve them.
TEAMS = 6
# Where the first truck stands, as a part of the way round the field, and how much farther round in
# each further try.
FIRST_TRUCK = 0.125
OTHER_TRUCK = 0.38
# Largest distance from the place of a truck to where its cart is emptied, and from a gate to the
# edge of the field [m].
NEAR_TRUCK = 60.0
# Part of a tank that a combine can surely fill without a cart.
SURE = 0.9
# Straight pieces of work that are shorter than this are no way for a cart [m].
SHORTEST_LINE = 30.0
# Carts come to a truck and leave it on a stretch of this length [m] that bends no more than this
# [rad].
RUN = 20.0
STRAIGHT = 0.6
# Least distance between a cart at its truck and all combines [m].
FREE = 1.0


@dataclass(frozen=True, eq=False)
class CombinePlan:
    """Paths and times of all combines, and the orders that they keep if something goes wrong.

    Attributes:
        field: What is cut.
        machines: The combines, N of one size.
        coverage: Their paths.
        timetable: Their times, and the orders at all places where paths meet.
        journeys: Their paths with the ground that they cover.
    """

    field: Field
    machines: tuple[Combine, ...]
    coverage: CoveragePaths
    timetable: MachineTimetable
    journeys: tuple[Journey, ...]

    @property
    def size(self) -> CombineSize:
        """Size of the combines."""
        return size_of(self.machines)

    @property
    def paths(self) -> tuple[TimedPath, ...]:
        """Timed paths of the combines."""
        return self.timetable.paths

    @property
    def makespan(self) -> float:
        """When the last combine has arrived where it parks [s]."""
        return self.timetable.makespan

    @property
    def makespan_over_bound(self) -> float:
        """The makespan divided by that of always full headers at top speed, no unit."""
        cuts = sum(combine.header_width * combine.speed for combine in self.machines)
        bound = self.field.area / cuts
        return self.makespan / bound

    @property
    def waiting(self) -> float:
        """Part of the combines' time that they wait for one another, no unit."""
        return float(self.timetable.waiting.sum()) / (self.makespan * len(self.paths))


def plan_combines(
    field: Field,
    combines: Sequence[Combine],
    *,
    pattern: str = "lands",
    seed: int = 0,
    reach: float = np.inf,
) -> CombinePlan:
    """Plan how combines cut a field: the one of the best ways to cut it that takes least time.

    Args:
        field: The field.
        combines: The combines, all of one size.
        pattern: Of the paths; see `find_coverages`.
        seed: Random seed of the orders that are tried.
        reach: How far a combine cuts until its tank is full [m].

    Raises:
        InvalidInput: A value is out of its range or of another type.
        NoPlan: The combines cannot cut the field, or block one another.
    """
    _require_team(field, combines, seed)
    require(reach > 0, "reach", "be positive", reach)
    return next(find_combine_plans(field, combines, pattern=pattern, seed=seed, reach=reach))


def _require_team(field: Field, combines: Sequence[Combine], seed: int) -> None:
    """Refuse arguments of wrong types, before planning asks them for what they do not have."""
    require_type("field", field, Field)
    require_type("combines", combines, Sequence)
    require(len(combines) > 0, "combines", "be one at least", "none")
    for number, combine in enumerate(combines):
        require_type(f"combines[{number}]", combine, Combine)
    require_whole("seed", seed, 0)


def find_combine_plans(
    field: Field,
    combines: Sequence[Combine],
    *,
    pattern: str = "lands",
    seed: int = 0,
    reach: float = np.inf,
) -> Iterator[CombinePlan]:
    """Yield plans of combines: the best ways to cut a field, quickest first, then other ways.

    Ways in which combines would block one another, or drive over too much crop, are left out.

    Args:
        field: The field.
        combines: The combines, all of one size.
        pattern: Of the paths; see `find_coverages`.
        seed: Random seed of the orders that are tried.
        reach: How far a combine cuts until its tank is full [m].

    Raises:
        InvalidInput: A value is out of its range.
        NoPlan: There is none.
    """
    best: list[CombinePlan] = []
    blocked: list[Standstill | TroddenCrop] = []
    every = find_coverages(field, combines, pattern=pattern, reach=reach)
    untimed: list[CoveragePaths] = []
    for number, coverage in enumerate(every):
        if best and coverage.times.max() >= min(plan.makespan for plan in best):
            untimed = [coverage]
            break
        plan = _time(field, combines, coverage, seed)
        if isinstance(plan, CombinePlan):
            best.append(plan)
        else:
            blocked.append(plan)
        if best and number + 1 >= BUILT:
            break
    if not best and not any(isinstance(each, Standstill) for each in blocked):
        raise NoPlan(
            f"`header_width` must be larger, got {combines[0].header_width:g} m: {blocked[0]} in "
            f"the first of {len(blocked)} ways to cut the field"
        )
    if not best:
        blocked.sort(key=lambda each: isinstance(each, TroddenCrop))
        raise NoPlan(
            f"`combines` must be fewer, for they would block one another in all of {len(blocked)} "
            f"ways to cut the field, as in the first of them: {blocked[0]}"
        )
    yield from sorted(best, key=lambda plan: plan.makespan)
    for coverage in chain(untimed, every):
        plan = _time(field, combines, coverage, seed)
        if isinstance(plan, CombinePlan):
            yield plan


class TroddenCrop(NamedTuple):
    """Combines that do not wait for slivers of crop would drive over more crop than they may.

    Attributes:
        share: Share of the crop that they would drive over [-].
    """

    share: float

    def __str__(self) -> str:
        """One line."""
        return f"bodies would drive over {self.share:.2%} of the crop"


def _time(
    field: Field, combines: Sequence[Combine], coverage: CoveragePaths, seed: int
) -> CombinePlan | Standstill | TroddenCrop:
    """Times for a way to cut a field; if waits are long, slivers of crop are not waited for."""
    size = size_of(combines)
    outline = combine_outline(size)
    journeys = [
        Journey(
            path, sweep_of(path, outline, grid_stations(path)), combine.speed, combine.acceleration
        )
        for path, combine in zip(coverage.paths, combines, strict=True)
    ]
    plan = _time_journeys(field, combines, coverage, journeys, seed)
    if isinstance(plan, CombinePlan) and plan.waiting <= LITTLE_WAITING:
        return plan
    for part in SLIVERS:
        precedence = find_precedence(field, coverage.paths, size, slivers=part)
        if not precedence.given_up:
            break
        eager = replace(coverage, precedence=precedence)
        other = _time_journeys(field, combines, eager, journeys, seed)
        if isinstance(other, CombinePlan):
            later = isinstance(plan, CombinePlan) and plan.makespan <= other.makespan
            return plan if later else other
        if isinstance(other, Standstill):
            break
    return plan


def _time_journeys(
    field: Field,
    combines: Sequence[Combine],
    coverage: CoveragePaths,
    journeys: Sequence[Journey],
    seed: int,
) -> CombinePlan | Standstill | TroddenCrop:
    precedence = coverage.precedence
    needs = {
        (m, n): precedence.needed_at(m, n, journey.sweep.stations)
        for m, journey in enumerate(journeys)
        for n, needed in enumerate(precedence.needs[m])
        if n != m and needed.any()
    }
    timetable = time_machines(journeys, needs, seed=seed)
    if isinstance(timetable, Standstill):
        return timetable
    if precedence.given_up:
        size = size_of(combines)
        share = crop_under_bodies(field, timetable.paths, size) / field.area
        if share > MOST_TRODDEN:
            return TroddenCrop(share)
    return CombinePlan(field, tuple(combines), coverage, timetable, tuple(journeys))


@dataclass(frozen=True, eq=False)
class HarvestPlan:
    """When every machine is where, and when grain flows.

    Attributes:
        combines: Paths and times of the combines, without stops for carts.
        cart: Each of the carts.
        supply: Crop and trucks.
        service: What carts do, and the times of combines with their stops.
    """

    combines: CombinePlan
    cart: Cart
    supply: Supply
    service: CartPlan

    @property
    def makespan(self) -> float:
        """When the last machine has done its work [s]."""
        ends = [plan.end for plan in self.service.plans]
        return max([*ends, *(motion.timed.end for motion in self.service.motions)])


def plan_harvest(
    field: Field,
    combines: Sequence[Combine],
    cart: Cart,
    *,
    carts: int,
    density: float | YieldMap,
    truck_rate: float = 300.0,
    trucks: TruckFleet | None = None,
    strategy: str = "sequential",
    threshold: float = 0.5,
    visits: str = "revised",
    pattern: str = "lands",
    seed: int = 0,
    failure: Failure | None = None,
    team: CombinePlan | None = None,
    progress: Callable[[str, float], None] = lambda stage, share: None,
) -> HarvestPlan:
    """Plan a whole harvest.

    If carts cannot serve the best plan of the combines, other plans of them are tried, with trucks
    elsewhere if the field has no places for these.

    Args:
        field: The field.
        combines: The combines, all of one size.
        cart: One of the equal carts.
        carts: How many.
        density: Of the crop [kg/m^2].
        truck_rate: Rate at which a cart is emptied into its truck [kg/s].
        trucks: What takes the grain; by default one for each cart, which holds any amount.
        strategy: Order in which combines are served, "sequential" or "on-demand"; see
            `serve_combines`.
        threshold: Part of a tank that has to be filled before a cart comes.
        visits: Whether visits are given up for others where a combine would have to wait,
            "revised" or "greedy"; see `serve_combines`.
        pattern: Of the combines' paths; see `find_coverages`.
        seed: Random seed of the orders that are tried.
        failure: Failure of a cart. Nobody knows of it until it happens, so that driving this plan
            is the same as planning anew when the cart fails.
        team: The plan of these combines, if there is one already.
        progress: Called with what is being done and the share that is done, in [0, 1].

    Raises:
        InvalidInput: A value is out of its range or of another type; the margin has no room for
            carts, or the only cart fails.
        NoPlan: The combines cannot cut the field, or block one another, or a cart can never get to
            a combine or to its truck.
    """
    _require_team(field, combines, seed)
    require_type("cart", cart, Cart)
    require_whole("carts", carts, 1)
    if not isinstance(density, YieldMap):
        require_positive("density", density)
    require_positive("truck_rate", truck_rate)
    require_finite("threshold", threshold)
    require(0 < threshold <= 1, "threshold", "lie above 0 and up to 1", threshold)
    progress("paths and times of the combines", 0.0)
    reach = tank_reach(field, combines, density)
    teams = find_combine_plans(field, combines, pattern=pattern, seed=seed, reach=reach)
    stage = "visits and routes of the carts"

    def served(team: CombinePlan, first_truck: float, failure: Failure | None) -> HarvestPlan:
        progress(stage, 0.0)
        supply = Supply(
            density=density,
            trucks=truck_places(team, cart, carts, first_truck),
            truck_rate=truck_rate,
            truck_fleet=trucks or TruckFleet(count=carts),
        )

        def retime(stops: Sequence[Stop]) -> list[TimedPath]:
            return [ended(plan) for plan in with_stops(team.timetable, team.journeys, stops)]

        service = serve_combines(
            field,
            combines,
            cart,
            team.paths,
            swath_lines(team),
            supply,
            retime,
            strategy,
            threshold,
            failure,
            lambda share: progress(stage, share),
            visits,
        )
        return HarvestPlan(team, cart, supply, service)

    faults: list[NoPlan] = []
    for number, each in enumerate(islice(teams, TEAMS) if team is None else [team]):
        first_truck = FIRST_TRUCK + number * OTHER_TRUCK
        try:
            return served(each, first_truck, failure)
        except NoPlan as fault:
            faults.append(fault)
        except InvalidInput:
            # Trucks may have no room elsewhere: then the first failure is raised.
            if not faults:
                raise
        if failure is not None:
            # If this plan works without the failure, nobody would have chosen another one.
            try:
                served(each, first_truck, None)
            except InvalidInput:
                continue
            break
    raise faults[0]


def tank_reach(field: Field, combines: Sequence[Combine], density: float | YieldMap) -> float:
    """How far a combine can surely cut before its tank is full [m].

    Args:
        field: The field.
        combines: The combines.
        density: Of the crop [kg/m^2].
    """
    grain = mean_density(density, field.polygon) * size_of(combines).header_width
    return SURE * min(each.capacity for each in combines) / grain if grain else math.inf


def swath_lines(team: CombinePlan) -> list[np.ndarray]:
    """Straight pieces of work, along which carts may drive, two points each (2, 2) [m]."""
    lines = []
    for timed in team.paths:
        path = timed.path
        straight = np.abs(path.curvatures) < 1e-6
        for k in np.flatnonzero(path.cutting & straight & (path.lengths > SHORTEST_LINE)):
            lines.append(path.poses[k : k + 2, :2])
    return lines


def truck_places(
    team: CombinePlan, cart: Cart, count: int, first: float = FIRST_TRUCK
) -> np.ndarray:
    """Poses of the tractor beside trucks on the margin, shape (K, 3).

    They are near the field's places for trucks, else as near to its gates as there is room, else
    about evenly spaced round it. Carts have room there from the beginning on, and no combine ever
    comes there.

    Args:
        team: Paths of the combines.
        cart: One of the equal carts.
        count: Of carts.
        first: Where the first truck stands if none has a place, as a part of the way round.

    Raises:
        InvalidInput: The margin has no room for so many, or none near the places of trucks.
        NoPlan: It has, but combines pass there.
    """
    field = team.field
    # Not as far out as carts may drive: they swing out a little where they come in.
    ring = field.outline.buffer(
        max(field.margin - cart.width - FREE, field.margin / 2), quad_segs=16
    ).exterior
    line = np.array(ring.coords)
    # Carts drive round the field as the combines of the first round do.
    edge = shapely.LineString(line[::-1] if ring.is_ccw else line)
    ways = np.arange(0.0, edge.length, SHORTEST_LINE / 4)
    here, there = (
        shapely.get_coordinates(shapely.line_interpolate_point(edge, way))
        for way in (ways, np.minimum(ways + 0.5, edge.length))
    )
    course = np.arctan2(*(there - here).T[::-1])
    poses = np.column_stack([here, course])
    rear, front = cart.length * 1.28 + cart.hitch_offset, cart.tractor_ends[1]
    outlines = _boxes(poses, -rear - FREE / 2, front + FREE / 2, cart.width / 2 + FREE / 2)
    fits = shapely.covers(field.ground.difference(field.outline), outlines)
    bent = _bends(course, math.ceil(RUN / (SHORTEST_LINE / 4))) > STRAIGHT
    choose = partial(_choose_places, field, count, first, edge, (ways, here), bent)
    # What has no room even without combines is no matter of their plan.
    choose(fits)
    passed = []
    for timed in team.paths:
        along = timed.path.pose_at(timed.path.stations_every(FREE))
        for part in combine_outline(team.size):
            passed.append(_boxes(along, part[0, 0], part[1, 0], part[2, 1]))
    near = shapely.STRtree(np.concatenate(passed)).query(outlines, "dwithin", distance=FREE)
    fits[near[0]] = False
    try:
        return poses[choose(fits)]
    except InvalidInput as fault:
        raise NoPlan(*fault.args) from None


def _choose_places(
    field: Field,
    count: int,
    first: float,
    edge: shapely.LineString,
    stations: tuple[np.ndarray, np.ndarray],
    bent: np.ndarray,
    fits: np.ndarray,
) -> list[int]:
    """Which of the places along the edge carts are emptied at.

    Args:
        field: Its places for trucks and its gates are asked.
        count: Of carts.
        first: As in `truck_places`.
        edge: Where the places lie.
        stations: How far along it each lies [m], shape (n,), and where that is [m], shape (n, 2).
        bent: Which of them are taken only if no other is left, shape (n,).
        fits: Which of them have room, shape (n,).

    Raises:
        InvalidInput: There is no room for so many, or none near the places of trucks.
    """
    ways, here = stations
    places = field.trucks if len(field.trucks) else field.gates
    chosen: list[int] = []
    for k in range(count):
        if len(places):
            ideal = edge.project(shapely.Point(places[k % len(places)]))
        else:
            ideal = edge.length * ((first + k / count) % 1.0)
        apart = np.abs((ways - ideal + edge.length / 2) % edge.length - edge.length / 2)
        # Where the way bends, as at the tip of a star, is chosen only if no straight part is left.
        apart[bent] += edge.length
        apart[~fits] = np.inf
        for other in chosen:
            apart[np.hypot(*(here - here[other]).T) < SHORTEST_LINE] = np.inf
        require(
            bool(np.isfinite(apart).any()),
            "margin",
            f"have room for {count} carts beside combines",
            field.margin,
        )
        if len(places):
            place = places[k % len(places)]
            far = np.hypot(*(here - place).T)
            most = NEAR_TRUCK + SHORTEST_LINE * (k // len(places))
            # Trucks drive in at a gate and on along the margin; where they have a place, they stay.
            free = np.isfinite(apart) if len(field.trucks) else np.ones(len(apart), dtype=bool)
            nearest = far[free].min()
            near_enough = f"have room for cart {k} within {most:g} m of ({place[0]:.1f}, "
            near_enough += f"{place[1]:.1f}) on the margin"
            require(bool(nearest <= most), "trucks", near_enough, f"{nearest:.0f} m")
            if len(field.trucks):
                apart[far > most] = np.inf
        chosen.append(int(np.argmin(apart)))
    return chosen


def _bends(course: np.ndarray, reach: int) -> np.ndarray:
    """How much a closed way bends in the neighbourhood of each point, shape (n,) [rad].

    Args:
        course: Heading at its points, shape (n,) [rad].
        reach: How many points before and behind belong to the neighbourhood.
    """
    near = np.stack([np.roll(course, k) for k in range(-reach, reach + 1)])
    return np.ptp(np.unwrap(near, axis=0), axis=0)


def _boxes(poses: np.ndarray, rear: float, front: float, half: float) -> np.ndarray:
    """Rectangles in the frames of poses."""
    c, s = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
    ahead, aside = np.array([rear, front, front, rear]), np.array([-half, -half, half, half])
    x, y = poses[:, :1] + c * ahead - s * aside, poses[:, 1:2] + s * ahead + c * aside
    return np.asarray(shapely.polygons(np.stack([x, y], axis=-1)))
