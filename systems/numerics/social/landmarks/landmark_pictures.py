"""What hangs on the walls and on the evader: pictures that no two landmarks share.

Each is a sign in dark ink on a patchwork of light and dark pieces of several sizes: the large ones
are still there when the picture is seen small, the small ones place it well when it is near.
"""

from functools import lru_cache

import cv2
import numpy as np
from scipy.spatial import KDTree

from ...errors import require
from .glyphs import draw_glyph

# Side of a picture [px]: a power of two, or VTK resamples it and shrinks it by a texel.
PIXELS = 256
# Separates the random numbers of landmarks from those of markers.
_LANDMARK, _MARKER = 0, 1
# How strong the patchwork is, beside white paper.
_CONTRAST = 0.7
# Width of frame and of the white line inside it, of the side.
_FRAME, _LINE = 0.035, 0.02


@lru_cache(maxsize=64)
def landmark_picture(number: int, pixels: int = PIXELS) -> np.ndarray:
    """The picture of a landmark: red, green, blue, shape (pixels, pixels, 3), uint8, read-only.

    Raises:
        InvalidInput: The number is negative.
    """
    require(number >= 0, "number", "be zero or positive", number)
    return _picture(_LANDMARK, number, pixels)


@lru_cache(maxsize=4)
def marker_picture(pixels: int = PIXELS) -> np.ndarray:
    """The marker's picture, as of a landmark, but of bolder pieces: the marker is smaller.

    Args:
        pixels: Width and height.
    """
    return _picture(_MARKER, 0, pixels)


def _picture(kind: int, number: int, pixels: int) -> np.ndarray:
    rng = np.random.default_rng([20140528, kind, number])
    cells = (4, 9) if kind == _LANDMARK else (3, 6)
    coarse, fine = (_patches(rng, each, pixels) for each in cells)
    paper = 1 - _CONTRAST * (0.65 * coarse + 0.35 * fine)
    hue = rng.uniform(0, 1)
    tint = 1 - 0.35 * (0.5 + 0.5 * np.cos(2 * np.pi * (hue + np.array([0, 1 / 3, 2 / 3]))))
    picture = paper[..., None] * tint
    inner = round(0.78 * pixels)
    edge = (pixels - inner) // 2
    stroke = 0.075 if kind == _LANDMARK else 0.1
    ink = np.zeros((pixels, pixels), dtype=np.float32)
    ink[edge : edge + inner, edge : edge + inner] = draw_glyph(rng, inner, stroke)
    colour = rng.uniform(0.0, 0.18, 3)
    picture = picture * (1 - ink[..., None]) + colour * ink[..., None]
    frame, line = round(_FRAME * pixels), round(_LINE * pixels)
    rim = np.ones((pixels, pixels), dtype=bool)
    rim[frame + line : -frame - line, frame + line : -frame - line] = False
    picture[rim] = 1.0
    rim[frame:-frame, frame:-frame] = False
    picture[rim] = colour
    shown = np.rint(255 * np.clip(picture, 0, 1)).astype(np.uint8)
    shown.flags.writeable = False
    return shown


def _patches(rng: np.random.Generator, cells: int, pixels: int) -> np.ndarray:
    """Polygons around scattered points, each of its own shade, 0 to 1, shape (pixels, pixels)."""
    steps = (np.arange(cells) + 0.5) / cells
    seeds = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    seeds = seeds + rng.uniform(-0.45, 0.45, seeds.shape) / cells
    shades = rng.permutation(np.linspace(0, 1, len(seeds)))
    centres = (np.arange(pixels) + 0.5) / pixels
    points = np.stack(np.meshgrid(centres, centres), axis=-1).reshape(-1, 2)
    _, nearest = KDTree(seeds).query(points)
    return cv2.GaussianBlur(shades[nearest].reshape(pixels, pixels), (0, 0), pixels / 400)
