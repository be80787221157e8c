"""How many landmarks and markers are recognised, how many falsely, and how well they tell places.

Pictures are taken from random poses in the thesis's maze, with further pictures on its walls that
are not on the map. It takes some minutes.
"""

import math
import time
from collections import Counter

import numpy as np
import pytest

from sightfield.diagrams.social.pictures.trials import make_trials
from sightfield.systems.numerics.social.landmarks.landmark_pictures import landmark_picture
from sightfield.systems.numerics.social.landmarks.thesis_maze import (
    LANDMARKS,
    hang_landmarks,
    thesis_maze,
)
from sightfield.systems.numerics.social.localisation.location import locate_evader
from sightfield.systems.numerics.social.localisation.relative import METHODS
from sightfield.systems.numerics.social.recognition.recognition import recognise
from sightfield.systems.numerics.social.recognition.references import MARKER, maze_references
from sightfield.systems.social.maze_renderer import Poster

pytestmark = pytest.mark.benchmarks

PICTURES, SEED, DECOYS = 400, 2014, 5
# A detection is true when its corners are this near to where they should be, of its height.
NEAR = 0.25
# Views that should be recognised: whole squares, no smaller and no more oblique than this.
SMALLEST, OBLIQUE = 24.0, math.radians(60)


@pytest.fixture(scope="module")
def maze():
    return thesis_maze()


@pytest.fixture(scope="module")
def trials(maze):
    """Pictures with decoys on the next best places for landmarks."""
    places = hang_landmarks(maze.world, LANDMARKS + DECOYS)[LANDMARKS:]
    decoys = [Poster(landmark_picture(900 + k), each.corners) for k, each in enumerate(places)]
    return list(make_trials(maze, PICTURES, SEED, decoys=decoys))


def is_near(detection, square):
    miss = np.abs(detection.corners - square.corners).max()
    return detection.subject == square.subject and miss < NEAR * square.size


@pytest.mark.parametrize("features", ["sift", "orb"])
def test_precision_and_recall(features, maze, trials):
    references = maze_references(maze, features)
    true, false, times = Counter(), Counter(), []
    recalled = {"landmark": [], "marker": []}
    for trial in trials:
        began = time.process_time()
        found = recognise(trial.picture, references).detections
        times.append(time.process_time() - began)
        for each in found:
            kind = "marker" if each.subject == MARKER else "landmark"
            right = any(is_near(each, square) for square in trial.squares)
            (true if right else false)[kind] += 1
        for square in trial.squares:
            if square.whole and square.size >= SMALLEST and square.obliqueness <= OBLIQUE:
                kind = "marker" if square.subject == MARKER else "landmark"
                recalled[kind].append(any(is_near(each, square) for each in found))
    print(f"\n{features}, {len(trials)} pictures, {np.median(times):.3f} s of CPU each")
    for kind, hits in recalled.items():
        count = true[kind] + false[kind]
        print(
            f"{kind}s: precision {true[kind]} of {count}, false {false[kind]}; "
            f"recall {sum(hits)} of {len(hits)} in clear view"
        )


def test_location_errors(maze, trials):
    references = maze_references(maze)
    seen = [(trial, recognise(trial.picture, references)) for trial in trials]
    print()
    for method in METHODS:
        outcomes, camera, evader, squares = Counter(), [], [], []
        for trial, recognition in seen:
            location = locate_evader(recognition, maze, method)
            outcomes[location.outcome.words] += 1
            if location.camera is not None:
                camera.append(math.dist(location.camera.pose[:2], trial.camera[:2]))
            if location.outcome.has_location:
                assert trial.evader is not None, "located where there is none"
                off = location.position - trial.evader[:2]
                evader.append(float(np.hypot(*off)))
                squares.append(float(off @ np.linalg.solve(location.covariance, off)) / 2)
        at = [1000 * np.quantile(each, (0.5, 0.9, 1.0)) for each in (camera, evader)]
        print(
            f"{method}: camera off by {at[0][0]:.1f}, {at[0][1]:.1f}, {at[0][2]:.0f} mm "
            f"(median, 90%, worst of {len(camera)}), evader by {at[1][0]:.1f}, {at[1][1]:.1f}, "
            f"{at[1][2]:.0f} mm (of {len(evader)}); squared deviations per coordinate "
            f"{np.median(squares):.2f} in the median; {dict(outcomes)}"
        )
