"""What the picture of a shell is expected to show, and how that changes with what is not known.

It is the outline of `make_outline`, lit, with what lies around and behind it and the robot's top,
smoothed by whatever smoothed the picture.

Source: ours.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.special import ndtr

from ...compiled import compiled
from .range_models import Outline, draw_cover
from .shell_detection import Window

# The unknowns: range and bearing; shifts of base, top, left and right side; the spread of the
# smoothing, xx, xy, yy; light, even, across and along; by how much more base and top are shifted at
# the right end than in the middle; the colour of the robot's top, and of what lies around and
# behind, at distances from the axis.
PLACE, SHIFTS, SPREAD = slice(0, 2), slice(2, 6), slice(6, 9)
TILT, TOP, BEHIND = 12, 13, slice(14, None)
# Share of the pixels around a blob that are white at which it is taken for saturated.
_WHITE, _WHITE_SHARE = 254, 0.03
# The colour behind the shell changes with the distance from the axis, where floor ends and walls
# begin. It is interpolated between points: their distance [px], and most of them on each side.
_APART, _POINTS = 2.5, 9
# Least noise of a pixel, in colour of the shell: no picture is known better.
LEAST_NOISE = 0.02


@dataclass(frozen=True, eq=False)
class Scene:
    """What does not change during a search: pixels, what they show, and what is known before.

    Attributes:
        outline: Of the shell.
        shape: Of the window, whose n pixels are counted row by row.
        axis: Pixel of the mirror's axis in the window (column, row), shape (2,).
        bearings, radii: Of the pixels about the mirror's axis, each shape (n,) [rad], [px].
        strength: How much of the shell's colour they have, shape (n,).
        inside: Numbers of the pixels that are fitted, at and around the blob, shape (u,).
        ring: Whether they are of the ring around the blob, shape (n,).
        points: How much each point around a shell counts in them, shape (n, k).
        noise: Standard deviation of `strength`, as a share of the shell's colour [-].
        saturated: Whether parts of the picture are as bright as it can tell.
    """

    outline: Outline
    shape: tuple[int, int]
    axis: np.ndarray
    bearings: np.ndarray
    radii: np.ndarray
    strength: np.ndarray
    inside: np.ndarray
    ring: np.ndarray
    points: np.ndarray
    noise: float
    saturated: bool

    def left(self, expected: np.ndarray) -> np.ndarray:
        """What fitted pixels show beyond what is expected, shape (u,).

        Args:
            expected: Of all pixels, shape (n,).
        """
        return self.strength[self.inside] - expected[self.inside]

    def image(self, values: np.ndarray) -> np.ndarray:
        """Images of what fitted pixels have, 0 elsewhere, shape (height, width, m).

        Args:
            values: Of fitted pixels, shape (u, m).
        """
        images = np.zeros((len(self.radii), values.shape[1]))
        images[self.inside] = values
        return images.reshape(*self.shape, -1)


def read_scene(window: Window, outline: Outline) -> Scene | None:
    """How much of the shell's colour each pixel has: 0 on the floor, about 1 on the shell.

    Args:
        window: The blob, and the pixels around it.
        outline: Of the shell.

    Returns:
        None where nothing lies around the blob, or it is of no colour.
    """
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
    noise = max(noise, LEAST_NOISE)
    bearings, radii = np.arctan2(right, up), np.hypot(right, up)
    white = float((colours[grown[1]].max(axis=1) >= _WHITE).mean())
    return Scene(
        outline,
        (height, width),
        window.axis,
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


def sharpness_of(values: np.ndarray) -> float:
    """Standard deviation of the smoothing [px].

    Args:
        values: The unknowns, shape (m,).
    """
    return math.sqrt(0.5 * (values[6] + values[8]))


def draw_shell(scene: Scene, values: np.ndarray) -> np.ndarray:
    """The images of `draw_cover`, shape (n, 16).

    Args:
        scene: Whose pixels.
        values: The unknowns, shape (m,).
    """
    cover = np.empty((len(scene.radii), 16))
    draw_cover(scene.outline, scene.bearings, scene.radii, values[:6], cover)
    return cover


def show_behind(scene: Scene, values: np.ndarray, cover: np.ndarray) -> np.ndarray:
    """Slopes with the colours of the robot's top and of what lies behind, shape (u, 1 + k).

    Args:
        scene: Whose pixels.
        values: The unknowns, shape (m,).
        cover: From `draw_shell`, shape (n, 16).
    """
    images = np.empty((len(cover), 1 + scene.points.shape[1]), np.float32)
    images[:, 0] = cover[:, 3]
    images[:, 1:] = np.maximum(1 - cover[:, :1] - cover[:, 3:4], 0) * scene.points
    return smooth(scene, images, values)[scene.inside]


def expect_picture(
    scene: Scene, values: np.ndarray, cover: np.ndarray, behind: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What the pixels should show, shape (n,), and slopes of the fitted ones, shape (u, m).

    Args:
        scene: Whose pixels.
        values: The unknowns, shape (m,).
        cover: From `draw_shell`, shape (n, 16).
        behind: From `show_behind`, shape (u, 1 + k), which changes little.
    """
    images = np.empty((len(cover), 11), np.float32)
    half = math.asin(scene.outline.radius / (values[0] + scene.outline.radius))
    _light(cover, scene.bearings, scene.points, values, half, images)
    smoothed = smooth(scene, images, values)
    shown = smoothed[:, 9] + values[TILT] * smoothed[:, 10]
    slopes = np.empty((len(scene.inside), len(values)))
    _fill_slopes(smoothed, shown.reshape(scene.shape), scene.inside, behind, slopes)
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
    even, across, along, top = values[9], values[10], values[11], values[TOP]
    for i in range(len(cover)):
        around = 0.0
        for k in range(points.shape[1]):
            around += points[i, k] * values[TOP + 1 + k]
        c = cover[i]
        images[i, 5:9], images[i, 10] = 0.0, 0.0
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
        # A Gaussian's slope with its variance is half its second derivative; motion's nearly so.
        middle = shown[row, column]
        slopes[n, 6] = 0.5 * (shown[row, after] + shown[row, before] - 2 * middle)
        slopes[n, 7] = 0.25 * (
            shown[below, after] + shown[above, before] - shown[above, after] - shown[below, before]
        )
        slopes[n, 8] = 0.5 * (shown[below, column] + shown[above, column] - 2 * middle)
        slopes[n, 9:12] = smooth[i, :3]
        slopes[n, 12] = smooth[i, 10]
        slopes[n, 13:] = behind[n]


