"""Everything that is settled before a harvest begins: paths, lanes, ground, trucks, timetable."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from ...systems.numerics.harvest.field.coverage import CoveragePlan, plan_coverage
from ...systems.numerics.harvest.machines.team import pack_paths
from ...systems.numerics.harvest.routes.clearance import crop_under, outline, outline_at
from ...systems.numerics.harvest.routes.ground import Ground, Traffic, ground_of
from ...systems.numerics.harvest.routes.lane import lanes_beside
from ...systems.numerics.harvest.routes.meeting import SETTLE, Lanes
from ...systems.numerics.harvest.routes.planner import RoutePlanner
from ...systems.numerics.harvest.schedule.answer import (
    ScheduleAnswer,
    answer_schedule,
)
from ...systems.numerics.harvest.schedule.fleet import Fleet, Truck
from ...systems.numerics.harvest.schedule.timetable import Timetable
from ...systems.numerics.harvest.timetables.latest_starts import Service, plan_visits
from ...systems.numerics.harvest.timetables.work import work_of
from .scenario import Carts, HarvestScenario

# Where the first truck stands, as a part of the way round the field.
FIRST_TRUCK = 0.125
# How far on it may stand where there is no room [m].
FARTHER = 60.0
# Ways round standing crop are as long as along the sides of a square.
ROUNDABOUT = math.sqrt(2.0)


@dataclass(frozen=True, eq=False)
class HarvestJob:
    """A harvest that is ready to begin.

    Attributes:
        scenario: What was asked for.
        coverage: Paths of the combines.
        ground: Raster of the crop.
        traffic: The combines at time 0.
        lanes: Beside the combines.
        planner: Of routes.
        reach: From a combine's middle to its lane [m].
        begins: When each combine sets out, shape (N,) [s].
        trucks: Where each cart stands at its truck: x, y, theta of the tractor, shape (K, 3).
        starts: x, y, theta, beta of each cart at first, shape (K, 4).
        answer: Whether the carts can serve the combines.
        timetable: What is planned for the work that the combines really do.
    """

    scenario: HarvestScenario
    coverage: CoveragePlan
    ground: Ground
    traffic: Traffic
    lanes: Lanes
    planner: RoutePlanner
    reach: float
    begins: np.ndarray
    trucks: np.ndarray
    starts: np.ndarray
    answer: ScheduleAnswer
    timetable: Timetable


def prepare_harvest(scenario: HarvestScenario, folder: Path = Path()) -> HarvestJob:
    """Plan a harvest.

    Args:
        scenario: What is asked for.
        folder: Where the field's file is looked for.

    Raises:
        InvalidInput: The field cannot be read, or is too small for the header.
    """
    team, carts = scenario.combines, scenario.carts
    coverage = cover_field(scenario, folder)
    paths = coverage.paths
    reach = team.header_width / 2 + team.cart_gap + carts.width / 2
    begins = np.array([path.start_delay / team.speed for path in paths])
    packed = pack_paths(paths, scenario.density)
    traffic = Traffic(
        packed.starts,
        packed.stations,
        packed.poses,
        np.zeros(len(paths)),
        begins,
        0.0,
        team.speed,
        np.array([team.header_width / 2, team.width / 2, team.length]),
    )
    room = coverage.field.ground.buffer(-carts.width)
    beside = (lanes_beside(p, room, team.header_width, reach, carts.turning_radius) for p in paths)
    lanes = Lanes(carts, tuple(beside))
    ground = ground_of(coverage.field, coverage.crop_cells(scenario.cell))
    trucks = _truck_places(coverage, carts, ground, traffic)
    starts = np.column_stack([trucks, np.zeros(len(trucks))])
    answer, timetable = _schedule(scenario, coverage, lanes, reach, trucks)
    return HarvestJob(
        scenario,
        coverage,
        ground,
        traffic,
        lanes,
        RoutePlanner(carts, ground, exact=scenario.routes == "exact"),
        reach,
        begins,
        trucks,
        starts,
        answer,
        timetable,
    )


def cover_field(scenario: HarvestScenario, folder: Path = Path()) -> CoveragePlan:
    """Plan the combines' paths.

    Args:
        scenario: What is asked for.
        folder: Where the field's file is looked for.

    Raises:
        InvalidInput: The field cannot be read, or is too small for the header.
    """
    team = scenario.combines
    return plan_coverage(
        scenario.field.load(folder),
        team.header_width,
        team.turning_radius,
        team.count,
        spacing=team.spacing,
        least_gap=team.least_gap,
        length=team.length,
    )


def _truck_places(
    coverage: CoveragePlan, carts: Carts, ground: Ground, traffic: Traffic
) -> np.ndarray:
    """Places along the outer half of the margin, clockwise from where the first combine begins.

    Evenly round the field, a little farther on where a cart has no room, and not where the loops
    begin: all combines turn there.
    """
    field = coverage.field
    outside = field.outline.buffer(max(field.margin - carts.width, field.margin / 2), quad_segs=16)
    ring = shapely.Polygon(outside.exterior).exterior
    line = np.array(ring.coords)
    if ring.is_ccw:
        line = line[::-1]
    edge = shapely.LineString(line)
    start = edge.project(shapely.Point(coverage.paths[0].points[0]))
    points = outline(carts)

    def place_at(way: float) -> tuple[float, float, float]:
        at = (start + way) % edge.length
        here, there = edge.interpolate(at), edge.interpolate(min(at + 0.5, edge.length))
        return here.x, here.y, math.atan2(there.y - here.y, there.x - here.x)

    def has_room(place: tuple[float, float, float]) -> bool:
        placed = outline_at(points, carts.length, carts.hitch_offset, np.array([*place, 0.0]))
        return crop_under(ground, traffic, placed, 0.0, 0.0) == 0

    places = []
    for k in range(carts.count):
        way = edge.length * (FIRST_TRUCK + k / carts.count)
        tried = [place_at(way + on) for on in np.arange(0.0, FARTHER, carts.width)]
        places.append(next(filter(has_room, tried), tried[0]))
    return np.array(places)


def travel_times(coverage: CoveragePlan, speed: float, cart_speed: float, radius: float):
    """How long a cart's ways between combines take at most, as far as the field tells.

    The greatest distance of two combines that work at one time, overtaking at the cart's speed,
    and a turn round; shape (N, N) [s].

    Args:
        coverage: Who works where and when.
        speed: Of the combines [m/s].
        cart_speed: Of the carts [m/s].
        radius: Of a cart's turn [m].
    """
    count = len(coverage.paths)
    clock = np.linspace(0.0, coverage.timeline.clock[-1], 600)
    stations = [coverage.timeline.station_at(n, clock) for n in range(count)]
    poses = [path.pose_at(s) for path, s in zip(coverage.paths, stations, strict=True)]
    working = [
        (s > 0) & (s < path.length - 1e-6) for path, s in zip(coverage.paths, stations, strict=True)
    ]
    times = np.zeros((count, count))
    for n in range(count):
        for m in range(count):
            both = working[n] & working[m]
            if n != m:
                gaps = np.hypot(*(poses[n] - poses[m])[:, :2].T)[both]
                far = float(np.max(gaps, initial=0.0))
                times[n, m] = (far + math.tau * radius + SETTLE) / (cart_speed - speed)
    return times


def _schedule(
    scenario: HarvestScenario,
    coverage: CoveragePlan,
    lanes: Lanes,
    reach: float,
    trucks: np.ndarray,
) -> tuple[ScheduleAnswer, Timetable]:
    team, carts = scenario.combines, scenario.carts
    count = len(coverage.paths)
    if scenario.travel_time is None:
        times = travel_times(coverage, team.speed, carts.speed, carts.turning_radius)
    else:
        numbers = np.arange(count)
        times = scenario.travel_time * np.abs(numbers[:, None] - numbers)
    fleet = Fleet(
        capacities=(team.capacity,) * count,
        fill_rates=(team.fill_rate(scenario.density),) * count,
        unload_rates=(team.unload_rate,) * count,
        travel_times=tuple(tuple(float(t) for t in row) for row in times),
    )
    truck = None
    if math.isfinite(carts.capacity):
        corners = np.array(coverage.field.outline.exterior.coords)
        far = np.hypot(*(corners[:, None] - trucks[None, :, :2]).reshape(-1, 2).T).max()
        truck = Truck(
            cart_capacity=carts.capacity,
            travel_time=float(far) / carts.speed,
            unload_rate=carts.truck_rate,
        )
    answer = answer_schedule(fleet, carts.count, truck, scenario.fill, neighbours=True)
    works = [
        work_of(path, n, coverage.timeline, lanes.of[n], reach, scenario.density, team.speed)
        for n, path in enumerate(coverage.paths)
    ]
    service = Service(
        level=scenario.fill * team.capacity,
        capacity=team.capacity,
        rate=team.unload_rate,
        speed=carts.speed - team.speed,
        roundabout=ROUNDABOUT,
        settling=(math.tau * carts.turning_radius + SETTLE) / (carts.speed - team.speed),
        truck=truck,
    )
    orders = [cart.group.order for cart in answer.carts]
    return answer, plan_visits(works, orders, trucks[:, :2], service)
