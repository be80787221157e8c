"""What evaders play beforehand against pursuers of the visibility game is how these then play."""

import math

import numpy as np
import pytest
from pydrake.systems.framework import LeafSystem

from sightfield.diagrams.tracking.game import set_up_game
from sightfield.diagrams.tracking.run import run_tracking
from sightfield.diagrams.tracking.scenario import Evaders, Pursuers, TrackingScenario
from sightfield.diagrams.tracking.solved_game import solved_game
from sightfield.diagrams.world_source import WorldSource
from sightfield.systems.numerics.geometry.corner_sight import build_corner_index
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.tracking.best_response.rollouts import (
    ALONG,
    FIXED,
    GameRules,
    Rollout,
    play_plan,
)
from sightfield.systems.numerics.tracking.corner_fields import FIELDS
from sightfield.systems.numerics.tracking.corner_table import corner_table
from sightfield.systems.numerics.tracking.risk import RISK_FUNCTIONS, RISK_VECTORS
from sightfield.systems.numerics.tracking.visibility_game.board import make_board

PERIOD = 0.05


@pytest.fixture(scope="module")
def game():
    return set_up_game(
        TrackingScenario(
            world=WorldSource(
                boundary=[[0, 0], [4, 0], [4, 4], [0, 4]],
                obstacles=[
                    [[1.53, 1.41], [2.71, 1.41], [2.71, 2.57], [1.53, 2.57]],
                    [[0.4, 3.0], [1.2, 3.0], [1.2, 3.45], [0.4, 3.45]],
                ],
            ),
            pursuers=Pursuers(
                top_speed=0.3, positions=[[0.5, 1.2]], field="guarantee", grid=0.15, smoothing=0.0
            ),
            evaders=Evaders(top_speed=0.2, positions=[[2.45, 1.2]]),
            seconds=20.0,
            period=PERIOD,
        )
    )


@pytest.fixture(scope="module")
def rules(game):
    index = build_edge_index(game.world)
    return GameRules(
        world=index,
        corner_index=build_corner_index(game.world, index),
        corners=corner_table(game.world),
        pursuer_region=index,
        evader_region=index,
        field=FIELDS["margin"],
        weightings=np.array([RISK_VECTORS["proportional"]]),
        matching=FIXED,
        held=True,
        riskiest=False,
        risk_kinds=np.array([RISK_FUNCTIONS["total"]]),
        ratio=2 / 3,
        pursuer_speed=0.3,
        evader_speed=0.2,
        standoff=1e-6,
    )


class Straight(LeafSystem):
    """An evader that runs along a direction."""

    def __init__(self, velocity):
        super().__init__()
        self.DeclareVectorOutputPort(
            "velocity", 2, lambda context, output: output.set_value(velocity)
        )


def test_a_straight_run_ends_when_it_was_said_to(game, rules):
    board, ends = make_board(solved_game(game)), []
    # Most of them past the box's corner on the right.
    for angle in [*np.linspace(0.1, 1.3, 8), 2.5, 4.0]:
        along = np.array([math.cos(angle), math.sin(angle)])
        run = run_tracking(game, evasion=Straight(0.2 * along))
        said = play_plan(
            rules,
            Rollout(horizon=20.0, step=PERIOD, headings=8),
            0,
            game.pursuer_starts[:, :2].ravel(),
            game.evader_starts[:, :2].ravel(),
            np.zeros(2),
            np.array([0]),
            np.array([ALONG, *along]),
            math.inf,
            board,
        )
        if run.lost_evader is None:
            assert said >= 20.0
        else:
            assert said == pytest.approx(run.tracking_time, abs=1e-3)
            ends.append(said)
    assert len(ends) >= 3
