"""What evaders choose against a rule that they know is as it was recorded."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.edge_index import build_edge_index, point_is_free
from sightfield.systems.numerics.geometry.segment_sight import build_corner_index
from sightfield.systems.numerics.geometry.world import make_world, shrink_world
from sightfield.systems.numerics.tracking.best_response.rollouts import (
    ALONG,
    BY_THE_GAME,
    FIXED,
    GREATEST_RISK,
    LEAST_RISK,
    LOOKAHEAD_PURSUIT,
    TO_POINT,
    GameRules,
    Rollout,
    choose_plan,
    play_plan,
)
from sightfield.systems.numerics.tracking.corner_game import corner_table
from sightfield.systems.numerics.tracking.corner_policies import FIELDS
from sightfield.systems.numerics.tracking.visibility_game.board import make_board
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.responsibilities import make_team_board
from sightfield.systems.numerics.tracking.visibility_game.two_evaders import solve_two_evaders

# No wall lies along an axis, and no two corners are alike.
WORLD = make_world(
    [(0.2, -0.3), (3.6, 0.4), (3.1, 1.9), (2.0, 1.6), (1.6, 2.9), (0.4, 2.4), (-0.3, 1.2)],
    [[(0.7, 0.6), (1.4, 0.7), (1.1, 1.5)], [(2.3, 0.6), (2.6, 0.5), (2.8, 1.1), (2.4, 1.2)]],
)
INDEX = build_edge_index(WORLD)
PURSUING, EVADING = (build_edge_index(*shrink_world(WORLD, radius)) for radius in (0.08, 0.05))
SPEEDS = {"pursuer_speed": 0.7, "evader_speed": 0.31}
COUNT, EVADERS = 3, 3

GAMES = {
    "margin": {"matching": LEAST_RISK, "held": True},
    "table": {"field": FIELDS["table"], "matching": GREATEST_RISK, "riskiest": True},
    "lookahead": {"field": LOOKAHEAD_PURSUIT, "matching": FIXED},
    "guarantee": {"matching": LEAST_RISK, "riskiest": True},
    "certified": {"matching": FIXED},
    "shared": {"matching": FIXED},
}


@pytest.fixture(scope="module")
def boards():
    """By the name of a rule, the board and the team's board that pursuers play by."""
    middle = solve_visibility_game(WORLD, **SPEEDS, grid=0.2)
    lower = solve_visibility_game(WORLD, **SPEEDS, grid=0.45, bound="lower")
    double = solve_two_evaders(WORLD, **SPEEDS, grid=0.4, horizon=20.0)
    return {
        "guarantee": (make_board(middle), None),
        "certified": (make_board(lower), None),
        "shared": (None, make_team_board(middle, double)),
        "step": lower.step,
    }


def rules_of(name, boards):
    """What the evaders know of a game."""
    options = {"field": FIELDS["margin"], "held": False, "riskiest": False} | GAMES[name]
    return GameRules(
        world=INDEX,
        corner_index=build_corner_index(WORLD, INDEX),
        corners=corner_table(WORLD),
        pursuer_region=PURSUING,
        evader_region=EVADING,
        weightings=np.array([2, 4, 1]),
        risk_kinds=np.array([0, 1, 2]),
        ratio=SPEEDS["evader_speed"] / SPEEDS["pursuer_speed"],
        **SPEEDS,
        standoff=0.051,
        commitment=boards["step"] if name == "certified" else 0.0,
        **options,
    )


def draw_game(rng):
    """Positions, the evaders' velocities, and an assignment."""
    teams = []
    for region in (PURSUING, EVADING):
        points = rng.uniform(WORLD.bounds[:2], WORLD.bounds[2:], (60, 2))
        free = points[[bool(point_is_free(region, *point)) for point in points]]
        teams.append(free[:3].ravel())
    velocities = SPEEDS["evader_speed"] * rng.uniform(-0.6, 0.6, 2 * EVADERS)
    return *teams, velocities, rng.integers(-1, EVADERS, COUNT)


@pytest.mark.parametrize("name", GAMES)
def test_plans_are_worth_what_is_recorded(name, boards, as_recorded):
    rules, found = rules_of(name, boards), []
    board, team = boards.get(name, (None, None))
    for seed in range(28):
        rng = np.random.default_rng(seed)
        game = draw_game(rng)
        owners = None if team is None else rng.integers(-1, COUNT, EVADERS)
        j, angle = seed % EVADERS, rng.uniform(-np.pi, np.pi)
        headings, leg = 0 if seed % 4 == 1 else 5, 0.6 if seed % 3 == 0 else math.inf
        rollout = Rollout(1.9, 0.17, headings, leg)
        plans = [
            [BY_THE_GAME, 0.0, 0.0],
            [ALONG, math.cos(angle), math.sin(angle)],
            [TO_POINT, *rng.uniform(WORLD.bounds[:2], WORLD.bounds[2:])],
        ]
        more = board, team, owners
        for plan in plans:
            for least in (np.inf, 0.8):
                value = play_plan(rules, rollout, j, *game, np.array(plan), least, *more)
                found.append([value, 0.0, 0.0, 0.0])
        plan, value = choose_plan(rules, rollout, j, *game, np.array(plans[1]), *more)
        found.append([value, *plan])
    as_recorded(np.array(found))
