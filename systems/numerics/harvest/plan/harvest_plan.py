"""The plan of a harvest: paths, times and visits of all machines."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
import shapely

from ...errors import InvalidInput, require
from ..carts.cart_plan import CartPlan, Failure, Supply
from ..carts.stops import Stop, ended
from ..carts.visits import serve_combines
from ..field.field import Field
from ..field.yield_map import YieldMap
from ..machines.cart import Cart
from ..machines.combine import Combine
from ..machines.outlines import combine_outline
from ..machines.trucks import TruckFleet
from ..no_plan import NoPlan
from ..paths.timed_path import TimedPath
from ..timing.timetable import with_stops
from .combine_plan import CombinePlan, find_combine_plans

# How many ways for the combines are tried, where carts cannot serve them.
TEAMS = 6
# Where the first truck stands, as a part of the way round the field, and how much farther round in
# each further try.
FIRST_TRUCK = 0.125
OTHER_TRUCK = 0.38
# How far a cart is emptied from the place of its truck, at most [m].
NEAR_TRUCK = 60.0
# Straight pieces of work that are shorter are no way for a cart [m].
SHORTEST_LINE = 30.0
# Carts come to a truck and leave it on a way that is about straight for so long [m], [rad].
RUN = 20.0
STRAIGHT = 0.6
# Between a cart at its truck and all combines, at least [m].
FREE = 1.0


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

    Where carts cannot serve the combines as they would cut the field best, others of their ways to
    cut it are tried, with trucks elsewhere if these have no places.

    Args:
        field: The field.
        combines: They, of one size.
        cart: One of the equal carts.
        carts: How many.
        density: Of the crop [kg/m^2].
        truck_rate: At which a cart is emptied into its truck [kg/s].
        trucks: What takes the grain; by default one that holds any amount.
        strategy: Order in which combines are served, "sequential" or "on-demand"; see
            `serve_combines`.
        threshold: Part of a tank from which on carts come.
        visits: Whether visits are given up for others where a combine would have to wait,
            "revised" or "greedy"; see `serve_combines`.
        pattern: Of the combines' paths; see `plan_coverage`.
        seed: Of the orders that are tried.
        failure: Of a cart: what comes after it is planned as if nobody had known of it before. So
            who drives this plan does the same as who plans anew when the cart fails.
        team: The plan of these combines, if there is one already.
        progress: Told what is done, and which part of it, in [0, 1].

    Raises:
        InvalidInput: The margin has no room for carts, or the only cart fails.
        NoPlan: The combines cannot cut the field, or block one another, or a cart can never get to
            a combine or to its truck.
    """
    progress("paths and times of the combines", 0.0)
    teams = find_combine_plans(field, combines, pattern=pattern, seed=seed)
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
            # Another way may leave no room for trucks: the first one's reason is told.
            if not faults:
                raise
        if failure is not None:
            # Nobody would have planned otherwise for a failure that was to come.
            try:
                served(each, first_truck, None)
            except InvalidInput:
                continue
            break
    raise faults[0]


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

    They are near the places where the field has room for trucks, else near its gates, else about
    evenly round it. There carts have room from the beginning on, and no combine ever comes there.

    Args:
        team: Paths of the combines.
        cart: One of the equal carts.
        count: Of carts.
        first: Where the first truck stands that has no place, as a part of the way round.

    Raises:
        InvalidInput: The margin has no room for so many, or none near the places of trucks.
    """
    field = team.field
    # Not as far out as carts may drive: there a cell less is open where a field lies aslant.
    ring = field.outline.buffer(
        max(field.margin - cart.width, field.margin / 2), quad_segs=16
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
    margin = field.ground.difference(field.outline)
    fits = shapely.covers(margin, outlines)
    passed = []
    for timed in team.paths:
        along = timed.path.pose_at(timed.path.stations_every(FREE))
        for part in combine_outline(team.size):
            passed.append(_boxes(along, part[0, 0], part[1, 0], part[2, 1]))
    near = shapely.STRtree(np.concatenate(passed)).query(outlines, "dwithin", distance=FREE)
    fits[near[0]] = False
    bent = _bends(course, math.ceil(RUN / (SHORTEST_LINE / 4))) > STRAIGHT
    places = field.trucks if len(field.trucks) else field.gates
    chosen: list[int] = []
    for k in range(count):
        if len(places):
            ideal = edge.project(shapely.Point(places[k % len(places)]))
        else:
            ideal = edge.length * ((first + k / count) % 1.0)
        apart = np.abs((ways - ideal + edge.length / 2) % edge.length - edge.length / 2)
        # Where the way bends, as at the tip of a star, only if it is straight nowhere.
        apart[bent] += edge.length
        apart[~fits] = np.inf
        for other in chosen:
            apart[np.hypot(*(here - here[other]).T) < SHORTEST_LINE] = np.inf
        chosen.append(int(np.argmin(apart)))
        require(
            bool(np.isfinite(apart[chosen[-1]])),
            "margin",
            f"have room for {count} carts beside combines",
            field.margin,
        )
        if len(places):
            place = places[k % len(places)]
            far = float(np.hypot(*(here[chosen[-1]] - place)))
            most = NEAR_TRUCK + SHORTEST_LINE * (k // len(places))
            near_enough = f"have room for cart {k} within {most:g} m of ({place[0]:.1f}, "
            near_enough += f"{place[1]:.1f}) on the margin"
            require(far <= most, "trucks", near_enough, f"{far:.0f} m")
    return poses[chosen]


def _bends(course: np.ndarray, reach: int) -> np.ndarray:
    """How much a closed way bends within so many points of each, shape (n,) [rad].

    Args:
        course: At its points, shape (n,) [rad].
        reach: How many, before and behind.
    """
    near = np.stack([np.roll(course, k) for k in range(-reach, reach + 1)])
    return np.ptp(np.unwrap(near, axis=0), axis=0)


def _boxes(poses: np.ndarray, rear: float, front: float, half: float) -> np.ndarray:
    """Rectangles in the frames of poses."""
    c, s = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
    ahead, aside = np.array([rear, front, front, rear]), np.array([-half, -half, half, half])
    x, y = poses[:, :1] + c * ahead - s * aside, poses[:, 1:2] + s * ahead + c * aside
    return np.asarray(shapely.polygons(np.stack([x, y], axis=-1)))
