"""Plans of carts, and the world that they are planned in, are as they were recorded."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.world import world_from_polygon
from sightfield.systems.numerics.harvest.carts.cart_motion import (
    CartMotion,
    Moving,
    Passage,
    plan_profile,
    plan_profile_back,
)
from sightfield.systems.numerics.harvest.carts.cart_plan import Failure, Stop, Supply
from sightfield.systems.numerics.harvest.carts.routes import Standing
from sightfield.systems.numerics.harvest.carts.surroundings import (
    changed_surroundings,
    make_surroundings,
    standing_poses,
)
from sightfield.systems.numerics.harvest.carts.traffic import cart_traffic
from sightfield.systems.numerics.harvest.carts.visits import serve_combines
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.field.yield_map import YieldMap
from sightfield.systems.numerics.harvest.machines import Cart
from sightfield.systems.numerics.harvest.paths import MachinePath, TimedPath
from sightfield.systems.numerics.harvest.trucks import TruckFleet

TRUCKS = np.array([[60.0, -13.0, 0.1], [100.0, -14.0, 0.0]])
GROWN = YieldMap(np.array([-3.0, 4.0]), 47.0, np.array([[1.1, 1.9, 1.4], [2.1, 0.8, 1.7]]))

# Width and height of the field, combines, cart, crop and trucks, and what else is told.
CASES = {
    "one cart": ((126.0, 100.0, 1), Cart(capacity=20000.0, hitch_offset=0.6), {"density": 1.6}, {}),
    "two carts in turns": (
        (126.0, 100.0, 2),
        Cart(capacity=12000.0, hitch_offset=0.3, length=5.4, speed=5.5, turning_radius=5.5),
        {
            "density": GROWN,
            "trucks": TRUCKS,
            "truck_rate": 170.0,
            "truck_fleet": TruckFleet(capacity=7000.0, road_time=240.0),
        },
        {"threshold": 0.4},
    ),
    "stops": ((126.0, 100.0, 2), Cart(), {"density": 3.2}, {"strategy": "on-demand"}),
    "long waits": (
        (108.0, 72.0, 2),
        Cart(capacity=8000.0, hitch_offset=0.2),
        {"density": 4.4, "truck_fleet": TruckFleet(capacity=6000.0, road_time=330.0)},
        {"strategy": "on-demand"},
    ),
    "greedy": (
        (126.0, 100.0, 2),
        Cart(capacity=14000.0),
        {"density": 3.2, "trucks": TRUCKS},
        {"strategy": "on-demand", "visits": "greedy", "failure": Failure(1, 420.0)},
    ),
}


def told(plan):
    """What a plan says, in numbers."""
    times = np.arange(0.0, max(each.timed.end for each in plan.motions), 37.0)
    poses = [np.hstack(motion.poses_at(times)) for motion in plan.motions]
    return {
        "combines": [np.column_stack([p.times, p.stations, p.speeds]) for p in plan.plans],
        "carts": poses,
        "ends": [motion.timed.end for motion in plan.motions],
        "ways": [motion.timed.path.length for motion in plan.motions],
        "visits": plan.visits,
        "trips": plan.trips,
        "stops": plan.stops,
        "left": plan.left,
    }


@pytest.mark.parametrize("case", CASES)
def test_a_plan_of_carts_is_as_recorded(hand_made, as_recorded, case):
    size, cart, supply, more = CASES[case]
    made = hand_made(*size)
    supply = Supply(**{"trucks": TRUCKS[:1], **supply})
    team = [made.combine] * len(made.plans)
    planned = made.field, team, cart, made.plans, made.swaths, supply, made.retime
    as_recorded(told(serve_combines(*planned, **more)))


@pytest.fixture(scope="module")
def world(hand_made):
    """A field that is like itself in no way, with a pond and a ditch, and combines on a part."""
    made = hand_made(126.0, 100.0, 2)
    corners = [(-3.3, -2.1), (131.7, 1.9), (127.2, 106.4), (58.0, 111.3), (-1.4, 99.2)]
    pond = [(88.3, 50.1), (94.1, 52.6), (92.7, 58.8), (87.9, 56.4)]
    ditch = shapely.Polygon([(-24.0, 40.0), (-11.2, 41.3), (-11.9, 45.7), (-24.0, 46.1)])
    crop = world_from_polygon(shapely.Polygon(corners, [pond]))
    field = Field(crop, 21.3, no_go=(ditch,))
    numbers = np.arange(len(made.swaths))[:, None, None]
    shifts = 0.9 * np.sin(3.1 * numbers + np.array([[1.0, 2.2], [0.7, 4.3]]))
    swaths = list(np.stack(made.swaths) + shifts)
    cart = Cart(capacity=15000.0, hitch_offset=0.45, length=4.7, lateral_acceleration=1.7)
    supply = Supply(density=1.3, trucks=np.array([[61.2, -13.4, 0.13], [103.9, -14.2, 3.2]]))
    team = [made.combine] * 2
    return field, made, make_surroundings(field, team, cart, swaths, supply, list(made.plans))


def test_the_world_of_carts_is_as_recorded(world, as_recorded):
    _, _, found = world
    planner, roadmap = found.planner, found.planner.roadmap
    as_recorded(found.cut, "cut")
    as_recorded([found.free, found.ground], "ground")
    as_recorded(roadmap, "roadmap")
    as_recorded(
        [planner.blocked, planner.last_blocked, planner.exits, planner.ways_out, planner.longest],
        "planner",
    )
    as_recorded(found.combines, "combines")
    as_recorded([[w.combine, w.begin, w.end, *w.lane[1:]] for w in found.windows], "windows")
    as_recorded(found.beginnings, "beginnings")
    as_recorded([found.arrivals(7, 412.0), found.arrivals(31, 96.0)], "arrivals")
    as_recorded([[tank.cut, tank.full_at(), tank.left] for tank in found.tanks], "tanks")
    at = [(n, t, found.plans[n].pose_at(t)) for n in (0, 1) for t in (133.0, 391.0, 700.0)]
    as_recorded(
        [standing_poses(found, pose, until) for _, t, pose in at for until in (t, np.inf)],
        "beside standing combines",
    )


def test_a_world_in_which_a_combine_stops_is_as_recorded(world, as_recorded):
    field, made, found = world
    stop = Stop(1, float(made.plans[1].station_at(333.0)), 75.0)
    later, since = changed_surroundings(found, field, made.retime([stop]), 1100.0)
    planner = later.planner
    as_recorded([since, later.until, later.cut.times, later.ground.times, later.combines.poses])
    as_recorded(
        [planner.blocked, planner.last_blocked, planner.ways_out, planner.roadmap.opens], "planner"
    )
    as_recorded([[w.combine, w.begin, w.end] for w in later.windows], "windows")


def route(motion):
    """What a route says, in numbers."""
    if motion is None:
        return None
    timed = motion.timed
    path = [
        timed.path.length,
        np.abs(timed.path.curvatures).max(initial=0.0),
        len(timed.path.poses),
    ]
    return [path, timed.times, timed.stations, timed.speeds, motion.last_pose, motion.last_angle]


def test_routes_among_combines_and_another_cart_are_as_recorded(world, as_recorded):
    _, _, found = world
    planner, cart, truck = found.planner, found.cart, found.supply.trucks[0]
    # The other cart comes along the margin, stands for a while, and drives on.
    way = [(-14.0, 96.0, -1.55), (-13.2, 20.0, -1.55), (4.0, -12.8, 0.0), (90.0, -13.0, 0.0)]
    path = MachinePath.of(way)
    at = np.array([0.0, 60.0, 60.0, path.length])
    drives = TimedPath(path, np.array([200.0, 230.0, 245.0, 285.0]), at, np.zeros(4))
    alone, others = cart_traffic(cart, [], 2), cart_traffic(cart, [[CartMotion(drives, cart)]], 2)
    windows = found.windows[:: max(len(found.windows) // 5, 1)]
    for k, window in enumerate(windows):
        plan = found.plans[window.combine]
        begin, end = window.begin + 0.3 * (window.end - window.begin), window.end - 2.0
        beside = [
            window.lane.path.pose_at(window.lane.stations(plan.station_at(t))) for t in (begin, end)
        ]
        stands = Standing(truck, 0.0, max(begin - 260.0, 0.0))
        among = alone if k % 2 else others
        speed = float(plan.speed_at(begin))
        to = planner.route_to(stands, beside[0], Moving(begin, speed), among)
        as_recorded(route(to), f"to {k}")
        goal = [None, found.supply.trucks, found.supply.trucks[1]][k % 3]
        off = planner.route_from(
            beside[1], 0.07, Moving(end, float(plan.speed_at(end))), among, goal
        )
        as_recorded(route(off), f"from {k}")
    # One that stands may wait; it has a long way, and is let pass by combines.
    off = planner.route_from(np.array([120.1, 113.0, 3.0]), 0.1, Moving(31.0, 0.0), others, truck)
    as_recorded(route(off), "across")
    # There is no time left to come.
    assert (
        planner.route_to(Standing(truck, 0.0, 99.0), beside[0], Moving(101.0, 1.5), alone) is None
    )


def test_places_to_stand_and_ways_out_are_as_recorded(world, as_recorded):
    _, _, found = world
    rng = np.random.default_rng(17)
    poses = np.column_stack([rng.uniform([-20, -20], [150, 130], (60, 2)), rng.uniform(-3, 3, 60)])
    planner = found.planner
    for time in (0.0, 290.5, 5000.0):
        as_recorded(planner.is_free_for_ever(poses, time), f"free from {time}")
        as_recorded(planner.with_ways_out(poses, time), f"ways out at {time}")
    as_recorded(found.nodes_near(poses), "nodes")
    assert len(planner.with_ways_out(poses[:0], 100.0)) == 0


def test_times_of_drives_past_what_is_closed_are_as_recorded(as_recorded):
    rng = np.random.default_rng(23)
    stations = np.arange(0.0, 80.1, 0.5)
    found = []
    for k in range(8):
        limits = np.repeat(rng.uniform(1.0, 6.0, 23), 7)
        closed = np.zeros((len(stations), 500), dtype=bool)
        for _ in range(22):
            place, begin = rng.integers(15, 140), rng.integers(0, 400)
            closed[place : place + rng.integers(2, 14), begin : begin + rng.integers(9, 90)] = True
        # Some are closed for ever from some time on.
        closed[100:103, (120 if k % 3 == 0 else 999) :] = True
        opens = np.where(stations > 55.0, rng.uniform(10.0, 50.0), -np.inf)
        passage = Passage(stations, limits, opens, closed, 7.0)
        for speed in (0.0, 1.3):
            found.append(plan_profile(passage, Moving(8.0, speed), 0.8 + 0.1 * k))
            found.append(plan_profile_back(passage, Moving(118.0, speed), 0.8 + 0.1 * k, 9.0))
    reached = [len(each.times) > 0 for each in found]
    assert 9 < sum(reached) < 30
    as_recorded(found)
