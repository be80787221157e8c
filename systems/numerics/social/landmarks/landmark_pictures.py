"""Pictures of the landmarks on the walls and of the evader's marker, each of them unique.

Each is a sign in dark ink on a patchwork of light and dark pieces of two sizes: the large pieces
are still visible from far away, the small ones locate the picture precisely when it is near.

The thesis's landmarks are Chinese characters. These signs are not, but have a similar structure:
two or three parts, side by side or one above the other, each a few strokes on a grid.
"""

from functools import lru_cache

import cv2
import numpy as np
from scipy.spatial import KDTree

from ...errors import require

# Strokes of each part from x0, y0 to x1, y1 within a unit square, y down.
_BOX = [(0.1, 0.1, 0.1, 0.9), (0.1, 0.1, 0.9, 0.1), (0.9, 0.1, 0.9, 0.9), (0.1, 0.9, 0.9, 0.9)]
PARTS = (
    _BOX,
    [*_BOX, (0.1, 0.5, 0.9, 0.5)],
    [*_BOX, (0.5, 0.1, 0.5, 0.9), (0.1, 0.5, 0.9, 0.5)],
    [(0.05, 0.35, 0.95, 0.35), (0.5, 0.0, 0.5, 1.0)],
    [(0.05, 0.3, 0.95, 0.3), (0.5, 0.0, 0.5, 1.0), (0.5, 0.35, 0.05, 0.9), (0.5, 0.35, 0.95, 0.9)],
    [(0.1, 0.15, 0.9, 0.15), (0.2, 0.5, 0.8, 0.5), (0.0, 0.9, 1.0, 0.9)],
    [(0.1, 0.1, 0.9, 0.1), (0.5, 0.1, 0.5, 0.95), (0.0, 0.95, 1.0, 0.95), (0.15, 0.5, 0.85, 0.5)],
    [(0.5, 0.0, 0.05, 0.95), (0.45, 0.3, 0.98, 0.95)],
    [(0.2, 0.0, 0.2, 0.95), (0.2, 0.3, 0.9, 0.1), (0.2, 0.6, 0.95, 0.95)],
    [(0.1, 0.1, 0.35, 0.3), (0.05, 0.45, 0.3, 0.6), (0.05, 0.95, 0.4, 0.7), (0.6, 0.0, 0.6, 1.0)],
    [(0.05, 0.25, 0.95, 0.25), (0.3, 0.0, 0.3, 0.5), (0.7, 0.0, 0.7, 0.5), (0.1, 0.7, 0.9, 0.7)],
    [(0.8, 0.0, 0.2, 0.3), (0.5, 0.2, 0.5, 1.0), (0.1, 0.55, 0.9, 0.55), (0.5, 1.0, 0.3, 0.85)],
    [(0.1, 0.0, 0.1, 1.0), (0.1, 0.05, 0.9, 0.05), (0.9, 0.05, 0.9, 1.0), (0.3, 0.5, 0.7, 0.5)],
    [(0.15, 0.1, 0.5, 0.4), (0.85, 0.1, 0.5, 0.4), (0.5, 0.4, 0.5, 1.0), (0.0, 0.65, 1.0, 0.65)],
)
# Left, top, width and height of the parts of each layout.
_LAYOUTS = (
    ((0.0, 0.0, 0.42, 1.0), (0.5, 0.0, 0.5, 1.0)),
    ((0.0, 0.0, 1.0, 0.45), (0.0, 0.53, 1.0, 0.47)),
    ((0.0, 0.05, 0.4, 0.9), (0.48, 0.0, 0.52, 0.46), (0.48, 0.54, 0.52, 0.46)),
    ((0.1, 0.0, 0.8, 0.4), (0.0, 0.48, 0.46, 0.52), (0.54, 0.48, 0.46, 0.52)),
)
# Strokes are drawn this much larger and then shrunk, so that their edges are smooth.
_OVERSAMPLING = 4


def draw_glyph(rng: np.random.Generator, size: int, stroke: float = 0.075) -> np.ndarray:
    """Draw a sign.

    Args:
        rng: Draws layout, parts, and small deviations of the strokes.
        size: Width and height of the picture [px].
        stroke: Width of a stroke, as a share of the picture's.

    Returns:
        Ink, 0 to 1, shape (size, size), float32.
    """
    large = _OVERSAMPLING * size
    ink = np.zeros((large, large), dtype=np.uint8)
    layout = _LAYOUTS[int(rng.integers(len(_LAYOUTS)))]
    parts = rng.choice(len(PARTS), size=len(layout), replace=False)
    for (left, top, width, height), part in zip(layout, parts, strict=True):
        for x0, y0, x1, y1 in PARTS[part]:
            ends = np.array([[x0, y0], [x1, y1]]) * [width, height] + [left, top]
            ends += rng.normal(0.0, 0.012, (2, 2))
            outline = _brush(rng, np.clip(ends, 0.03, 0.97), stroke)
            cv2.fillPoly(ink, [np.rint(outline * large).astype(np.int32)], 255)
    shrunk = cv2.resize(ink, (size, size), interpolation=cv2.INTER_AREA)
    return (shrunk / 255).astype(np.float32)


def _brush(rng: np.random.Generator, ends: np.ndarray, stroke: float) -> np.ndarray:
    """Outline of a stroke that starts with a press, thins, and bends a little; shape (n, 2)."""
    start, end = ends
    along = end - start
    across = np.array([-along[1], along[0]]) / max(float(np.hypot(*along)), 1e-6)
    share = np.linspace(0.0, 1.0, 9)
    bend = rng.normal(0.0, 0.012) * 4 * share * (1 - share)
    spine = start + share[:, None] * along + bend[:, None] * across
    taper = rng.uniform(0.35, 0.9)
    width = 0.5 * stroke * (1 - (1 - taper) * share + 0.35 * np.exp(-((share / 0.12) ** 2)))
    width[0] *= 0.7
    return np.vstack([spine + width[:, None] * across, (spine - width[:, None] * across)[::-1]])


# Side of a picture [px]: a power of two, or VTK resamples it and shrinks it by a texel.
PIXELS = 256
# Separates the random numbers of landmarks from those of markers.
_LANDMARK, _MARKER = 0, 1
# Contrast of the patchwork to white paper.
_CONTRAST = 0.7
# Widths of the frame and of the white line inside it, as shares of the side.
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
    """The marker's picture: like a landmark's, but with larger pieces, as the marker is smaller.

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
