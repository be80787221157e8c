"""Pictures of landmarks: always the same, and no two alike."""

import cv2
import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.landmarks.landmark_pictures import (
    draw_glyph,
    landmark_picture,
    marker_picture,
)
from sightfield.systems.numerics.social.landmarks.maze import Landmark, picture_obj


def correlation(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.corrcoef(a.ravel(), b.ravel())[0, 1])


def test_a_landmark_has_one_picture():
    again = landmark_picture.__wrapped__(3)
    assert np.array_equal(landmark_picture(3), again)


def test_no_two_landmarks_look_alike_even_far_away():
    pictures = [*(landmark_picture(number) for number in range(13)), marker_picture()]
    # Their insides: all have the same frame.
    inner = [cv2.cvtColor(each, cv2.COLOR_RGB2GRAY)[24:-24, 24:-24] for each in pictures]
    small = [cv2.resize(each, (24, 24), interpolation=cv2.INTER_AREA) for each in inner]
    alike = [correlation(a, b) for i, a in enumerate(small) for b in small[:i]]
    assert max(alike) < 0.75


def test_a_landmark_upside_down_is_another_picture():
    pictures = [landmark_picture(number) for number in range(13)]
    assert max(correlation(each, each[::-1, ::-1]) for each in pictures) < 0.8


def test_a_glyph_is_some_ink_and_much_paper():
    ink = draw_glyph(np.random.default_rng(5), 128)
    assert ink.min() == 0.0
    assert ink.max() == 1.0
    assert 0.05 < ink.mean() < 0.5


def test_a_negative_number_is_refused():
    with pytest.raises(InvalidInput, match="`number` must be zero or positive; got -1"):
        landmark_picture(-1)


def test_a_picture_s_normal_points_where_it_faces():
    text = picture_obj(Landmark(number=0, x=1.0, y=0.0, facing=0.6).corners, "a")
    (normal,) = [line.split()[1:] for line in text.splitlines() if line.startswith("vn")]
    assert [float(each) for each in normal] == pytest.approx([np.cos(0.6), np.sin(0.6), 0.0])
