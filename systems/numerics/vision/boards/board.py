"""Checkerboards, where their corners are in pictures, and how a board lies before a camera."""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np

from ...checked import Checked, PositiveSized
from ...errors import require
from ..camera_models.camera_model import CameraModel

# More than can be told apart in a picture.
_MOST_CORNERS = 100_000
# Corners found in two pictures never agree so well, for noise and the sensor's pixels [px].
_COPIED = 0.01


@dataclass(frozen=True, kw_only=True)
class Checkerboard(Checked):
    """The inner corners of a checkerboard, where four squares meet.

    Raises:
        InvalidInput: Fewer than 3 corners a side, more than a picture has room for, or a square
            without a size.
    """

    # Corners along a row, and rows.
    columns: int
    rows: int
    # Width and height of a square [m]. A print may have stretched them differently.
    square_width: PositiveSized
    square_height: PositiveSized

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("columns", "rows"):
            value = getattr(self, name)
            whole = isinstance(value, int) and not isinstance(value, bool)
            require(whole and value >= 3, name, "be a whole number of at least 3", value)
        count = self.columns * self.rows
        require(count <= _MOST_CORNERS, "columns * rows", f"be at most {_MOST_CORNERS}", count)

    @property
    def points(self) -> np.ndarray:
        """Corners on the board, row by row, shape (columns * rows, 2) [m]."""
        x = np.arange(self.columns) * self.square_width
        y = np.arange(self.rows) * self.square_height
        return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


@dataclass(frozen=True)
class Pose:
    """How a board lies before a camera.

    Attributes:
        rotation: Axes of the board in the camera frame, as columns, shape (3, 3).
        translation: Of the board's first corner in the camera frame, shape (3,) [m].
    """

    rotation: np.ndarray
    translation: np.ndarray

    def place(self, points: np.ndarray) -> np.ndarray:
        """Where points of the board are in the camera frame, shapes (n, 2) [m] -> (n, 3) [m]."""
        return points @ self.rotation[:, :2].T + self.translation


def find_corners(picture: np.ndarray, board: Checkerboard) -> np.ndarray | None:
    """The board's inner corners in a picture, however much a mirror bends it.

    OpenCV's search by sectors, with its ray of sub-pixel fits.

    Args:
        picture: Grey levels or colours, shape (rows, columns) or (rows, columns, 3), of 255.
        board: Which.

    Returns:
        (column, row) of each corner in the order of `Checkerboard.points`, shape (n, 2); None if
        there is no whole board. A board cannot be told from itself turned by half.

    Source: Duda and Frese, "Accurate detection and localization of checkerboard corners for
    calibration", BMVC 2018, in OpenCV.
    """
    grey = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    flags = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
    found, corners = cv2.findChessboardCornersSB(grey, (board.columns, board.rows), flags=flags)
    return corners.reshape(-1, 2).astype(float) if found else None


def copied(corners: np.ndarray, others: Iterable[np.ndarray]) -> bool:
    """Whether corners are those of another picture: of a copy, which tells nothing new.

    Counted as a picture of its own, a copy would make a calibration look surer than it is.

    Args:
        corners: Of one picture, shape (n, 2), in pixels.
        others: Of others, shapes (n, 2).
    """
    return any(float(np.abs(corners - other).max()) < _COPIED for other in others)


def board_pose(camera: CameraModel, points: np.ndarray, pixels: np.ndarray) -> Pose:
    """How a board lies, from the rays of its corners: a first answer, linear.

    The rays are a homography of the board: d x (H (X, Y, 1)) = 0, whose columns are two axes of
    the board and its origin. It holds for rays in all directions, behind the camera too.

    Args:
        camera: Whose rays.
        points: On the board, shape (n, 2) [m], n >= 4 and not in a line.
        pixels: Of the points, shape (n, 2).

    Raises:
        InvalidInput: Fewer than four pixels have a ray.
    """
    rays = camera.rays(pixels)
    seen = np.isfinite(rays).all(axis=1)
    require(int(seen.sum()) >= 4, "pixels", "have at least four rays", int(seen.sum()))
    rays, points = rays[seen], points[seen]
    middle, size = points.mean(axis=0), points.std()
    flat = np.column_stack([(points - middle) / size, np.ones(len(points))])
    none = np.zeros_like(flat)
    x, y, z = (rays[:, [k]] * flat for k in range(3))
    rows = np.block([[none, -z, y], [z, none, -x], [-y, x, none]])
    homography = np.linalg.eigh(rows.T @ rows)[1][:, 0].reshape(3, 3)
    if np.sum(rays * (flat @ homography.T)) < 0:
        homography = -homography
    first, second, origin = homography.T
    # Both axes have the same length; the nearest rotation favours neither of them.
    length = 0.5 * (np.linalg.norm(first) + np.linalg.norm(second))
    left, _, right = np.linalg.svd(np.column_stack([first, second]), full_matrices=False)
    axes = left @ right
    rotation = np.column_stack([axes, np.cross(axes[:, 0], axes[:, 1])])
    return Pose(rotation, size * origin / length - axes @ middle)
