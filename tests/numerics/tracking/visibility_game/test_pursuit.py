"""Pursuit by the solved visibility game."""

import math

import numpy as np
import pytest
import shapely
from scipy.ndimage import distance_transform_edt

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index, point_is_free
from sightfield.systems.numerics.geometry.segment_sight import segment_is_clear
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.visibility_game import board as boards
from sightfield.systems.numerics.tracking.visibility_game.board import make_board
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.planes import FOR_EVER, worst_reply
from sightfield.systems.numerics.tracking.visibility_game.pursuit import (
    guarantee_velocities,
    pair_worths,
    time_of_team,
    velocity_after,
)

ROOM = make_world([(0, 0), (4, 0), (4, 4), (2.03, 4), (2.03, 2.03), (0, 2.03)])
WEST = np.array([-0.5, 0.0])


@pytest.fixture(scope="module")
def table():
    return solve_visibility_game(ROOM, pursuer_speed=1.0, evader_speed=0.3, grid=0.1)


@pytest.fixture(scope="module")
def board(table):
    return make_board(table)


def velocity(board, pursuer, evader, field=WEST, target=0.0, period=0.05):
    places = [np.array(point, dtype=float) for point in (pursuer, evader)]
    visible = np.array([[bool(segment_is_clear(build_edge_index(ROOM), *pursuer, *evader))]])
    return guarantee_velocities(board, *places, visible, np.array([target]), field, 1.0, period)


def test_it_runs_to_where_it_sees_round_the_corner(board):
    # The evader makes for the edge x = 2.03; the pursuer has to come to x >= 2.03.
    vx, vy = velocity(board, (1.0, 1.5), (2.6, 2.1))
    assert vx > 0.7
    assert np.hypot(vx, vy) == pytest.approx(1.0)


