"""Camera and poses that fit pictures of a board best, and how surely.

Least squares of the distances between the corners that were found and those that the model puts in
the picture, over the camera's parameters and six numbers for each picture. With J the derivative
at the minimum, m residuals and p numbers,

    covariance = s^2 (J^T J)^-1,   s^2 = (sum of squares) / (m - p)

which supposes that corners err independently, alike and little. Where few corners leave Mei's xi
open by some hundredths, the model bends within that range, and intervals of xi, focal length and
k_1 are too short.

What a board cannot tell is its own size: with squares twice as large all boards lie twice as far
off, and the pictures are the same. Its proportions it tells: see `fit_aspect`.

Source: Triggs et al., "Bundle adjustment - a modern synthesis", 1999; for the covariance Seber and
Wild, "Nonlinear Regression", 2.1.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from ...errors import InvalidInput, require, require_one_of
from ..camera_models.camera_model import CameraModel
from .board import Pose, board_pose

# A corner that the model does not show at all is this far off [px].
_LOST = 1e3
# By how much a step of a difference quotient moves a corner [px].
_NUDGE = 1e-2
# Rounds over all numbers; a fit from a fair guess takes ten.
_ROUNDS = 60


@dataclass(frozen=True, eq=False)
class BoardFit:
    """A camera fitted to pictures of a board.

    Attributes:
        camera: As fitted.
        covariance: Of its parameters, shape (p, p), in the units of `names`, with the poses
            unknown; 0 for those that were not fitted.
        poses: Of the board in each picture.
        residuals: Model less found, shape (pictures, corners, 2) [px].
        aspect: Height over width of the squares, over what the board says; 1 unless fitted [-].
        aspect_deviation: Standard deviation of the aspect, 0 unless fitted [-].
        rounds: Evaluations of the derivative.
        converged: Whether the minimum was reached.
    """

    camera: CameraModel
    covariance: np.ndarray
    poses: tuple[Pose, ...]
    residuals: np.ndarray
    aspect: float
    aspect_deviation: float
    rounds: int
    converged: bool

    @property
    def rms(self) -> float:
        """Root mean square of the distances between model and corners [px]."""
        return rms_of(self.residuals)

    @property
    def deviations(self) -> np.ndarray:
        """Standard deviations of the parameters, shape (p,), in the units of `names`."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def freedom(self) -> int:
        """Residuals less fitted numbers."""
        fitted = int(np.count_nonzero(np.diag(self.covariance))) + (self.aspect_deviation > 0)
        return self.residuals.size - fitted - 6 * len(self.poses)

    def intervals(self, confidence: float = 0.95) -> np.ndarray:
        """Intervals that cover each true parameter with a probability, by Student's t.

        They are those of the linear problem, too short where the model bends: see the module.

        Args:
            confidence: The probability.

        Returns:
            Lower and upper ends, shape (p, 2), in the units of `names`.
        """
        half = student.ppf(0.5 + 0.5 * confidence, self.freedom) * self.deviations
        return self.camera.vector[:, None] + half[:, None] * [-1.0, 1.0]


def rms_of(residuals: np.ndarray) -> float:
    """Root mean square length of residuals, shape (..., 2) [px] -> [px]."""
    return float(np.sqrt(np.mean(np.sum(residuals**2, axis=-1))))


