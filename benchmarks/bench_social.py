"""How soon, how well and how safely an evader is found in the pictures of friends.

Fifty searches of a minute, each some ninety pictures that are drawn and read: half an hour.
"""

import numpy as np
import pytest

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.social import scenarios
from sightfield.diagrams.social.report import summarise_search
from sightfield.diagrams.social.run import run_social_search
from sightfield.diagrams.social.scenario import SocialScenario
from sightfield.diagrams.social.social_game import set_up_social_game
from sightfield.systems.numerics.social.network.acceptance import MemoryNetwork

pytestmark = pytest.mark.benchmarks

SEEDS, SECONDS = 50, 60


def test_fifty_searches_of_the_thesis_maze():
    path = find_scenario("thesis_maze", scenarios)
    errors, first, held, factors = [], [], [], []
    collisions, wall_gap, robot_gap = 0, np.inf, np.inf
    for seed in range(SEEDS):
        settings = [f"seed={seed}", f"seconds={SECONDS}"]
        game = set_up_social_game(load_scenario(SocialScenario, path, settings))
        run = run_social_search(game, MemoryNetwork(game.temperaments, seed))
        numbers = summarise_search(run, "thesis_maze")
        errors += run.location_errors.tolist()
        if numbers["time_to_first_location"] is not None:
            first.append(numbers["time_to_first_location"])
            held.append(numbers["tracking_error"]["median"])
        collisions += numbers["collisions"]
        wall_gap = min(wall_gap, numbers["min_wall_gap"])
        robot_gap = min(robot_gap, numbers["min_robot_gap"])
        factors.append(numbers["realtime_factor"])
        print(seed, numbers["time_to_first_location"], numbers["location_error"], flush=True)
    print(
        f"\n{SEEDS} searches of {SECONDS} s: the evader is located in {len(first)}, first after "
        f"{np.median(first):.1f} s (median), {len(errors)} times in all; "
        f"error {1000 * np.median(errors):.1f} mm (median), "
        f"{1000 * np.quantile(errors, 0.9):.0f} mm (90 %), {1000 * max(errors):.0f} mm (worst); "
        f"the estimate held is {np.median(held):.2f} m off (median); {collisions} collisions, "
        f"nearest {1000 * wall_gap:.0f} mm to a wall, {1000 * robot_gap:.0f} mm to a robot; "
        f"{np.median(factors):.2f} simulated seconds per second"
    )
    assert len(first) >= 0.9 * SEEDS
    assert np.median(errors) < 0.15
    assert collisions == 0
