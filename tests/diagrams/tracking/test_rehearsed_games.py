"""What evaders play beforehand against pursuers of the visibility game is how these then play."""

import math

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import LeafSystem

from sightfield.diagrams.tracking.game import set_up_game
from sightfield.diagrams.tracking.make_tracking import MakeTracking
from sightfield.diagrams.tracking.run import run_tracking
from sightfield.diagrams.tracking.scenario import Evaders, Pursuers, TrackingScenario
from sightfield.diagrams.tracking.solved_game import solved_game, solved_game_of_two
from sightfield.diagrams.world_source import WorldSource
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import build_corner_index
from sightfield.systems.numerics.tracking.best_response.rollouts import (
    ALONG,
    FIXED,
    GameRules,
    Rollout,
    play_plan,
)
from sightfield.systems.numerics.tracking.corner_game import corner_table
from sightfield.systems.numerics.tracking.corner_policies import FIELDS
from sightfield.systems.numerics.tracking.risk import RISK_FUNCTIONS, RISK_VECTORS
from sightfield.systems.numerics.tracking.visibility_game.board import make_board
from sightfield.systems.numerics.tracking.visibility_game.responsibilities import (
    NOBODY,
    make_team_board,
)
from sightfield.systems.tracking import best_response_evaders
from sightfield.systems.tracking.best_response_evaders import IN_TEAMS, BestResponseEvaders

PERIOD = 0.05


OBSTACLES = [
    [[1.53, 1.41], [2.71, 1.41], [2.71, 2.57], [1.53, 2.57]],
    [[0.4, 3.0], [1.2, 3.0], [1.2, 3.45], [0.4, 3.45]],
]


def make_game(pursuers, evaders, **pursuing):
    return set_up_game(
        TrackingScenario(
            world=WorldSource(boundary=[[0, 0], [4, 0], [4, 4], [0, 4]], obstacles=OBSTACLES),
            pursuers=Pursuers(
                **{
                    "top_speed": 0.3,
                    "positions": pursuers,
                    "field": "guarantee",
                    "assignment": "guarantee",
                    "grid": 0.15,
                    "grid_of_two": 0.3,
                    "smoothing": 0.0,
                    **pursuing,
                }
            ),
            evaders=Evaders(top_speed=0.2, positions=evaders),
            seconds=20.0,
            period=PERIOD,
        )
    )


def make_rules(game, commitment=0.0):
    index, pursuers = build_edge_index(game.world), len(game.pursuer_starts)
    return GameRules(
        world=index,
        corner_index=build_corner_index(game.world, index),
        corners=corner_table(game.world),
        pursuer_region=index,
        evader_region=index,
        field=FIELDS["margin"],
        weightings=np.full(pursuers, RISK_VECTORS["proportional"]),
        matching=FIXED,
        held=True,
        riskiest=False,
        risk_kinds=np.full(pursuers, RISK_FUNCTIONS["total"]),
        ratio=2 / 3,
        pursuer_speed=0.3,
        evader_speed=0.2,
        standoff=1e-6,
        commitment=commitment,
    )


class Straight(LeafSystem):
    """Evaders of which the first runs along a direction and the others stand."""

    def __init__(self, velocity, evaders):
        super().__init__()
        velocities = np.append(velocity, np.zeros(2 * (evaders - 1)))
        self.DeclareVectorOutputPort(
            "velocity", 2 * evaders, lambda context, output: output.set_value(velocities)
        )


def ends_of(game, angle, **known):
    """When sight of the first evader ends, as played and as said beforehand; infinite for never."""
    along = np.array([math.cos(angle), math.sin(angle)])
    m = len(game.evader_starts)
    run = run_tracking(game, evasion=Straight(0.2 * along, m))
    said = play_plan(
        make_rules(game, known.pop("commitment", 0.0)),
        Rollout(horizon=20.0, step=PERIOD, headings=8),
        0,
        game.pursuer_starts[:, :2].ravel(),
        game.evader_starts[:, :2].ravel(),
        np.zeros(2 * m),
        run.log["assignment"][0],
        np.array([ALONG, *along]),
        math.inf,
        *(known.get(name) for name in ("board", "team", "responsible")),
    )
    return (
        math.inf if run.lost_evader != 0 else run.tracking_time,
        math.inf if said >= 20.0 else said,
        run,
    )


# Most of them past the box's corner on the right.
ANGLES = [*np.linspace(0.1, 1.3, 8), 2.5, 4.0]


def test_a_straight_run_ends_when_it_was_said_to():
    game = make_game([[0.5, 1.2]], [[2.45, 1.2]])
    board, lost = make_board(solved_game(game)), 0
    for angle in ANGLES:
        played, said, _ = ends_of(game, angle, board=board)
        assert said == pytest.approx(played, abs=1e-3)
        lost += math.isfinite(played)
    assert lost >= 3


def test_evaders_know_how_pursuers_share_them_out():
    # The first pursuer watches the one that runs and the one behind itself.
    game = make_game([[0.5, 1.2], [0.6, 3.7]], [[2.45, 1.2], [0.9, 0.5], [2.2, 3.3]])
    team = make_team_board(solved_game(game), solved_game_of_two(game))
    nobody, lost = np.full(3, NOBODY), 0
    for angle in ANGLES:
        played, said, run = ends_of(game, angle, team=team, responsible=nobody)
        assert run.lost_evader in (None, 0)
        assert said == pytest.approx(played, abs=1e-3)
        lost += math.isfinite(played)
    assert lost >= 3


def test_evaders_know_where_certified_pursuers_commit_themselves_to():
    game = make_game([[0.5, 1.2]], [[2.45, 1.2]], field="certified")
    table = solved_game(game, "lower")
    known = {"board": make_board(table), "commitment": table.step}
    lost, near = 0, 0
    for angle in ANGLES:
        played, said, _ = ends_of(game, angle, **known)
        assert math.isfinite(said) == math.isfinite(played)
        if math.isfinite(played):
            lost += 1
            near += abs(said - played) < 0.25
    assert lost >= 3
    assert near >= 0.8 * lost


def test_a_commitment_lasts_as_long_in_every_rollout(monkeypatch):
    """Plans that look farther ahead take longer steps: they counted in the steps of the others."""
    game = make_game([[0.5, 1.2]], [[2.45, 1.2]], field="certified")
    table, choose, seen = solved_game(game, "lower"), best_response_evaders.choose_plan, set()

    def choose_late(rules, rollout, *others):
        seen.add((rules.commitment, rollout.step))
        plan, _ = choose(rules, rollout, *others)
        return plan, math.inf

    monkeypatch.setattr(best_response_evaders, "choose_plan", choose_late)
    evaders = BestResponseEvaders(
        game.world,
        game.pursuer_regions,
        game.evader_regions,
        pursuers=1,
        evaders=1,
        pursuer_speed=0.3,
        evader_speed=0.2,
        pursuit="certified",
        foresight=IN_TEAMS._replace(patience=0.0),
        table=table,
    )
    Simulator(MakeTracking(game, evasion=evaders)).AdvanceTo(2.0)
    steps = IN_TEAMS.rollout.step, IN_TEAMS.beyond.step
    assert seen == {(table.step, step) for step in steps}
    assert len(seen) == 2