def fit_camera(
    camera: CameraModel,
    points: np.ndarray,
    pictures: Sequence[np.ndarray],
    *,
    fixed: Sequence[str] = (),
    with_aspect: bool = False,
) -> BoardFit:
    """Fit a camera and the poses of a board.

    Args:
        camera: A first guess, of the model that is to be fitted.
        points: Corners on the board, shape (n, 2) [m].
        pictures: Pixels of the corners in each picture, shapes (n, 2).
        fixed: Parameters that stay as they are, of `names` without their units.
        with_aspect: Whether the height of the squares over their width is fitted too.

    Raises:
        InvalidInput: No more residuals than numbers to fit, corners without rays, or no such
            parameter.
    """
    pixels = np.stack(pictures)
    problem = _Problem(camera, points, pixels, with_aspect, free_indices(camera, fixed))
    require(
        pixels.size > problem.size, "pictures", f"hold over {problem.size} numbers", pixels.size
    )
    found = least_squares(
        problem.residuals,
        problem.start,
        jac=problem.derivative,  # type: ignore[arg-type]  # a function of the numbers, as SciPy says
        method="lm",
        x_scale="jac",
        xtol=1e-10,
        ftol=1e-12,
        gtol=1e-12,
        max_nfev=_ROUNDS,
    )
    free = pixels.size - problem.size
    # Columns of one length first: units differ by many orders.
    jacobian = problem.derivative(found.x)
    lengths = np.linalg.norm(jacobian, axis=0)
    lengths[lengths == 0] = 1.0
    inverse = np.linalg.pinv((jacobian / lengths).T @ (jacobian / lengths), hermitian=True)
    covariance = 2 * found.cost / free * inverse / np.outer(lengths, lengths)
    inner = len(problem.free)
    aspect = float(found.x[inner]) if with_aspect else 1.0
    spread = float(np.sqrt(covariance[inner, inner])) if with_aspect else 0.0
    whole = np.zeros((len(camera.vector),) * 2)
    whole[np.ix_(problem.free, problem.free)] = covariance[:inner, :inner]
    return BoardFit(
        problem.camera(found.x),
        whole,
        problem.poses(found.x),
        problem.residuals(found.x).reshape(pixels.shape),
        aspect,
        spread,
        int(found.nfev),
        bool(found.success),
    )


def fit_aspect(
    fit: BoardFit, points: np.ndarray, pictures: Sequence[np.ndarray], *, fixed: Sequence[str] = ()
) -> BoardFit:
    """Fit again with the proportions of the squares free: a ruler wrong in one direction shows.

    Args:
        fit: Where to start.
        points: Corners on the board as measured, shape (n, 2) [m].
        pictures: Pixels of the corners in each picture, shapes (n, 2).
        fixed: As of `fit_camera`.
    """
    return fit_camera(fit.camera, points, pictures, fixed=fixed, with_aspect=True)


def held_out_residuals(
    camera: CameraModel,
    points: np.ndarray,
    pictures: Sequence[np.ndarray],
    *,
    folds: int,
    fixed: Sequence[str] = (),
) -> np.ndarray:
    """Residuals of pictures by cameras that were fitted to others.

    Each picture is left out once, with every `folds`-th other; of it only the pose is fitted.

    Args:
        camera: Where the fits start, of the model.
        points: Corners on the board, shape (n, 2) [m].
        pictures: Pixels of the corners in each picture, shapes (n, 2).
        folds: How many fits.
        fixed: As of `fit_camera`.

    Returns:
        Model less found, shape (pictures, n, 2) [px].

    Raises:
        InvalidInput: Fewer than 2 folds, or fewer pictures than folds.
    """
    require(2 <= folds <= len(pictures), "folds", f"be from 2 to {len(pictures)}", folds)
    residuals = np.empty((len(pictures), len(points), 2))
    for first in range(folds):
        out = np.arange(len(pictures)) % folds == first
        others = [each for each, held in zip(pictures, out, strict=True) if not held]
        fitted = fit_camera(camera, points, others, fixed=fixed).camera
        for k in np.flatnonzero(out).tolist():
            residuals[k] = _pose_residuals(fitted, points, pictures[k])
    return residuals


