"""The calibration of 2.2.4.2: k and h, the error curves of both models, and the parabola of (2.8).

The thesis measures h and computes k. Here the exact optics are fitted to the same readings first,
which gives h as well (the height of the mirror), the focal length, and the mirror's axis in the
picture; only the mirror's radius and its distance from the pinhole are taken as known.

Files are JSON in SI units, with the readings that a calibration was made from.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from ...checked import Checked, NonNegative, NonNegativeSized, PositiveSized, Sized
from ...errors import (
    MOST_SIZE,
    InvalidInput,
    require,
    require_finite,
    require_positive,
    require_sized,
)
from ...files import read_input
from ..omni_optics import OmniCamera, bearing_of
from .range_models import (
    MODELS,
    Outline,
    exact_pixel_radius,
    exact_range,
    fit_parabola,
    k_values,
    make_outline,
    thesis_range,
)

INCH = 0.0254
# The distances of 2.2.4.2: 15, 20, ... 60 inches [m].
THESIS_DISTANCES = tuple(inches * INCH for inches in range(15, 61, 5))
# An empirical curve needs a parabola and one more.
_MIN_DISTANCES = 4


@dataclass(frozen=True, kw_only=True)
class Readings:
    """Where shells stood and where they were seen, a row per picture.

    Attributes:
        distance: True distance from the mirror's axis to the shell's near side, shape (n,) [m].
        bearing: True bearing from the robot's front, counter-clockwise, shape (n,) [rad].
        pixels: Near point of the bottom edge in the picture (column, row), shape (n, 2).

    Raises:
        InvalidInput: Shapes differ, or a number is not finite.
    """

    distance: np.ndarray
    bearing: np.ndarray
    pixels: np.ndarray

    def __post_init__(self) -> None:
        count = len(self.distance)
        shapes = (self.distance.shape, self.bearing.shape, self.pixels.shape)
        require(
            shapes == ((count,), (count,), (count, 2)),
            "readings",
            "hold a distance, a bearing and a pixel per picture",
            shapes,
        )
        for name in ("distance", "bearing", "pixels"):
            # Written so that NaN fails.
            fine = np.all(np.abs(getattr(self, name)) <= MOST_SIZE)
            words = f"be finite, and at most {MOST_SIZE:g}"
            require(bool(fine), f"readings.{name}", words, "something that is not")
        require(bool(np.all(self.distance > 0)), "readings.distance", "be positive", "less")
        different = len(self.distances)
        require(
            different >= _MIN_DISTANCES,
            "readings",
            f"hold at least {_MIN_DISTANCES} different distances",
            different,
        )

    @property
    def distances(self) -> np.ndarray:
        """The different distances, rising, shape (m,) [m]."""
        return np.unique(self.distance)

    def means(self, values: np.ndarray) -> np.ndarray:
        """Means over the directions at each of `distances`, shape (n,) -> (m,).

        Args:
            values: One for each picture, any unit, shape (n,).
        """
        return np.array([values[self.distance == each].mean() for each in self.distances])


@dataclass(frozen=True, kw_only=True)
class ErrorCurve:
    """How a model errs at each distance, over all directions.

    Attributes:
        distance: True distances, shape (m,) [m].
        pixel_radius: Mean p, shape (m,) [px].
        mean_error: True distance less the mean estimate, e of (2.8); its size is Figure 2.11;
            shape (m,) [m].
        spread: Standard deviation of the estimates over the directions, Figure 2.12;
            shape (m,) [m].
        rms: Root of the mean square error, both together, shape (m,) [m].
    """

    distance: np.ndarray
    pixel_radius: np.ndarray
    mean_error: np.ndarray
    spread: np.ndarray
    rms: np.ndarray

    @property
    def mean_absolute_error(self) -> float:
        """Mean of Figure 2.11 over the distances [m]."""
        return float(np.abs(self.mean_error).mean())


def error_curve(readings: Readings, radius: np.ndarray, estimate: np.ndarray) -> ErrorCurve:
    """Compare estimates with the truth.

    Args:
        readings: The truth, n rows.
        radius: Pixel radius of each reading, shape (n,) [px].
        estimate: Estimated distance of each reading, shape (n,) [m].
    """
    error = readings.distance - estimate
    mean = readings.means(error)
    rms = np.sqrt(readings.means(error**2))
    return ErrorCurve(
        distance=readings.distances,
        pixel_radius=readings.means(radius),
        mean_error=mean,
        spread=np.sqrt(np.maximum(rms**2 - mean**2, 0.0)),
        rms=rms,
    )


# Residuals beyond this many pixels pull less: a picture with a wrong label must not bend all.
_ROBUST = 0.5
# Step by which slopes of the optics are taken.
_TINY = 1e-5
# Directions on more than half the circle tell where the mirror's axis is.
_WIDEST_GAP = np.pi


@dataclass(frozen=True, kw_only=True)
class Calibration(Checked):
    """What an estimator has to know of a camera and of the shells it looks for.

    Attributes:
        camera: Its optics, as fitted.
        base: Height of the shells' bottom edges above the floor [m].
        shell_radius: Of the shells [m].
        shell_top: Height of the shells' top edges above the floor [m].
        height: h of (2.4), of the mirror's focus above the bottom edges [m].
        k: Of (2.4), the mean over the distances [px/rad].
        k_spread: Standard deviation of k over the distances [px/rad].
        parabola: a [1/m], b [-], c [m] of (2.8), the error of the thesis's model.
        readings: What it was made from.

    Raises:
        InvalidInput: A number is out of its range, or the readings do not show farther shells
            farther out.
    """

    camera: OmniCamera
    base: NonNegativeSized
    shell_radius: PositiveSized
    shell_top: Sized
    height: PositiveSized
    k: PositiveSized
    k_spread: NonNegative
    parabola: tuple[float, float, float]
    readings: Readings

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.shell_top > self.base, "shell_top", "be above the base", self.shell_top)
        require(len(self.parabola) == 3, "parabola", "be a, b and c", self.parabola)
        for value in self.parabola:
            require_finite("parabola", value)
        # The curves are read between pixel radii, which must rise with the distance.
        rising = bool(np.all(np.diff(self.curves["exact"].pixel_radius) > 0))
        require(rising, "readings", "show farther shells farther out", "others")

    def range_of(self, model: str, pixel_radius: np.ndarray | float) -> np.ndarray:
        """Distances by a model of MODELS, any shape [px] -> same shape [m].

        Args:
            model: One of MODELS.
            pixel_radius: p, any shape [px].
        """
        if model == "thesis":
            return thesis_range(pixel_radius, k=self.k, height=self.height)
        return exact_range(pixel_radius, camera=self.camera, base=self.base)

    @cached_property
    def pixel_radius(self) -> np.ndarray:
        """Pixel radius of each reading about the fitted axis, shape (n,) [px]."""
        return _radius(self.camera, self.readings)

    @cached_property
    def curves(self) -> Mapping[str, ErrorCurve]:
        """The error curve of each model on the readings."""
        radius = self.pixel_radius
        return {
            model: error_curve(self.readings, radius, self.range_of(model, radius))
            for model in MODELS
        }

    @cached_property
    def outline(self) -> Outline:
        """Where the camera shows the edges of such shells."""
        return make_outline(
            self.camera, radius=self.shell_radius, base=self.base, top=self.shell_top
        )

    @cached_property
    def optics_covariance(self) -> np.ndarray:
        """Covariance of fitted height [m], log of the focal length, axis [px], shape (4, 4).

        Readings err alike in directions that are mirror images of each other on the grid of pixels:
        only directions that differ count.
        """
        distances, where = np.unique(self.readings.distance, return_inverse=True)

        def residuals(camera: OmniCamera) -> np.ndarray:
            radius = exact_pixel_radius(distances, camera=camera, base=self.base)
            return radius[where] - _radius(camera, self.readings)

        here = residuals(self.camera)
        slopes = np.column_stack(
            [(residuals(each) - here) / _TINY for each in _neighbours(self.camera, _TINY)]
        )
        size = 4 if _tells_axis(self.readings) else 2
        fold = self.readings.bearing % (0.5 * np.pi)
        fold = np.round(np.minimum(fold, 0.5 * np.pi - fold), 6)
        different = len(np.unique(np.column_stack([where, fold]), axis=0))
        rest = max(len(here) - size, 1) * different / len(here)
        covariance = np.zeros((4, 4))
        matrix = slopes[:, :size].T @ slopes[:, :size]
        covariance[:size, :size] = np.linalg.pinv(matrix) * float(here @ here) / rest
        return covariance

    def optics_doubt(self, distance: float, pixel_radius: float) -> tuple[float, float]:
        """Variances of range [m^2] and bearing [rad^2] that come from the calibration itself.

        Args:
            distance: By the exact optics [m].
            pixel_radius: p, at which they show it [px].
        """
        ranges = [
            float(exact_range(pixel_radius, camera=each, base=self.base))
            for each in _neighbours(self.camera, _TINY)[:2]
        ]
        slopes = (np.array(ranges) - distance) / _TINY
        spread = self.optics_covariance
        axis = 0.5 * float(spread[2, 2] + spread[3, 3])
        steepness = 10 * float(
            exact_range(pixel_radius + 0.05, camera=self.camera, base=self.base)
            - exact_range(pixel_radius - 0.05, camera=self.camera, base=self.base)
        )
        along = float(slopes @ spread[:2, :2] @ slopes) + axis * steepness**2
        return along, axis / pixel_radius**2

    @cached_property
    def bearing_error(self) -> np.ndarray:
        """Measured less true bearing of each reading, shape (n,) [rad]."""
        turn = bearing_of(self.camera, self.readings.pixels) - self.readings.bearing
        return (turn + np.pi) % (2 * np.pi) - np.pi

    @property
    def bearing_rms(self) -> float:
        """Root mean square of the bearing's error [rad]."""
        return float(np.sqrt(np.mean(self.bearing_error**2)))


