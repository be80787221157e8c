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
from .range_models import Outline, draw_cover
from .shell_detection import Window

# The unknowns: range and bearing; shifts of base, top, left and right side; the spread of the
# smoothing, xx, xy, yy; light, even, across and along; by how much more base and top are shifted at
# the right end than in the middle; the colour of the robot's top, and of what lies around and
# behind, at distances from the axis.
_PLACE, _SHIFTS, _SPREAD, _LIGHT = slice(0, 2), slice(2, 6), slice(6, 9), slice(9, 12)
_TILT, _TOP, _BEHIND = 12, 13, slice(14, None)
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
# Share of the pixels around a blob that are white at which it is taken for saturated.
_WHITE, _WHITE_SHARE = 254, 0.03
# Deviations of light across and along, and of other things' colour, in that of the shell.
_LIGHT_SPREAD, _OTHER_SPREAD = 0.25, 0.1
# What lies behind changes its colour with the distance from the axis, where floor ends and walls
# begin: between points so far apart [px], so many at most, on the left and on the right.
_APART, _POINTS = 2.5, 9
# How alike neighbouring points are, and the two sides.
_NEXT, _ACROSS = 0.8, 0.8
# Variance of the smoothing where the search starts, its bounds [px^2], and the weight of the start.
_START_SPREAD, _SPREAD_BOUNDS, _SPREAD_WEIGHT = 0.45, (0.09, 36.0), 1e-4
# Least noise of a pixel, in colour of the shell: no picture is known better.
_LEAST_NOISE = 0.02
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


@dataclass(frozen=True, eq=False)
class _Scene:
    """What does not change during a search: pixels, what they show, and what is known before.

    Attributes:
        outline: Of the shell.
        shape: Of the window, whose n pixels are counted row by row.
        bearings, radii: Of the pixels about the mirror's axis, each shape (n,) [rad], [px].
        strength: How much of the shell's colour they have, shape (n,).
        inside: Numbers of the pixels that are fitted, at and around the blob, shape (u,).
        ring: Whether they are of the ring around the blob, shape (n,).
        points: How much each point around a shell counts in them, shape (n, k).
        noise: Standard deviation of `strength`.
        saturated: Whether parts of the picture are as bright as it can tell.
    """

    outline: Outline
    shape: tuple[int, int]
    bearings: np.ndarray
    radii: np.ndarray
    strength: np.ndarray
    inside: np.ndarray
    ring: np.ndarray
    points: np.ndarray
    noise: float
    saturated: bool

    def left(self, expected: np.ndarray) -> np.ndarray:
        """What fitted pixels show beyond what is expected of all, shape (n,) -> (u,)."""
        return self.strength[self.inside] - expected[self.inside]

    def image(self, values: np.ndarray) -> np.ndarray:
        """Images of what fitted pixels have, 0 elsewhere, shape (u, m) -> (height, width, m)."""
        images = np.zeros((len(self.radii), values.shape[1]))
        images[self.inside] = values
        return images.reshape(*self.shape, -1)

    @property
    def widths(self) -> tuple[float, ...]:
        """Of the shifts' prior, in deviations of the smoothing."""
        return _SATURATED if self.saturated else _LINEAR


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
    scene = _scene(window, outline)
    if scene is None:
        return None
    mean, prior = _before(start, hidden, scene)
    values, count = mean.copy(), len(mean)
    weights = np.full(len(scene.inside), scene.noise**-2)
    excess = 1.0
    cover = _draw(scene, values)
    behind = _behind(scene, values, cover)
    expected, slopes = _expect(scene, values, cover, behind)
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
                found = _expect(scene, trial, _draw(scene, trial), behind)
                gain = cost - _cost(scene, weights, found[0], trial - mean, prior)
                if gain >= 0:
                    values, (expected, slopes) = trial, found
                    damping = max(0.1 * damping, 1e-6)
                # A shorter step gains no more where a whole one changes nothing.
                if gain > -_GAIN:
                    break
                damping *= 10
            if gain < _GAIN:
                break
        damping = 1e-3
        weights, excess = _weights(scene, values, expected)
        cover = _draw(scene, values)
        behind = _behind(scene, values, cover)
        expected, slopes = _expect(scene, values, cover, behind)
        _know_shifts(prior, max(scene.widths), scene, values, hidden)
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


