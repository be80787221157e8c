"""Where the picture was taken, and where the evader is."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.landmarks.forward_camera import project_forward
from sightfield.systems.numerics.social.localisation.location import Outcome, locate_evader
from sightfield.systems.numerics.social.localisation.relative import METHODS
from sightfield.systems.numerics.social.recognition.recognition import NOTHING, Recognition, Stance
from sightfield.systems.numerics.social.recognition.references import MARKER

# In the south-west corner, looking north-east: the wedge's landmark hangs to the right of the way.
CAMERA, EVADER = np.array([1.25, 1.0, 0.9]), np.array([1.55, 1.5, 0.4])
# Landmarks before that camera: on the short wall, and on the north wall.
NEAR, FAR = 1, 0


def error(location, evader=EVADER):
    return math.dist(location.position, evader[:2])


@pytest.mark.parametrize("method", ["edges", "pnp", "level"])
def test_camera_and_evader_are_located_exactly_from_exact_corners(method, look, maze):
    found = locate_evader(look(CAMERA, [NEAR], EVADER), maze, method)
    assert found.outcome is Outcome.LOCATED
    assert found.camera.pose == pytest.approx(CAMERA, abs=2e-3)
    # By its apparent size alone there is no telling how the evader is turned.
    assert error(found) < (0.04 if method == "edges" else 2e-3)


def test_the_printed_equation_is_off_and_says_so(look, maze):
    turned = np.array([1.25, 1.0, 1.25])
    found = locate_evader(look(turned, [NEAR], EVADER), maze, "thesis")
    exact = locate_evader(look(turned, [NEAR], EVADER), maze, "edges")
    assert np.trace(found.covariance) > 4 * np.trace(exact.covariance)


@pytest.mark.parametrize("method", METHODS)
def test_estimates_are_as_far_off_as_they_say(method, look, maze):
    rng = np.random.default_rng(7)
    ratios = []
    for _ in range(40):
        evader = np.array([*EVADER[:2], rng.uniform(-3, 3)])
        found = locate_evader(
            look(CAMERA, [NEAR, FAR], evader, deviation=0.6, rng=rng), maze, method
        )
        if found.outcome.has_location:
            off = found.position - evader[:2]
            ratios.append(off @ np.linalg.solve(found.covariance, off) / 2)
    assert len(ratios) > 20
    assert 0.05 < np.median(ratios) < 4


def test_two_landmarks_tell_more_than_one(look, maze):
    one = locate_evader(look(CAMERA, [FAR], EVADER), maze)
    two = locate_evader(look(CAMERA, [FAR, NEAR], EVADER), maze)
    assert set(two.camera.used) == {NEAR, FAR}
    assert np.trace(two.camera.covariance) < 0.5 * np.trace(one.camera.covariance)


@pytest.mark.parametrize("method", ["edges", "pnp", "level"])
def test_a_false_landmark_among_true_ones_is_left_out(method, look, maze, detect):
    true = look(CAMERA, [NEAR, FAR], EVADER)
    corners = project_forward(maze.camera, CAMERA, maze.landmark(NEAR).corners)
    false = detect(7, 0.7 * (corners - corners.mean(axis=0)) + [150.0, 240.0])
    recognition = Recognition((false, *true.detections), true.matches)
    found = locate_evader(recognition, maze, method)
    assert set(found.camera.used) == {NEAR, FAR}
    assert error(found) < 0.04


def test_a_far_landmark_leaves_two_poses_and_the_covariance_covers_both(look, maze):
    rng = np.random.default_rng(2)
    camera = np.array([0.25, 1.25, -0.1])
    ratios = []
    for _ in range(30):
        found = locate_evader(look(camera, [9], EVADER, deviation=0.6, rng=rng), maze)
        if found.outcome.has_location:
            off = found.position - EVADER[:2]
            ratios.append(off @ np.linalg.solve(found.covariance, off) / 2)
    assert np.mean(ratios) < 4


@pytest.mark.parametrize(
    ("landmarks", "evader", "outcome"),
    [
        ([], EVADER, Outcome.NO_LANDMARK),
        ([NEAR], None, Outcome.NO_EVADER),
        ([], None, Outcome.NO_EVADER),
    ],
)
def test_without_landmark_or_evader_there_is_no_location(landmarks, evader, outcome, look, maze):
    found = locate_evader(look(CAMERA, landmarks, evader), maze)
    assert found.outcome is outcome
    assert np.isnan(found.position).all()
    assert np.isinf(np.diag(found.covariance)).all()
    assert not outcome.has_location


def test_the_camera_is_located_without_the_evader(look, maze):
    found = locate_evader(look(CAMERA, [NEAR]), maze)
    assert found.camera.pose == pytest.approx(CAMERA, abs=2e-3)


def test_a_landmark_that_hangs_upside_down_is_not_trusted(look, maze):
    true = look(CAMERA, [NEAR], EVADER)
    turned = tuple(
        each if each.subject == MARKER else replace(each, stance=Stance.UPSIDE_DOWN)
        for each in true.detections
    )
    found = locate_evader(Recognition(turned, true.matches), maze)
    assert found.outcome is Outcome.NOT_UPRIGHT


def test_an_evader_behind_a_wall_is_not_believed(look, maze):
    # The short wall, with its landmark, is between.
    found = locate_evader(look(CAMERA, [NEAR], [2.3, 1.6, 0.3]), maze)
    assert found.outcome is Outcome.BEHIND_A_WALL


def test_an_evader_outside_the_maze_is_not_believed(look, maze):
    found = locate_evader(look([1.7, 1.9, 1.57], [FAR], [1.7, 3.2, 0.0]), maze)
    assert found.outcome is Outcome.EVADER_OUTSIDE


def test_a_camera_outside_the_maze_is_not_believed(look, maze):
    # From beyond the south wall.
    found = locate_evader(look([1.9, -0.5, 1.57], [FAR], EVADER), maze)
    assert found.outcome is Outcome.CAMERA_OUTSIDE


def test_nothing_recognised_is_nothing_located(maze):
    assert locate_evader(NOTHING, maze).outcome is Outcome.NO_EVADER


def test_an_unknown_method_is_refused(look, maze):
    with pytest.raises(InvalidInput, match="`method` must be one of thesis, edges, pnp, level"):
        locate_evader(look(CAMERA, [NEAR]), maze, "guess")


box = st.tuples(
    st.floats(0, 640), st.floats(0, 480), st.floats(8, 400), st.floats(8, 400), st.floats(0.5, 2)
)


@settings(max_examples=100)
@given(
    squares=st.lists(st.tuples(st.integers(-1, 12), box), min_size=1, max_size=5),
    method=st.sampled_from(METHODS),
    deviation=st.floats(0.05, 5),
)
def test_whatever_was_recognised_no_location_is_outside_the_maze(
    maze, detect, squares, method, deviation
):
    found = []
    for subject, (x, y, width, height, uneven) in squares:
        h, k = 0.5 * height, 0.5 * height * uneven
        corners = [[x, y - h], [x + width, y - k], [x + width, y + k], [x, y + h]]
        found.append(detect(subject, corners, deviation))
    location = locate_evader(Recognition(tuple(found), NOTHING.matches), maze, method)
    if location.outcome.has_location:
        assert maze.world.polygon.distance(shapely.Point(location.position)) < 1e-9
        assert np.linalg.eigvalsh(location.covariance)[0] > 0
    else:
        assert np.isnan(location.position).all()
