"""Carts on their planned ways as a page that plays back without a server or a network."""

import math
from pathlib import Path

import numpy as np
import shapely
from pydrake.geometry import Meshcat, MeshcatParams, Rgba

from ...systems.numerics.planning.plan import TrailerPath
from ...systems.numerics.planning.trailer import Trailer, trailer_pose
from ..visuals.lighting import paint, set_lights
from ..visuals.meshes import bar_mesh, extruded_mesh, flat_mesh, line_mesh
from ..visuals.replay import write_replay
from ..visuals.stage import Stage
from ..visuals.text import advance, text_mesh
from .pictures import (
    METHOD_COLOURS,
    ValueSlice,
    band_levels,
    bands,
    drawbar_shape,
    followed_row,
    line_width,
    slices_along,
    swept_area,
    time_colours,
    tractor_shape,
    trailer_shape,
)
from .verdict import PlanningVerdict


class ValueFloor:
    """Shows the slice whose moment is nearest, and what its colours mean."""

    def __init__(
        self,
        stage: Stage,
        slices: list[ValueSlice],
        whose: str,
        corner: tuple[float, float],
        letter: float,
        ink: Rgba,
    ) -> None:
        """Draw every slice, and the key; `show` hides all slices but one.

        Args:
            stage: Where.
            slices: In order of their moments.
            whose: Name of the planner whose cart they follow, or "the start".
            corner: Lower left corner of the key [m].
            letter: Height of its letters [m].
            ink: Their colour.
        """
        self._stage = stage
        self._moments = np.array([piece.moment for piece in slices])
        levels = band_levels(slices)
        tints = time_colours(len(levels) - 1)
        colours = [paint(*tints(k)[:3]) for k in range(len(levels) - 1)]
        left, bottom = corner
        top = bottom + 1.3 * letter * len(colours)
        for k, piece in enumerate(slices):
            for number, area in enumerate(bands(piece, levels)):
                if not area.is_empty:
                    stage.mesh(f"value/{k}/{number}", flat_mesh(area), colours[number])
            _, _, theta, beta = piece.state
            words = text_mesh(f"theta {theta:.2f}, beta {beta:.2f} rad", letter)
            stage.mesh(f"value/{k}/words", words, ink)
            stage.place(f"value/{k}/words", left, top + 1.6 * letter)
        _write(stage, "key/title/0", "time to go [s] at angles", letter, ink)
        stage.place("key/title/0", left, top + 5.2 * letter)
        _write(stage, "key/title/1", f"of {whose}:", letter, ink)
        stage.place("key/title/1", left, top + 3.4 * letter)
        for number, colour in enumerate(colours):
            low = bottom + 1.3 * letter * number
            box = shapely.box(left, low, left + 3 * letter, low + 1.3 * letter)
            stage.mesh(f"key/bands/{number}", flat_mesh(box), colour)
        # Numbers stand at the edges of bands; all of them would touch.
        for number in range(0, len(levels), 2):
            _write(stage, f"key/levels/{number}", f"{levels[number]:g}", letter, ink)
            height = bottom + 1.3 * letter * number - 0.5 * letter
            stage.place(f"key/levels/{number}", left + 3.8 * letter, height)

    def show(self, time: float) -> None:
        """Show the slice for a `time` of the plan [s]."""
        nearest = int(np.abs(self._moments - time).argmin())
        for k in range(len(self._moments)):
            self._stage.show(f"value/{k}", k == nearest)


def _write(stage: Stage, path: str, words: str, letter: float, ink: Rgba) -> None:
    stage.mesh(path, text_mesh(words, letter), ink)


ROOT = "/planning"
# Between frames of the recording, and how long it stays on its last picture [s].
_PERIOD = 1 / 30
_AFTERWARDS = 1.0
_BACKGROUND = [0.914, 0.925, 0.941]
_PAPER, _INK = paint(0.985, 0.985, 0.985), paint(0.11, 0.13, 0.17)
_WALL = paint(0.30, 0.66, 0.37)
# The camera leans back a little, so that carts show that they have a height [rad].
_TILT = 0.24
_ASPECT = 16 / 9
# Slices of the value function along a plan.
_SLICES = 12


