"""A recording hears of a line of sight only while there is one."""

import numpy as np
import pytest

from sightfield.diagrams.tracking.scene.floor_layers import SightLines
from sightfield.diagrams.tracking.scene.layout import make_layout
from sightfield.diagrams.visuals.stage import Stage

PURSUERS = np.array([[0.0, 0.0], [4.0, 0.0]])
EVADERS = np.array([[3.0, 4.0], [4.0, 2.0], [0.0, 1.0]])
NOBODY = np.array([-1, -1])


def sees(*pairs: tuple[int, int]) -> np.ndarray:
    matrix = np.zeros((2, 3), dtype=bool)
    for pair in pairs:
        matrix[pair] = True
    return matrix


def make_stage(meshcat_log, *, recording: bool) -> Stage:
    return Stage(meshcat_log, "/stage", recording=recording, period=0.1, tolerance=1e-3)


def make_lines(stage: Stage) -> SightLines:
    return SightLines(stage, make_layout((0, 0, 4, 4), 0.1))


def test_a_recorded_line_is_a_unit_bar_turned_and_stretched(meshcat_log):
    stage = make_stage(meshcat_log, recording=True)
    make_lines(stage).update(PURSUERS, EVADERS, sees((0, 0)), NOBODY)
    stage.finish_recording()
    pose = meshcat_log.keys["/stage/sight/0_0", "pose"][0]
    np.testing.assert_allclose(pose.rotation().matrix()[:2, 0], [0.6, 0.8])
    np.testing.assert_allclose(pose.translation(), 0.0)
    assert meshcat_log.keys["/stage/sight/0_0/bar", "scale"] == {0: [5.0, 1.0, 1.0]}


def test_pairs_that_never_see_each_other_cost_nothing(meshcat_log):
    make_lines(make_stage(meshcat_log, recording=True)).update(
        PURSUERS, EVADERS, sees((1, 2)), NOBODY
    )
    assert list(meshcat_log.meshes) == ["/stage/sight/1_2/bar"]


def test_a_line_that_breaks_is_hidden_and_comes_back(meshcat_log):
    lines = make_lines(make_stage(meshcat_log, recording=True))
    for visible in (sees((0, 0), (1, 1)), sees((1, 1)), sees((0, 0), (1, 1))):
        lines.update(PURSUERS, EVADERS, visible, NOBODY)
    sent = [path for path, name in meshcat_log.sent if name == "visible"]
    assert sent.count("/stage/sight/0_0") == 3
    assert sent.count("/stage/sight/1_1") == 1


def test_a_chase_goes_over_to_another_evader(meshcat_log):
    stage = make_stage(meshcat_log, recording=True)
    lines = make_lines(stage)
    for time, target in enumerate((1, 1, 2)):
        stage.begin(float(time))
        lines.update(PURSUERS, EVADERS, sees(), np.array([-1, target]))
    stage.finish_recording()
    for evader, length, shown in (
        (1, 2.0, {0: True, 20: False}),
        (2, 17**0.5, {0: False, 20: True}),
    ):
        path = f"/stage/chases/1_{evader}"
        assert meshcat_log.keys[path, "visible"] == shown
        scales = meshcat_log.keys[f"{path}/bar", "scale"].values()
        assert [scale[0] for scale in scales] == pytest.approx([length] * len(scales))


def test_a_live_page_gets_all_lines_in_one_message_and_only_if_something_moved(meshcat_log):
    lines = make_lines(make_stage(meshcat_log, recording=False))
    everyone = np.ones((2, 3), dtype=bool)
    for _ in range(3):
        lines.update(PURSUERS, EVADERS, everyone, NOBODY)
    assert meshcat_log.sent.count(("/stage/sight", "mesh")) == 1
    lines.update(PURSUERS + 0.1, EVADERS, everyone, NOBODY)
    assert meshcat_log.sent.count(("/stage/sight", "mesh")) == 2
    vertices, faces = meshcat_log.meshes["/stage/sight"]
    assert (vertices.shape, faces.shape) == ((3, 4 * 6), (3, 2 * 6))
