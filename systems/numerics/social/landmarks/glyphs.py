"""Signs in the manner of Chinese characters, made up of brush strokes.

The thesis's landmarks are characters. These are none, but built like some: two or three parts, side
by side or one above the other, each a small set of strokes on a grid.
"""

import cv2
import numpy as np

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
        rng: Decides layout, parts, and how the hand trembles.
        size: Of the picture [px].
        stroke: Width of a stroke, of the whole.

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