class PlanningScene:
    """Draws the carts of a verdict, each on its own way in its method's colour.

    Attributes:
        meshcat: Where it is drawn.
    """

    def __init__(self, meshcat: Meshcat, verdict: PlanningVerdict) -> None:
        """Draw what stands still: floor, walls, swept areas, ways, names, start and goal."""
        self.meshcat = meshcat
        self._trailer = verdict.question.trailer
        self._paths = verdict.shown
        low, high = _view(verdict, self._paths)
        span = float(max(high[1] - low[1], (high[0] - low[0]) / 1.05))
        self._stage = Stage(meshcat, ROOT, recording=True, period=_PERIOD, tolerance=5e-5 * span)
        _set_camera(meshcat, low, high, span)
        self._draw_floor(verdict, low, high)
        self._draw_ends(verdict, 0.003 * span)
        self._draw_names(verdict, (low[0] - 0.44 * span, high[1]), span)
        for k, row in enumerate(verdict.rows):
            if row.method in self._paths:
                self._draw_way(row.method, (k, len(verdict.rows)), span)
        self._value = self._draw_value(verdict, low, high, span)
        # On the floor, above all ways.
        self._stage.raise_to("ends", 0.0005 * span * (2 * len(verdict.rows) + 2))

    def play(self) -> None:
        """Drive every cart along its way, and record it."""
        end = max((path.times[-1] for path in self._paths.values()), default=0.0) + _AFTERWARDS
        for time in np.arange(0.0, end + _PERIOD / 2, _PERIOD).tolist():
            self._stage.begin(time)
            if self._value is not None:
                self._value.show(time)
            for method, path in self._paths.items():
                state = [float(np.interp(time, path.times, column)) for column in path.states.T]
                x, y, heading = trailer_pose(state[0], state[1], state[2], state[3], self._trailer)
                reach = 1.5 * self._trailer.length
                self._stage.pose(
                    f"carts/{method}/tractor", state[0], state[1], state[2], reach=reach
                )
                self._stage.pose(
                    f"carts/{method}/trailer", float(x), float(y), float(heading), reach=reach
                )

    def finish_recording(self) -> None:
        """End the recording with what was drawn last."""
        self._stage.finish_recording()

    def _draw_names(
        self, verdict: PlanningVerdict, corner: tuple[float, float], span: float
    ) -> None:
        """Every planner's name and time, one below the other from an upper left corner."""
        lines = [
            f"{row.method}  " + ("no path" if row.plan.path is None else f"{row.plan.time:.4f} s")
            for row in verdict.rows
        ]
        widest = max((advance(line, bold=True) for line in lines), default=1.0)
        height = min(0.026, 0.42 / widest) * span
        for k, (row, line) in enumerate(zip(verdict.rows, lines, strict=True)):
            colour = paint(*METHOD_COLOURS[row.method])
            self._stage.mesh(f"names/{k}", text_mesh(line, height, bold=True), colour)
            self._stage.place(f"names/{k}", corner[0], corner[1] - 2.2 * height * (k + 1))

    def _draw_floor(self, verdict: PlanningVerdict, low: np.ndarray, high: np.ndarray) -> None:
        question = verdict.question
        if question.world is None:
            self._stage.mesh("floor", flat_mesh(shapely.box(*low, *high)), _PAPER)
        else:
            size = 0.25 * self._trailer.length
            outline = shapely.Polygon(question.world.boundary)
            wall = outline.buffer(size / 2, join_style="mitre").difference(outline)
            solid = [shapely.Polygon(ring) for ring in question.world.obstacles]
            self._stage.mesh("floor", flat_mesh(outline), _PAPER)
            self._stage.mesh(
                "walls", extruded_mesh(shapely.union_all([wall, *solid]), 0, size), _WALL
            )

    def _draw_ends(self, verdict: PlanningVerdict, line: float) -> None:
        """Start and goal, and the box in which paths may end with a line of a width [m]."""
        start, goal = verdict.question.start, verdict.question.goal
        for name, state in (("start", start), ("goal", goal.state)):
            mark = _end_mark(state, self._trailer)
            self._stage.mesh(f"ends/{name}", flat_mesh(mark), _INK)
        wide, high = goal.tolerance[:2]
        if 0 < wide < math.inf and 0 < high < math.inf:
            outline = line_mesh([goal.corners()], line)
            self._stage.mesh("ends/box", outline, _INK)

    def _draw_value(
        self, verdict: PlanningVerdict, low: np.ndarray, high: np.ndarray, span: float
    ) -> ValueFloor | None:
        """The time to go on the floor, below all ways."""
        value, row = verdict.value_function, followed_row(verdict)
        if value is None:
            return None
        bounds = np.array([*low, *high])
        way = None if row is None else self._paths[row.method]
        slices = slices_along(value, way, verdict.question.start, bounds, _SLICES)
        self._stage.raise_to("value", 0.00025 * span)
        corner = (float(low[0]) - 0.44 * span, 0.5 * float(low[1] + high[1]) - 0.48 * span)
        whose = "the start" if row is None else row.method
        return ValueFloor(self._stage, slices, whose, corner, 0.02 * span, _INK)

    def _draw_way(self, method: str, place: tuple[int, int], span: float) -> None:
        """Swept area and way on the floor, and the cart itself.

        Planners that agree cover each other, so the later ones are lower and slimmer: the place is
        a number and how many there are.
        """
        number, count = place
        path, colour = self._paths[method], METHOD_COLOURS[method]
        trailer, stage = self._trailer, self._stage
        # Many areas on top of each other shall still let the floor through.
        shade = paint(*colour, min(0.22, 0.8 / len(self._paths)))
        stage.raise_to(f"ways/{method}/swept", 0.0005 * span * (2 * number + 1))
        stage.mesh(f"ways/{method}/swept", flat_mesh(swept_area(path, trailer)), shade)
        stage.raise_to(f"ways/{method}/line", 0.0005 * span * (2 * number + 2))
        line = shapely.LineString(path.states[:, :2]) if len(path.times) > 1 else shapely.Point()
        # A bar for each of thousands of samples would make a large page.
        points = shapely.get_coordinates(shapely.simplify(line, 2e-4 * span))
        stage.mesh(
            f"ways/{method}/line",
            bar_mesh(points[:-1], points[1:], 0.003 * line_width(number, count) * span),
            paint(*colour),
        )
        size = trailer.length
        height = (1 - 0.08 * number) * size
        body, towed = paint(*colour), paint(*(0.45 + 0.55 * part for part in colour))
        cart = f"carts/{method}"
        stage.mesh(
            f"{cart}/tractor/body", extruded_mesh(tractor_shape(trailer), 0, 0.24 * height), body
        )
        stage.mesh(
            f"{cart}/trailer/body", extruded_mesh(trailer_shape(trailer), 0, 0.18 * height), towed
        )
        stage.mesh(
            f"{cart}/trailer/drawbar", extruded_mesh(drawbar_shape(trailer), 0, 0.1 * height), _INK
        )
        hitch = shapely.Point(-trailer.hitch_offset, 0).buffer(0.05 * size)
        stage.mesh(f"{cart}/tractor/hitch", extruded_mesh(hitch, 0, 0.26 * height), _INK)


