"""The error of a shell's place that comes from the raster of a picture.

Before the smoothing a pixel shows the shell or not, by the one point that it looks at: an edge's
place errs by up to half a pixel in each row that it crosses. Rows err independently where an edge
crosses the grid at an odd angle, and alike where it runs along the grid, or along its diagonal: a
whole side then is off by as much as one of its pixels. So the error depends on how a shell lies on
the grid.

To find its size, the grid is laid over the fitted shell in as many ways as there are parts of a
pixel. The error of the place in each way is a sum over its points: of the difference between what
a point sees and what its pixel covers, times the slopes of range and bearing with that pixel.

Source: ours.
"""

import math

import cv2
import numpy as np

from ...compiled import compiled
from .expected_picture import BEHIND, TOP, Scene, smooth
from .range_models import ROUND, Outline, fill_round, radii_at

# Parts of a pixel each way by which the grid is moved; odd, so that one is in the middle.
_PARTS = 7


def raster_covariance(scene: Scene, values: np.ndarray, gains: np.ndarray) -> np.ndarray:
    """Covariance of range and bearing due to where the pixels' grid happens to lie, shape (2, 2).

    Args:
        scene: Whose pixels.
        values: The unknowns, shape (m,).
        gains: Derivatives of range and bearing by what each fitted pixel shows, shape (u, 2).
    """
    height, width = scene.shape
    size = width * _PARTS, height * _PARTS
    moves = smooth(scene, scene.image(gains).reshape(-1, 2).astype(np.float32), values)
    moves = cv2.resize(moves.reshape(height, width, 2), size, interpolation=cv2.INTER_CUBIC)
    seen = cv2.resize((scene.points @ values[BEHIND]).reshape(scene.shape), size)
    _look(scene.outline, scene.axis, values, seen)
    off = (seen - cv2.blur(seen, (_PARTS, _PARTS)))[:, :, None] * moves
    # By rows and columns of pixels, and the parts of each.
    sums = off.reshape(height, _PARTS, width, _PARTS, 2).sum(axis=(0, 2)).reshape(-1, 2)
    return np.cov(sums.T)


@compiled
def _look(outline: Outline, axis: np.ndarray, values: np.ndarray, seen: np.ndarray) -> None:
    """Find what points see of a shell; those that see none of it keep what they have.

    Args:
        outline: Of the shell.
        axis: Pixel of the mirror's axis (column, row), shape (2,).
        values: The unknowns, shape (m,).
        seen: To be filled, for the parts of pixels, shape (height p, width p).
    """
    parts, rho = _PARTS, outline.radius
    edges = np.empty((ROUND, 3))
    fill_round(outline, values[0], edges)
    nearest = edges[-1, 0] - values[2]
    farthest = max(edges[-1, 2], edges[0, 1] + values[3])
    ratio = (values[0] + rho) / rho
    narrow, wide = 1 / ratio, math.sqrt(1 - 1 / ratio**2)
    sine, cosine = math.sin(values[1]), math.cos(values[1])
    for i in range(len(seen)):
        up = axis[1] - ((i + 0.5) / parts - 0.5)
        for j in range(seen.shape[1]):
            right = (j + 0.5) / parts - 0.5 - axis[0]
            out, aside = right * sine + up * cosine, right * cosine - up * sine
            r = math.sqrt(out * out + aside * aside)
            side = 4 if aside < 0.0 else 5
            # Sides are lines through the axis, and shifted along the normal as good as aside.
            if (
                out > 0.0
                and nearest < r < farthest
                and abs(aside) < r * narrow + wide * values[side]
            ):
                x = min(max(ratio * aside / r, -1.0), 1.0)
                along = math.sqrt(1.0 - x * x)
                _, low, high, rim = radii_at(edges, along, values)
                if low <= r < high:
                    seen[i, j] = values[9] + values[10] * x + values[11] * along
                elif high <= r < rim:
                    seen[i, j] = values[TOP]
