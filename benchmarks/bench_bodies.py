"""What bodies cost: games from random starts with and without them, gaps, and who waits for whom.

A hundred games each, or as GAMES says: `GAMES=1000 make bench ARGS="-k bodies"`; on a ROS map with
SIGHTFIELD_MAP=.../map.yaml.
"""

import os
from dataclasses import replace

import numpy as np
import pytest

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.tracking.game import set_up_game, with_random_starts
from sightfield.diagrams.tracking.report import summarise_tracking
from sightfield.diagrams.tracking.run import TrackingRun, run_tracking
from sightfield.diagrams.tracking.scenario import TrackingScenario
from sightfield.diagrams.world_source import WorldSource
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.statistics import paired_difference
from sightfield.systems.numerics.tracking.collision_avoidance import avoid

pytestmark = pytest.mark.benchmarks

GAMES = int(os.environ.get("GAMES", "100"))
TEAMS = ["thesis_3v3", "thesis_3v4", "thesis_4v3", "thesis_borda_4v3"]

# Slower than this a robot stands [m/s]; nearer than this a teammate may be why [m].
STANDS, NEAR = 0.01, 0.05


def longest_wait(run: TrackingRun) -> float:
    """How long a pursuer stood that would have gone at half its speed but for a teammate [s]."""
    scenario = run.game.scenario
    team, period = scenario.pursuers, scenario.period
    places, wishes = run.log["pursuer_position"], run.log["pursuer_velocity"]
    speeds = np.hypot(*np.diff(places, axis=0).transpose(2, 0, 1)) / period
    wanted = np.hypot(*wishes[:-1].transpose(2, 0, 1)) > 0.5 * team.top_speed
    longest = 0
    for i in range(team.size):
        mates = np.delete(places[:-1], i, axis=1) - places[:-1, i : i + 1]
        gaps = np.hypot(mates[..., 0], mates[..., 1]).min(axis=1) - 2 * team.radius
        steps = 0
        for k in range(len(speeds)):
            stands = wanted[k, i] and speeds[k, i] < STANDS and gaps[k] < NEAR
            steps = steps + 1 if stands and alone(run, i, k) > 0.5 * team.top_speed else 0
            longest = max(longest, steps)
    return longest * period


def alone(run: TrackingRun, i: int, k: int) -> float:
    """Speed at which pursuer i would go at sample k without its teammates [m/s]."""
    scenario = run.game.scenario
    velocity = avoid(
        *build_edge_index(*run.game.pursuer_regions),
        run.log["pursuer_position"][k, i].copy(),
        run.log["pursuer_velocity"][k, i].copy(),
        np.array((scenario.pursuer_radii or [0.0])[:1]),
        run.log["evader_position"][k].ravel().copy(),
        np.array(scenario.evader_radii or []),
        np.zeros(1),
        np.zeros(1, dtype=bool),
        0,
        0.0,
        0.0,
        scenario.pursuers.top_speed,
        scenario.period,
    )
    return float(np.hypot(*velocity))


@pytest.mark.parametrize("name", TEAMS)
def test_games_with_bodies_and_without(name):
    scenario = with_random_starts(load_scenario(TrackingScenario, find_scenario(name)))
    where = "its arena"
    if "SIGHTFIELD_MAP" in os.environ:
        where = os.environ["SIGHTFIELD_MAP"]
        scenario = replace(scenario, world=WorldSource(file=where))
    world = scenario.world.load()
    gaps, waits, times, free = [], [], [], []
    for seed in range(GAMES):
        game = set_up_game(replace(scenario, seed=seed), world)
        run = run_tracking(game)
        summary = summarise_tracking(run, name)
        assert summary["contacts"] == 0
        gaps.append(summary["min_body_gap"])
        waits.append(longest_wait(run))
        times.append(run.tracking_time)
        ghosts = set_up_game(replace(scenario, seed=seed, bodies=False), world)
        free.append(run_tracking(ghosts).tracking_time)
    change = paired_difference(np.array(times), np.array(free))
    late = int((np.array(waits) > 5.0).sum())
    print(
        f"\n{name} in {where}, {GAMES} games: least gap {min(gaps):.4f} m; waits beyond 5 s in "
        f"{late}, longest {max(waits):.1f} s; mean {np.mean(times):.1f} s with bodies, "
        f"{np.mean(free):.1f} s without, difference {change.mean:+.1f} "
        f"[{change.low:+.1f}, {change.high:+.1f}]"
    )
