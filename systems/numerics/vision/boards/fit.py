"""Camera and poses that fit pictures of a board best, and how surely.

Least squares of the distances between the corners that were found and those that the model puts in
the picture, over the camera's parameters and six numbers for each picture. With J the derivative
at the minimum, m residuals and p numbers,

    covariance = s^2 (J^T J)^-1,   s^2 = (sum of squares) / (m - p)

which supposes that corners err independently, alike and little. Where few corners leave Mei's xi
open by some hundredths, the model bends within that range, and v +- t s would be too short for xi,
focal length and k_1. Intervals therefore are those of the profile likelihood: an interval of v
ends where the best fit with v held there, all other numbers free, leaves t^2 s^2 more than the
minimum.

Pictures of a board do not tell its size: with squares twice as large all boards lie twice as far
off, and the pictures are the same. They do tell its proportions: see `fit_aspect`.

Source: Triggs et al., "Bundle adjustment - a modern synthesis", 1999; for the covariance Seber and
Wild, "Nonlinear Regression", 2.1, and 5.4 for the intervals.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.special import stdtrit

from ...errors import InvalidInput, require, require_one_of
from ..camera_models.camera_model import CameraModel
from .board import Pose, board_pose

# A corner that the model does not show at all counts as this far off [px].
_LOST = 1e3
# By how much a step of a difference quotient moves a corner [px].
_NUDGE = 1e-2
# Rounds over all numbers; a fit from a fair guess takes ten, one along a flat valley many more.
_ROUNDS = 300
# Most fits on the way to an end of an interval, most rounds of each, and how near the last has to
# come to the end, in deviations.
_POINTS, _POINT_ROUNDS, _NEAR_END = 15, 40, 0.02
# Least gain of a round of these fits that is worth another round, in squared deviations.
_SETTLED = 0.005


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
    covariance = 2 * found.cost / free * _inverse(problem.derivative(found.x))
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


def fit_intervals(
    fit: BoardFit,
    points: np.ndarray,
    pictures: Sequence[np.ndarray],
    *,
    fixed: Sequence[str] = (),
    confidence: float = 0.95,
) -> np.ndarray:
    """Intervals that cover each true parameter with a probability, by the profile likelihood.

    Args:
        fit: Of `fit_camera`.
        points: Corners on the board, shape (n, 2) [m].
        pictures: Pixels of the corners in each picture, shapes (n, 2).
        fixed: As of `fit_camera`; these have intervals without length.
        confidence: The probability, in (0, 1).

    Returns:
        Lower and upper ends, shape (p, 2), in the units of `names`; infinite where the pictures
        leave a parameter open on that side.

    Raises:
        InvalidInput: No such probability.
    """
    require(0 < confidence < 1, "confidence", "lie in (0, 1)", confidence)
    free = free_indices(fit.camera, fixed)
    with_aspect = fit.aspect_deviation > 0
    problem = _Problem(fit.camera, points, np.stack(pictures), with_aspect, free, fit.poses)
    best = problem.start
    if with_aspect:
        best[len(free)] = fit.aspect
    inverse = _inverse(problem.derivative(best))
    # The quantile of Student's t. All of scipy.stats takes half a second to import.
    bound = float(stdtrit(fit.freedom, 0.5 + 0.5 * confidence))
    ends = np.repeat(fit.camera.vector[:, None], 2, axis=1)
    for column, index in enumerate(free.tolist()):
        valley = inverse[:, column] / inverse[column, column]
        reach = bound * float(fit.deviations[index])
        for side, way in enumerate((-1.0, 1.0)):
            ends[index, side] = _profile_end(
                problem, best, column, valley, way * reach, bound, fit.freedom
            )
    return ends


def _profile_end(
    problem: "_Problem",
    best: np.ndarray,
    column: int,
    valley: np.ndarray,
    reach: float,
    bound: float,
    freedom: int,
) -> float:
    """Where the best fit with a number held is `bound` deviations worse, or infinity.

    Args:
        problem: What is fitted.
        best: The minimum, shape (p,).
        column: Of the number.
        valley: Change of all numbers per change of this one, near the minimum, shape (p,).
        reach: Way from the minimum to the end in the linear problem.
        bound: Deviations by which the fit at the end is worse.
        freedom: Residuals less numbers.
    """
    least = float(np.sum(problem.residuals(best) ** 2))
    if least == 0 or reach == 0:
        return float(best[column])
    # Numbers of the best fits so far, by how far the held one is from the minimum.
    path = {0.0: best}

    def best_from(start: np.ndarray, way: float) -> tuple[float, np.ndarray]:
        """How much worse the fit from a start is with the number held there, and its numbers."""
        start[column] = best[column] + way

        def whole(rest: np.ndarray) -> np.ndarray:
            return np.insert(rest, column, start[column])

        def slopes(rest: np.ndarray) -> np.ndarray:
            return np.delete(problem.derivative(whole(rest)), column, axis=1)

        found = least_squares(
            lambda rest: problem.residuals(whole(rest)),
            np.delete(start, column),
            jac=slopes,  # type: ignore[arg-type]  # a function of the numbers, as SciPy says
            method="lm",
            x_scale="jac",
            ftol=_SETTLED / freedom,
            max_nfev=_POINT_ROUNDS,
        )
        worse = math.sqrt(max(2 * float(found.cost) / least - 1, 0.0) * freedom)
        return worse, whole(found.x)

    def deviations_at(way: float) -> float:
        """How much worse the best fit is there."""
        nearest, *others = sorted(path, key=lambda other: abs(other - way))
        slope = valley
        if others:
            slope = (path[nearest] - path[others[0]]) / (nearest - others[0])
        worse, numbers = best_from(path[nearest] + slope * (way - nearest), way)
        if others and worse > bound - _NEAR_END:
            # Before it counts as beyond the end: a fit from the minimum may be better.
            again = best_from(best + valley * way, way)
            worse, numbers = min((worse, numbers), again, key=lambda each: each[0])
        path[way] = numbers
        return worse

    inside, beyond = (0.0, 0.0), None
    for _ in range(_POINTS):
        there = deviations_at(reach)
        if abs(there - bound) < _NEAR_END:
            return float(best[column] + reach)
        if there < bound:
            inside = (reach, there)
        else:
            beyond = (reach, there)
        if beyond is None:
            # The excess grows ever more slowly along a valley: not too far at once.
            reach *= min(max(bound / max(there, 1e-3), 1.1), 2.0)
            continue
        # Between the two, nearly straight.
        share = (bound - inside[1]) / (beyond[1] - inside[1])
        reach = inside[0] + min(max(share, 0.1), 0.9) * (beyond[0] - inside[0])
    return float(best[column] + reach) if beyond is not None else math.copysign(math.inf, reach)


def _inverse(jacobian: np.ndarray) -> np.ndarray:
    """Inverse of J^T J, its columns scaled to one length first: units differ by many orders."""
    lengths = np.linalg.norm(jacobian, axis=0)
    lengths[lengths == 0] = 1.0
    inverse = np.linalg.pinv((jacobian / lengths).T @ (jacobian / lengths), hermitian=True)
    return inverse / np.outer(lengths, lengths)


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
        poses: Sequence[Pose] = (),
    ) -> None:
        self._camera, self._points, self._pixels = camera, points, pixels
        self.free, self._inner = free, len(free)
        self._head = self._inner + with_aspect
        self._first = list(poses) or [board_pose(camera, points, each) for each in pixels]
        rows = [np.append(np.zeros(3), each.translation) for each in self._first]
        head = np.append(camera.vector[free], [1.0] * with_aspect)
        self.start = np.concatenate([head, *rows])
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
        return self._away(numbers, self._places(numbers)[None])[0]

    def _places(self, numbers: np.ndarray) -> np.ndarray:
        """Corners in the camera frame, shape (n pictures, 3) [m]."""
        points = self._points
        if self._head > self._inner:
            points = points * [1.0, numbers[self._inner]]
        return np.concatenate([pose.place(points) for pose in self.poses(numbers)])

    def _away(self, numbers: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Residuals of corners at places, shape (m, n pictures, 3) -> (m, 2 n pictures) [px]."""
        try:
            camera = self.camera(numbers)
        except InvalidInput:
            return np.full((len(places), self._pixels.size), _LOST)
        shown = camera.project(places.reshape(-1, 3)).reshape(len(places), -1)
        away = shown - self._pixels.ravel()
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
        here, placed = self._places(numbers), []
        for k, (step, group) in enumerate(zip(self._steps, groups, strict=True)):
            nudge = np.zeros(self.size)
            nudge[group] = step
            if k < self._inner:
                # The camera moves no corner.
                ahead, behind = (self._away(numbers + n, here[None])[0] for n in (nudge, -nudge))
                jacobian[:, k] = (ahead - behind) / (2 * step)
            else:
                placed += [self._places(numbers + nudge), self._places(numbers - nudge)]
        away = self._away(numbers, np.array(placed))
        for k in range(self._inner, len(groups)):
            ahead, behind = away[2 * (k - self._inner) :][:2]
            slope = (ahead - behind) / (2 * self._steps[k])
            if k < self._head:
                jacobian[:, k] = slope
                continue
            for picture, column in enumerate(groups[k]):
                rows = slice(picture * each, (picture + 1) * each)
                jacobian[rows, column] = slope[rows]
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
