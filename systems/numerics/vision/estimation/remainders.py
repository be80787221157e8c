"""What is left over after a fit, and how far it may have moved what was fitted.

Remainders are the pixels' noise, each its own; what the raster does to the pixels of an edge; and
what else a picture errs by, in which neighbours err alike: the blocks of a compressed picture, or
edges of another profile than was expected. How much there is of each is read from the remainders:
from their mean square, and from sums of products of neighbours, near ones and farther ones. What a
fit could follow is not among its remainders. So each sum is compared with what would be left of
errors of one kind, of a known size, after the same fit.

Sources: ours; C. R. Rao, Estimation of variance and covariance components, Journal of Multivariate
Analysis 1, 1971, whose sums of squares and of products of neighbours are compared in this way.
"""

import cv2
import numpy as np
from scipy.optimize import nnls

from .expected_picture import Scene

# Pixels err alike as far as this, less so the farther apart they are: alone, or within the blocks
# of a compressed picture, which have 8 pixels [px].
_REACHES = (1, 2, 4, 8)


def remainder_covariance(
    scene: Scene,
    left: np.ndarray,
    slopes: np.ndarray,
    gains: np.ndarray,
    moves: np.ndarray,
    raster: np.ndarray,
    spread: np.ndarray,
) -> np.ndarray:
    """Covariance that all errors but the raster's make of range and bearing, shape (2, 2).

    Args:
        scene: Whose pixels.
        left: What fitted pixels show beyond what is expected, shape (u,).
        slopes: Of what they show, with the unknowns, shape (u, m).
        gains: What a fitted pixel that shows more does to the unknowns, shape (u, m).
        moves: What it does to range and bearing, shape (u, 2).
        raster: Deviation of a fitted pixel by the raster, shape (u,).
        spread: Of the smoothing, xx, xy, yy, shape (3,) [px^2].
    """
    sums = [_Neighbours(scene, _near(reach)) for reach in _REACHES]
    ones = np.ones((len(left), 1))
    near_slopes = [each.sums(slopes) for each in sums]
    squares = [slopes.T @ each for each in near_slopes]
    found = np.array([float(left @ each.sums(left[:, None])[:, 0]) for each in sums])
    smeared = _Neighbours(scene, _smeared(spread))

    def kept(kind: _Neighbours, share: np.ndarray) -> np.ndarray:
        """What each sum would be after the fit, of errors of a kind, shape (k,)."""
        moved = share * kind.sums(share * gains)
        matrix = gains.T @ moved
        return np.array(
            [
                float((share * each.times(kind).sums(share)).sum())
                - 2 * float((moved * near).sum())
                + float((square * matrix).sum())
                for each, near, square in zip(sums, near_slopes, squares, strict=True)
            ]
        )

    known = kept(smeared, raster[:, None])
    kinds = np.column_stack([kept(kind, ones) for kind in sums])
    # Sums of many products are less sure.
    scale = np.array([1 / reach for reach in _REACHES])
    sizes, _ = nnls(kinds * scale[:, None], np.maximum(found - known, 0.0) * scale)
    covariances = [moves.T @ kind.sums(moves) for kind in sums]
    return np.tensordot(sizes, covariances, 1)


def _near(reach: int) -> np.ndarray:
    """Weights that fall with the distance, shape (2 reach - 1,)."""
    return 1 - np.abs(np.arange(1 - reach, reach)) / reach


def _smeared(spread: np.ndarray) -> np.ndarray:
    """How alike the smoothing makes neighbours, as far as sums go, shape (2 reach - 1, ...)."""
    along = np.arange(1.0 - _REACHES[-1], _REACHES[-1])
    xx, xy, yy = spread
    square = yy * along**2 - 2 * xy * along * along[:, None] + xx * along[:, None] ** 2
    return np.exp(-0.25 * square / (xx * yy - xy * xy))


class _Neighbours:
    """Sums over the fitted neighbours of a pixel, with weights by where they are.

    The weights are the same along rows and columns, shape (k,), or of both together, (k, k).
    """

    def __init__(self, scene: Scene, weights: np.ndarray) -> None:
        self.scene, self.weights = scene, weights

    def sums(self, values: np.ndarray) -> np.ndarray:
        """Of values of fitted pixels, shape (u, m) -> (u, m)."""
        weights, edge = self.weights, cv2.BORDER_CONSTANT
        if len(weights) == 1:
            return values
        images = self.scene.image(values).astype(np.float32)
        if weights.ndim == 1:
            summed = cv2.sepFilter2D(images, -1, weights, weights, borderType=edge)
        else:
            summed = cv2.filter2D(images, -1, weights, borderType=edge)
        return summed.reshape(-1, values.shape[1])[self.scene.inside].astype(float)

    def times(self, other: "_Neighbours") -> "_Neighbours":
        """Those whose weights are the products of both."""
        half = min(len(self.weights), len(other.weights)) // 2
        mine, others = (
            each[tuple(slice(n // 2 - half, n // 2 + half + 1) for n in each.shape)]
            for each in (self.weights, other.weights)
        )
        if mine.ndim < others.ndim:
            mine = np.outer(mine, mine)
        return _Neighbours(self.scene, mine * others)