def test_every_step_leaves_as_much_as_the_table_says(table, board):
    rng = np.random.default_rng(3)
    tried = 0
    while tried < 30:
        p = table.places[rng.integers(len(table.places))]
        times = table.times_from(p)
        losing = np.argwhere(np.isfinite(times) & (times > 2 * table.step))
        if len(losing) == 0:
            continue
        row, column = losing[rng.integers(len(losing))]
        e = table.evader_grid.at(row, column)
        at = velocity(board, p, e, period=table.step)
        then = table.times_from(p + at * table.step)
        # Whatever the evader does, a step less is left.
        near = then[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
        assert np.nanmin(near) >= times[row, column] - table.step - 1e-9
        tried += 1


def test_of_safe_steps_it_takes_the_safest(table, board):
    # From far away everything is safe; it still goes where the evader cannot even come near.
    p, e = np.array([1.05, 0.55]), np.array([2.9, 1.2])
    assert table.time(p, e) == np.inf
    vx, _ = velocity(board, p, e)
    assert vx > 0.4


def test_without_a_target_or_knowledge_the_field_decides(board):
    np.testing.assert_array_equal(velocity(board, (0.3, 1.0), (2.1, 3.8), target=-1.0), WEST)
    # Off the map.
    np.testing.assert_array_equal(velocity(board, (1, 1), (9.0, 9.0)), WEST)


def test_too_large_a_table_is_refused(table, monkeypatch):
    make_board.cache_clear()
    monkeypatch.setattr(boards, "MEMORY", 1e6)
    with pytest.raises(InvalidInput, match="`grid` must be coarser for pursuit"):
        make_board(table)


def test_one_that_sees_both_minds_both_until_the_other_is_there():
    box = make_world(
        [(0, 0), (3, 0), (3, 3), (0, 3)], [[(1.03, 0.98), (1.96, 0.98), (1.96, 2.11), (1.03, 2.11)]]
    )
    table = solve_visibility_game(box, pursuer_speed=1.0, evader_speed=0.3, grid=0.1)
    board, index, rng = make_board(table), build_edge_index(box), np.random.default_rng(5)
    rows, columns = np.nonzero(table.evader_nodes)
    gained = 0
    for _ in range(400):
        p, far = table.places[rng.integers(len(table.places), size=2)]
        nodes = rng.integers(len(rows), size=2)
        e1, e2 = table.evader_grid.at(rows[nodes], columns[nodes])
        if not all(segment_is_clear(index, *p, *e) for e in (e1, e2)):
            continue
        teams = np.concatenate([p, far]), np.concatenate([e1, e2])
        left = []
        for seen in (False, True):
            visible = np.array([[True, True], [False, seen]])
            targets = np.array([0.0, 1.0])
            v = guarantee_velocities(board, *teams, visible, targets, np.zeros(4), 1.0, table.step)
            then = table.times_from(p + v[:2] * table.step)
            left.append(min(then[rows[nodes], columns[nodes]]))
        assert left[0] >= left[1] - table.step
        gained += left[0] > left[1] + table.step
    assert gained >= 3


def test_a_team_lasts_as_long_as_its_weakest_pair_and_who_minds_two_for_less():
    # Round a box one evader may be kept, and another one on its other side, but not both.
    world = make_world(
        [(0, 0), (4, 0), (4, 4), (0, 4)], [[(1.53, 1.41), (2.71, 1.41), (2.71, 2.57), (1.53, 2.57)]]
    )
    table = solve_visibility_game(world, pursuer_speed=1.0, evader_speed=0.6, grid=0.15)
    board, index, rng = make_board(table), build_edge_index(world), np.random.default_rng(6)
    rows, columns = np.nonzero(table.evader_nodes)
    less = 0
    for _ in range(2000):
        p, q = rng.integers(len(table.places), size=2)
        nodes = rng.integers(len(rows), size=2)
        e1, e2 = table.evader_grid.at(rows[nodes], columns[nodes])
        places = np.array([table.places[p], table.places[q]])
        visible = np.array([[segment_is_clear(index, *a, *e) for e in (e1, e2)] for a in places])
        game = board, places.ravel(), np.concatenate([e1, e2]), visible
        times, _ = pair_worths(*game)
        assignment = np.array([0, 1])
        if visible[0, 0] and visible[1, 1]:
            assert time_of_team(*game, assignment) == min(times[0, 0], times[1, 1])
        if visible[0].all() and not visible[1, 1]:
            # The first minds both.
            first, last = table.rules.neighbour_starts[p : p + 2]
            left = [
                min(worst_reply(table.planes, int(to), rows[n], columns[n]) for n in nodes)
                for to in table.rules.neighbours[first:last]
            ]
            most = np.inf if max(left) == FOR_EVER else max(left) + 1 if max(left) > 0 else 0
            assert time_of_team(*game, assignment) == most
            less += most < min(times[0])
        if not visible[:, 1].any():
            assert time_of_team(*game, assignment) == 0
    assert less > 0


# Round a box no side of which lies on nodes.
BOX = make_world(
    [(0, 0), (4, 0), (4, 4), (0, 4)], [[(1.53, 1.41), (2.71, 1.41), (2.71, 2.57), (1.53, 2.57)]]
)
OPEN = shapely.Polygon(BOX.rings[0], [BOX.rings[1]]).buffer(1e-9)


@pytest.fixture(scope="module")
def boxed():
    return solve_visibility_game(BOX, pursuer_speed=1.0, evader_speed=0.3, grid=0.1)


def draw_winnable(rng, table):
    """A pursuer between nodes, and an evader on a node that it can keep in sight for ever."""
    rows, columns = np.nonzero(table.evader_nodes)
    while True:
        p, n = rng.uniform(0.05, 3.95, 2), rng.integers(len(rows))
        e = table.evader_grid.at(rows[n], columns[n])
        free = bool(point_is_free(table.pursuer_region, *p))
        seen = free and segment_is_clear(table.sight, *p, *e)
        if seen and table.time(p, e) == np.inf:
            return p, e, rows[n], columns[n]


def node_made_for(board, p, e):
    """Where a pursuer is after a second, if it goes no farther than the node that it makes for."""
    vx, vy = velocity_after(board, p, e, np.zeros(2), 10.0, 1.0)
    return p + np.array([vx, vy])


def test_no_way_hides_an_evader_that_stands(boxed):
    # Evaders are off their nodes too, where a corner may come between that the table knows not of.
    board, rng, beside = make_board(boxed), np.random.default_rng(8), 0
    box = shapely.Polygon(BOX.rings[1])
    for _ in range(2500):
        p, e, _, _ = draw_winnable(rng, boxed)
        e = e + rng.uniform(-0.5, 0.5, 2) * boxed.evader_grid.spacing
        if not OPEN.covers(shapely.LineString([p, e])):
            continue
        to = node_made_for(board, p, e)
        pieces = 2 * math.ceil(math.hypot(*(to - p)) / boxed.pursuer_grid.spacing)
        for k in range(1, pieces + 1):
            assert OPEN.covers(shapely.LineString([p + (to - p) * k / pieces, e]))
        beside += shapely.LineString([to, e]).distance(box) < 0.05
    assert beside > 16


def test_of_straight_ways_that_keep_the_evader_the_best_one_is_taken(boxed):
    """Against every node within reach, with SciPy's distances and Shapely's lines of sight."""
    board, rng = make_board(boxed), np.random.default_rng(9)
    spacing, straight = boxed.pursuer_grid.spacing, 0
    for _ in range(50):
        p, e, row, column = draw_winnable(rng, boxed)

        def distance(q, row=row, column=column):
            """From where the evader would be lost some day [cells], -1 if it is lost."""
            if worst_reply(boxed.planes, q, row, column) < FOR_EVER:
                return -1
            times = boxed.times_from(boxed.places[q])
            return int(distance_transform_edt(np.isinf(times) | np.isnan(times))[row, column])

        def keeps(q, p=p, e=e, distance=distance):
            to = boxed.places[q]
            cells = math.hypot(*(to - p)) / spacing
            pieces = math.ceil(cells)
            kept = True
            for k in range(1, pieces):
                # All corners of the cell, of those that there are.
                apart = np.abs(boxed.places - (p + (to - p) * k / pieces)).max(axis=1)
                corners = np.flatnonzero(apart < spacing)
                kept &= all(distance(int(corner)) >= cells * k / pieces for corner in corners)
            return kept and OPEN.covers(shapely.MultiPoint([p, to, e]).convex_hull)

        here = boxed.nearest_place(p)
        first, last = boxed.rules.neighbour_starts[here : here + 2]
        farthest = max(distance(int(q)) for q in boxed.rules.neighbours[first:last])
        if farthest >= 15:
            # Nothing hangs on it.
            continue
        near = np.flatnonzero(np.hypot(*(boxed.places - p).T) <= 5.0 * spacing)
        cells = np.hypot(*(boxed.places[near] - p).T) / spacing
        worths = [
            distance(int(q)) - 0.5 * way
            for q, way in zip(near, cells, strict=True)
            if distance(int(q)) > max(way, farthest) and keeps(int(q))
        ]
        to = node_made_for(board, p, e)
        chosen = int(np.argmin(np.hypot(*(boxed.places - to).T)))
        if worths:
            worth = distance(chosen) - 0.5 * math.hypot(*(to - p)) / spacing
            assert worth >= max(worths) - 1e-9
            straight += 1
    assert straight > 5