def write_planning_replay(path: Path, verdict: PlanningVerdict) -> Path:
    """Write a self-contained page that plays the plans of a verdict.

    Raises:
        OSError: The file cannot be written.
    """
    meshcat = Meshcat(MeshcatParams(host="localhost", port=0, show_stats_plot=False))
    scene = PlanningScene(meshcat, verdict)
    scene.play()
    return write_replay(scene, path, title="Sightfield: plans")


def _view(verdict: PlanningVerdict, paths: dict[str, TrailerPath]) -> tuple[np.ndarray, np.ndarray]:
    """Corners of what is to be seen [m]."""
    if verdict.question.world is not None:
        bounds = verdict.question.world.bounds
        return bounds[:2], bounds[2:]
    ends = np.array([verdict.question.start[:2], verdict.question.goal.state[:2]])
    points = np.vstack([ends, *(path.states[:, :2] for path in paths.values())])
    margin = 1.8 * verdict.question.trailer.length
    return points.min(axis=0) - margin, points.max(axis=0) + margin


def _set_camera(meshcat: Meshcat, low: np.ndarray, high: np.ndarray, span: float) -> None:
    """Look down through an orthographic camera, with room for names on the left."""
    height = 1.06 * span
    half = 0.5 * _ASPECT * height
    centre = np.array([low[0] - 0.48 * span + half, 0.5 * (low[1] + high[1]), 0.0])
    meshcat.SetCamera(
        Meshcat.OrthographicCamera(
            left=-half,
            right=half,
            bottom=-height / 2,
            top=height / 2,
            near=0.01 * span,
            far=8.0 * span,
        )
    )
    eye = centre + 4.0 * span * np.array([0.0, -math.sin(_TILT), math.cos(_TILT)])
    # Drake's stubs put the dtype of an array where its shape belongs.
    meshcat.SetCameraPose(eye, centre)  # pyright: ignore[reportArgumentType]
    for part in ("/Grid", "/Axes"):
        meshcat.SetProperty(part, "visible", False)
    for colour in ("top_color", "bottom_color"):
        meshcat.SetProperty("/Background/<object>", colour, _BACKGROUND)
    set_lights(meshcat)


def _end_mark(state, trailer: Trailer) -> shapely.Geometry:
    """A ring with a nose along the heading."""
    x, y, theta, _ = state
    ring = shapely.Point(0, 0).buffer(0.14).difference(shapely.Point(0, 0).buffer(0.09))
    nose = shapely.LineString([(0.14, 0), (0.4, 0)]).buffer(0.025)
    mark = shapely.union(ring, nose)
    c, s = trailer.length * math.cos(theta), trailer.length * math.sin(theta)
    return shapely.transform(
        mark, lambda points: points @ np.array([[c, s], [-s, c]]) + np.array([x, y])
    )
