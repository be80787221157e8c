"""How surely evaders are found again that cameras lose from sight: thousands of occlusions.

Trials are drawn at random, other ones for another SEED.

    make bench ARGS="-k occlusions"                          # an hour
    SEED=900 TRIALS=12 make bench ARGS="-k occlusions"       # seven minutes
"""

import os
import time

import numpy as np
import pytest

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.tracking.game import set_up_game
from sightfield.diagrams.vision import scenarios
from sightfield.diagrams.vision.scenario import PictureTrackingScenario
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.vision.whereabouts.evader_tracks import Search
from sightfield.systems.numerics.vision.whereabouts.occlusion_trial import run_occlusion_trial
from sightfield.systems.numerics.vision.whereabouts.reachable_set import make_place_grid

pytestmark = pytest.mark.benchmarks

# Trials of each rate, the first one's seed, and how long each lasts [s].
TRIALS, SEED, SECONDS = int(os.environ.get("TRIALS", "60")), int(os.environ.get("SEED", "0")), 300.0


@pytest.mark.parametrize("evaders", [1, 2])
@pytest.mark.parametrize("rate", [5.0, 10.0, 20.0])
def test_occlusions_of_one_to_thirty_seconds(evaders, rate):
    scenario = load_scenario(PictureTrackingScenario, find_scenario("omni_2v2", scenarios), [])
    game = set_up_game(scenario)
    speed = scenario.evaders.top_speed
    search = Search(
        grid=make_place_grid(game.evader_regions),
        walls=build_edge_index(game.world),
        colours=(0,) * evaders,
        speed=speed,
        density=speed**2 / 0.15,
        shell_radius=0.1,
        certain_range=(0.35, 2.5),
        body_radius=0.1,
    )
    began = time.process_time()
    trials = [
        run_occlusion_trial(
            search, cameras=evaders, rate=rate, seconds=SECONDS, camera_speed=0.3, seed=seed
        )
        for seed in range(SEED, SEED + TRIALS)
    ]
    used = time.process_time() - began
    hidden = np.concatenate([each.hidden for each in trials])
    found = np.concatenate([each.reacquired for each in trials])
    counted = (hidden >= 1) & (hidden <= 30) & ~np.isnan(found)
    quick, worst = np.mean(found[counted] <= 0.5), found[counted].max()
    print(
        f"\n{evaders} evaders, {rate:g} Hz: {counted.sum()} occlusions of 1 to 30 s; found within "
        f"0.5 s {quick:.2%}, at worst after {worst:.2f} s; in the set "
        f"{np.nanmean([each.inside for each in trials]):.2%} of the time; set beyond the disc by "
        f"{max(each.excess for each in trials):.1e} m; told apart "
        f"{np.nanmean([each.apart for each in trials]):.2%}; {used:.0f} CPU-s for "
        f"{TRIALS * SECONDS:.0f} s"
    )
