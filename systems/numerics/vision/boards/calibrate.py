"""From pictures of a board to a camera of a model.

It starts from a first guess of camera and poses, by linear equations.

Source of that: Scaramuzza, Martinelli and Siegwart, "A flexible technique for accurate
omnidirectional camera calibration and structure from motion", ICVS 2006, with a polynomial of
degree 2 and a search for the centre.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from ...errors import InvalidInput, require, require_one_of
from ..camera_models.camera_model import CameraModel
from ..camera_models.central_cameras import KannalaBrandtCamera, MeiCamera, ScaramuzzaCamera
from .board import Checkerboard, board_pose, copied
from .fit import BoardFit, fit_camera, free_indices

# Search for the centre: number of grids, nodes to either side, and step relative to the last grid.
_GRIDS, _EACH_WAY, _FINER = 4, 2, 0.5
# How far the first grid reaches from the middle, as a share of the picture's smaller side.
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


MODELS = ("scaramuzza", "mei", "mei_k3", "kannala_brandt")
# What each model keeps at 0: `mei` is OpenCV's and Kalibr's, `mei_k3` has the r^6 of Mei's paper.
# A mirror off its axis also shows in what only `decentred` fits, which turns the camera frame away
# from the axis of the picture.
_KEPT = {"mei": ("k3",)}
_DECENTRED = {"scaramuzza": ("e",), "mei": ("p1", "p2"), "mei_k3": ("p1", "p2")}
# OCamCalib's own is 4; a mirror that is no conic wants one more.
_DEGREE = 5
# Where the search for Mei's xi begins: lens, hyperbola, parabola, and beyond.
_XI = (0.5, 0.8, 1.0, 1.5, 2.2)
# A point that a camera does not show counts as this far off [px].
_LOST = 1e3


def calibrate_on_board(
    board: Checkerboard,
    pictures: Sequence[np.ndarray],
    *,
    width: int,
    height: int,
    model: str,
    decentred: bool = False,
) -> BoardFit:
    """Fit a camera of a model to the corners of a board in several pictures.

    Args:
        board: Which.
        pictures: Pixels of its corners in each picture, shapes (n, 2).
        width, height: Of the pictures, in pixels.
        model: One of MODELS.
        decentred: As of `fixed_names`.

    Raises:
        InvalidInput: Another model, fewer than 3 pictures, copies among them, or they fit no
            camera.
    """
    require_one_of("model", model, MODELS)
    for number, corners in enumerate(pictures):
        new = not copied(corners, pictures[:number])
        require(new, "pictures", "differ from each other", f"number {number}, a copy")
    points = board.points
    curve: CameraModel = first_guess(points, pictures, width, height)
    for degree in (2, _DEGREE):
        if isinstance(curve, ScaramuzzaCamera):
            curve = with_degree(curve, degree)
        curve = fit_camera(curve, points, pictures, fixed=("c", "e")).camera
    # The polynomial finds its way from anywhere; the others start from what it has found.
    start = curve
    if model != "scaramuzza":
        start = nearest_camera(model, curve, np.concatenate(pictures))
    return fit_camera(start, points, pictures, fixed=fixed_names(model, decentred=decentred))


def fixed_names(model: str, *, decentred: bool = False) -> tuple[str, ...]:
    """Parameters of a model that a calibration leaves at 0.

    Args:
        model: One of MODELS.
        decentred: Whether the lens may look past the mirror's axis a little: then tangential
            distortion and shear are fitted.

    Raises:
        InvalidInput: Another model.
    """
    require_one_of("model", model, MODELS)
    return _KEPT.get(model, ()) + (() if decentred else _DECENTRED.get(model, ()))


def with_degree(camera: ScaramuzzaCamera, degree: int) -> ScaramuzzaCamera:
    """The same camera with a polynomial of a higher degree, whose new coefficients are 0.

    Args:
        camera: Which.
        degree: Of the polynomial.

    Raises:
        InvalidInput: Its degree is higher already.
    """
    more = degree + 1 - len(camera.polynomial)
    require(more >= 0, "degree", f"be at least {len(camera.polynomial) - 1}", degree)
    return replace(camera, polynomial=(*camera.polynomial, *[0.0] * more))


def nearest_camera(model: str, camera: CameraModel, pixels: np.ndarray) -> CameraModel:
    """The camera of a model whose pixels are nearest to those of another camera.

    Args:
        model: One of MODELS.
        camera: The other camera.
        pixels: Where both are to agree, shape (n, 2).

    Raises:
        InvalidInput: Another model, or fewer than 20 pixels with rays.
    """
    require_one_of("model", model, MODELS)
    rays = camera.rays(pixels)
    seen = np.isfinite(rays).all(axis=1)
    require(int(seen.sum()) >= 20, "pixels", "have at least 20 rays", int(seen.sum()))
    rays, pixels = rays[seen], pixels[seen]
    best, nearest = math.inf, None
    fixed = fixed_names(model)
    for start in _starts(model, camera, rays, pixels):
        free = free_indices(start, fixed)

        def changed(
            values: np.ndarray, start: CameraModel = start, free: np.ndarray = free
        ) -> CameraModel:
            vector = start.vector
            vector[free] = values
            return start.with_vector(vector)

        def away(values: np.ndarray, changed: Callable = changed) -> np.ndarray:
            try:
                miss = (changed(values).project(rays) - pixels).ravel()
            except InvalidInput:
                return np.full(pixels.size, _LOST)
            return np.where(np.isfinite(miss), miss, _LOST)

        found = least_squares(away, start.vector[free], method="lm", x_scale="jac")
        if found.cost < best:
            best, nearest = found.cost, changed(found.x)
    if nearest is None:
        raise InvalidInput(f"`camera` must be near one of the model {model}; got {camera}")
    return nearest


def _starts(
    model: str, camera: CameraModel, rays: np.ndarray, pixels: np.ndarray
) -> list[CameraModel]:
    """Cameras of a model that are somewhere near rays of pixels, by linear equations."""
    axis = camera.project(np.array([[0.0, 0.0, 1.0]]))[0]
    column, row = axis.tolist()
    grid = {"centre_x": column, "centre_y": row, "width": camera.width, "height": camera.height}
    radius = np.linalg.norm(pixels - axis, axis=1)
    across = np.hypot(rays[:, 0], rays[:, 1])
    if model in ("mei", "mei_k3"):
        starts: list[CameraModel] = []
        # Linear once xi is chosen, and the focal length is kept for both axes.
        for xi in _XI:
            plane = across / (rays[:, 2] + xi)
            if (rays[:, 2] <= -min(xi, 1 / xi)).any():
                continue
            powers = (1, 3, 5, 7) if model == "mei_k3" else (1, 3, 5)
            terms = np.stack([plane**power for power in powers], axis=1)
            focal, *others = np.linalg.lstsq(terms, radius, rcond=None)[0].tolist()
            if focal > 0:
                rest = dict(zip(("k1", "k2", "k3"), [k / focal for k in others], strict=False))
                starts.append(MeiCamera(xi=xi, focal_x=focal, focal_y=focal, **rest, **grid))
        return starts
    angle = np.arctan2(across, rays[:, 2])
    if model == "kannala_brandt":
        terms = np.stack([angle, angle**3, angle**5, angle**7, angle**9], axis=1)
        focal, *others = np.linalg.lstsq(terms, radius, rcond=None)[0].tolist()
        names = ("k1", "k2", "k3", "k4")
        rest = {name: other / focal for name, other in zip(names, others, strict=True)}
        return [KannalaBrandtCamera(focal_x=focal, focal_y=focal, **rest, **grid)]
    depth = rays[:, 2] / across * radius
    powers = [0, *range(2, _DEGREE + 1)]
    scale = float(radius.max())
    terms = (radius[:, None] / scale) ** powers
    found = np.linalg.lstsq(terms, -depth, rcond=None)[0] / scale ** np.array(powers)
    a0, *others = found.tolist()
    return [ScaramuzzaCamera(polynomial=(a0, 0.0, *others), **grid)]