def _scene(window: Window, outline: Outline) -> _Scene | None:
    """How much of the shell's colour each pixel has: 0 on the floor, about 1 on the shell."""
    height, width = window.blob.shape
    rows, columns = np.divmod(np.arange(height * width), width)
    right, up = columns - window.axis[0], window.axis[1] - rows
    colours = window.colours.reshape(-1, 3).astype(float)
    grown = [cv2.dilate(window.blob, np.ones((n, n), np.uint8)).ravel() > 0 for n in (9, 13)]
    core = cv2.erode(window.blob, np.ones((3, 3), np.uint8)).ravel() > 0
    ring = grown[1] & ~grown[0]
    if not core.any():
        core = window.blob.ravel() > 0
    if not ring.any():
        return None
    # Colourfulness, of which grey floor and dark robot have none.
    chroma = colours - colours.mean(axis=1, keepdims=True)
    floor = np.median(chroma[ring], axis=0)
    across = np.median(chroma[core], axis=0) - floor
    if not across @ across > 0:
        return None
    strength = (chroma - floor) @ across / (across @ across)
    noise = 1.4826 * float(np.median(np.abs(strength[ring] - np.median(strength[ring]))))
    noise = max(noise, _LEAST_NOISE)
    bearings, radii = np.arctan2(right, up), np.hypot(right, up)
    white = float((colours[grown[1]].max(axis=1) >= _WHITE).mean())
    return _Scene(
        outline,
        (height, width),
        bearings,
        radii,
        strength,
        np.flatnonzero(grown[1]),
        ring,
        _points(bearings, radii, grown[1]),
        noise,
        white > _WHITE_SHARE,
    )


def _points(bearings: np.ndarray, radii: np.ndarray, used: np.ndarray) -> np.ndarray:
    """How much each point around a shell counts in a pixel, shape (n, k); they sum to 1."""
    low, high = float(radii[used].min()), float(radii[used].max())
    count = min(max(math.ceil((high - low) / _APART), 1) + 1, _POINTS)
    out = np.clip((radii - low) / (high - low), 0, 1) * (count - 1)
    hats = np.maximum(1 - np.abs(out[:, None] - np.arange(count)), 0)
    middle = bearings[np.flatnonzero(used)[0]]
    turn = (bearings - middle + math.pi) % (2 * math.pi) - math.pi
    first, last = float(turn[used].min()), float(turn[used].max())
    right = np.clip((turn - first) / (last - first), 0, 1)[:, None]
    return np.hstack([(1 - right) * hats, right * hats])