def _pose_residuals(camera: CameraModel, points: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """What is left in one picture when only the pose is fitted, shape (n, 2) [px]."""
    problem = _Problem(camera, points, pixels[None], False, np.arange(0))
    found = least_squares(problem.residuals, problem.start, x_scale="jac", method="lm")
    return problem.residuals(found.x).reshape(-1, 2)


def free_indices(camera: CameraModel, fixed: Sequence[str]) -> np.ndarray:
    """Indices of the parameters that are fitted, shape (f,).

    Args:
        camera: Whose parameters.
        fixed: Those that are not, of `names` without their units.

    Raises:
        InvalidInput: No such parameter.
    """
    names = [name.partition(" ")[0] for name in camera.names]
    for name in fixed:
        require_one_of("fixed", name, names)
    return np.array([k for k, name in enumerate(names) if name not in fixed], dtype=int)


class _Problem:
    """Numbers to residuals: the camera's vector, the aspect if fitted, turn and place by picture.

    Turns are small ones after those of the first guess, so that no angle is singular.
    """

    def __init__(
        self,
        camera: CameraModel,
        points: np.ndarray,
        pixels: np.ndarray,
        with_aspect: bool,
        free: np.ndarray,
    ) -> None:
        self._camera, self._points, self._pixels = camera, points, pixels
        self.free, self._inner = free, len(free)
        self._head = self._inner + with_aspect
        self._first = [board_pose(camera, points, each) for each in pixels]
        poses = [np.append(np.zeros(3), each.translation) for each in self._first]
        head = np.append(camera.vector[free], [1.0] * with_aspect)
        self.start = np.concatenate([head, *poses])
        self.size = len(self.start)
        self._steps: np.ndarray | None = None

    def camera(self, numbers: np.ndarray) -> CameraModel:
        """The camera of these numbers."""
        if not self._inner:
            return self._camera
        values = self._camera.vector
        values[self.free] = numbers[: self._inner]
        return self._camera.with_vector(values)

    def poses(self, numbers: np.ndarray) -> tuple[Pose, ...]:
        """The poses of these numbers."""
        rows = numbers[self._head :].reshape(-1, 6)
        return tuple(
            replace(
                pose, rotation=cv2.Rodrigues(row[:3])[0] @ pose.rotation, translation=row[3:].copy()
            )
            for pose, row in zip(self._first, rows, strict=True)
        )

    def residuals(self, numbers: np.ndarray) -> np.ndarray:
        """Model less found, shape (2 n pictures,) [px]."""
        points = self._points
        if self._head > self._inner:
            points = points * [1.0, numbers[self._inner]]
        try:
            camera = self.camera(numbers)
        except InvalidInput:
            return np.full(self._pixels.size, _LOST)
        places = np.concatenate([pose.place(points) for pose in self.poses(numbers)])
        away = camera.project(places).ravel() - self._pixels.ravel()
        return np.where(np.isfinite(away), away, _LOST)

    def derivative(self, numbers: np.ndarray) -> np.ndarray:
        """Of the residuals, shape (2 n pictures, p), by central differences.

        Pictures do not share poses: one nudge moves all of them, each in its own rows.
        """
        pictures = len(self._pixels)
        each = self._pixels[0].size
        groups = [np.array([k]) for k in range(self._head)]
        groups += [self._head + k + 6 * np.arange(pictures) for k in range(6)]
        if self._steps is None:
            self._steps = self._chosen_steps(numbers, groups)
        jacobian = np.zeros((self._pixels.size, self.size))
        for step, group in zip(self._steps, groups, strict=True):
            nudge = np.zeros(self.size)
            nudge[group] = step
            slope = (self.residuals(numbers + nudge) - self.residuals(numbers - nudge)) / (2 * step)
            if len(group) == 1 and group[0] < self._head:
                jacobian[:, group[0]] = slope
                continue
            for k, column in enumerate(group):
                jacobian[k * each : (k + 1) * each, column] = slope[k * each : (k + 1) * each]
        return jacobian

    def _chosen_steps(self, numbers: np.ndarray, groups: list[np.ndarray]) -> np.ndarray:
        """Steps that move the farthest corner by about the nudge: units differ by many orders."""
        here = self.residuals(numbers)
        steps = []
        for group in groups:
            step = 1e-6 * max(float(np.abs(numbers[group]).max()), 1e-9)
            for _ in range(3):
                nudge = np.zeros(self.size)
                nudge[group] = step
                moved = np.abs(self.residuals(numbers + nudge) - here)
                largest = float(moved[moved < 0.5 * _LOST].max(initial=0.0))
                step *= float(np.clip(_NUDGE / max(largest, 1e-300), 1e-6, 1e6))
            steps.append(step)
        return np.array(steps)
