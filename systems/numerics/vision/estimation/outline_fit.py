"""A shell's range and bearing from its whole outline, and how sure they are, from one picture.

The picture is expected to be the outline of `make_outline`, smoothed by whatever smoothed the
picture: lens, motion, compression. Least squares over the pixels around a blob find range and
bearing together with what of the picture is not known beforehand:

- the spread of the smoothing, a 2 x 2 matrix, so that an edge is as sharp as in this picture: a
  Gaussian, along a line if the scene moved;
- the light on the shell, even and from a side (Lambert's law);
- the colours of what lies around and behind, floor first and then walls, at distances from the
  axis, and of the robot's top, which is seen over the shell and hides some of that;
- by how much base, top and sides appear too far out or in: where the sensor's response is not
  linear, or white is all that it can say, the middle of a blurred edge is not where the picture is
  half as colourful. How far edges are shifted is found from the picture too: estimates are averaged
  over several widths of the shifts' prior, each as likely as it makes the picture.

A pixel's noise is that of the ring around the blob, and near edges that of the raster besides, as
a pixel is either shell or not before the smoothing. By this pixels are weighed. How sure range and
bearing are is then told by how the raster lies under this very outline and by what is left over
after the fit (`edge_errors`), and by what is not known beforehand.

Source: ours.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ...compiled import compiled
from .edge_errors import raster_covariance, remainder_covariance
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

# Correlation of the shifts of base and top, whose neighbour is dark, of the two sides, whose
# neighbour is bright but which are lit differently, and of both in saturated pictures.
_ALIKE, _ALIKE_SIDES, _ALIKE_WHITE = 0.97, 0.94, 0.995
# In saturated pictures base and top differ the more, the farther edges are shifted: by this times
# the fourth power of the shift, as a blurred edge is one between shell and floor where the dark in
# between is thin [deviations of the smoothing].
_DARK_LOST = 0.19
# Error of an edge's pixels in a saturated picture, where the profile is cut off and no longer that
# of the smoothing [deviations of the smoothing].
_PROFILE = 0.9
# How much shifts change along an edge, as the light on the shell does, as a share of them.
_UNEVEN = 0.2
# Widths of the shifts' prior, in deviations of the smoothing: the response is close to linear, or
# parts of the picture are as bright as it can tell.
_LINEAR, _SATURATED = (0.0015, 0.005, 0.015, 0.045, 0.135, 0.4), (0.3, 0.6, 1.2)
# Expected deviations of the light across and along, and of the colours of other things, in units of
# the shell's colour.
_LIGHT_SPREAD, _OTHER_SPREAD = 0.25, 0.1
# Expected correlation of the colours at neighbouring points, and on the two sides.
_NEXT, _ACROSS = 0.8, 0.8
# Variance of the smoothing where the search starts, its bounds [px^2], and the weight of the start.
_START_SPREAD, _SPREAD_BOUNDS, _SPREAD_WEIGHT = 0.45, (0.09, 36.0), 1e-4
# Variance of an edge's place within one pixel, as a pixel is either shell or not [px^2].
_RASTER = 1 / 12
# Keeps the equations solvable where a blob says nothing of an unknown.
_RIDGE = 1e-9
# Most steps in each round of the search, after which weights are worked out anew; the least gain
# that is worth another step; and how often a step that loses is shortened.
_STEPS, _GAIN, _TRIALS = (3, 5), 0.1, 3
# Noise as far apart as this is independent: the blocks of a JPEG have 8 pixels [px].
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
        shift: Largest shift of an edge, hidden sides left out [px].
        lopsided: How much farther out the left side is than the right one [px]; 0 where one is
            hidden, or the picture is saturated and the light alone may do it.
        sharpness: Standard deviation of the smoothing [px].
        saturated: Whether parts of the picture are as bright as it can tell.
        misfit: Size of the remainders, as the shift of edges that would make them [px].
        dent: Greatest remainder after smoothing, as a share of the shell's colour.
        roughness: Root mean square of the smoothed remainders, as a share of it.
        strange: How many times larger it is than the noise around and the raster would make it.
        around: Largest difference of what lies around from the floor's colour, as a share of the
            shell's.
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
    strange: float
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
    raster, excess = np.zeros(len(scene.inside)), 1.0
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
        weights, raster, excess = _weights(scene, values, expected)
        behind = show_behind(scene, values, cover)
        expected, slopes = expect_picture(scene, values, cover, behind)
        _know_shifts(prior, max(_widths(scene)), scene, values, hidden)
    weights /= excess
    return _judge(scene, values, mean, prior, weights, raster, expected, slopes, hidden)


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
    """Prior mean of the unknowns, shape (m,), and its precision, shape (m, m)."""
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
    """Widths of the shifts' prior, in deviations of the smoothing."""
    return _SATURATED if scene.saturated else _LINEAR


