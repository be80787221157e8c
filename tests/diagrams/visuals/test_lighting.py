"""Paints undo what Meshcat's renderer does to colours, and a square shows a picture in its own."""

import base64
import json

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydrake.geometry import Meshcat, MeshcatParams, Rgba

from sightfield.diagrams.visuals.lighting import paint, picture_square, set_lights

# three.js, src/renderers/shaders/ShaderChunk/tonemapping_pars_fragment.glsl.js
IN = np.array([[0.59719, 0.35458, 0.04823], [0.076, 0.90834, 0.01566], [0.0284, 0.13383, 0.83777]])
OUT = np.array(
    [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]]
)


def linear(srgb):
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def rendered(colour, irradiance: float) -> np.ndarray:
    """sRGB of a matt surface under white light of an irradiance, as three.js renders it."""
    light = linear(np.array([colour.r(), colour.g(), colour.b()])) * irradiance / np.pi
    v = IN @ (light / 0.6)
    fitted = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432951) + 0.238081)
    shown = np.clip(OUT @ fitted, 0.0, 1.0)
    return np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * shown ** (1 / 2.4) - 0.055)


@pytest.fixture
def level_irradiance(meshcat_log) -> float:
    """What the lights give to a level surface."""
    values = {}
    meshcat_log.SetProperty = lambda path, name, value: values.update({(path, name): value})
    set_lights(meshcat_log)
    lamp = np.array(values["/Lights/FillLight/<object>", "position"])
    return values["/Lights/AmbientLight/<object>", "intensity"] + values[
        "/Lights/FillLight/<object>", "intensity"
    ] * lamp[2] / np.linalg.norm(lamp)


@pytest.mark.parametrize(
    "wanted", [(0.985, 0.985, 0.985), (0.3, 0.66, 0.37), (0.1, 0.12, 0.16), (0.83, 0.2, 0.2)]
)
def test_a_paint_is_rendered_as_the_colour_asked_for(wanted, level_irradiance):
    np.testing.assert_allclose(rendered(paint(*wanted), level_irradiance), wanted, atol=1e-3)


@given(grey=st.floats(0.02, 0.98))
def test_a_grey_paint_has_no_hue(grey):
    colour = paint(grey, grey, grey)
    assert colour.r() == pytest.approx(colour.g(), abs=1e-3)
    assert colour.g() == pytest.approx(colour.b(), abs=1e-3)


@given(parts=st.tuples(*[st.floats(0.0, 1.0)] * 3))
def test_every_colour_has_a_paint(parts):
    colour = paint(*parts, 0.5)
    assert all(0 <= part <= 1 for part in (colour.r(), colour.g(), colour.b()))
    assert colour.a() == 0.5


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
