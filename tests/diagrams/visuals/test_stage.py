"""A stage sends changes only, and records them so that a player gets every moment right."""

import numpy as np
import pytest

from sightfield.diagrams.visuals.stage import Stage

PERIOD = 0.1


@pytest.fixture
def live(meshcat_log) -> Stage:
    return Stage(meshcat_log, "/stage", recording=False, period=PERIOD, tolerance=1e-3)


@pytest.fixture
def recorded(meshcat_log) -> Stage:
    return Stage(meshcat_log, "/stage", recording=True, period=PERIOD, tolerance=1e-3)


def place_at(stage: Stage, frame: int, x: float) -> None:
    stage.begin(frame * PERIOD)
    stage.place("robot", x, 0.0)


def test_what_has_not_changed_is_not_sent(live, meshcat_log):
    for frame in range(5):
        live.begin(frame * PERIOD)
        live.place("robot", 1.0, 2.0)
        live.pose("robot/body", 0.0, 0.0, 0.5, reach=0.2)
        live.stretch("bar", 3.0)
        live.show("lamp", True)
        live.fade("trail", 0.5)
    assert sorted(meshcat_log.sent) == [
        ("/stage/bar", "scale"),
        ("/stage/lamp", "visible"),
        ("/stage/robot", "position"),
        ("/stage/robot/body", "pose"),
        ("/stage/trail/<object>", "material.opacity"),
    ]


def test_what_has_changed_is_sent(live, meshcat_log):
    for frame, x in enumerate([1.0, 1.0, 2.0, 1.0]):
        place_at(live, frame, x)
    assert meshcat_log.sent == [("/stage/robot", "position")] * 3


def test_nothing_is_recorded_on_a_live_page(live, meshcat_log):
    place_at(live, 3, 1.0)
    assert meshcat_log.keys == {}
    assert not meshcat_log.recording


def test_a_steady_motion_is_keyed_where_it_begins_bends_and_ends(recorded, meshcat_log):
    for frame, x in enumerate([0.0, 1.0, 2.0, 3.0, 5.0, 7.0]):
        place_at(recorded, frame, x)
    recorded.finish_recording()
    keys = meshcat_log.keys["/stage/robot", "position"]
    assert keys == {0: [0.0, 0.0, 0.0], 3: [3.0, 0.0, 0.0], 5: [7.0, 0.0, 0.0]}


def test_a_robot_that_stood_is_held_until_it_starts(recorded, meshcat_log):
    for frame, x in enumerate([0.0, 0.0, 0.0, 0.0, 1.0]):
        place_at(recorded, frame, x)
    recorded.finish_recording()
    # Without the key at 3 a player would let it creep from frame 0 on.
    keys = meshcat_log.keys["/stage/robot", "position"]
    assert keys == {0: [0.0, 0.0, 0.0], 3: [0.0, 0.0, 0.0], 4: [1.0, 0.0, 0.0]}


def test_a_lamp_needs_no_key_before_it_changes(recorded, meshcat_log):
    for frame, lit in enumerate([True, True, True, False]):
        recorded.begin(frame * PERIOD)
        recorded.show("lamp", lit)
    assert meshcat_log.keys["/stage/lamp", "visible"] == {0: True, 3: False}


def test_what_appears_late_was_hidden_before(recorded, meshcat_log):
    recorded.begin(7 * PERIOD)
    recorded.show("trail", True)
    assert meshcat_log.keys["/stage/trail", "visible"] == {0: False, 7: True}


def test_every_path_is_recorded_to_the_end(recorded, meshcat_log):
    recorded.show("early", True)
    recorded.pose("early", 0.0, 0.0, 1.0, reach=1.0)
    recorded.fade("early", 0.5)
    place_at(recorded, 9, 1.0)
    recorded.finish_recording()
    assert {max(keys) for keys in meshcat_log.keys.values()} == {9}
    assert not meshcat_log.recording


def test_a_frame_is_the_nearest_multiple_of_the_period(recorded, meshcat_log):
    for frame in range(1, 200):
        recorded.begin(frame * PERIOD * (1 - 1e-12))
        recorded.show("lamp", frame % 2 == 1)
    keys = meshcat_log.keys["/stage/lamp", "visible"]
    assert keys == {0: False} | {frame: frame % 2 == 1 for frame in range(1, 200)}


def test_a_replayed_line_ends_within_the_tolerance_however_long_it_is(recorded, meshcat_log):
    angles = {frame: 0.01 * (frame % 3) for frame in range(60)}
    for reach, exact in ((0.01, False), (10.0, True)):
        for frame, angle in angles.items():
            recorded.begin(frame * PERIOD)
            recorded.pose(f"line{reach}", 0.0, 0.0, angle, reach=reach)
        recorded.finish_recording()
        assert (len(meshcat_log.keys[f"/stage/line{reach}", "pose"]) > 30) == exact


def test_what_creeps_is_followed_but_seldom_told(recorded, meshcat_log):
    at = {frame: 3.0 + 1e-4 * max(frame - 200, 0) for frame in range(600)}
    for frame, x in at.items():
        place_at(recorded, frame, x)
    recorded.finish_recording()
    keys = meshcat_log.keys["/stage/robot", "position"]
    played = np.interp(list(at), list(keys), [x for x, _, _ in keys.values()])
    assert np.abs(played - list(at.values())).max() < 1.3e-3
    assert len(meshcat_log.sent) < 150
    assert len(keys) < 30


def test_a_trail_fades_on_between_calls(recorded, meshcat_log):
    for frame, opacity in ((0, 1.0), (10, 0.5), (20, 0.0)):
        recorded.begin(frame * PERIOD)
        recorded.fade("trail", opacity)
    recorded.finish_recording()
    assert meshcat_log.keys["/stage/trail/<object>", "material.opacity"] == {0: 1.0, 20: 0.0}


def test_a_new_stage_clears_the_folder_and_the_recording(recorded, meshcat_log):
    place_at(recorded, 1, 1.0)
    Stage(meshcat_log, "/stage", recording=True, period=PERIOD, tolerance=1e-3)
    assert meshcat_log.keys == {}