def _know_shifts(
    prior: np.ndarray,
    width: float,
    scene: Scene,
    values: np.ndarray,
    hidden: tuple[float, float],
) -> None:
    """Set the prior precision of shifts and tilt; a side that is hidden gets a wide prior."""
    sharpness = sharpness_of(values)
    spread = np.eye(4)
    spread[0, 1] = spread[1, 0] = _ALIKE
    spread[2, 3] = spread[3, 2] = _ALIKE_SIDES
    if scene.saturated:
        sides = [off for off, amount in zip(values[4:6], hidden, strict=True) if amount == 0]
        far = float(np.mean(np.abs(sides))) / sharpness if sides else width
        lost = 0.5 * (_DARK_LOST * far**4 / width) ** 2
        spread[0, 1] = spread[1, 0] = 1 - min(max(lost, 1 - _ALIKE_WHITE), 1.0)
        spread[2, 3] = spread[3, 2] = _ALIKE_WHITE
    spread *= (width * sharpness) ** 2
    for side, amount in zip((2, 3), hidden, strict=True):
        if amount > 0:
            spread[side], spread[:, side] = 0.0, 0.0
            spread[side, side] = (1.0 + amount) ** 2
    prior[SHIFTS, SHIFTS] = np.linalg.inv(spread)
    prior[TILT, TILT] = (_UNEVEN * width * sharpness) ** -2


def _bounded(values: np.ndarray) -> np.ndarray:
    """The unknowns, with range and spread within their bounds."""
    values = values.copy()
    values[0] = min(max(values[0], 0.02), 50.0)
    sizes, ways = np.linalg.eigh([[values[6], values[7]], [values[7], values[8]]])
    spread = (ways * np.clip(sizes, *_SPREAD_BOUNDS)) @ ways.T
    values[SPREAD] = spread[0, 0], spread[0, 1], spread[1, 1]
    return values


def _weights(
    scene: Scene, values: np.ndarray, expected: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """Inverse variances of fitted pixels, their deviations by the raster, and the excess.

    The first two have shape (u,); the excess, at least 1, is how many times larger the squares of
    remainders are than noise, raster and profile make them.

    Pixels that one edge crosses err alike by the raster: their variance is such that all of them
    together tell its place no better than the raster lets them.
    """
    down, across = np.gradient(expected.reshape(scene.shape))
    steep = (down**2 + across**2).ravel()
    # The smoothing across the edge that a pixel is on, and both ways.
    xx, xy, yy = values[SPREAD]
    normal = np.sqrt(xx * across**2 + 2 * xy * across * down + yy * down**2).ravel()
    alone = _RASTER * normal * np.sqrt(steep / (xx * yy - xy * xy)) / (2 * math.sqrt(math.pi))
    left = scene.strength - expected
    noise = max(1.4826 * float(np.median(np.abs(left[scene.ring]))), LEAST_NOISE)
    sharpness = sharpness_of(values)
    profile = (_PROFILE * sharpness) ** 2 * scene.saturated
    excess = float(np.mean((left**2 / (noise**2 + alone + profile * steep))[scene.inside]))
    # In a compressed picture neighbours err alike: so many of them tell what one does.
    around = (np.clip(left, -3 * noise, 3 * noise) * scene.ring).reshape(scene.shape)
    alike = float((around * _sums(around)).sum() / max((around**2).sum(), 1e-12))
    shared = _shared_raster(noise, sharpness)
    together = noise**2 * max(alike, 1.0) + (shared + profile) * steep
    return 1 / together[scene.inside], np.sqrt(alone[scene.inside]), max(excess, 1.0)


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
    raster: np.ndarray,
    expected: np.ndarray,
    slopes: np.ndarray,
    hidden: tuple[float, float],
) -> OutlineFit | None:
    """The fit at the end of a search, and its covariance, averaged over the shifts' priors."""
    left, count = scene.left(expected), len(values)
    matrix, pull = _normal_equations(slopes, weights, left)
    off = values - mean
    scores, steps, inverses, priors = [], [], [], []
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
        steps.append(step)
        inverses.append(inverse)
        priors.append(inverse[PLACE] @ prior @ inverse[:, PLACE])
    shares = np.exp(np.array(scores) - max(scores))
    shares /= shares.sum()
    step = shares @ np.array(steps)
    apart = (np.array(steps) - step)[:, PLACE]
    gains = (slopes @ np.tensordot(shares, inverses, 1)) * weights[:, None]
    by_raster = raster_covariance(scene, values, gains[:, PLACE])
    by_rest = remainder_covariance(
        scene, left - slopes @ step, slopes, gains, raster, values[SPREAD]
    )
    covariance = by_raster + by_rest + np.tensordot(shares, priors, 1) + (apart.T * shares) @ apart
    place, shift = values[PLACE] + step[PLACE], (off + step)[SHIFTS]
    if not (np.isfinite(place).all() and np.isfinite(covariance).all()):
        return None
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
        strange=_strange(scene, values, expected, dents, raster),
        around=float(np.abs(values[BEHIND]).max()),
    )


def _strange(
    scene: Scene, values: np.ndarray, expected: np.ndarray, dents: np.ndarray, raster: np.ndarray
) -> float:
    """How much rougher smoothed remainders are than noise and raster make them."""
    quiet = cv2.GaussianBlur(
        np.where(scene.ring, scene.strength - expected, 0.0).reshape(scene.shape), (0, 0), _SMOOTH
    ).ravel()
    share = cv2.GaussianBlur(scene.ring.astype(float).reshape(scene.shape), (0, 0), _SMOOTH)
    noise = float((quiet[scene.ring] ** 2).sum() / (share.ravel()[scene.ring]).sum())
    spread = sharpness_of(values) ** 2
    known = noise + float(np.mean(raster**2)) * spread / (spread + _SMOOTH**2)
    return math.sqrt(float(np.mean(dents[scene.inside] ** 2)) / max(known, 1e-12))