def smooth(scene: Scene, images: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Images as the smoothing makes them, shape (n, k).

    Args:
        scene: Whose pixels.
        images: Shape (n, k), float32.
        values: The unknowns, shape (m,).
    """
    flat = images.reshape(*scene.shape, -1)
    smoothed = cv2.filter2D(flat, -1, _smoothing(values), borderType=cv2.BORDER_REPLICATE)
    return smoothed.reshape(images.shape)


def _smoothing(values: np.ndarray) -> np.ndarray:
    """The smoothing of the spread, as a kernel of odd sides that sums to 1.

    Where the spread is larger along one direction, the scene moved while the picture was taken: the
    kernel is a round Gaussian, dragged along a line.
    """
    xx, xy, yy = values[SPREAD]
    (least, most), ways = np.linalg.eigh([[xx, xy], [xy, yy]])
    sharp, length = math.sqrt(least), math.sqrt(max(12 * (most - least), 0.0))
    half = max(math.ceil(3 * sharp + 0.5 * length), 1)
    y, x = np.mgrid[-half : half + 1, -half : half + 1].astype(float)
    along, across = x * ways[0, 1] + y * ways[1, 1], x * ways[1, 1] - y * ways[0, 1]
    kernel = np.exp(-0.5 * across * across / least)
    if length > 0.1 * sharp:
        ends = (along + 0.5 * length) / sharp, (along - 0.5 * length) / sharp
        kernel *= ndtr(ends[0]) - ndtr(ends[1])
    else:
        kernel *= np.exp(-0.5 * along * along / most)
    return kernel / kernel.sum()
