"""Shortest routes on the visibility graph of grown obstacles."""

import itertools
import math

import numpy as np
import pytest
import shapely
from scipy.sparse.csgraph import dijkstra

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import are_clear
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.social.landmarks.thesis_maze import thesis_maze
from sightfield.systems.numerics.social.routes.shortest_route import (
    build_route_graph,
    rounded_regions,
    shortest_route,
)

SQUARE = [[0, 0], [4, 0], [4, 4], [0, 4]]
BLOCK = [[1, 1], [3, 1], [3, 3], [1, 3]]


@pytest.fixture(scope="module")
def around_a_block():
    return build_route_graph([make_world(SQUARE, [BLOCK])])


@pytest.fixture(scope="module")
def maze_graph():
    return build_route_graph(rounded_regions(thesis_maze().world, 0.145))


def random_points(graph, count, seed):
    generator = np.random.default_rng(seed)
    low, high = graph.regions[0].bounds[:2], graph.regions[0].bounds[2:]
    found = []
    while len(found) < count:
        point = generator.uniform(low, high)
        if shapely.contains_xy(graph.free, *point):
            found.append(point)
    return np.array(found)


def test_a_way_round_a_block_touches_its_corners(around_a_block):
    route = shortest_route(around_a_block, [0.5, 0.5], [3.5, 2.0])
    assert route.found
    assert route.points.tolist() == [[0.5, 0.5], [3, 1], [3.5, 2.0]]
    assert route.length == pytest.approx(math.hypot(2.5, 0.5) + math.hypot(0.5, 1))


def test_what_is_in_sight_is_reached_straight_and_nothing_by_nothing(around_a_block):
    straight = shortest_route(around_a_block, [0.5, 0.5], [3.5, 0.5])
    assert straight.points.tolist() == [[0.5, 0.5], [3.5, 0.5]]
    nowhere = shortest_route(around_a_block, [0.5, 0.5], [0.5, 0.5])
    assert (nowhere.points.tolist(), nowhere.length, nowhere.found) == ([[0.5, 0.5]], 0.0, True)


def test_ends_in_an_obstacle_are_led_by_the_nearest_free_point(around_a_block):
    into = shortest_route(around_a_block, [0.5, 2.0], [1.2, 2.0])
    np.testing.assert_allclose(into.points, [[0.5, 2.0], [1.0, 2.0]])
    out = shortest_route(around_a_block, [1.2, 2.0], [0.5, 2.0])
    np.testing.assert_allclose(out.points, [[1.2, 2.0], [1.0, 2.0], [0.5, 2.0]])
    assert out.length == pytest.approx(0.7)


def test_no_way_is_a_result():
    rooms = [make_world([[0, 0], [1, 0], [1, 1], [0, 1]]), make_world([[2, 0], [3, 0], [3, 1]])]
    route = shortest_route(build_route_graph(rooms), [0.5, 0.5], [2.7, 0.3])
    assert not route.found
    assert route.length == math.inf
    assert route.points.tolist() == [[0.5, 0.5]]


def test_routes_are_as_long_as_those_of_a_graph_built_with_all_vertices(maze_graph):
    # All vertices of the grown obstacles, as the thesis has it, and another's Dijkstra.
    points = random_points(maze_graph, 12, seed=1)
    vertices = np.concatenate([ring for world in maze_graph.regions for ring in world.rings])
    nodes = np.concatenate([points, vertices])
    i, j = np.triu_indices(len(nodes), 1)
    weights = np.zeros((len(nodes), len(nodes)))
    clear = are_clear(build_edge_index(*maze_graph.regions), nodes[i], nodes[j])
    weights[i[clear], j[clear]] = np.hypot(*(nodes[i[clear]] - nodes[j[clear]]).T)
    lengths = dijkstra(weights, directed=False)
    for a, b in itertools.combinations(range(len(points)), 2):
        route = shortest_route(maze_graph, points[a], points[b])
        assert route.length == pytest.approx(lengths[a, b], rel=1e-9)
        assert maze_graph.free.buffer(1e-6).covers(shapely.LineString(route.points))


