"""What the games of one evader's plans have in common, against each game played afresh."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import build_corner_index, segment_is_clear
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.best_response import common_play
from sightfield.systems.numerics.tracking.best_response.rollouts import (
    ALONG,
    FIXED,
    LEAST_RISK,
    GameRules,
    Rollout,
    choose_plan,
    play_plan,
)
from sightfield.systems.numerics.tracking.corner_game import corner_table
from sightfield.systems.numerics.tracking.corner_policies import FIELDS
from sightfield.systems.numerics.tracking.risk import RISK_FUNCTIONS, RISK_VECTORS
from sightfield.systems.numerics.tracking.visibility_game.board import make_board
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)

# Two boxes, so that some evaders are seen by one pursuer, by two or by nobody.
ROOM = make_world(
    [(0, 0), (5, 0), (5, 4), (0, 4)],
    [
        [(1.03, 1.02), (1.96, 1.02), (1.96, 2.51), (1.03, 2.51)],
        [(3.02, 1.53), (3.87, 1.53), (3.87, 2.98), (3.02, 2.98)],
    ],
)
INDEX = build_edge_index(ROOM)
PURSUERS, EVADERS = 3, 3
ROLLOUT = Rollout(horizon=4.0, step=0.2, headings=8)


def rules(matching):
    return GameRules(
        world=INDEX,
        corner_index=build_corner_index(ROOM, INDEX),
        corners=corner_table(ROOM),
        pursuer_region=INDEX,
        evader_region=INDEX,
        field=FIELDS["margin"],
        weightings=np.full(PURSUERS, RISK_VECTORS["proportional"]),
        matching=matching,
        held=False,
        riskiest=False,
        risk_kinds=np.full(PURSUERS, RISK_FUNCTIONS["total"]),
        ratio=0.3,
        pursuer_speed=1.0,
        evader_speed=0.3,
        standoff=1e-6,
    )


@pytest.fixture(scope="module")
def table():
    return solve_visibility_game(ROOM, pursuer_speed=1.0, evader_speed=0.3, grid=0.2)


def drawn(table, rng):
    """Places of both teams, the evaders' velocities, and an assignment."""
    rows, columns = np.nonzero(table.evader_nodes)
    nodes = rng.integers(len(rows), size=EVADERS)
    pursuers = table.places[rng.integers(len(table.places), size=PURSUERS)]
    evaders = table.evader_grid.at(rows[nodes], columns[nodes])
    velocities = rng.uniform(-0.2, 0.2, 2 * EVADERS)
    # Two after one evader, and one after none, are among them.
    assignment = rng.integers(-1, EVADERS, PURSUERS)
    return pursuers.ravel(), evaders.ravel(), velocities, assignment


@pytest.mark.parametrize("matching", [FIXED, LEAST_RISK])
@pytest.mark.parametrize("solved", [True, False], ids=["guarantee", "margin"])
def test_plans_come_to_what_they_come_to_alone(table, matching, solved):
    board, known, rng = (
        make_board(table) if solved else None,
        rules(matching),
        np.random.default_rng(4),
    )
    hidden = 0
    for _ in range(40):
        pursuers, evaders, velocities, assignment = drawn(table, rng)
        seen = [p for p in pursuers.reshape(-1, 2) if segment_is_clear(INDEX, *p, *evaders[:2])]
        if not seen:
            continue
        game = known, ROLLOUT, 0, pursuers, evaders, velocities, assignment
        plan, value = choose_plan(*game, np.zeros(3), board, None, None)
        assert value == play_plan(*game, plan, math.inf, board, None, None)
        nearest = min(seen, key=lambda p: np.hypot(*(p - evaders[:2])))
        away = math.atan2(*(evaders[:2] - nearest)[::-1])
        for k in range(ROLLOUT.headings):
            angle = away + 2.0 * math.pi * k / ROLLOUT.headings
            along = np.array([ALONG, math.cos(angle), math.sin(angle)])
            assert value <= play_plan(*game, along, math.inf, board, None, None) + 1e-9
        hidden += value < ROLLOUT.horizon
    assert 3 < hidden < 30


def test_only_who_stands_and_minds_as_before_answers_as_before():
    known = common_play.no_common_play(3, 2, 2, 4)
    places, minded = np.array([1.0, 2.0, 3.0, 4.0]), np.array([[True, False], [False, True]])
    mine = np.array([0, 1])
    assert not common_play.answers_as_before(known, 0, places, mine, minded, 0, 1)
    known.turns[0] = 1
    known.pursuers[0] = places
    common_play.remember_answers(known, 0, mine, minded, np.arange(4.0))

    def same(i, j, turn=0, places=places, mine=mine, minded=minded):
        return common_play.answers_as_before(known, turn, places, mine, minded, i, j)

    assert same(0, 1)
    assert same(1, 0)
    # It minds, or goes after, the one that tries its plans.
    assert not same(0, 0)
    assert not same(0, 1, mine=np.array([1, 1]))
    assert not same(0, 1, minded=np.array([[True, True], [False, True]]))
    # It stands elsewhere, has another evader, minds another, or nobody got so far.
    assert not same(0, 1, places=np.array([1.0, 2.0 + 1e-12, 3.0, 4.0]))
    assert not same(1, 0, mine=np.array([0, -1]))
    assert not same(1, 0, minded=np.zeros((2, 2), dtype=bool))
    assert not same(0, 1, turn=1)
