"""What robots feel, where they turn, and which ways they take is as recorded."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.social.landmarks.thesis_maze import thesis_maze
from sightfield.systems.numerics.social.routes.infrared import InfraredRing, infrared_ranges
from sightfield.systems.numerics.social.routes.motion import (
    FollowingLaw,
    WanderingLaw,
    deviation,
    drive_towards,
    guarded_commands,
    point_at,
    progress_along,
    wander,
)
from sightfield.systems.numerics.social.routes.outlook import (
    belief,
    expected_view,
    make_outlook,
    view,
)
from sightfield.systems.numerics.social.routes.shortest_route import (
    build_route_graph,
    rounded_regions,
    shortest_route,
)

RING = InfraredRing(bearings=(1.4, 0.6, 0.1, -0.7, -1.5), cone=0.9, reach=0.55)
WORLD = make_world(
    [[0.1, -0.2], [3.1, 0.3], [2.7, 2.5], [-0.4, 2.1]],
    [[[0.9, 0.8], [1.6, 0.9], [1.4, 1.5]], [[2.1, 1.0], [2.3, 1.1], [2.0, 1.9]]],
)
EDGES, RADIUS = build_edge_index(WORLD), 0.11


def poses_of(count, seed):
    return np.random.default_rng(seed).uniform([0.2, 0.2, -3.1], [2.6, 2.2, 3.1], (count, 3))


def test_ranges_are_as_recorded(as_recorded):
    poses = poses_of(25, 0)
    # Robots that overlap, and one whose middle lies in another.
    poses[1, :2] = poses[0, :2] + [0.13, -0.07]
    poses[2, :2] = poses[0, :2] + [0.05, 0.06]
    as_recorded(
        [infrared_ranges(EDGES.edges, poses, RADIUS, ring) for ring in (RING, InfraredRing())]
    )
    as_recorded([RING.coverage, RING.count, InfraredRing(cone=0.7).coverage], "ring")


@pytest.mark.parametrize(
    ("bearings", "cone", "coverage"),
    [
        ((0.9, 0.4, -0.4, -0.9), 0.8, 1.3),
        ((0.9, 0.4, -0.4, -0.8), 0.8, 1.2),
        # A gap on the left ends what is covered there, and the other side counts for nothing.
        ((1.4, 0.4, -0.4, -0.9), 0.8, 0.8),
        ((0.9, 0.4, -0.4, -1.4), 0.8, 0.8),
        ((0.6, -0.2), 0.5, 0.05),
        ((2.0, 1.0), 0.5, 0.0),
        ((0.5, -0.5), 1.0, 1.0),
    ],
)
def test_a_ring_covers_what_lies_between_its_gaps(bearings, cone, coverage):
    assert InfraredRing(bearings=bearings, cone=cone).coverage == pytest.approx(coverage)


def test_agents_wander_as_recorded(as_recorded):
    law = WanderingLaw(speed=0.17, turn_rate=1.3, turn_range=0.21, centring=7.0)
    rng = np.random.default_rng(3)
    ranges = rng.uniform(0.05, 0.55, (40, RING.count))
    turns = np.where(rng.random(40) < 0.5, 0.0, rng.uniform(-2, 2, 40))
    turns[:3] = law.turn_rate * 0.04 * np.array([1.0, -1.0, 0.5])
    ranges[:5, 2] = [0.1, 0.1, 0.1, law.turn_range, 0.1]
    ranges[4:8, [0, 1]] = ranges[4:8][:, [4, 3]]
    as_recorded(wander(law, RING, turns, ranges, rng.random(40), 0.04), "drawn")
    as_recorded(wander(WanderingLaw(), RING, turns, ranges, rng.random(40), 0.05), "usual")
    # Alike on both sides: below one half to the right.
    alike, usual = np.full((2, 4), 0.05), InfraredRing()
    _, commands = wander(law, usual, np.zeros(2), alike, np.array([0.49, 0.5]), 0.04)
    np.testing.assert_allclose(commands, [[0.0, -1.3], [0.0, 1.3]])


def test_a_robot_keeps_clear_of_others_as_recorded(as_recorded):
    law = FollowingLaw(wary_range=0.3, passing_gap=0.05, gain=3.0, turn_rate=1.7)
    found = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        pose = poses_of(1, seed)[0]
        poses = np.vstack([pose, pose + rng.uniform([-0.4, -0.4, 0], [0.4, 0.4, 0], (2, 3))])
        felt = infrared_ranges(EDGES.edges, poses, RADIUS, RING)[0]
        walls = infrared_ranges(EDGES.edges, poses[:1], RADIUS, RING)[0]
        wish, side = rng.uniform(-3, 3), float(rng.integers(-1, 2))
        way, side = deviation(law, RING, EDGES, pose, wish, felt, walls, RADIUS, side)
        found.append([way, side, *drive_towards(law, float(pose[2]), way)])
    as_recorded(found)


def test_a_range_counts_where_it_is_near_and_shorter_than_the_walls():
    law = FollowingLaw(wary_range=0.25)
    pose, wide = np.array([0.6, 0.4, 0.2]), np.full(RING.count, 0.5)

    def avoided(felt, expected):
        ranges = wide.copy()
        ranges[2] = felt
        walls = wide.copy()
        walls[2] = expected
        return deviation(law, RING, EDGES, pose, 0.3, ranges, walls, RADIUS, 0.0) != (0.3, 0.0)

    assert avoided(0.24, 0.5)
    assert not avoided(0.25, 0.5)
    assert avoided(0.2, 0.221)
    assert not avoided(0.2, 0.219)


def test_places_along_a_route_are_as_recorded(as_recorded):
    route = np.array([[0.3, 0.3], [1.8, 0.5], [1.8, 0.5], [1.9, 1.6], [0.4, 1.7]])
    found = []
    for k, (x, y, _) in enumerate(poses_of(30, 7)):
        found.append(progress_along(EDGES, route, np.array([x, y]), 0.13 * k, 0.3))
    as_recorded([[each.arc, each.rest, *each.aim, each.in_sight] for each in found])
    as_recorded([point_at(route, arc) for arc in (-0.2, 0.4, 1.9, 3.3, 9.0)], "points")


def test_speeds_are_slowed_as_recorded(as_recorded):
    rng = np.random.default_rng(5)
    commands = rng.uniform([-0.1, -2], [0.6, 2], (20, 2))
    ranges = rng.uniform(0.0, 0.1, (20, RING.count))
    as_recorded(guarded_commands(commands, ranges, np.array(RING.bearings), 0.45, 0.02, 0.2))


def test_outlooks_are_as_recorded(as_recorded):
    outlook = make_outlook(WORLD, cell=0.17, view_angle=1.2, reach=1.4)
    pose = np.array([0.6, 0.4, 0.7])
    as_recorded(outlook.cells, "cells")
    as_recorded(outlook.typical, "typical")
    as_recorded([view(outlook, each) for each in poses_of(5, 1)], "views")
    as_recorded([expected_view(outlook, pose, age, 3.0) for age in (0.5, 20.5, 21.0)], "faded")
    spread = np.array([[0.04, 0.01], [0.01, 0.02]])
    as_recorded(belief(outlook, np.array([1.9, 0.7]), spread), "belief")


@pytest.fixture(scope="module")
def graph():
    return build_route_graph(rounded_regions(WORLD, 0.12))


def test_routes_are_as_recorded(graph, as_recorded):
    as_recorded([graph.nodes, graph.lengths], "graph")
    as_recorded([each.boundary for each in rounded_regions(thesis_maze().world, 0.19)], "regions")
    routes = []
    for start, goal in zip(poses_of(12, 3)[:, :2], poses_of(12, 4)[:, :2], strict=True):
        block = 0.5 * (start + goal)
        routes.append(shortest_route(graph, start, goal))
        routes.append(shortest_route(graph, start, goal, avoid=[block], distance=0.25))
    as_recorded([[each.points, each.length, each.found] for each in routes], "routes")


def test_a_way_keeps_its_distance_from_blocks_as_far_as_its_ends_do(graph):
    start, goal = np.array([0.5, 0.4]), np.array([2.5, 0.7])
    straight = shortest_route(graph, start, goal)
    assert len(straight.points) == 2
    across = np.array([-(goal - start)[1], (goal - start)[0]]) / math.dist(start, goal)
    middle = 0.5 * (start + goal)
    for off, bent in ((0.201, False), (0.199, True)):
        way = shortest_route(graph, start, goal, avoid=[middle + off * across], distance=0.2)
        assert (len(way.points) > 2 or not way.found) is bent
    # Who stands in the block already need not keep farther off than that.
    beside = start + 0.05 * across
    assert shortest_route(graph, start, goal, avoid=[beside], distance=0.2).length == pytest.approx(
        straight.length
    )


@pytest.mark.parametrize(
    "make",
    [
        lambda: WanderingLaw(speed=0.0),
        lambda: WanderingLaw(least_turn=1.0, greatest_turn=0.999),
        lambda: FollowingLaw(lookahead=0.0),
        lambda: InfraredRing(bearings=(0.5, 0.5)),
        lambda: InfraredRing(bearings=(math.inf, 0.5)),
        lambda: InfraredRing(cone=0.0),
        lambda: InfraredRing(cone=math.pi),
        lambda: InfraredRing(reach=0.0),
        lambda: rounded_regions(WORLD, 0.0),
        lambda: rounded_regions(WORLD, 5.0),
        lambda: build_route_graph([]),
        lambda: make_outlook(WORLD, cell=0.1, view_angle=0.0, reach=1.0),
        lambda: make_outlook(WORLD, cell=0.1, view_angle=1.0, reach=0.0),
    ],
)
def test_what_is_no_way_to_drive_is_refused(make):
    with pytest.raises(InvalidInput, match="` must"):
        make()


def test_ends_of_routes_are_finite_points(graph):
    for start, goal in (([0.5, 0.4, 1.0], [2, 1]), ([0.5, 0.4], [2, math.nan])):
        with pytest.raises(InvalidInput, match="be a finite point"):
            shortest_route(graph, start, goal)
    with pytest.raises(InvalidInput, match="`distance`"):
        shortest_route(graph, [0.5, 0.4], [2, 1], distance=-0.1)
    assert WanderingLaw(least_turn=1.0, greatest_turn=1.0).greatest_turn == 1.0


def test_sensors_at_45_degrees_are_beside_and_one_straight_ahead_on_no_side():
    law, edge = WanderingLaw(), math.radians(45)
    ring = InfraredRing(bearings=(edge, 0.0, -edge), cone=0.8)
    beside = np.array([[0.01, 0.4, 0.4], [0.4, 0.4, 0.01]])
    _, commands = wander(law, ring, np.zeros(2), beside, np.full(2, 0.3), 0.05)
    assert (commands[:, 0] == law.speed).all()
    ahead = np.array([[0.3, 0.05, 0.3], [0.3, 0.05, 0.31], [0.31, 0.05, 0.3]])
    _, commands = wander(law, ring, np.zeros(3), ahead, np.full(3, 0.3), 0.05)
    assert np.sign(commands[:, 1]).tolist() == [-1.0, -1.0, 1.0]
