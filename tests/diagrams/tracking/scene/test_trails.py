"""A trail is where its team was during the last ten seconds."""

import numpy as np
import pytest
import shapely
from pydrake.geometry import Rgba

from sightfield.diagrams.tracking.scene.floor_layers import PIECE_DURATION, TRAIL_DURATION, Trails
from sightfield.diagrams.tracking.scene.layout import make_layout
from sightfield.diagrams.visuals.stage import Stage

PERIOD = 0.05


def spiral(time: float) -> np.ndarray:
    """Two robots, one of which stands still."""
    return np.array([[np.cos(time) * (1 + 0.1 * time), np.sin(time)], [3.0, 3.0]])


def run(meshcat_log, end: float, *, recording: bool = False, motion=spiral) -> None:
    stage = Stage(meshcat_log, "/stage", recording=recording, period=PERIOD, tolerance=1e-3)
    layout = make_layout((0, 0, 4, 4), 0.1)
    trails = Trails(stage, layout, "pursuers", Rgba(0, 0, 1))
    for time in np.arange(0, end + 1e-9, PERIOD):
        stage.begin(time)
        trails.update(time, motion(time))
    if recording:
        stage.finish_recording()


def drawn(meshcat_log) -> shapely.Geometry:
    meshes = meshcat_log.meshes.values()
    return shapely.union_all([shapely.polygons(v[:2].T[f.T]) for v, f in meshes])


def test_it_follows_the_way_that_the_robot_took(meshcat_log):
    run(meshcat_log, 5.0)
    way = shapely.LineString([spiral(time)[0] for time in np.linspace(0, 5, 1000)])
    trail = drawn(meshcat_log)
    assert trail.hausdorff_distance(way) < 0.02
    assert way.difference(trail.buffer(0.01)).length == pytest.approx(0.0, abs=1e-3)


def test_a_robot_that_stands_leaves_none(meshcat_log):
    run(meshcat_log, 5.0, motion=lambda time: np.array([[1.0, 1.0]]))
    assert meshcat_log.meshes == {}


def test_a_live_page_keeps_no_more_than_the_last_seconds(meshcat_log):
    run(meshcat_log, 40.0)
    assert len(meshcat_log.meshes) <= TRAIL_DURATION / PIECE_DURATION + 1
    way = [spiral(time)[0] for time in np.linspace(40.0 - TRAIL_DURATION - PIECE_DURATION, 40, 999)]
    assert drawn(meshcat_log).difference(shapely.LineString(way).buffer(0.03)).area < 1e-6


def test_in_a_recording_each_piece_appears_fades_and_goes(meshcat_log):
    run(meshcat_log, 15.0, recording=True)
    visible = meshcat_log.keys["/stage/trails/pursuers/2", "visible"]
    born, gone = 2 * PIECE_DURATION / PERIOD, (2 * PIECE_DURATION + TRAIL_DURATION) / PERIOD
    assert visible == {0: False, born: True, gone: False, 15.0 / PERIOD: False}
    opacity = meshcat_log.keys["/stage/trails/pursuers/2/<object>", "material.opacity"]
    values = [opacity[frame] for frame in sorted(opacity)]
    assert values == sorted(values, reverse=True)
    assert values[-1] == 0.0
