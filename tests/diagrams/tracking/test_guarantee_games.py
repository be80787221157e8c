"""Games of pursuers that play by the solved visibility game."""

import numpy as np
import pytest

from sightfield.diagrams.tracking.game import set_up_game
from sightfield.diagrams.tracking.run import run_tracking
from sightfield.diagrams.tracking.scenario import Evaders, Pursuers, TrackingScenario
from sightfield.diagrams.world_source import WorldSource
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)

ARENA = WorldSource(
    boundary=[[0, 0], [4, 0], [4, 4], [0, 4]],
    obstacles=[[[1.53, 1.41], [2.71, 1.41], [2.71, 2.57], [1.53, 2.57]]],
)


def make_scenario(pursuer, evader, radius=0.0, policy="adversarial", **pursuing):
    team = {"top_speed": 0.3, "positions": [pursuer], "radius": radius, "smoothing": 0.0}
    return TrackingScenario(
        world=ARENA,
        pursuers=Pursuers(**(team | {"field": "guarantee", "grid": 0.15} | pursuing)),
        evaders=Evaders(top_speed=0.09, positions=[evader], radius=radius, policies=[policy]),
        seconds=40.0,
    )


@pytest.mark.parametrize("radius", [0.0, 0.12])
@pytest.mark.parametrize("policy", ["adversarial", "best_response"])
def test_what_can_be_kept_is_kept(radius, policy):
    scenario = make_scenario([0.9, 0.7], [1.9, 1.1], radius, policy)
    game = set_up_game(scenario)
    table = solve_visibility_game(
        game.world,
        pursuer_speed=0.3,
        evader_speed=0.09,
        grid=0.15,
        pursuer_regions=game.pursuer_regions,
        evader_regions=game.evader_regions,
    )
    assert table.time(game.pursuer_starts[0, :2], game.evader_starts[0, :2]) == np.inf
    run = run_tracking(game)
    assert run.lost_evader is None
    assert run.tracking_time == 40.0


def test_what_is_lost_is_held_about_as_long_as_the_table_says():
    scenario = make_scenario([0.5, 1.2], [3.0, 1.3])
    game = set_up_game(scenario)
    table = solve_visibility_game(game.world, pursuer_speed=0.3, evader_speed=0.09, grid=0.05)
    promised = table.time([0.5, 1.2], [3.0, 1.3])
    assert 0.5 < promised < 20.0
    assert run_tracking(game).tracking_time > promised - 1.0


def test_a_grid_has_to_be_positive():
    with pytest.raises(InvalidInput, match="`grid` must be positive"):
        make_scenario([0.5, 0.5], [1.0, 0.5], grid=0.0)
