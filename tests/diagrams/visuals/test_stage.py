"""A stage sends changes only, and records them so that a player gets every moment right."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.geometry import Rgba

from sightfield.diagrams.visuals.meshes import disc_mesh
from sightfield.diagrams.visuals.stage import Glide, Keyframes, Stage

TOLERANCE = 0.05


def keys_of(samples: dict[int, tuple[float, ...]]) -> dict[int, tuple[float, ...]]:
    """Frames and values that a recording of samples keys, the last sample among them."""
    (first, values), *others = samples.items()
    tolerance = (TOLERANCE,) * len(values)
    glide = Glide(first, values, tolerance)
    needed = [glide.add(frame, values, tolerance) for frame, values in others]
    return dict([key for key in needed if key is not None] + glide.finish())


def worst_miss(samples: dict[int, tuple[float, ...]]) -> float:
    """How far the player passes from a sample at most."""
    keys = keys_of(samples)
    values, at = np.array(list(samples.values())), list(samples)
    played = [np.interp(at, list(keys), column) for column in np.array(list(keys.values())).T]
    return float(np.abs(values - np.array(played).T).max())


@given(
    values=st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=60),
    gaps=st.lists(st.integers(1, 5), min_size=60, max_size=60),
)
def test_every_sample_is_passed_within_the_tolerance(values, gaps):
    frames = np.cumsum(gaps)[: len(values)].tolist()
    assert worst_miss(dict(zip(frames, values, strict=True))) <= TOLERANCE + 1e-9


@given(step=st.floats(-0.01, 0.01), bend=st.floats(0, 6.3))
def test_a_smooth_curve_is_passed_within_the_tolerance(step, bend):
    angles = bend + step * np.arange(300)
    samples = {k: (np.cos(angle), np.sin(angle)) for k, angle in enumerate(angles)}
    assert worst_miss(samples) <= TOLERANCE + 1e-9
    assert len(keys_of(samples)) < 20


@pytest.mark.parametrize("frames", [range(100), range(0, 100, 7)])
def test_a_straight_line_needs_its_ends_only(frames):
    samples = {frame: (0.3 * frame, 1.0 - 0.1 * frame) for frame in frames}
    assert list(keys_of(samples)) == [frames[0], frames[-1]]


def test_a_bend_is_keyed_where_it_is():
    samples = {frame: (float(min(frame, 40)),) for frame in range(80)}
    assert list(keys_of(samples)) == [0, 40, 79]


def test_a_key_is_a_sample():
    rng = np.random.default_rng(1)
    samples = {frame: (value,) for frame, value in enumerate(rng.normal(size=200).tolist())}
    assert keys_of(samples).items() <= samples.items()


def test_a_later_value_of_the_same_frame_counts():
    glide = Glide(0, (0.0,), (TOLERANCE,))
    assert glide.add(0, (1.0,), (TOLERANCE,)) is None
    assert glide.add(3, (9.0,), (TOLERANCE,)) == (0, (1.0,))
    assert glide.add(3, (7.0,), (TOLERANCE,)) is None
    assert glide.finish() == [(3, (7.0,))]


def test_one_sample_is_one_key():
    assert keys_of({5: (1.0,)}) == {5: (1.0,)}


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
