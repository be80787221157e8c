"""Pictures that were read, as the scene shows them."""

import numpy as np

from sightfield.diagrams.social.gallery import draw_reading, picture_pixels
from sightfield.systems.numerics.social.localisation.location import Outcome, Reading, no_location
from sightfield.systems.numerics.social.network.interface import Picture
from sightfield.systems.numerics.social.recognition.recognition import NOTHING


def test_what_was_recognised_is_drawn_where_it_is(found):
    camera = found.game.maze.camera
    reading = next(each for each in found.readings if each.location.outcome.has_location)
    plain, drawn = picture_pixels(reading.picture, camera), draw_reading(reading, camera)
    assert drawn.shape == plain.shape == (camera.height, camera.width, 3)
    changed = (drawn != plain).any(axis=2)
    for each in reading.recognition.detections:
        column, row = np.clip(
            np.rint(each.pixels[0]), 0, [camera.width - 1, camera.height - 1]
        ).astype(int)
        assert changed[row, column]
    # Most of the picture is as it was.
    assert changed.mean() < 0.3


def test_what_is_no_picture_is_shown_as_a_gray_field_with_words(found):
    camera = found.game.maze.camera
    broken = Picture(id="x", agent=0, time=0.0, data=b"hello")
    plain = picture_pixels(broken, camera)
    assert plain.shape == (camera.height, camera.width, 3)
    assert len(np.unique(plain)) == 1
    drawn = draw_reading(Reading(broken, NOTHING, no_location(Outcome.NO_PICTURE)), camera)
    assert 0 < (drawn != plain).any(axis=2).mean() < 0.1
