"""A first guess of camera and poses from pictures of a board alone, by linear equations.

Source: Scaramuzza, Martinelli and Siegwart, "A flexible technique for accurate omnidirectional
camera calibration and structure from motion", ICVS 2006, with a polynomial of degree 2 and a
search for the centre.
"""

import math
from collections.abc import Sequence

import numpy as np

from ...errors import InvalidInput, require
from ..camera_models.scaramuzza import ScaramuzzaCamera
from .board import board_pose

# The centre is looked for on grids: so many each way, each grid this much finer.
_GRIDS, _EACH_WAY, _FINER = 4, 2, 0.5
# Of the smaller side of the picture, from the middle, on the first grid.
_SPREAD = 0.12


def first_guess(
    points: np.ndarray, pictures: Sequence[np.ndarray], width: int, height: int
) -> ScaramuzzaCamera:
    """The parabola and the centre that fit pictures of a board.

    A corner lies in the plane of its pixel and the axis, whatever the polynomial: that gives poses
    but for their depth, and the depths are linear with the polynomial.

    Args:
        points: Corners on the board, shape (n, 2) [m].
        pictures: Pixels of the corners in each picture, shapes (n, 2).
        width, height: Of the pictures, in pixels.

    Raises:
        InvalidInput: Fewer than 3 pictures, or they fit no camera at all.
    """
    require(len(pictures) >= 3, "pictures", "show the board at least 3 times", len(pictures))
    pixels = np.stack(pictures)
    centre = 0.5 * np.array([width - 1, height - 1])
    step = _SPREAD * min(width, height) / _EACH_WAY
    best, camera = math.inf, None
    for _ in range(_GRIDS):
        offsets = step * np.arange(-_EACH_WAY, _EACH_WAY + 1)
        for shift in np.stack(np.meshgrid(offsets, offsets), axis=-1).reshape(-1, 2) + centre:
            guess = _at_centre(points, pixels, shift, width, height)
            miss = _miss(guess, points, pixels) if guess is not None else math.inf
            if miss < best:
                best, camera, centre = miss, guess, shift
        step *= _FINER
    if camera is None:
        raise InvalidInput("`pictures` must fit a camera with one centre; got others")
    return camera


def _at_centre(
    points: np.ndarray, pixels: np.ndarray, centre: np.ndarray, width: int, height: int
) -> ScaramuzzaCamera | None:
    """The parabola that fits best with the axis at a pixel, None if it is none of a camera."""
    size = float(np.abs(points).max())
    flat = points / size
    scale = 0.25 * (width + height)
    offsets = (pixels - centre) / scale
    depths: list[np.ndarray] = []
    wanted: list[np.ndarray] = []
    x, y = offsets[..., 0, None], offsets[..., 1, None]
    board = np.broadcast_to(flat, (len(pixels), *flat.shape))
    rows = np.concatenate([-y * board, x * board, -y, x], axis=2)
    # Of (r11, r12, r21, r22, t1, t2), up to scale: least singular vectors.
    vectors = np.linalg.eigh(np.swapaxes(rows, 1, 2) @ rows)[1][:, :, 0]
    for k, (vector, offset) in enumerate(zip(vectors, offsets, strict=True)):
        across = flat @ vector[:4].reshape(2, 2).T + vector[4:]
        if np.sum(across * offset) < 0:
            vector, across = -vector, -across
        (r11, r12), (r21, r22) = vector[:4].reshape(2, 2)
        # r1 and r2 are at right angles and as long: r31 r32 = a and r31^2 - r32^2 = b.
        a, b = -(r11 * r12 + r21 * r22), r12**2 + r22**2 - r11**2 - r21**2
        r31 = math.sqrt(max(0.5 * (b + math.hypot(b, 2 * a)), 0.0))
        r32 = math.copysign(math.sqrt(max(r31**2 - b, 0.0)), a)
        rise = flat @ [r31, r32]
        square = np.sum(offset**2, axis=1)
        # across (c0 + c2 rho^2) = offset (rise + t3), for both coordinates.
        terms = np.stack([across, across * square[:, None], -offset], axis=2).reshape(-1, 3)
        right = (offset * rise[:, None]).ravel()
        # Both signs of the rise fit as well, with both signs of c0: the camera looks along +z.
        if np.linalg.lstsq(terms, right, rcond=None)[0][0] < 0:
            right = -right
        block = np.zeros((len(terms), 2 + len(pixels)))
        block[:, :2], block[:, 2 + k] = terms[:, :2], terms[:, 2]
        length = math.sqrt(r11**2 + r21**2 + r31**2)
        depths.append(block / length)
        wanted.append(right / length)
    solution = np.linalg.lstsq(np.vstack(depths), np.concatenate(wanted), rcond=None)[0]
    c0, c2 = float(solution[0]), float(solution[1])
    if not c0 > 0:
        return None
    polynomial = (-c0 * scale, 0.0, -c2 / scale)
    column, row = centre.tolist()
    return ScaramuzzaCamera(
        polynomial=polynomial, centre_x=column, centre_y=row, width=width, height=height
    )


def _miss(camera: ScaramuzzaCamera, points: np.ndarray, pixels: np.ndarray) -> float:
    """Root mean square of the reprojection error with linear poses [px]."""
    total = 0.0
    for each in pixels:
        seen = camera.project(board_pose(camera, points, each).place(points))
        total += float(np.sum((seen - each) ** 2))
    return math.sqrt(total / pixels[..., 0].size) if math.isfinite(total) else math.inf
