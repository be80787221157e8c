"""How far errors along a shell's edges may have moved it: by the raster, and as remainders show.

Before the smoothing a pixel shows the shell or not, by the one point that it looks at: an edge's
place errs by up to half a pixel in each row that it crosses. Rows err independently where an edge
crosses the grid at an odd angle, and alike where it runs along the grid, or along its diagonal: a
whole side then is off by as much as one of its pixels. So the error depends on how a shell lies on
the grid.

To find its size, the grid is laid over the fitted shell in as many ways as there are parts of a
pixel. The error of the place in each way is a sum over its points: of the difference between what
a point sees and what its pixel covers, times the slopes of range and bearing with that pixel.

Remainders have three sources: the noise of each pixel by itself; the effect of the raster on the
pixels of an edge; and other errors of a picture that neighbouring pixels share, as by the blocks of
a compressed picture, or by edges of another profile than expected. The size of each is estimated
from the remainders: from their mean square, and from sums of products of near and of farther
neighbours. Errors that the fit could follow are not among its remainders. So each sum is compared
with what errors of one kind, of a known size, would leave after the same fit. What errors in the
blocks of a compressed picture are near to one another they are not over the whole block: kinds may
have negative sizes. But errors are never taken for smaller than if each pixel erred by itself. And
where errors are alike over many pixels, few independent ones tell their size, which is then
enlarged by how unsure it is.

Sources: ours; C. R. Rao, Estimation of variance and covariance components, Journal of Multivariate
Analysis 1, 1971, whose sums of squares and of products of neighbours are compared in this way.
"""

import math

import cv2
import numpy as np

from ...compiled import compiled
from .expected_picture import BEHIND, PLACE, TOP, Scene, smooth
from .range_models import ROUND, Outline, fill_round, radii_at

# Distances up to which errors of pixels are correlated, less so the farther apart they are: from
# each pixel alone to the blocks of a compressed picture, which have 8 pixels [px].
_REACHES = (1, 2, 4, 8)
# Largest relative variance of what is told by them: beyond, it is not known.
_MOST_DOUBT = 0.5
# Least share of the remainders that is not put down to the raster.
_LEAST_LEFT = 0.1


def remainder_covariance(
    scene: Scene,
    left: np.ndarray,
    slopes: np.ndarray,
    gains: np.ndarray,
    raster: np.ndarray,
    spread: np.ndarray,
) -> np.ndarray:
    """Covariance of range and bearing due to all errors but the raster's, shape (2, 2).

    Args:
        scene: Whose pixels.
        left: What fitted pixels show beyond what is expected, shape (u,).
        slopes: Derivatives of what they show by the unknowns, shape (u, m).
        gains: Derivatives of the fitted unknowns by what each pixel shows, shape (u, m).
        raster: Standard deviation of a fitted pixel due to the raster, shape (u,).
        spread: Of the smoothing, xx, xy, yy, shape (3,) [px^2].
    """
    sums = [_Neighbours(scene, _near(reach)) for reach in _REACHES]
    ones = np.ones((len(left), 1))
    near_slopes = [each.sums(slopes) for each in sums]
    squares = [slopes.T @ each for each in near_slopes]
    found = np.array([float(left @ each.sums(left[:, None])[:, 0]) for each in sums])
    smeared = _Neighbours(scene, _smeared(spread))

    def kept(kind: _Neighbours, share: np.ndarray) -> np.ndarray:
        """What each sum would be after the fit, if errors were of one kind, shape (k,)."""
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
    # A kind of negative size is one that takes back what a wider one has too much of.
    solve = np.linalg.pinv(kinds * scale[:, None]) * scale
    sizes = solve @ (found - known)
    moves = gains[:, PLACE]
    covariances = np.array([moves.T @ kind.sums(moves) for kind in sums])
    doubt = np.sqrt(1 + _doubts(sizes, np.diagonal(covariances, 0, 1, 2).T @ solve, len(left)))
    alone = max(found[0] - known[0], _LEAST_LEFT * found[0]) / kinds[0, 0]
    shared = np.tensordot(sizes, covariances, 1) * np.outer(doubt, doubt)
    return _at_least(alone * covariances[0], shared)


def _doubts(sizes: np.ndarray, weights: np.ndarray, count: int) -> np.ndarray:
    """Relative variances of variances that sums over neighbours tell, shape (k,).

    A variance that few remainders tell comes out too small as often as too large. The mean of a
    squared error over such a variance then exceeds 1 by this much. Worked out for an even field of
    normal remainders, of which the spectrum is known.

    Args:
        sizes: Of the kinds of errors.
        weights: Of the sums in each variance, shape (k, sums).
        count: How many remainders there are.
    """
    power = np.maximum(np.tensordot(sizes, _SPECTRA, 1), 0.0)
    shares = np.tensordot(weights, _SPECTRA, 1) * power
    mean = count * shares.mean(axis=(1, 2)) ** 2
    doubts = 2 * (shares**2).mean(axis=(1, 2)) / np.maximum(mean, 1e-300)
    return np.minimum(doubts, _MOST_DOUBT)


def _at_least(least: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """A covariance that is no smaller in any direction than one, or than another, shape (k, k)."""
    scale = np.sqrt(np.diag(least))
    if not (scale > 0).all():
        return least
    units = np.outer(scale, scale)
    amounts, ways = np.linalg.eigh((covariance - least) / units)
    return least + (ways * np.maximum(amounts, 0.0)) @ ways.T * units


def _near(reach: int) -> np.ndarray:
    """Weights that fall with the distance, shape (2 reach - 1,)."""
    return 1 - np.abs(np.arange(1 - reach, reach)) / reach


def _spectrum(reach: int) -> np.ndarray:
    """Of the weights of neighbours in the plane, shape (n, n)."""
    size = 4 * _REACHES[-1]
    row = np.zeros(size)
    row[np.arange(1 - reach, reach)] = _near(reach)
    along = np.fft.fft(row).real
    return np.outer(along, along)


_SPECTRA = np.array([_spectrum(reach) for reach in _REACHES])


def _smeared(spread: np.ndarray) -> np.ndarray:
    """Correlation of neighbours by the smoothing, as far as sums go, shape (2 reach - 1, ...)."""
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
        """Weighted sums of values of fitted pixels, shape (u, m) -> (u, m)."""
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
        """Sums whose weights are the products of the weights of both."""
        half = min(len(self.weights), len(other.weights)) // 2
        mine, others = (
            each[tuple(slice(n // 2 - half, n // 2 + half + 1) for n in each.shape)]
            for each in (self.weights, other.weights)
        )
        if mine.ndim < others.ndim:
            mine = np.outer(mine, mine)
        return _Neighbours(self.scene, mine * others)


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
