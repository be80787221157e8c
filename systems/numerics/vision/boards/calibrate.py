"""From pictures of a board to a camera of a model."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from ...errors import InvalidInput, require, require_one_of
from ..camera_models.camera_model import CameraModel
from ..camera_models.kannala_brandt import KannalaBrandtCamera
from ..camera_models.mei import MeiCamera
from ..camera_models.scaramuzza import ScaramuzzaCamera
from .board import Checkerboard
from .first_guess import first_guess
from .fit import BoardFit, fit_camera, free_indices

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
# A pixel that a camera does not show is this far off [px].
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
        InvalidInput: Another model, fewer than 3 pictures, or they fit no camera.
    """
    require_one_of("model", model, MODELS)
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