def _before(
    start: tuple[float, float], hidden: tuple[float, float], scene: _Scene
) -> tuple[np.ndarray, np.ndarray]:
    """What is expected of the unknowns, shape (m,), and its precision, shape (m, m)."""
    mean = np.zeros(_BEHIND.start + scene.points.shape[1])
    mean[_PLACE], mean[6], mean[8], mean[9] = start, _START_SPREAD, _START_SPREAD, 1.0
    mean[4:6] = -np.array(hidden)
    precision = np.zeros(len(mean))
    precision[_SPREAD] = _SPREAD_WEIGHT
    precision[10:12], precision[_TOP] = _LIGHT_SPREAD**-2, _OTHER_SPREAD**-2
    prior = np.diag(precision)
    place = np.arange(scene.points.shape[1] // 2)
    alike = np.kron([[1, _ACROSS], [_ACROSS, 1]], _NEXT ** np.abs(place[:, None] - place))
    prior[_BEHIND, _BEHIND] = np.linalg.inv(alike) / _OTHER_SPREAD**2
    _know_shifts(prior, max(scene.widths), scene, mean, hidden)
    return mean, prior


def _know_shifts(
    prior: np.ndarray,
    width: float,
    scene: _Scene,
    values: np.ndarray,
    hidden: tuple[float, float],
) -> None:
    """Set the precision of shifts and tilt; nothing is known of a side that is hidden."""
    alike = 1 - _DARK_LOST * width**4 if scene.saturated else _ALIKE
    spread = np.eye(4)
    spread[0, 1] = spread[1, 0] = alike
    spread[2, 3] = spread[3, 2] = _ALIKE
    spread *= (width * _sharpness(values)) ** 2
    for side, amount in zip((2, 3), hidden, strict=True):
        if amount > 0:
            spread[side], spread[:, side] = 0.0, 0.0
            spread[side, side] = (1.0 + amount) ** 2
    prior[_SHIFTS, _SHIFTS] = np.linalg.inv(spread)
    prior[_TILT, _TILT] = (_UNEVEN * width * _sharpness(values)) ** -2


def _sharpness(values: np.ndarray) -> float:
    return math.sqrt(0.5 * (values[6] + values[8]))


def _bounded(values: np.ndarray) -> np.ndarray:
    """The unknowns with a range and a spread that can be."""
    values = values.copy()
    values[0] = min(max(values[0], 0.02), 50.0)
    sizes, ways = np.linalg.eigh([[values[6], values[7]], [values[7], values[8]]])
    spread = (ways * np.clip(sizes, *_SPREAD_BOUNDS)) @ ways.T
    values[_SPREAD] = spread[0, 0], spread[0, 1], spread[1, 1]
    return values


def _smoothing(values: np.ndarray) -> np.ndarray:
    """The Gaussian of the spread, as a kernel of odd sides that sums to 1."""
    half = max(math.ceil(3 * math.sqrt(max(values[6], values[8]))), 1)
    y, x = np.mgrid[-half : half + 1, -half : half + 1].astype(float)
    xx, xy, yy = values[_SPREAD]
    square = (yy * x * x - 2 * xy * x * y + xx * y * y) / (xx * yy - xy * xy)
    kernel = np.exp(-0.5 * square)
    return kernel / kernel.sum()


def _draw(scene: _Scene, values: np.ndarray) -> np.ndarray:
    """The images of `draw_cover`, shape (n, 16)."""
    cover = np.empty((len(scene.radii), 16))
    draw_cover(scene.outline, scene.bearings, scene.radii, values[:6], cover)
    return cover


def _behind(scene: _Scene, values: np.ndarray, cover: np.ndarray) -> np.ndarray:
    """Slopes with the colours of the robot's top and of what lies behind, shape (u, 1 + k)."""
    images = np.empty((len(cover), 1 + scene.points.shape[1]), np.float32)
    images[:, 0] = cover[:, 3]
    images[:, 1:] = np.maximum(1 - cover[:, :1] - cover[:, 3:4], 0) * scene.points
    return _smooth(scene, images, values)[scene.inside]


def _smooth(scene: _Scene, images: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Images, shape (n, k), as the smoothing makes them."""
    flat = images.reshape(*scene.shape, -1)
    smooth = cv2.filter2D(flat, -1, _smoothing(values), borderType=cv2.BORDER_REPLICATE)
    return smooth.reshape(images.shape)


def _expect(
    scene: _Scene, values: np.ndarray, cover: np.ndarray, behind: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What the pixels should show, shape (n,), and slopes of the fitted ones, shape (u, m)."""
    images = np.empty((len(cover), 11), np.float32)
    half = math.asin(scene.outline.radius / (values[0] + scene.outline.radius))
    _light(cover, scene.bearings, scene.points, values, half, images)
    smooth = _smooth(scene, images, values)
    shown = smooth[:, 9] + values[_TILT] * smooth[:, 10]
    slopes = np.empty((len(scene.inside), len(values)))
    _fill_slopes(smooth, shown.reshape(scene.shape), scene.inside, behind, slopes)
    return shown, slopes


@compiled
def _light(
    cover: np.ndarray,
    bearings: np.ndarray,
    points: np.ndarray,
    values: np.ndarray,
    half: float,
    images: np.ndarray,
) -> None:
    """Light a drawn shell and all around it.

    Args:
        cover: Of `draw_cover`, shape (n, 16).
        bearings: Of the pixels, shape (n,) [rad].
        points: How much each point around the shell counts in them, shape (n, k).
        values: The unknowns, shape (m,).
        half: Half the angle that the shell takes up [rad].
        images: To be filled, shape (n, 11): the slopes with even light, across and along, with
            range, bearing and shifts of base, top, left and right side, what the pixels would show
            without smoothing, and its slope with the tilt.
    """
    even, across, along, top = values[9], values[10], values[11], values[_TOP]
    for i in range(len(cover)):
        around = 0.0
        for k in range(points.shape[1]):
            around += points[i, k] * values[_TOP + 1 + k]
        c = cover[i]
        images[i, :9], images[i, 10] = 0.0, 0.0
        images[i, 9] = around
        lit = c[0] * even + c[1] * across + c[2] * along
        images[i, 9] = lit + c[3] * top + (1 - c[0] - c[3]) * around
        images[i, 0], images[i, 1], images[i, 2] = c[0], c[1], c[2]
        for k in range(2):
            n = 4 + 4 * k
            images[i, 3 + k] = c[n] * even + c[n + 1] * across + c[n + 2] * along
            images[i, 3 + k] += c[n + 3] * top - (c[n] + c[n + 3]) * around
        if c[0] > 0.0:
            # Light falls on an edge as on the pixel's covered part; the robot's top is above it.
            edge = lit / c[0]
            images[i, 5] = (edge - around) * c[12]
            images[i, 6] = (edge - top) * c[13]
            images[i, 7] = (edge - around) * c[14]
            images[i, 8] = (edge - around) * c[15]
            off = (bearings[i] - values[1] + math.pi) % (2 * math.pi) - math.pi
            images[i, 10] = min(max(off / half, -1.0), 1.0) * (images[i, 5] + images[i, 6])


@compiled
def _fill_slopes(
    smooth: np.ndarray,
    shown: np.ndarray,
    inside: np.ndarray,
    behind: np.ndarray,
    slopes: np.ndarray,
) -> None:
    """Fill in the slopes of what fitted pixels show, with all unknowns.

    Args:
        smooth: The images of `_light`, smoothed, shape (n, 11).
        shown: What the pixels show, shape (height, width).
        inside: Numbers of the fitted ones, shape (u,).
        behind: Slopes of these with the colours behind, shape (u, k).
        slopes: To be filled, shape (u, 13 + k).
    """
    height, width = shown.shape
    for n in range(len(inside)):
        i = inside[n]
        row, column = divmod(i, width)
        above, below = max(row - 1, 0), min(row + 1, height - 1)
        before, after = max(column - 1, 0), min(column + 1, width - 1)
        slopes[n, :6] = smooth[i, 3:9]
        # A Gaussian's slope with its variance is half its second derivative.
        middle = shown[row, column]
        slopes[n, 6] = 0.5 * (shown[row, after] + shown[row, before] - 2 * middle)
        slopes[n, 7] = 0.25 * (
            shown[below, after] + shown[above, before] - shown[above, after] - shown[below, before]
        )
        slopes[n, 8] = 0.5 * (shown[below, column] + shown[above, column] - 2 * middle)
        slopes[n, 9:12] = smooth[i, :3]
        slopes[n, 12] = smooth[i, 10]
        slopes[n, 13:] = behind[n]


def _weights(scene: _Scene, values: np.ndarray, expected: np.ndarray) -> tuple[np.ndarray, float]:
    """One over the variance of each fitted pixel, shape (u,), and how much more is left over.

    Pixels that one edge crosses err alike by the raster: their variance is such that all of them
    together tell its place no better than the raster lets them.
    """
    down, across = np.gradient(expected.reshape(scene.shape))
    steep = (down**2 + across**2).ravel()
    left = scene.strength - expected
    noise = max(1.4826 * float(np.median(np.abs(left[scene.ring]))), _LEAST_NOISE)
    sharpness = _sharpness(values)
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
    scene: _Scene, weights: np.ndarray, expected: np.ndarray, off: np.ndarray, prior: np.ndarray
) -> float:
    return float(weights @ scene.left(expected) ** 2 + off @ prior @ off)


def _judge(
    scene: _Scene,
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
    for width in scene.widths:
        prior = prior.copy()
        _know_shifts(prior, width, scene, values, hidden)
        # A place off the blob has no slopes, nor a precision before: the ridge lets it be unknown.
        inverse = np.linalg.inv(matrix + prior + _RIDGE * np.eye(count))
        rest = pull - prior @ off
        step = inverse @ rest
        cost = off @ prior @ off - rest @ step
        signs = np.linalg.slogdet(prior[_SHIFTS, _SHIFTS])[1] + np.linalg.slogdet(inverse)[1]
        scores.append(0.5 * (signs - cost) - math.log(width))
        places.append((values + step)[_PLACE])
        shifts.append((off + step)[_SHIFTS])
        inverses.append(inverse[_PLACE])
        priors.append(inverse[_PLACE] @ prior @ inverse[:, _PLACE])
    alike = _alike(scene, slopes * (weights * left)[:, None], np.array(inverses))
    spreads = [
        _larger(inverse[:, _PLACE], one + other)
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
        sharpness=_sharpness(values),
        saturated=scene.saturated,
        misfit=math.sqrt(float(left @ left) / max(steepness, 1e-12)),
        dent=float(np.abs(dents).max()),
        roughness=math.sqrt(float(np.mean(dents[scene.inside] ** 2))),
        around=float(np.abs(values[_BEHIND]).max()),
    )


def _alike(scene: _Scene, pulls: np.ndarray, inverses: np.ndarray) -> np.ndarray:
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
