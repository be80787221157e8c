"""Paints undo what Meshcat's renderer does to colours."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.diagrams.visuals.lighting import paint, set_lights

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
