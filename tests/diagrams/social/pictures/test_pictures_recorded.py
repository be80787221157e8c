"""Trials, errors over distance and the frames of the gallery are as they were recorded."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from sightfield.diagrams.social.gallery import frames
from sightfield.diagrams.social.pictures.error_curves import (
    ErrorCurves,
    Errors,
    measure_errors,
    save_error_curves,
)
from sightfield.diagrams.social.pictures.trials import make_trials
from sightfield.diagrams.social.report import draw_connectivity, runs
from sightfield.diagrams.tracking.scene.layout import make_layout
from sightfield.systems.numerics.social.landmarks.thesis_maze import thesis_maze
from sightfield.systems.numerics.social.localisation.location import METHODS


def test_trials_are_as_recorded(as_recorded):
    trials = make_trials(thesis_maze(), 9, 4, without_evader=0.3)
    told = [
        (each.camera, each.evader, [(vars(square), square.size) for square in each.squares])
        for each in trials
    ]
    as_recorded(told)


def test_measured_errors_are_as_recorded(as_recorded):
    curves = measure_errors(distances=(0.8,), angles=(0.35,), pictures=2, seed=3)
    as_recorded(curves, relative=0.02, absolute=2e-4)


def test_drawn_errors_are_as_recorded(drawn, as_recorded, saved_pictures, tmp_path):
    rng = np.random.default_rng(2)

    def made_up(values):
        found = {method: Errors(*rng.uniform(1e-3, 0.2, (4, values, 5))) for method in METHODS}
        found["thesis"].camera[1, :3] = found["edges"].evader[:, 2:] = np.nan
        return found

    curves = ErrorCurves((0.5, 1.2, 2.0), (0.1, 0.7), made_up(3), made_up(2))
    save_error_curves(tmp_path / "errors.png", curves)
    as_recorded(drawn(saved_pictures["errors.png"]))


@pytest.mark.parametrize("count", [1, 4, 5, 9])
def test_frames_of_the_gallery_are_as_recorded(count, as_recorded):
    layout = make_layout([-0.2, 0.1, 2.3, 2.5], 0.07)
    as_recorded([frames(layout, count, proportion) for proportion in (0.6, 1.4)])


def test_bands_of_friends_are_as_recorded(drawn, as_recorded):
    rng = np.random.default_rng(1)
    times, connected = 0.5 * np.arange(30), rng.random((30, 3)) < 0.6
    as_recorded([runs(times, connected[:, k]) for k in range(3)], "runs")
    for name, waiting in (("waited for", rng.random((30, 3)) < 0.5), ("alone", None)):
        figure = Figure()
        draw_connectivity(figure.subplots(), times, connected, waiting)
        as_recorded(drawn(figure), name)