def test_a_way_back_is_the_way_there(maze_graph):
    for a, b in random_points(maze_graph, 20, seed=2).reshape(-1, 2, 2):
        there, back = shortest_route(maze_graph, a, b), shortest_route(maze_graph, b, a)
        assert there.length == pytest.approx(back.length)
        np.testing.assert_allclose(there.points, back.points[::-1])


def test_end_points_leave_the_graph_as_it_was(maze_graph):
    nodes, lengths = maze_graph.nodes.copy(), maze_graph.lengths.copy()
    a, b = random_points(maze_graph, 2, seed=3)
    first = shortest_route(maze_graph, a, b)
    shortest_route(maze_graph, b, [0.3, 0.3])
    np.testing.assert_array_equal(maze_graph.nodes, nodes)
    np.testing.assert_array_equal(maze_graph.lengths, lengths)
    np.testing.assert_array_equal(shortest_route(maze_graph, a, b).points, first.points)


@pytest.mark.parametrize("distance", [0.05, 0.1, 0.13, 0.15])
def test_rounded_regions_keep_their_distance_and_little_more(distance):
    world = thesis_maze().world
    walls = world.polygon.boundary
    for region in rounded_regions(world, distance):
        assert region.polygon.distance(walls) >= distance
    # All that keeps a little more is in them.
    exact = world.polygon.buffer(-1.06 * distance, quad_segs=32)
    parts = shapely.union_all([region.polygon for region in rounded_regions(world, distance)])
    assert parts.covers(exact)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: shortest_route(build_route_graph([make_world(SQUARE)]), [0, math.nan], [1, 1]),
         "`start` must be a finite point"),
        (lambda: shortest_route(build_route_graph([make_world(SQUARE)]), [0, 0], [1, 1, 1]),
         "`goal` must be a finite point"),
        (lambda: build_route_graph([]), "`regions` must hold a region"),
        (lambda: rounded_regions(make_world(SQUARE), 0.0), "`distance` must be positive"),
        (lambda: rounded_regions(make_world(SQUARE), 2.5), "`distance` must leave free space"),
    ],
)  # fmt: skip
def test_bad_input_is_named(make, message):
    with pytest.raises(InvalidInput, match=message):
        make()


def test_who_stands_in_the_way_is_passed_on_the_other_side(around_a_block):
    start, goal = [0.5, 0.5], [3.5, 2.0]
    # Beside the corner (3, 1), which the shortest way touches.
    blocks = [[3.1, 0.9]]
    route = shortest_route(around_a_block, start, goal, avoid=blocks, distance=0.3)
    assert route.points.tolist() == [[0.5, 0.5], [1, 3], [3, 3], [3.5, 2.0]]
    assert shapely.LineString(route.points).distance(shapely.Point(blocks[0])) >= 0.3
    far = shortest_route(around_a_block, start, goal, avoid=[[0.2, 3.8]], distance=0.3)
    assert far.points.tolist() == [[0.5, 0.5], [3, 1], [3.5, 2.0]]


def test_from_beside_somebody_a_way_leads_off_but_not_nearer(around_a_block):
    away = shortest_route(around_a_block, [0.5, 0.5], [0.5, 3.0], avoid=[[0.5, 0.3]], distance=0.4)
    assert away.points.tolist() == [[0.5, 0.5], [0.5, 3.0]]
    past = shortest_route(around_a_block, [0.5, 0.5], [0.5, 3.0], avoid=[[0.5, 0.8]], distance=0.4)
    assert past.length > 5
    walled = [[0.5, 0.8], [0.8, 0.5]]
    none = shortest_route(around_a_block, [0.5, 0.5], [0.5, 3.0], avoid=walled, distance=0.4)
    assert not none.found
