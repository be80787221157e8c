"""Ways to where an evader can be guarded, against plain search in Python."""

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.visibility_game.board import make_board
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.regain import (
    steps_to_guard,
    way_to_guard,
)

ROOM = make_world([(0, 0), (4, 0), (4, 4), (2.03, 4), (2.03, 2.03), (0, 2.03)])
TABLE = solve_visibility_game(ROOM, pursuer_speed=1.0, evader_speed=0.3, grid=0.2)
ONE = np.ones((1, 1), dtype=bool)


def distances(table, node, nodes):
    """From evader nodes to the nearest one that is lost some day, seen from a node [cells]."""
    times = table.times_from(table.places[node])
    losing = np.argwhere(np.isfinite(times))
    if len(losing) == 0:
        return np.full(len(nodes), 255.0)
    return np.hypot(*(losing[:, None, :] - nodes[None]).transpose(2, 0, 1)).min(axis=0)


def soonest(table, p, e):
    """The least k such that all that the evader reaches in k steps is kept from a place k away."""
    here, rules = table.nearest_place(p), table.rules
    row, column = table._evader_node(np.array(e))
    layer, reached = [here], {here}
    for k in range(1000):
        for q in layer:
            # A whole number of cells, as the tables keep it.
            far = np.floor(distances(table, q, np.array([[row, column]]))[0])
            if table.time(table.places[q], table.evader_grid.at(row, column)) > 0 and (
                far > k * np.sqrt(5.0)
            ):
                return k
        following = set()
        for q in layer:
            following |= set(
                rules.neighbours[rules.neighbour_starts[q] : rules.neighbour_starts[q + 1]]
            )
        layer = sorted(following - reached)
        reached |= following
        if not layer:
            return None
    return None


@pytest.mark.parametrize("seed", range(8))
def test_no_way_is_sooner(seed):
    rng = np.random.default_rng(seed)
    p = TABLE.places[rng.integers(len(TABLE.places))]
    rows, columns = np.nonzero(TABLE.evader_nodes)
    k = rng.integers(len(rows))
    e = TABLE.evader_grid.at(rows[k], columns[k])
    found = steps_to_guard(make_board(TABLE), p, e, ONE)[0, 0]
    expected = soonest(TABLE, p, e)
    assert expected is not None
    assert found == expected


def test_the_way_leads_there_step_by_step():
    board = make_board(TABLE)
    p, e = np.array([0.5, 1.5]), np.array([3.5, 3.5])
    assert TABLE.time(p, e) == 0.0
    steps = steps_to_guard(board, p, e, ONE)[0, 0]
    taken = 0
    while (node := way_to_guard(board, *p, *e)) >= 0:
        before, p = p, TABLE.places[node]
        assert np.hypot(*(p - before)) < 0.2 * 2.24 + 0.15
        taken += 1
        assert taken <= steps + 1
    assert TABLE.time(p, e) == np.inf


def test_what_is_not_asked_for_is_not_searched():
    p, e = np.array([0.5, 1.5]), np.array([3.5, 3.5])
    assert steps_to_guard(make_board(TABLE), p, e, ~ONE)[0, 0] == np.inf


def test_off_the_map_there_is_no_way():
    board = make_board(TABLE)
    assert way_to_guard(board, 0.5, 1.5, 9.0, 9.0) == -1
    assert way_to_guard(board, 9.0, 9.0, 0.5, 1.5) == -1
