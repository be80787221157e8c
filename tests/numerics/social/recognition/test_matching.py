"""Limits of matches and squares, and sizes that files state, just kept and just not."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.systems.numerics.social.recognition import recognition
from sightfield.systems.numerics.social.recognition.matching import (
    FEWEST,
    Matches,
    find_square,
    homography_of,
    is_sane,
    map_square,
    match,
)
from sightfield.systems.numerics.social.recognition.recognition import (
    LandmarkDetection,
    Stance,
    _is_known,
    _within,
    stance_of,
)
from sightfield.systems.numerics.social.recognition.references import MARKER, Features

CORNERS = np.array([[10.0, 20.0], [90.0, 12.0], [96.0, 81.0], [8.0, 71.0]])


def sane(corners):
    corners = np.array(corners, dtype=float)
    return is_sane(homography_of(corners), corners)


def test_a_square_is_mapped_onto_its_corners_and_lines_onto_lines():
    homography = homography_of(CORNERS)
    unit = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    np.testing.assert_allclose(map_square(homography, unit), CORNERS, atol=1e-9)
    # Diagonals meet in the middle, and three points of a line stay on one.
    (middle,) = map_square(homography, np.array([[0.5, 0.5]]))
    for a, b in ((0, 2), (1, 3)):
        way, part = CORNERS[b] - CORNERS[a], middle - CORNERS[a]
        assert way[0] * part[1] - way[1] * part[0] == pytest.approx(0.0, abs=1e-6)
    line = map_square(homography, np.array([[0.1, 0.2], [0.3, 0.4], [0.8, 0.9]]))
    (ax, ay), (bx, by) = line[1] - line[0], line[2] - line[0]
    assert ax * by - ay * bx == pytest.approx(0.0, abs=1e-6)
    assert np.isinf(homography_of(np.zeros((4, 2)))).all()


def test_squares_have_upright_edges_of_nine_pixels_and_no_four_times_longer_ones():
    for height, good in ((9.01, True), (8.99, False)):
        assert sane([[0, 0], [20, 0], [20, height], [0, height]]) is good
    # The upper and the lower edge may be short.
    assert sane([[0, 0], [2, 0], [2, 20], [0, 20]])
    for long, good in ((39.9, True), (40.1, False)):
        aside = 0.5 * (long - 10)
        assert sane([[0, -aside], [30, 0], [30, 10], [0, 10 + aside]]) is good
        assert sane([[0, 0], [30, -aside], [30, 10 + aside], [0, 10]]) is good
        assert sane([[-aside, 0], [10 + aside, 0], [10, 30], [0, 30]]) is good
        assert sane([[0, 0], [10, 0], [10 + aside, 30], [-aside, 30]]) is good


def test_mirrored_bent_and_infinite_squares_are_none():
    assert sane(CORNERS)
    assert not sane(CORNERS[::-1])
    assert not sane([[0, 0], [40, 0], [12, 11], [0, 40]])
    assert not sane(CORNERS * [1.0, np.nan])
    homography = homography_of(CORNERS)
    assert is_sane(-homography, CORNERS)
    # A corner behind the camera.
    behind = homography.copy()
    behind[2] = [-1.5, 0.0, 1.0]
    assert not is_sane(behind, CORNERS)


def at_angles(*distances):
    """Unit vectors at these distances from the first axis, each in a plane of its own."""
    rows = []
    for k, distance in enumerate(distances):
        row = np.zeros(8)
        row[0] = 1 - 0.5 * distance**2
        row[1 + k] = math.sqrt(1 - row[0] ** 2)
        rows.append(row)
    return np.array(rows)


def matched(method, *distances, starts=(0, 1)):
    references = SimpleNamespace(
        descriptors=at_angles(*distances),
        starts=np.array(starts),
        subjects=(4, 9, 11)[: len(starts)],
        points=np.arange(2.0 * len(distances)).reshape(-1, 2),
        finder=SimpleNamespace(method=method),
    )
    feature = Features(np.array([[7.0, 8.0]]), np.eye(8)[:1])
    found = match(feature, references)
    return [
        (int(s), *p, *q) for s, p, q in zip(found.subject, found.place, found.pixel, strict=True)
    ]


@pytest.mark.parametrize(
    ("method", "ratio", "farthest"), [("sift", 0.85, 0.75), ("orb", 0.9, 0.72), ("surf", 0.85, 0.7)]
)
def test_matches_are_clear_and_near(method, ratio, farthest):
    assert matched(method, 0.5, 0.501 / ratio) == [(4, 0.0, 1.0, 7.0, 8.0)]
    assert matched(method, 0.5, 0.499 / ratio) == []
    assert matched(method, 0.501 / ratio, 0.5) == [(9, 2.0, 3.0, 7.0, 8.0)]
    assert matched(method, farthest - 0.001, 1.4)
    assert not matched(method, farthest + 0.001, 1.4)
    # A subject's own views are no rivals, and a subject alone has none.
    assert matched(method, 0.5, 0.49, 1.4, starts=(0, 2)) == [(4, 2.0, 3.0, 7.0, 8.0)]
    assert matched(method, 0.5, 0.5, starts=(0,)) == [(4, 0.0, 1.0, 7.0, 8.0)]
    assert len(match(Features(np.zeros((0, 2)), np.zeros((0, 8))), None)) == 0


def on_square(places):
    places = np.array(places)
    pixels = map_square(homography_of(CORNERS), places)
    return Matches(np.full(len(places), 4), places, pixels)


def test_five_different_matches_make_a_square():
    places = [[0.1, 0.1], [0.9, 0.2], [0.8, 0.9], [0.2, 0.8], [0.5, 0.4], [0.3, 0.6]]
    found = find_square(on_square(places[:FEWEST]))
    assert found is not None
    np.testing.assert_allclose(found[0], CORNERS, atol=0.05)
    assert found[1].tolist() == [True] * 5
    assert find_square(on_square(places[:4])) is None
    # One feature that is matched from several views counts once.
    assert find_square(on_square([*places[:4], places[0]])) is None
    # A match farther off than three pixels is none of the square's.
    for off, good in ((2.5, True), (3.5, False)):
        more = on_square(
            [*places[:5], [0.6, 0.1], [0.7, 0.6], [0.15, 0.5], [0.4, 0.9], *places[5:]]
        )
        pixels = more.pixel.copy()
        pixels[-1] += [off, 0.0]
        found = find_square(Matches(more.subject, more.place, pixels))
        assert found is not None
        assert bool(found[1][-1]) is good


@pytest.mark.parametrize(
    ("aside", "stance"),
    [
        (11.9, Stance.UPRIGHT),
        (12.1, Stance.TILTED),
        (-11.9, Stance.UPRIGHT),
        (-12.1, Stance.TILTED),
    ],
)
def test_edges_may_lean_by_a_part_of_their_height(aside, stance):
    for left, right in ((aside, 0.0), (0.0, aside)):
        square = np.array([[0.0, 0.0], [80.0, 0.0], [80.0 + right, 100.0], [left, 100.0]])
        assert stance_of(square, 0.12) is stance
        turned = Stance.TILTED if stance is Stance.TILTED else Stance.UPSIDE_DOWN
        assert stance_of(square[[3, 2, 1, 0]], 0.12) is turned
    crossed = np.array([[0.0, 0.0], [80.0, 100.0], [80.0, 0.0], [0.0, 100.0]])
    assert stance_of(crossed, 0.12) is Stance.TILTED


def detection(subject, corners):
    nothing = np.zeros((0, 2))
    return LandmarkDetection(
        subject=subject,
        corners=corners,
        covariance=np.eye(8),
        correlation=1.0,
        visible=1.0,
        stance=Stance.UPRIGHT,
        places=nothing,
        pixels=nothing,
    )


def test_a_square_is_known_whose_middle_lies_in_one_of_the_same_subject():
    found = [detection(4, CORNERS)]
    assert _is_known(detection(4, CORNERS + 20.0), found)
    assert not _is_known(detection(4, CORNERS + 60.0), found)
    assert not _is_known(detection(5, CORNERS), found)
    edges = map_square(homography_of(CORNERS), np.array([[0.5, -0.01], [0.5, 0.01], [0.99, 0.5]]))
    assert _within(CORNERS, edges).tolist() == [False, True, True]
    beyond = map_square(homography_of(CORNERS), np.array([[1.01, 0.5], [0.5, 1.01], [-0.01, 0.5]]))
    assert not _within(CORNERS, beyond).any()


@pytest.mark.parametrize(
    ("change", "good"),
    [
        ({}, True),
        ({"correlation": 0.801}, True),
        ({"correlation": 0.799}, False),
        ({"visible": 0.121}, True),
        ({"visible": 0.119}, False),
        ({"corners": CORNERS + np.outer([0, 0, 1, 1], [20.0, 0.0])}, False),
        ({"corners": CORNERS[[2, 3, 0, 1]]}, True),
    ],
)
def test_what_is_alike_visible_and_level_enough_is_detected(change, good, monkeypatch):
    seen = {"corners": CORNERS, "covariance": np.eye(8), "correlation": 0.9, "visible": 0.5}
    aligned = SimpleNamespace(**(seen | change))
    monkeypatch.setattr(recognition, "align", lambda *_: aligned)
    found = recognition._detect(None, None, CORNERS, on_square([[0.5, 0.5]]))
    assert (found is not None) is good
    monkeypatch.setattr(recognition, "align", lambda *_: None)
    assert recognition._detect(None, None, CORNERS, on_square([[0.5, 0.5]])) is None


def test_three_sides_of_the_evader_at_most_and_one_of_each_landmark(monkeypatch):
    subjects = (2, MARKER, 7)
    rows = [subject for subject in subjects for _ in range(40)] + [9] * 40
    matches = Matches(np.array(rows), np.zeros((160, 2)), np.tile(np.arange(40.0), (2, 4)).T)
    monkeypatch.setattr(recognition, "match", lambda features, references: matches)
    tried = []

    def find_square(own):
        tried.append((int(own.subject[0]), len(own)))
        return CORNERS, own.pixel[:, 0] < own.pixel[0, 0] + 8

    def detect(picture, reference, corners, on):
        subject = int(on.subject[0])
        shift = 200.0 * len([each for each in tried if each[0] == subject])
        return None if subject == 7 else detection(subject, CORNERS + shift)

    monkeypatch.setattr(recognition, "find_square", find_square)
    monkeypatch.setattr(recognition, "_detect", detect)
    references = SimpleNamespace(
        subjects=subjects,
        pictures=dict.fromkeys(subjects),
        finder=SimpleNamespace(find=lambda grey: None),
    )
    found = recognition.recognise(np.zeros((16, 16, 3), np.uint8), references)
    assert [each.subject for each in found.landmarks] == [2]
    assert [each.subject for each in found.markers] == [MARKER] * 3
    assert tried == [(2, 40), (MARKER, 40), (MARKER, 32), (MARKER, 24), (7, 40)]
    assert found.matches is matches
