"""Lights that shine alike everywhere, and paints that come out on the page as they were asked for.

Meshcat maps light to screen colours with the ACES filmic curve, under which a white floor is grey
and reds and blues lose their hue. The curve can be inverted, so a paint is mixed from the colour
that a level surface shall have on the screen.

Source of the curve: three.js, ACESFilmicToneMapping (the fit by S. Hill).
"""

from math import pi

import numpy as np
from pydrake.geometry import Meshcat, Rgba

# Light from everywhere, and from a lamp in the north-west that leaves the south sides of obstacles
# and robots, which a camera leaning back sees, darker than their tops. It stands low, so that level
# surfaces do not gleam.
_AMBIENT = 12.0
_LAMP = 20.0
_LAMP_DIRECTION = np.array([-0.54, 0.73, 0.42])
# What a white level surface sends back.
_LEVEL_LIGHT = (_AMBIENT + _LAMP * _LAMP_DIRECTION[2] / np.linalg.norm(_LAMP_DIRECTION)) / pi

_TO_CURVE = np.array(
    [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]]
)
_FROM_CURVE = np.array(
    [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]]
)
_EXPOSURE = 1 / 0.6


def paint(red: float, green: float, blue: float, opacity: float = 1.0) -> Rgba:
    """Mix the paint that shows as an sRGB colour, each part from 0 to 1, on a level surface.

    The purest hues are beyond the curve: they come out a little paler.

    Args:
        red, green, blue: Parts of the colour, from 0 to 1.
        opacity: From 0 to 1.
    """
    shown = _FROM_CURVE_INVERSE @ _linear(np.array([red, green, blue]))
    # The curve is (v^2 + p v - q) / (r v^2 + s v + t): solve it for v.
    a = 1 - 0.983729 * shown
    b = 0.0245786 - 0.4329510 * shown
    c = -0.000090537 - 0.238081 * shown
    v = (-b + np.sqrt(b * b - 4 * a * c)) / (2 * a)
    light = np.linalg.solve(_TO_CURVE, v) / _EXPOSURE
    albedo = _srgb(np.clip(light / _LEVEL_LIGHT, 0.0, 1.0))
    return Rgba(float(albedo[0]), float(albedo[1]), float(albedo[2]), opacity)


def set_lights(meshcat: Meshcat) -> None:
    """Light every place alike: the usual lamps near the origin leave the rest of a map dark."""
    for lamp in ("SpotLight", "PointLightNegativeX", "PointLightPositiveX"):
        meshcat.SetProperty(f"/Lights/{lamp}", "visible", False)
    meshcat.SetProperty("/Lights/AmbientLight/<object>", "intensity", _AMBIENT)
    meshcat.SetProperty("/Lights/FillLight/<object>", "intensity", _LAMP)
    meshcat.SetProperty("/Lights/FillLight/<object>", "position", (10 * _LAMP_DIRECTION).tolist())


_FROM_CURVE_INVERSE = np.linalg.inv(_FROM_CURVE)


def _linear(srgb: np.ndarray) -> np.ndarray:
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def _srgb(linear: np.ndarray) -> np.ndarray:
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