def calibrate(
    readings: Readings,
    *,
    camera: OmniCamera,
    base: float,
    shell_radius: float,
    shell_top: float,
    height: float | None = None,
) -> Calibration:
    """Calibrate both models on the same readings.

    Args:
        readings: From pictures of shells at known places.
        camera: The optics as measured with a ruler; the fit starts there.
        base: Height of the shells' bottom edges above the floor [m].
        shell_radius: Of the shells [m].
        shell_top: Height of their top edges above the floor [m].
        height: h, if it was measured; None: of the fitted optics, by F = D / 4 [m].

    Raises:
        InvalidInput: A number is out of range, or the readings fit no such mirror.
    """
    fitted = fit_optics(readings, camera, base)
    if height is None:
        height = fitted.focus_height - base
    require_positive("height", height)
    require_sized("height", height)
    radius = _radius(fitted, readings)
    values = k_values(readings.means(radius), readings.distances, height=height)
    k = float(values.mean())
    estimate = readings.means(thesis_range(radius, k=k, height=height))
    require(bool(np.isfinite(estimate).all()), "height", "put all shells below the horizon", height)
    return Calibration(
        camera=fitted,
        base=base,
        shell_radius=shell_radius,
        shell_top=shell_top,
        height=float(height),
        k=k,
        k_spread=float(values.std(ddof=1)),
        parabola=fit_parabola(readings.distances, estimate),
        readings=readings,
    )


