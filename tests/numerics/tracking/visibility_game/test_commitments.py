"""What pursuers that keep promises do next, where both are taken for being on nodes."""

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import segment_is_clear
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.visibility_game.board import make_board
from sightfield.systems.numerics.tracking.visibility_game.bottleneck import (
    COMMITMENT,
    committed_velocities,
    promised_steps,
)
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.planes import FOR_EVER, worst_reply

ROOM = make_world([(0, 0), (4, 0), (4, 4), (2.03, 4), (2.03, 2.03), (0, 2.03)])
INDEX = build_edge_index(ROOM)


@pytest.fixture(scope="module")
def table():
    return solve_visibility_game(ROOM, pursuer_speed=1.0, evader_speed=0.3, grid=0.4, bound="lower")


def draw_pairs(table, rng, count):
    """Numbers of a place and rows and columns of a node in sight of it, where evaders can be."""
    rows, columns = np.nonzero(table.evader_nodes)
    while count > 0:
        p, n = rng.integers(len(table.places)), rng.integers(len(rows))
        e = table.evader_grid.at(rows[n], columns[n])
        if segment_is_clear(INDEX, *table.places[p], *e):
            yield int(p), int(rows[n]), int(columns[n]), e
            count -= 1


def replies(table, p, row, column):
    """W at all places to which a pursuer may go from a place, by their numbers."""
    first, last = table.rules.neighbour_starts[p : p + 2]
    near = table.rules.neighbours[first:last]
    return {int(q): worst_reply(table.planes, int(q), row, column) for q in near}


def test_no_place_within_a_step_promises_more(table):
    board, kinds = make_board(table), set()
    for p, row, column, e in draw_pairs(table, np.random.default_rng(1), 150):
        most = max(replies(table, p, row, column).values())
        expected = np.inf if most == FOR_EVER else most + 1 if most > 0 else 0
        seen = np.array([[True]])
        assert promised_steps(board, table.places[p], e, seen)[0, 0] == expected
        assert promised_steps(board, table.places[p], e, ~seen)[0, 0] == 0
        kinds.add(0 if expected == 0 else 1 if np.isfinite(expected) else 2)
    assert kinds == {0, 1, 2}


def test_who_committed_itself_goes_there_in_a_step_whatever_the_evader_does(table):
    board, moved, period = make_board(table), 0, 0.05
    steps = int(np.ceil(table.step / period))
    seen, own, field = np.array([[True]]), np.array([0]), np.array([0.3, -0.2])
    for p, row, column, e in draw_pairs(table, np.random.default_rng(2), 400):
        left = replies(table, p, row, column)
        at, commitments = table.places[p].copy(), np.zeros((1, COMMITMENT))
        if max(left.values()) == 0:
            game = board, at, e, seen, own, field, commitments, steps, period
            np.testing.assert_array_equal(committed_velocities(*game), field)
            continue
        best = [q for q, steps_left in left.items() if steps_left == max(left.values())]
        distances = np.hypot(*(table.places[best] - at).T)
        for _ in range(steps):
            velocity = committed_velocities(
                board, at, e, seen, own, field, commitments, steps, period
            )
            assert np.hypot(*velocity) <= 1.0 + 1e-9
            at, e, seen = at + period * velocity, e + 0.01, np.array([[False]])
        seen = np.array([[True]])
        apart = np.hypot(*(table.places[best] - at).T)
        assert apart.min() < 1e-9
        # The nearest of those that promise the same.
        assert distances[apart.argmin()] == pytest.approx(distances.min())
        moved += distances.min() > 0
    assert moved > 3


def test_a_commitment_ends_where_the_evader_is_another(table):
    board = make_board(table)
    evaders = np.array([3.0, 1.0, 1.0, 0.4])
    seen, field = np.array([[True, True]]), np.zeros(2)
    commitments = np.zeros((1, COMMITMENT))
    for j in (0, 1):
        game = board, np.array([1.1, 0.9]), evaders, seen, np.array([j]), field
        committed_velocities(*game, commitments, 4, 0.05)
        assert commitments[0, 2:].tolist() == [3.0, float(j)]
