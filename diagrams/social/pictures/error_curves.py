"""How far off camera and evader are located, over distance and angle, by every method."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ....systems.numerics.geometry.world import make_world
from ....systems.numerics.social.landmarks.forward_camera import ForwardCamera
from ....systems.numerics.social.landmarks.maze import Landmark, Maze
from ....systems.numerics.social.localisation.location import locate_evader
from ....systems.numerics.social.localisation.relative import METHODS
from ....systems.numerics.social.recognition.recognition import recognise
from ....systems.numerics.social.recognition.references import maze_references
from ....systems.numerics.vision.sensor import Sensor, expose
from ....systems.social.maze_renderer import MazeRenderer

COLOURS = {"thesis": "#d92e33", "edges": "#e69400", "pnp": "#7a4fd0", "level": "#215fcc"}
NAMES = {
    "thesis": "(2.14) as printed",
    "edges": "(2.14) corrected",
    "pnp": "solvePnP",
    "level": "level camera, weighted",
}
DISTANCES = (0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0)
ANGLES = tuple(math.radians(angle) for angle in (0, 10, 20, 30, 40, 50, 60))
# Where the angle is varied, and where the distance is.
_AT_DISTANCE, _AT_ANGLE = 1.0, math.radians(25)
# The room, and where its one landmark hangs [m].
_SIDE, _MIDDLE = 5.0, 2.5
# The evader stands beside the way to the landmark: this far before it and to the side [m].
_BEFORE, _BESIDE = 0.2, 0.28
_DPI = 120


@dataclass(frozen=True, eq=False)
class Errors:
    """Errors of one method over one thing that is varied.

    Attributes:
        camera, evader: Off by, shape (values, pictures) [m]; NaN where there is no estimate.
        camera_doubt, evader_doubt: Promised root of the mean square, of the same shape [m].
    """

    camera: np.ndarray
    evader: np.ndarray
    camera_doubt: np.ndarray
    evader_doubt: np.ndarray


@dataclass(frozen=True, eq=False)
class ErrorCurves:
    """Errors by method, over distance and over angle.

    Attributes:
        distances: Of the camera from the landmark [m].
        angles: Of the view off its normal [rad].
        over_distance, over_angle: By method.
    """

    distances: tuple[float, ...]
    angles: tuple[float, ...]
    over_distance: dict[str, Errors]
    over_angle: dict[str, Errors]


def measure_errors(
    *,
    camera: ForwardCamera | None = None,
    sensor: Sensor | None = None,
    distances: Sequence[float] = DISTANCES,
    angles: Sequence[float] = ANGLES,
    pictures: int = 12,
    seed: int = 0,
) -> ErrorCurves:
    """Measure on rendered pictures of one landmark and an evader beside it.

    Args:
        camera: Whose pictures.
        sensor: Their quality.
        distances: From the landmark, at 25 degrees off its normal [m].
        angles: Off its normal, at 1 m [rad].
        pictures: Of each distance and each angle, turned at random.
        seed: Of the turns.
    """
    world = make_world([[0, 0], [_SIDE, 0], [_SIDE, _SIDE], [0, _SIDE]])
    landmark = Landmark(number=6, x=_SIDE, y=_MIDDLE, facing=math.pi)
    camera = ForwardCamera() if camera is None else camera
    maze = Maze(world=world, landmarks=(landmark,), camera=camera)
    studio = _Studio(maze, Sensor() if sensor is None else sensor, seed)
    over_distance = studio.measure([(each, _AT_ANGLE) for each in distances], pictures)
    over_angle = studio.measure([(_AT_DISTANCE, each) for each in angles], pictures)
    return ErrorCurves(tuple(distances), tuple(angles), over_distance, over_angle)


class _Studio:
    """A room with one landmark, a camera and an evader."""

    def __init__(self, maze: Maze, sensor: Sensor, seed: int) -> None:
        self._maze, self._sensor = maze, sensor
        self._renderer = MazeRenderer(maze)
        self._references = maze_references(maze)
        self._rng = np.random.default_rng(seed)
        self._count = 0

    def measure(self, views: Sequence[tuple[float, float]], pictures: int) -> dict[str, Errors]:
        """Errors by method of a number of pictures from each distance and angle."""
        shape = (4, len(views), pictures)
        found = {method: np.full(shape, math.nan) for method in METHODS}
        for i, (distance, angle) in enumerate(views):
            for j in range(pictures):
                for method, numbers in self._look(distance, angle).items():
                    found[method][:, i, j] = numbers
        return {method: Errors(*each) for method, each in found.items()}

    def _look(self, distance: float, angle: float) -> dict[str, np.ndarray]:
        """Errors and doubts of one picture, by method, shape (4,)."""
        rng, side = self._rng, self._rng.choice((-1.0, 1.0))
        way = side * angle
        at = np.array([_SIDE - distance * math.cos(way), _MIDDLE - distance * math.sin(way)])
        pose = np.array([*at, way + rng.uniform(-0.15, 0.15)])
        # On the side from which the camera does not look, or it would be in the way.
        evader = np.array([_SIDE - _BEFORE, _MIDDLE + side * _BESIDE, rng.uniform(-3, 3)])
        seen = self._renderer.render(0, pose[None], evader)
        picture = expose(self._sensor, seen / np.float32(255), self._count)
        self._count += 1
        recognition = recognise(picture, self._references)
        found = {}
        for method in METHODS:
            numbers = np.full(4, math.nan)
            location = locate_evader(recognition, self._maze, method)
            if location.camera is not None:
                numbers[0] = math.dist(location.camera.pose[:2], at)
                numbers[2] = math.sqrt(np.trace(location.camera.covariance[:2, :2]))
            if location.outcome.has_location:
                numbers[1] = math.dist(location.position, evader[:2])
                numbers[3] = math.sqrt(np.trace(location.covariance))
            found[method] = numbers
        return found


def save_error_curves(path: Path, curves: ErrorCurves) -> None:
    """Draw medians and ninth deciles of the errors, and medians of what covariances promise."""
    figure = Figure(figsize=(11, 7.6), layout="constrained")
    panels = figure.subplots(2, 2, sharey="row")
    columns = (
        ("distance from the landmark [m]", np.array(curves.distances), curves.over_distance),
        ("angle off its normal [deg]", np.degrees(curves.angles), curves.over_angle),
    )
    for column, (label, values, errors) in enumerate(columns):
        for row, what in enumerate(("camera", "evader")):
            axes: Axes = panels[row, column]
            for method in METHODS:
                _draw(axes, method, values, errors[method], what)
            axes.set_yscale("log")
            axes.set_xlabel(label)
            axes.grid(alpha=0.3, which="both")
            if column == 0:
                axes.set_ylabel(f"error of the {what}'s position [mm]")
    at = (f"{math.degrees(_AT_ANGLE):.0f} degrees off the normal", f"{_AT_DISTANCE:g} m away")
    for axes, words in zip(panels[0], at, strict=True):
        axes.set_title(words, fontsize="medium")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    figure.suptitle(
        "One landmark in view: median (line), ninth decile (thin), promised by covariance (dots)",
        fontsize="medium",
    )
    figure.savefig(path, dpi=_DPI)


def _draw(axes: Axes, method: str, values: np.ndarray, errors: Errors, what: str) -> None:
    size, doubt = getattr(errors, what), getattr(errors, f"{what}_doubt")
    # A method that fails on most pictures has no median.
    known = np.isfinite(size).mean(axis=1) >= 0.5
    colour = COLOURS[method]
    if not known.any():
        return
    size, doubt, values = 1000 * size[known], 1000 * doubt[known], values[known]
    axes.plot(values, np.nanmedian(size, axis=1), "-o", color=colour, ms=4, label=NAMES[method])
    axes.plot(values, np.nanquantile(size, 0.9, axis=1), "-", color=colour, lw=0.7)
    axes.plot(values, np.nanmedian(doubt, axis=1), ":", color=colour, lw=1.5)
