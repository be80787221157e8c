"""How fast pictures are taken, and how long sight is kept on pictures alone.

The study of fifty starts takes a quarter of an hour: it plays every game twice, on pictures and
on true positions.
"""

import time
from dataclasses import replace

import numpy as np
import pytest

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.tracking.game import with_random_starts
from sightfield.diagrams.vision import scenarios
from sightfield.diagrams.vision.report import summarise_picture_tracking
from sightfield.diagrams.vision.run import run_picture_tracking
from sightfield.diagrams.vision.scenario import (
    PictureTrackingScenario,
    practise,
    set_up_picture_game,
)
from sightfield.systems.numerics.vision.omni_optics import make_ray_table
from sightfield.systems.numerics.vision.rendering import render
from sightfield.systems.numerics.vision.sensor import expose
from sightfield.systems.numerics.vision.surroundings import SHELL_COLOURS, Surroundings, shell_of

pytestmark = pytest.mark.benchmarks

SEEDS = 50


def scenario_of(name, *settings):
    return load_scenario(PictureTrackingScenario, find_scenario(name, scenarios), settings)


def test_pictures_of_the_thesis_arena_with_four_shells():
    scenario = scenario_of("omni_2v2")
    vision, world = scenario.vision, scenario.world.load()
    rays, scene = make_ray_table(vision.optics), Surroundings(world=world)
    shells = [shell_of(colour) for colour in list(SHELL_COLOURS)[:4]]
    positions = np.array([[2.9, 1.7], [1.5, 1.5], [2.4, 1.4], [1.6, 0.5]])
    times = []
    for frame in range(60):
        began = time.process_time()
        light = render(vision.optics, rays, scene, (2.0, 1.3, 0.1 * frame), shells, positions)
        expose(vision.quality, light, frame)
        times.append(time.process_time() - began)
    rate = 1 / float(np.median(times[5:]))
    print(
        "\n640 x 480 pixels, four shells, blur and noise: "
        f"{rate:.0f} pictures per second of one core"
    )


@pytest.mark.parametrize("name", ["omni_1v1", "omni_2v2"])
def test_tracking_on_pictures_against_real_time(name):
    scenario = scenario_of(name, "seconds=20")
    run = run_picture_tracking(set_up_picture_game(scenario))
    factor = summarise_picture_tracking(run, name)["realtime_factor"]
    print(f"\n{name} on pictures: {factor:.2f} simulated seconds per second")


@pytest.mark.parametrize("name", ["omni_1v1", "omni_2v2"])
def test_tracking_time_on_pictures_and_on_the_truth(name):
    scenario = with_random_starts(scenario_of(name, "seconds=20", "vision.weight=0.5"))
    calibration = practise(scenario.vision)
    kept = np.empty((SEEDS, 2))
    errors = []
    for seed in range(SEEDS):
        for k, senses in enumerate(("pictures", "truth")):
            vision = replace(scenario.vision, senses=senses)
            game = set_up_picture_game(replace(scenario, seed=seed, vision=vision), calibration)
            numbers = summarise_picture_tracking(run_picture_tracking(game), name)
            kept[seed, k] = numbers["tracking_time"]
            if senses == "pictures":
                errors.append(numbers["estimation_error_rms"])
    pictures, truth = kept.mean(axis=0)
    known = np.array([error for error in errors if error is not None])
    print(
        f"\n{name}, {SEEDS} random starts, w = 0.5, horizon 20 s: {pictures:.2f} s on pictures, "
        f"{truth:.2f} s on the truth, {pictures / truth:.1%}; lost in "
        f"{(kept[:, 0] < 20).sum()} and {(kept[:, 1] < 20).sum()} games; "
        f"estimates off by {1000 * np.sqrt(np.mean(known**2)):.0f} mm rms"
    )