def fit_optics(readings: Readings, camera: OmniCamera, base: float) -> OmniCamera:
    """Fit height, focal length and, if the directions tell it, the axis's pixel.

    Least squares of the pixel radii, robust against single wrong labels.

    Args:
        readings: Where shells stood and were seen.
        camera: A first guess, with the mirror's size.
        base: Height of the shells' bottom edges above the floor [m].

    Raises:
        InvalidInput: The readings fit no mirror of this size.
    """
    size = 4 if _tells_axis(readings) else 2
    distances, where = np.unique(readings.distance, return_inverse=True)
    low = base - camera.mirror_distance + 1e-3

    def fitted(values: np.ndarray) -> OmniCamera:
        height, log_focal, *axis = values.tolist()
        return replace(
            camera,
            pinhole_height=height,
            focal_length=camera.focal_length * float(np.exp(log_focal)),
            centre=tuple(axis or camera.axis_pixel.tolist()),
        )

    def residuals(values: np.ndarray) -> np.ndarray:
        guess = fitted(values)
        return exact_pixel_radius(distances, camera=guess, base=base)[where] - _radius(
            guess, readings
        )

    start = np.array([camera.pinhole_height, 0.0, *camera.axis_pixel])[:size]
    bounds = np.array([(max(low, 1e-3), 5.0), (-2.0, 2.0), (-np.inf, np.inf), (-np.inf, np.inf)])
    found = least_squares(
        residuals,
        np.clip(start, bounds[:size, 0] + 1e-6, bounds[:size, 1] - 1e-6),
        bounds=(bounds[:size, 0], bounds[:size, 1]),
        x_scale=np.array([0.1, 0.1, 1.0, 1.0])[:size],
        loss="soft_l1",
        f_scale=_ROBUST,
    )
    off = float(np.median(np.abs(residuals(found.x))))
    require(off < 3, "readings", "fit the mirror to 3 pixels", f"{off:.1f} pixels")
    return fitted(found.x)


