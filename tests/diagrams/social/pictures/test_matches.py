"""Pictures with what was recognised in them."""

import numpy as np
import pytest

from sightfield.diagrams.social.report import draw_detections, draw_reading
from sightfield.systems.numerics.social.landmarks.thesis_maze import thesis_maze
from sightfield.systems.numerics.social.localisation.location import Outcome, read_picture
from sightfield.systems.numerics.social.network.interface import Picture
from sightfield.systems.numerics.social.recognition.picture_files import encode_picture
from sightfield.systems.numerics.social.recognition.references import maze_references
from sightfield.systems.social.maze_renderer import MazeRenderer

MAZE = thesis_maze()


@pytest.fixture(scope="module")
def read():
    """A function of bytes: what is read in them."""
    references = maze_references(MAZE)

    def make(data: bytes):
        return read_picture(Picture(id="a", agent=2, time=3.5, data=data), MAZE, references)

    return make


@pytest.fixture(scope="module")
def pixels() -> np.ndarray:
    """Landmarks and the evader."""
    cameras, evader = np.array([[1.25, 1.0, 0.9]]), np.array([1.55, 1.5, 0.4])
    return MazeRenderer(MAZE).render(0, cameras, evader)


def test_what_was_recognised_is_outlined_and_the_rest_is_left_alone(read, pixels):
    reading = read(encode_picture(pixels))
    before = pixels.copy()
    drawn = draw_detections(pixels, reading.recognition.detections)
    assert np.array_equal(pixels, before)
    changed = np.any(drawn != pixels, axis=2)
    for each in reading.recognition.detections:
        column, row = each.corners[2].round().astype(int)
        if 0 <= column < changed.shape[1] and 0 <= row < changed.shape[0]:
            assert changed[row - 1 : row + 2, column - 1 : column + 2].any()
    assert 0 < changed.mean() < 0.1


def test_a_sheet_shows_picture_references_and_matches(read, pixels):
    reading = read(encode_picture(pixels))
    assert reading.location.outcome is Outcome.LOCATED
    sheet = draw_reading(reading, MAZE)
    camera = MAZE.camera
    assert sheet.shape[1] == 2 * camera.width
    assert sheet.shape[0] > 2 * camera.height
    # References below the picture, and words below them.
    assert sheet[2 * camera.height + 16 : -60].std() > 20
    assert sheet[-50:].min() < 100


def test_what_is_no_picture_is_drawn_as_such(read):
    reading = read(b"not a picture")
    assert reading.location.outcome is Outcome.NO_PICTURE
    sheet = draw_reading(reading, MAZE)
    assert (sheet[: 2 * MAZE.camera.height] == 200).all()
