"""Evasion by the solved visibility game, against whole planes of the table."""

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import segment_is_clear
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.visibility_game.board import make_board
from sightfield.systems.numerics.tracking.visibility_game.bounds import MOVES
from sightfield.systems.numerics.tracking.visibility_game.evasion import optimal_velocities
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.plane_steps import steps_from
from sightfield.systems.numerics.tracking.visibility_game.planes import steps_at

SPEED = 0.3
# Two reflex corners, and a wall thinner than a step of the evader.
ROOM = make_world(
    [(0, 0), (4, 0), (4, 4), (2.03, 4), (2.03, 2.03), (0, 2.03)],
    [[(2.9, 0.6), (2.93, 0.6), (2.93, 1.4), (2.9, 1.4)]],
)


@pytest.fixture(scope="module")
def table():
    return solve_visibility_game(ROOM, pursuer_speed=1.0, evader_speed=SPEED, grid=0.1)


@pytest.fixture(scope="module")
def board(table):
    return make_board(table)


def velocity(board, pursuers, evader, closed_form, with_distance=False):
    """Of one evader, which all pursuers see."""
    pursuers = np.array(pursuers, dtype=float).ravel()
    seen = np.ones((len(pursuers) // 2, 1))
    form, region = np.array([closed_form], dtype=float), build_edge_index(ROOM)
    place = np.array(evader, dtype=float)
    return optimal_velocities(board, region, pursuers, place, seen, form, with_distance)


def playing(angle, steps=np.inf, margin=np.inf):
    return [SPEED * np.cos(angle), SPEED * np.sin(angle), steps, margin]


def moves_from(table, row, column):
    """Nodes that an evader can go to."""
    index, grid = build_edge_index(ROOM), table.evader_grid
    here = grid.at(row, column)
    for down, right in MOVES.offsets:
        r, c = row + down, column + right
        if 0 <= r < grid.rows and 0 <= c < grid.columns and table.evader_nodes[r, c]:
            there = grid.at(r, c)
            if segment_is_clear(index, *here, *there):
                yield r, c, there


def test_a_single_pair_is_worth_what_the_whole_plane_says(table):
    rng = np.random.default_rng(2)
    for p in rng.integers(len(table.places), size=20):
        plane = steps_from(table.planes, table.rules, p)
        for row, column in rng.integers(0, plane.shape, size=(200, 2)):
            assert steps_at(table.planes, table.rules, p, row, column) == plane[row, column]


@pytest.mark.parametrize("count", [1, 2])
def test_it_leaves_the_least_time_to_all_that_see_it(table, board, count):
    rng = np.random.default_rng(3)
    tried = 0
    while tried < 40:
        numbers = rng.integers(len(table.places), size=count)
        worth = np.max([table.times_from(table.places[p]) for p in numbers], axis=0)
        losing = np.argwhere(np.isfinite(worth) & (worth > 2 * table.step))
        if len(losing) == 0:
            continue
        row, column = losing[rng.integers(len(losing))]
        e, form = table.evader_grid.at(row, column), playing(rng.uniform(-np.pi, np.pi))
        v = velocity(board, table.places[numbers], e, form)
        if not v.any():
            at = row, column
        elif np.allclose(v, form[:2]):
            # The move most like the closed form's is as good as any.
            at = max(moves_from(table, row, column), key=lambda move: (move[2] - e) @ v)
        else:
            # One of the moves leads that way.
            on_line = [
                move
                for move in moves_from(table, row, column)
                if (move[2] - e) @ v >= SPEED * np.hypot(*(move[2] - e)) - 1e-12
                and not np.array_equal(move[2], e)
            ]
            assert np.hypot(*v) == pytest.approx(SPEED)
            at = min(on_line, key=lambda move: worth[move[0], move[1]])
        least = min(worth[r, c] for r, c, _ in moves_from(table, row, column))
        assert worth[at[0], at[1]] == least
        tried += 1


def test_the_closed_form_goes_first_where_it_promises_less(table, board):
    pursuer, evader = (0.5, 1.2), (3.0, 1.9)
    steps = 1 + table.time(pursuer, evader) / table.step
    assert 4 < steps < 40
    better = 0
    for angle in np.linspace(-np.pi, np.pi, 12, endpoint=False):
        form = playing(angle)[:2]
        better += not np.array_equal(velocity(board, [pursuer], evader, playing(angle)), form)
        sooner = velocity(board, [pursuer], evader, playing(angle, steps=1.0))
        np.testing.assert_array_equal(sooner, form)
    # The table alone goes its own way where the closed form leads astray.
    assert better >= 4


def test_with_the_distance_it_makes_for_the_nearest_place_where_it_is_lost(table, board):
    rng, grid = np.random.default_rng(5), table.evader_grid
    tried = 0
    while tried < 40:
        p = table.places[rng.integers(len(table.places))]
        times = table.times_from(p)
        losing, kept = np.argwhere(np.isfinite(times)), np.argwhere(np.isposinf(times))
        if len(losing) == 0 or len(kept) == 0:
            continue
        row, column = kept[rng.integers(len(kept))]
        cells = np.hypot(*(losing - (row, column)).T).min()
        if not 6 < cells < 200:
            continue
        e, angle = grid.at(row, column), rng.uniform(-np.pi, np.pi)
        # A way through walls says nothing; and the closed form takes over where it is nearer.
        nearest = grid.at(*losing[np.hypot(*(losing - (row, column)).T).argmin()])
        if not segment_is_clear(build_edge_index(ROOM), *e, *nearest):
            continue
        v = velocity(board, [p], e, playing(angle), with_distance=True)
        then = (e + v / SPEED * 2.0 * grid.spacing - grid.at(0, 0)) / grid.spacing
        left = np.hypot(*(losing[:, ::-1] - then).T).min()
        # Distances are kept as whole cells.
        assert left < cells - 0.7
        near = playing(angle, margin=0.5 * cells * grid.spacing)
        np.testing.assert_array_equal(velocity(board, [p], e, near, with_distance=True), near[:2])
        tried += 1


def test_it_presses_against_no_thin_wall(table, board):
    # Beyond the wall it would be hidden; the way there is round its end.
    evader = (2.88, 1.3)
    for x in (1.0, 1.5, 2.2):
        v = velocity(board, [(x, 1.0)], evader, playing(np.pi / 2))
        index = build_edge_index(ROOM)
        assert segment_is_clear(index, *evader, *(evader + 0.1 * v))


def test_without_knowledge_the_closed_form_decides(board):
    form = playing(1.0)
    # Off the map, and before a pursuer that is.
    np.testing.assert_array_equal(velocity(board, [(1, 1)], (9.0, 9.0), form), form[:2])
    np.testing.assert_array_equal(velocity(board, [(9, 9)], (1.0, 1.0), form), form[:2])
    np.testing.assert_array_equal(velocity(board, [(1, 1)], (1.5, 1), [0, 0, np.inf, 1]), [0, 0])