def _tells_axis(readings: Readings) -> bool:
    """Whether the directions of readings tell where the mirror's axis is."""
    turns = np.sort(np.unique(readings.bearing % (2 * np.pi)))
    gaps = np.diff(np.append(turns, turns[0] + 2 * np.pi))
    return len(turns) >= 3 and bool(gaps.max() < _WIDEST_GAP)


def _neighbours(camera: OmniCamera, step: float) -> list[OmniCamera]:
    """The camera with a little more height, focal length (as a share), and axis either way."""
    column, row = camera.axis_pixel.tolist()
    return [
        replace(camera, pinhole_height=camera.pinhole_height + step),
        replace(camera, focal_length=camera.focal_length * (1 + step)),
        replace(camera, centre=(column + step, row)),
        replace(camera, centre=(column, row + step)),
    ]


def _radius(camera: OmniCamera, readings: Readings) -> np.ndarray:
    return np.linalg.norm(readings.pixels - camera.axis_pixel, axis=1)


FORMAT, VERSION = "sightfield camera calibration", 1
_NUMBERS = ("base", "shell_radius", "shell_top", "height", "k", "k_spread")
_KEYS = ("format", "version", "camera", *_NUMBERS, "parabola", "readings")
_CAMERA_KEYS = tuple(field.name for field in fields(OmniCamera))
_READING_KEYS = tuple(field.name for field in fields(Readings))


def save_calibration(path: Path, calibration: Calibration) -> None:
    """Write a calibration, for `load_calibration`."""
    tree = {
        "format": FORMAT,
        "version": VERSION,
        "camera": asdict(calibration.camera) | {"centre": calibration.camera.axis_pixel.tolist()},
        **{key: getattr(calibration, key) for key in _NUMBERS},
        "parabola": dict(zip("abc", calibration.parabola, strict=True)),
        "readings": {key: getattr(calibration.readings, key).tolist() for key in _READING_KEYS},
    }
    path.write_text(json.dumps(tree, indent=1) + "\n", encoding="utf-8")


def load_calibration(path: str | Path) -> Calibration:
    """Read a calibration.

    Raises:
        InvalidInput: No readable JSON, not a calibration or of another version, keys missing or
            unknown, or values that make no sense.
    """
    data = read_input("calibration", path)
    try:
        tree = json.loads(data)
    except (ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise InvalidInput(f"`calibration` must be readable JSON; got {path} ({reason})") from None
    is_ours = isinstance(tree, dict) and tree.get("format") == FORMAT
    require(is_ours, "calibration", f'be a file of the format "{FORMAT}"', path)
    version = tree.get("version")
    require(version == VERSION, "calibration.version", f"be {VERSION}", version)
    _require_keys("calibration", tree, _KEYS)
    _require_keys("calibration.camera", tree["camera"], _CAMERA_KEYS)
    _require_keys("calibration.parabola", tree["parabola"], ("a", "b", "c"))
    _require_keys("calibration.readings", tree["readings"], _READING_KEYS)
    camera = dict(tree["camera"])
    camera["centre"] = tuple(_array("calibration.camera.centre", camera["centre"], 1).tolist())
    for key in ("mirror_radius", "mirror_distance", "pinhole_height", "focal_length"):
        camera[key] = _number(f"calibration.camera.{key}", camera[key])
    readings = {
        key: _array(f"calibration.readings.{key}", tree["readings"][key], ndim)
        for key, ndim in zip(_READING_KEYS, (1, 1, 2), strict=True)
    }
    a, b, c = (_number(f"calibration.parabola.{key}", tree["parabola"][key]) for key in "abc")
    return Calibration(
        camera=OmniCamera(**camera),
        parabola=(a, b, c),
        readings=Readings(**readings),
        **{key: _number(f"calibration.{key}", tree[key]) for key in _NUMBERS},
    )


def _require_keys(name: str, tree: Any, keys: tuple[str, ...]) -> None:
    require(isinstance(tree, dict), name, "be a mapping", tree)
    missing = [key for key in keys if key not in tree]
    require(not missing, name, f"have the keys {', '.join(keys)}", f"no {', '.join(missing)}")
    others = [key for key in tree if key not in keys]
    require(not others, name, f"have the keys {', '.join(keys)}", f"also {', '.join(others)}")


def _number(name: str, value: object) -> float:
    fine = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    require(fine, name, "be a finite number", value)
    return float(value)  # type: ignore[arg-type]  # a number, or the line above had raised


def _array(name: str, values: object, ndim: int) -> np.ndarray:
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput(f"`{name}` must be a list of numbers; got something else") from None
    require(array.ndim == ndim, name, f"be a list of {ndim} dimensions", array.ndim)
    return array
