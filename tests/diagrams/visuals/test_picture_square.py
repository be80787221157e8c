"""A square in Meshcat that shows a picture."""

import base64
import json

import cv2
import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatParams, Rgba

from sightfield.diagrams.visuals.picture_square import picture_square


@pytest.fixture
def picture():
    """Red on the left, blue below, white elsewhere."""
    picture = np.full((64, 64, 3), 255, dtype=np.uint8)
    picture[48:] = [0, 0, 255]
    picture[:, :16] = [255, 0, 0]
    return picture


def scene_of(mesh):
    return json.loads(mesh.source().in_memory().mesh_file.contents())


def data_of(uri):
    return base64.b64decode(uri.partition("base64,")[2])


def test_the_image_is_the_picture_made_smaller(picture):
    scene = scene_of(picture_square(picture, 2.0, pixels=32))
    jpeg = np.frombuffer(data_of(scene["images"][0]["uri"]), np.uint8)
    image = cv2.cvtColor(cv2.imdecode(jpeg, cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
    assert image.shape == (32, 32, 3)
    for (row, column), colour in (
        ((4, 24), (255, 255, 255)),
        ((4, 3), (255, 0, 0)),
        ((29, 24), (0, 0, 255)),
    ):
        np.testing.assert_allclose(image[row, column], colour, atol=30)


def test_the_square_lies_flat_and_its_top_left_shows_the_pictures(picture):
    scene = scene_of(picture_square(picture, 2.0, pixels=32))
    data = data_of(scene["buffers"][0]["uri"])
    corners, texture, faces = (
        np.frombuffer(data, kind, count, view["byteOffset"])
        for view, kind, count in zip(
            scene["bufferViews"], (np.float32, np.float32, np.uint16), (12, 8, 6), strict=True
        )
    )
    # glTF has y up and z towards the viewer: x, -z, y are ours.
    x, up, back = corners.reshape(4, 3).T
    np.testing.assert_array_equal(up, 0)
    np.testing.assert_array_equal(
        texture.reshape(4, 2), np.column_stack([(x + 1) / 2, (back + 1) / 2])
    )
    ours = np.column_stack([x, -back])[faces.reshape(2, 3)]
    first, second = ours[:, 1] - ours[:, 0], ours[:, 2] - ours[:, 0]
    turns = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    # Two triangles that face up and fill the square.
    np.testing.assert_array_equal(turns, 4.0)


def test_meshcat_takes_it(picture):
    page = Meshcat(MeshcatParams(port=0))
    page.SetObject("square", picture_square(picture, 1.0, pixels=16), Rgba(1, 1, 1, 1))
    assert page.HasPath("square")


def test_a_picture_that_is_no_square_keeps_its_proportion(picture):
    scene = scene_of(picture_square(picture[:48], 2.0, pixels=32))
    jpeg = np.frombuffer(data_of(scene["images"][0]["uri"]), np.uint8)
    assert cv2.imdecode(jpeg, cv2.IMREAD_COLOR).shape == (24, 32, 3)
    bounds = scene["accessors"][0]
    np.testing.assert_allclose(bounds["max"], [1.0, 0.0, 0.75])
    np.testing.assert_allclose(bounds["min"], [-1.0, 0.0, -0.75])
