"""A changing shape is one path on a live page and many that take turns in a recording."""

import numpy as np
import pytest
from pydrake.geometry import Rgba

from sightfield.diagrams.visuals.keyframes import Keyframes
from sightfield.diagrams.visuals.meshes import disc_mesh
from sightfield.diagrams.visuals.stage import Stage


def draw(meshcat_log, *, recording: bool, times) -> Keyframes:
    stage = Stage(meshcat_log, "/stage", recording=recording, period=0.05, tolerance=1e-3)
    keyframes = Keyframes(stage, "shape", Rgba(), period=0.2)
    for time in times:
        stage.begin(time)
        if keyframes.due(time):
            keyframes.draw(disc_mesh(1.0 + time))
    return keyframes


@pytest.mark.parametrize("start", [0.0, 0.05])
def test_it_is_due_once_in_a_period(meshcat_log, start):
    draw(meshcat_log, recording=False, times=start + 0.05 * np.arange(16))
    assert meshcat_log.sent.count(("/stage/shape/0", "mesh")) == 4 + (start > 0)


def test_a_live_page_uses_one_path(meshcat_log):
    draw(meshcat_log, recording=False, times=[0.0, 0.2, 0.4])
    assert list(meshcat_log.meshes) == ["/stage/shape/0"]


def test_in_a_recording_one_shape_is_shown_at_a_time(meshcat_log):
    draw(meshcat_log, recording=True, times=[0.0, 0.2, 0.4])
    assert [meshcat_log.keys[f"/stage/shape/{k}", "visible"] for k in range(3)] == [
        {0: True, 4: False},
        {0: False, 4: True, 8: False},
        {0: False, 8: True},
    ]


def test_a_cleared_shape_is_hidden_until_it_is_drawn_again(meshcat_log):
    keyframes = draw(meshcat_log, recording=True, times=[0.0, 0.2])
    keyframes.clear()
    keyframes.clear()
    assert meshcat_log.keys["/stage/shape/1", "visible"] == {0: False, 4: False}
