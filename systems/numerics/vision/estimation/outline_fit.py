"""A shell's range and bearing from its whole outline, and how sure they are, from one picture.

The picture is expected to be the outline of `shell_outline`, smoothed by whatever smoothed the
picture: lens, motion, compression. Least squares over the pixels around a blob find range and
bearing together with what of the picture is not known beforehand:

- the spread of the smoothing, a 2 x 2 matrix, so that an edge is as sharp as in this picture;
- the light on the shell, even and from a side (Lambert's law);
- the colours of what lies around and behind, floor first and then walls, at distances from the
  axis, and of the robot's top, which is seen over the shell and hides some of that;
- by how much base, top and sides appear too far out or in: where the sensor's response is not
  linear, or white is all that it can say, the middle of a blurred edge is not where the picture is
  half as colourful. How far edges are shifted is found from the picture too: estimates are averaged
  over several widths of the shifts' prior, each as likely as it makes the picture.

A pixel's noise is that of the ring around the blob, and near edges that of the raster besides, as
a pixel is either shell or not before the smoothing. What is left over after the fit may be more
than that, and neighbours may err alike, as they do in the blocks of a compressed picture: the
covariance is then that of the remainders themselves, with weights that fall with the distance.

Sources: ours; W. Newey and K. West, A simple, positive semi-definite, heteroskedasticity and
autocorrelation consistent covariance matrix, Econometrica 55, 1987.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ...compiled import compiled
from .expected_picture import (
    BEHIND,
    LEAST_NOISE,
    PLACE,
    SHIFTS,
    SPREAD,
    TILT,
    TOP,
    Scene,
    draw_shell,
    expect_picture,
    read_scene,
    sharpness_of,
    show_behind,
)
from .range_models import Outline
from .shell_detection import Window

# How alike shifts are where the neighbour is alike: dark below and above a shell, bright beside it.
# In saturated pictures more of it is lost the farther edges are shifted, as a blurred edge is
# between shell and floor besides where the dark in between is thin.
_ALIKE, _DARK_LOST = 0.97, 0.07
# What a pixel on an edge of a saturated picture is off by, as its profile is cut off and no longer
# that of the smoothing [deviations of the smoothing].
_PROFILE = 0.9
# How much shifts change along an edge, as the light on the shell does, as a share of them.
_UNEVEN = 0.2
# Widths of the shifts' prior, in deviations of the smoothing: the response is close to linear, or
# parts of the picture are as bright as it can tell.
_LINEAR, _SATURATED = (0.015, 0.045, 0.135, 0.4), (0.3, 0.6, 1.2)
# Deviations of light across and along, and of other things' colour, in that of the shell.
_LIGHT_SPREAD, _OTHER_SPREAD = 0.25, 0.1
# How alike neighbouring points are, and the two sides.
_NEXT, _ACROSS = 0.8, 0.8
# Variance of the smoothing where the search starts, its bounds [px^2], and the weight of the start.
_START_SPREAD, _SPREAD_BOUNDS, _SPREAD_WEIGHT = 0.45, (0.09, 36.0), 1e-4
# Variance of an edge's place within one pixel, as a pixel is either shell or not [px^2].
_RASTER = 1 / 12
# Keeps the equations solvable where a blob says nothing of an unknown.
_RIDGE = 1e-9
# Steps of the search at most, between which weights are worked out anew; the least gain that is
# worth another; and how often a step that loses is shortened.
_STEPS, _GAIN, _TRIALS = (3, 5), 0.1, 3
# Remainders as far apart as this are independent: the blocks of a JPEG have 8 pixels [px].
_TOGETHER = 8
# Remainders are smoothed by this to tell a wrong shape from noise [px].
_SMOOTH = 1.5


@dataclass(frozen=True, kw_only=True)
class OutlineFit:
    """A shell that has been fitted to a picture.

    Attributes:
        range: d, from the axis to the shell's near side, by the exact optics [m].
        bearing: Counter-clockwise from the robot's front [rad].
        covariance: Of range and bearing, shape (2, 2).
        shift: How far the edge that is off most is off, hidden sides left out [px].
        lopsided: How much farther out the left side is than the right one [px]; 0 where one is
            hidden, or the picture is saturated and the light alone may do it.
        sharpness: Standard deviation of the smoothing [px].
        saturated: Whether parts of the picture are as bright as it can tell.
        misfit: What is left over, as the distance by which edges would be off [px].
        dent: Greatest remainder after smoothing, as a share of the shell's colour.
        roughness: Root mean square of the smoothed remainders, as a share of it.
        around: How far what lies around is from the floor's colour, at most, as a share of it.
    """

    range: float
    bearing: float
    covariance: np.ndarray
    shift: float
    lopsided: float
    sharpness: float
    saturated: bool
    misfit: float
    dent: float
    roughness: float
    around: float


def fit_outline(
    window: Window,
    outline: Outline,
    start: tuple[float, float],
    hidden: tuple[float, float] = (0, 0),
) -> OutlineFit | None:
    """Fit a shell to a picture.

    Args:
        window: Around the blob.
        outline: Of a shell.
        start: Range [m] and bearing [rad] of its near side, roughly.
        hidden: How much of its left and right side something hides, roughly [px]; 0 if all is seen.

    Returns:
        The fit, or None where the blob has no colour of its own or no shell comes near it.
    """
    scene = read_scene(window, outline)
    if scene is None:
        return None
    mean, prior = _before(start, hidden, scene)
    values, count = mean.copy(), len(mean)
    weights = np.full(len(scene.inside), scene.noise**-2)
    excess = 1.0
    cover = draw_shell(scene, values)
    behind = show_behind(scene, values, cover)
    expected, slopes = expect_picture(scene, values, cover, behind)
    damping = 1e-3
    for steps in _STEPS:
        for _ in range(steps):
            cost = _cost(scene, weights, expected, values - mean, prior)
            matrix, pull = _normal_equations(slopes, weights, scene.left(expected))
            matrix += prior
            pull -= prior @ (values - mean)
            gain = -1.0
            for _ in range(_TRIALS):
                damped = matrix + damping * np.diag(np.diag(matrix)) + _RIDGE * np.eye(count)
                trial = _bounded(values + np.linalg.solve(damped, pull))
                drawn = draw_shell(scene, trial)
                found = expect_picture(scene, trial, drawn, behind)
                gain = cost - _cost(scene, weights, found[0], trial - mean, prior)
                if gain >= 0:
                    values, cover, (expected, slopes) = trial, drawn, found
                    damping = max(0.1 * damping, 1e-6)
                # A shorter step gains no more where a whole one changes nothing.
                if gain > -_GAIN:
                    break
                damping *= 10
            if gain < _GAIN:
                break
        damping = 1e-3
        weights, excess = _weights(scene, values, expected)
        behind = show_behind(scene, values, cover)
        expected, slopes = expect_picture(scene, values, cover, behind)
        _know_shifts(prior, max(_widths(scene)), scene, values, hidden)
    weights /= excess
    return _judge(scene, values, mean, prior, weights, expected, slopes, hidden)


@compiled
def _normal_equations(
    slopes: np.ndarray, weights: np.ndarray, left: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Matrix and right side of weighted least squares, shapes (m, m), (m,).

    On one core: BLAS shares this between threads, which on a busy machine wait for one another
    several times as long as they work.

    Args:
        slopes: Shape (n, m).
        weights: Shape (n,).
        left: What is to be explained, shape (n,).
    """
    size, count = slopes.shape
    matrix, pull = np.zeros((count, count)), np.zeros(count)
    # Four pixels at once, so that sums are read and written a fourth as often.
    whole = size - size % 4
    for i in range(0, whole, 4):
        a, b, c, d = slopes[i], slopes[i + 1], slopes[i + 2], slopes[i + 3]
        for p in range(count):
            row = matrix[p]
            e, f = weights[i] * a[p], weights[i + 1] * b[p]
            g, h = weights[i + 2] * c[p], weights[i + 3] * d[p]
            pull[p] += e * left[i] + f * left[i + 1] + g * left[i + 2] + h * left[i + 3]
            for q in range(count):
                row[q] += e * a[q] + f * b[q] + g * c[q] + h * d[q]
    for i in range(whole, size):
        for p in range(count):
            e = weights[i] * slopes[i, p]
            pull[p] += e * left[i]
            for q in range(count):
                matrix[p, q] += e * slopes[i, q]
    return matrix, pull


