"""Games mirrored, turned, moved, rescaled and renumbered end at the same time."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from sightfield.diagrams.tracking.game import TrackingGame, set_up_game
from sightfield.diagrams.tracking.run import TrackingRun, run_tracking
from sightfield.diagrams.tracking.scenario import Evaders, Pursuers, TrackingScenario
from sightfield.diagrams.world_source import WorldSource
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.random_arena import Arena, draw_arena
from sightfield.systems.numerics.geometry.segment_sight import build_corner_index
from sightfield.systems.numerics.tracking.corner_game import corner_table
from sightfield.systems.numerics.tracking.risk import RISK_FUNCTIONS, team_risk
from sightfield.systems.numerics.tracking.sight_state import observe

ANGLE, SCALE, SHIFT = 0.7, 1.7, np.array([13.0, -7.0])


def source_of(boundary, obstacles):
    rings = [np.asarray(ring).tolist() for ring in obstacles]
    return WorldSource(boundary=np.asarray(boundary).tolist(), obstacles=rings)


def started(scenario, pursuers, evaders):
    """The scenario with poses for both teams, shape (n, 3) each."""

    def placed(team, poses):
        positions, headings = poses[:, :2].tolist(), poses[:, 2].tolist()
        return replace(team, positions=positions, headings=headings, count=len(poses))

    return replace(
        scenario,
        pursuers=placed(scenario.pursuers, pursuers),
        evaders=placed(scenario.evaders, evaders),
    )


def draw_game(seed, size, *, seconds=20.0, policy="adversarial", **strategy):
    """Equal teams at random places of a random arena, looking anywhere."""
    world = draw_arena(Arena(), seed)
    scenario = TrackingScenario(
        world=source_of(world.boundary, world.obstacles),
        pursuers=Pursuers(top_speed=0.3, radius=0.16, count=size, **strategy),
        evaders=Evaders(top_speed=0.09, radius=0.16, count=size, policies=[policy]),
        seconds=seconds,
        seed=seed,
    )
    game, rng = set_up_game(scenario), np.random.default_rng(seed)
    for poses in (game.pursuer_starts, game.evader_starts):
        poses[:, 2] = rng.uniform(-math.pi, math.pi, size)
    return set_up_game(started(scenario, game.pursuer_starts, game.evader_starts))


def carried(game: TrackingGame, order: np.ndarray, *, mirrored: bool) -> TrackingGame:
    """The same game elsewhere, both teams in another order."""
    scenario = game.scenario
    sign = -1.0 if mirrored else 1.0
    c, s = math.cos(ANGLE), math.sin(ANGLE)
    matrix = SCALE * np.array([[c, -s], [s, c]]) @ np.diag([1.0, sign])

    def carry(points):
        return np.asarray(points) @ matrix.T + SHIFT

    def moved(poses):
        return np.column_stack([carry(poses[:, :2]), sign * poses[:, 2] + ANGLE])[order]

    def scaled(team):
        return replace(team, top_speed=SCALE * team.top_speed, radius=SCALE * team.radius)

    world = source_of(carry(game.world.boundary), [carry(ring) for ring in game.world.obstacles])
    changed = replace(
        scenario,
        world=world,
        pursuers=scaled(scenario.pursuers),
        evaders=scaled(scenario.evaders),
    )
    return set_up_game(started(changed, moved(game.pursuer_starts), moved(game.evader_starts)))


def had_equal_choices(run: TrackingRun) -> bool:
    """Whether a team ever chose between two matchings of the same total risk."""
    game, size = run.game, run.game.scenario.pursuers.size
    index, corners = build_edge_index(game.world), corner_table(game.world)
    corner_index, kinds = build_corner_index(game.world, index), np.full(size, 0)
    assert RISK_FUNCTIONS["total"] == 0
    chosen = run.log["assignment"]
    for k, time in enumerate(run.times):
        held = k > 0 and np.array_equal(chosen[k], chosen[k - 1])
        if time > run.tracking_time or (held and game.scenario.pursuers.switch != "none"):
            continue
        pursuers, evaders = (run.log[f"{team}_position"][k] for team in ("pursuer", "evader"))
        sight = observe(index, corner_index, pursuers.ravel(), evaders.ravel())
        visible = sight[: size * size].reshape(size, size) > 0.5
        risk = team_risk(kinds, evaders.ravel(), sight, corners)
        ranked = {}
        for targets in itertools.permutations(range(size)):
            pairs = tuple((i, j) for i, j in enumerate(targets) if visible[i, j])
            ranked[pairs] = (-len(pairs), sum(risk[pair] for pair in pairs))
        first, *rest = sorted(ranked.values())
        if rest and rest[0][0] == first[0] and rest[0][1] - first[1] < 1e-9:
            return True
    return False


def check(game: TrackingGame, seed: int) -> bool:
    """Compare a game with itself elsewhere; whether it was one without equal choices."""
    size = game.scenario.pursuers.size
    order = np.roll(np.arange(size), 1)
    run = run_tracking(game)
    if had_equal_choices(run):
        return False
    other = run_tracking(carried(game, order, mirrored=seed % 2 == 0))
    assert other.tracking_time == pytest.approx(run.tracking_time, abs=1e-6)
    lost = None if other.lost_evader is None else int(order[other.lost_evader])
    assert lost == run.lost_evader
    return True


@pytest.mark.parametrize("hold", ["none", "until_lost"])
@pytest.mark.parametrize("field", ["table", "margin", "lookahead"])
def test_games_of_the_corner_game_s_evaders_end_at_the_same_time_everywhere(field, hold):
    for size in (1, 2, 3):
        compared = [check(draw_game(seed, size, field=field, hold=hold), seed) for seed in range(4)]
        assert sum(compared) >= 2


@pytest.mark.parametrize("hold", ["none", "until_lost"])
@pytest.mark.parametrize("field", ["table", "margin", "lookahead"])
def test_games_of_evaders_that_answer_end_at_the_same_time_everywhere(field, hold):
    strategy = {"field": field, "hold": hold, "policy": "best_response", "seconds": 4.0}
    # An evader of each gets away before the end, whatever the field.
    games = ((0, 1), (7, 2), (36, 3), (37, 3))
    compared = [check(draw_game(seed, size, **strategy), seed) for seed, size in games]
    assert sum(compared) >= 3