def _before(
    start: tuple[float, float], hidden: tuple[float, float], scene: Scene
) -> tuple[np.ndarray, np.ndarray]:
    """What is expected of the unknowns, shape (m,), and its precision, shape (m, m)."""
    mean = np.zeros(BEHIND.start + scene.points.shape[1])
    mean[PLACE], mean[6], mean[8], mean[9] = start, _START_SPREAD, _START_SPREAD, 1.0
    mean[4:6] = -np.array(hidden)
    precision = np.zeros(len(mean))
    precision[SPREAD] = _SPREAD_WEIGHT
    precision[10:12], precision[TOP] = _LIGHT_SPREAD**-2, _OTHER_SPREAD**-2
    prior = np.diag(precision)
    place = np.arange(scene.points.shape[1] // 2)
    alike = np.kron([[1, _ACROSS], [_ACROSS, 1]], _NEXT ** np.abs(place[:, None] - place))
    prior[BEHIND, BEHIND] = np.linalg.inv(alike) / _OTHER_SPREAD**2
    _know_shifts(prior, max(_widths(scene)), scene, mean, hidden)
    return mean, prior


def _widths(scene: Scene) -> tuple[float, ...]:
    """Of the shifts' prior, in deviations of the smoothing."""
    return _SATURATED if scene.saturated else _LINEAR


def _know_shifts(
    prior: np.ndarray,
    width: float,
    scene: Scene,
    values: np.ndarray,
    hidden: tuple[float, float],
) -> None:
    """Set the precision of shifts and tilt; nothing is known of a side that is hidden."""
    alike = 1 - _DARK_LOST * width**4 if scene.saturated else _ALIKE
    spread = np.eye(4)
    spread[0, 1] = spread[1, 0] = alike
    spread[2, 3] = spread[3, 2] = _ALIKE
    spread *= (width * sharpness_of(values)) ** 2
    for side, amount in zip((2, 3), hidden, strict=True):
        if amount > 0:
            spread[side], spread[:, side] = 0.0, 0.0
            spread[side, side] = (1.0 + amount) ** 2
    prior[SHIFTS, SHIFTS] = np.linalg.inv(spread)
    prior[TILT, TILT] = (_UNEVEN * width * sharpness_of(values)) ** -2


def _bounded(values: np.ndarray) -> np.ndarray:
    """The unknowns with a range and a spread that can be."""
    values = values.copy()
    values[0] = min(max(values[0], 0.02), 50.0)
    sizes, ways = np.linalg.eigh([[values[6], values[7]], [values[7], values[8]]])
    spread = (ways * np.clip(sizes, *_SPREAD_BOUNDS)) @ ways.T
    values[SPREAD] = spread[0, 0], spread[0, 1], spread[1, 1]
    return values


def _weights(scene: Scene, values: np.ndarray, expected: np.ndarray) -> tuple[np.ndarray, float]:
    """One over the variance of each fitted pixel, shape (u,), and how much more is left over.

    Pixels that one edge crosses err alike by the raster: their variance is such that all of them
    together tell its place no better than the raster lets them.
    """
    down, across = np.gradient(expected.reshape(scene.shape))
    steep = (down**2 + across**2).ravel()
    left = scene.strength - expected
    noise = max(1.4826 * float(np.median(np.abs(left[scene.ring]))), LEAST_NOISE)
    sharpness = sharpness_of(values)
    profile = (_PROFILE * sharpness) ** 2 * scene.saturated
    alone = noise**2 + (_RASTER / (2 * math.sqrt(math.pi) * sharpness) + profile) * steep
    excess = float(np.mean((left**2 / alone)[scene.inside]))
    # In a compressed picture neighbours err alike: so many of them tell what one does.
    around = (np.clip(left, -3 * noise, 3 * noise) * scene.ring).reshape(scene.shape)
    alike = float((around * _sums(around)).sum() / max((around**2).sum(), 1e-12))
    together = noise**2 * max(alike, 1.0) + (_shared_raster(noise, sharpness) + profile) * steep
    return 1 / together[scene.inside], max(excess, 1.0)


def _sums(images: np.ndarray) -> np.ndarray:
    """Sums over neighbours, with weights that fall with the distance; shape as `images`."""
    near = 1 - np.abs(np.arange(1 - _TOGETHER, _TOGETHER)) / _TOGETHER
    return cv2.sepFilter2D(images, -1, near, near, borderType=cv2.BORDER_CONSTANT)


def _shared_raster(noise: float, sharpness: float) -> float:
    """Variance per pixel of an edge's place, for pixels that are taken for independent [px^2].

    Along an edge its place has the variance of the raster and of the noise, per pixel of length;
    across it there are as many pixels as the smoothing makes steep.
    """
    x = np.arange(-12.0, 12.5, 0.5) * sharpness
    # The slope, and what differences over two pixels show of it.
    square, shown = (
        (np.exp(-0.5 * x * x / wide) / math.sqrt(2 * math.pi * wide)) ** 2
        for wide in (sharpness**2 + _RASTER, sharpness**2 + _RASTER + 1 / 3)
    )
    known = square.sum() / noise**2
    wanted = 1 / (_RASTER * 0.5 * sharpness + 1 / known)
    low, high = 0.0, 10.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        if float((square / (noise**2 + middle * shown)).sum()) > wanted:
            low = middle
        else:
            high = middle
    return high


def _cost(
    scene: Scene, weights: np.ndarray, expected: np.ndarray, off: np.ndarray, prior: np.ndarray
) -> float:
    return float(weights @ scene.left(expected) ** 2 + off @ prior @ off)


def _judge(
    scene: Scene,
    values: np.ndarray,
    mean: np.ndarray,
    prior: np.ndarray,
    weights: np.ndarray,
    expected: np.ndarray,
    slopes: np.ndarray,
    hidden: tuple[float, float],
) -> OutlineFit | None:
    """How sure a search's end is, averaged over the widths of the shifts' prior."""
    left, count = scene.left(expected), len(values)
    matrix, pull = _normal_equations(slopes, weights, left)
    off = values - mean
    scores, places, shifts, inverses, priors = [], [], [], [], []
    for width in _widths(scene):
        prior = prior.copy()
        _know_shifts(prior, width, scene, values, hidden)
        # A place off the blob has no slopes, nor a precision before: the ridge lets it be unknown.
        inverse = np.linalg.inv(matrix + prior + _RIDGE * np.eye(count))
        rest = pull - prior @ off
        step = inverse @ rest
        cost = off @ prior @ off - rest @ step
        signs = np.linalg.slogdet(prior[SHIFTS, SHIFTS])[1] + np.linalg.slogdet(inverse)[1]
        scores.append(0.5 * (signs - cost) - math.log(width))
        places.append((values + step)[PLACE])
        shifts.append((off + step)[SHIFTS])
        inverses.append(inverse[PLACE])
        priors.append(inverse[PLACE] @ prior @ inverse[:, PLACE])
    alike = _alike(scene, slopes * (weights * left)[:, None], np.array(inverses))
    spreads = [
        _larger(inverse[:, PLACE], one + other)
        for inverse, one, other in zip(inverses, alike, priors, strict=True)
    ]
    shares = np.exp(np.array(scores) - max(scores))
    shares /= shares.sum()
    place = shares @ np.array(places)
    apart = np.array(places) - place
    covariance = np.tensordot(shares, spreads, 1) + (apart.T * shares) @ apart
    if not (np.isfinite(place).all() and np.isfinite(covariance).all()):
        return None
    shift = shares @ np.array(shifts)
    seen = np.array([True, True, *(amount == 0 for amount in hidden)])
    steep = np.gradient(expected.reshape(scene.shape))
    steepness = float((steep[0] ** 2 + steep[1] ** 2).ravel()[scene.inside].sum())
    dents = cv2.GaussianBlur(scene.image(left[:, None]), (0, 0), _SMOOTH).ravel()
    return OutlineFit(
        range=float(place[0]),
        bearing=math.remainder(float(place[1]), 2 * math.pi),
        covariance=covariance,
        shift=float(np.abs(shift[seen]).max()),
        lopsided=float(shift[2] - shift[3]) if seen.all() and not scene.saturated else 0.0,
        sharpness=sharpness_of(values),
        saturated=scene.saturated,
        misfit=math.sqrt(float(left @ left) / max(steepness, 1e-12)),
        dent=float(np.abs(dents).max()),
        roughness=math.sqrt(float(np.mean(dents[scene.inside] ** 2))),
        around=float(np.abs(values[BEHIND]).max()),
    )


def _alike(scene: Scene, pulls: np.ndarray, inverses: np.ndarray) -> np.ndarray:
    """Covariances that remainders make where neighbours err alike, shape (w, 2, 2).

    Args:
        scene: Whose pixels.
        pulls: How each fitted pixel pulls at the unknowns, shape (u, m).
        inverses: What a pull does to range and bearing, shape (w, 2, m).
    """
    each = _moves(pulls, inverses)
    sums = _sums(scene.image(each)).reshape(-1, each.shape[1])[scene.inside]
    # So many blocks are independent; that the fit has made their remainders small counts most where
    # they are few.
    blocks = max(len(pulls) / _TOGETHER**2, 2.0)
    return _paired(each, sums) * blocks / (blocks - 1)


@compiled
def _moves(pulls: np.ndarray, inverses: np.ndarray) -> np.ndarray:
    """What each pixel does to range and bearing, with each inverse, shape (u, 2 w)."""
    size, count = pulls.shape
    moves = np.zeros((size, 2 * len(inverses)))
    for i in range(size):
        for k in range(moves.shape[1]):
            row = inverses[k // 2, k % 2]
            for p in range(count):
                moves[i, k] += pulls[i, p] * row[p]
    return moves


@compiled
def _paired(each: np.ndarray, sums: np.ndarray) -> np.ndarray:
    """Sums over pixels of the products of one pair of columns after the other, (w, 2, 2)."""
    products = np.zeros((each.shape[1] // 2, 2, 2))
    for i in range(len(each)):
        for k in range(len(products)):
            for p in range(2):
                for q in range(2):
                    products[k, p, q] += each[i, 2 * k + p] * sums[i, 2 * k + q]
    return products


def _larger(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The least covariance that is as large as `one` and, along its axes, as `other`."""
    root = np.linalg.cholesky(one)
    inverse = np.linalg.inv(root)
    sizes, ways = np.linalg.eigh(inverse @ other @ inverse.T)
    return root @ (ways * np.maximum(sizes, 1.0)) @ ways.T @ root.T
