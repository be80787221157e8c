"""The floor, its obstacles, and what is laid over it: a field, what is seen and lost, trails."""

from collections.abc import Callable, Sequence
from math import atan2, floor, hypot

import numpy as np
import shapely
from pydrake.geometry import Rgba

from ....systems.numerics.geometry.world import World
from ...visuals.meshes import (
    Mesh,
    arrow_mesh,
    bar_mesh,
    extruded_mesh,
    fan_mesh,
    flat_mesh,
    line_mesh,
    mesh_of,
    unit_bar_mesh,
)
from ...visuals.stage import Keyframes, Stage
from .layout import (
    CHASE,
    FIELD,
    GROWN_BOUNDARY,
    LINE_OF_SIGHT,
    LOSING,
    OBSTACLE,
    PAPER,
    POLYGON,
    Layout,
)

# How often the arrows are drawn afresh [s].
FIELD_PERIOD = 0.5
# Least and greatest distance between arrows, relative to the view's height; in between, a robot's
# radius. And the radius of the disc that they fill, in such distances.
_SPACING = (0.02, 0.034)
_RADIUS = 6.0

# (pursuer, points (m, 2) [m], evaders (Ne, 2) [m], assignment (Np,)) -> vectors (m, 2).
PursuitField = Callable[[int, np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def draw_world(stage: Stage, layout: Layout, world: World, grown: Sequence[World]) -> None:
    """Draw a world and the boundaries that the centres of its robots keep to.

    Args:
        stage: Where to draw.
        layout: Sizes of what has no size of its own.
        world: The free region.
        grown: The free region shrunk by a robot's radius; in pieces, where that splits it.
    """
    outline = shapely.Polygon(world.boundary)
    stage.mesh("world/floor", flat_mesh(outline), PAPER)
    wall = outline.buffer(layout.wall, join_style="mitre").difference(outline)
    solid = [shapely.Polygon(ring) for ring in world.obstacles]
    height = layout.obstacle_height
    stage.mesh("world/wall", extruded_mesh(wall, 0.0, height), OBSTACLE)
    for k, obstacle in enumerate(solid):
        stage.mesh(f"world/obstacles/{k}", extruded_mesh(obstacle, 0.0, height), OBSTACLE)
    stage.raise_to("boundaries", layout.level("boundaries"))
    rings = [ring for piece in grown for ring in piece.rings]
    if rings:
        stage.mesh("boundaries", line_mesh(rings, 1.3 * layout.line), GROWN_BOUNDARY)


class FieldLayer:
    """Draws arrows: which way, by `pursuit_field`, a pursuer would go from the points around it.

    The points are a lattice that stays put.
    """

    def __init__(
        self, stage: Stage, layout: Layout, grown: Sequence[World], pursuit_field: PursuitField
    ) -> None:
        self._pursuit_field = pursuit_field
        least, greatest = (share * layout.span for share in _SPACING)
        self._spacing = min(max(layout.robot_radius, least), greatest)
        self._radius = _RADIUS * self._spacing
        self._free = shapely.union_all([piece.polygon for piece in grown])
        shapely.prepare(self._free)
        self._keyframes = Keyframes(stage, "field", FIELD, period=FIELD_PERIOD)
        stage.raise_to("field", layout.level("field"))

    def update(
        self,
        time: float,
        pursuer: int | None,
        pursuers: np.ndarray,
        evaders: np.ndarray,
        assignment: np.ndarray,
    ) -> None:
        """Show the field of one pursuer; nothing for None or a pursuer that chases nobody.

        Args:
            time: [s].
            pursuer: Its number.
            pursuers, evaders: Positions, shapes (Np, 2), (Ne, 2) [m].
            assignment: The evader of each pursuer or -1, shape (Np,).
        """
        if pursuer is None or assignment[pursuer] < 0:
            self._keyframes.clear()
        elif self._keyframes.due(time):
            points = self.lattice(pursuers[pursuer])
            vectors = (
                self._pursuit_field(pursuer, points, evaders, assignment) if len(points) else points
            )
            if vectors.any():
                self._keyframes.draw(arrow_mesh(points, vectors, 0.85 * self._spacing))
            else:
                self._keyframes.clear()

    def lattice(self, centre: np.ndarray) -> np.ndarray:
        """Points of the world's lattice around a centre, shape (2,) [m], that a robot can reach.

        Returns:
            Shape (m, 2) [m].
        """
        low = np.ceil((centre - self._radius) / self._spacing)
        high = np.floor((centre + self._radius) / self._spacing)
        x, y = (np.arange(low[k], high[k] + 1) * self._spacing for k in range(2))
        points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        points = points[np.hypot(*(points - centre).T) <= self._radius]
        return points[shapely.contains_xy(self._free, points[:, 0], points[:, 1])]


# In a recording each polygon is a mesh of its own, so they come less often than the robots move.
RECORDED_PERIOD = 0.2
# Not a number equals nothing, so the first polygon is always drawn.
NOWHERE = np.full(2, np.nan)


class VisibilityLayer:
    """Draws all that a pursuer sees, from a function that maps a point, shape (2,) [m], to the
    visibility polygon of the point, shape (n, 2) [m], in order around it."""

    def __init__(
        self,
        stage: Stage,
        layout: Layout,
        visibility_polygon: Callable[[np.ndarray], np.ndarray],
    ) -> None:
        period = max(stage.period, RECORDED_PERIOD) if stage.recording else stage.period
        self._visibility_polygon = visibility_polygon
        self._seen_from = NOWHERE
        self._keyframes = Keyframes(stage, "polygon", POLYGON, period=period)
        stage.raise_to("polygon", layout.level("polygon"))

    def update(self, time: float, position: np.ndarray | None) -> None:
        """Show what is seen from a position; nothing without one.

        Args:
            time: [s].
            position: Shape (2,) [m].
        """
        if position is None:
            self._keyframes.clear()
            self._seen_from = NOWHERE
        elif not np.array_equal(position, self._seen_from) and self._keyframes.due(time):
            self._keyframes.draw(fan_mesh(self._visibility_polygon(position), position))
            self._seen_from = position


# Where a chosen pursuer would lose an evader some day, laid over the floor.

# How often the set is drawn afresh: each time some thousand places are looked up [s].
LOSING_PERIOD = 0.2
# Times at which one colour takes over from the next [s].
BANDS = (2.0, 5.0)

# From a pursuer's place, shape (2,) [m], to strips of places in its sight where an evader is lost:
# x_min, y_min, x_max, y_max, shape (k, 4) [m], and how long it can be kept there, shape (k,) [s].
LosingSet = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


class LosingLayer:
    """Draws the places from which an evader escapes a pursuer, the sooner the darker.

    Args:
        stage: Where to draw.
        layout: Sizes.
        losing_set: Of a pursuer at a place.
    """

    def __init__(self, stage: Stage, layout: Layout, losing_set: LosingSet) -> None:
        self._losing_set = losing_set
        self._bands = [
            Keyframes(stage, f"losing/{k}", colour, period=LOSING_PERIOD)
            for k, colour in enumerate(LOSING)
        ]
        self._seen_from = NOWHERE
        stage.raise_to("losing", layout.level("losing"))

    def update(self, time: float, position: np.ndarray | None) -> None:
        """Show the losing set of a pursuer at a position; nothing without one.

        Args:
            time: [s].
            position: Shape (2,) [m].
        """
        if position is None:
            for keyframes in self._bands:
                keyframes.clear()
            self._seen_from = NOWHERE
            return
        if np.array_equal(position, self._seen_from):
            return
        # Each keeps a clock of its own, and they run together.
        due = [keyframes.due(time) for keyframes in self._bands]
        if not all(due):
            return
        self._seen_from = position
        strips, times = self._losing_set(position)
        band_of = np.searchsorted(BANDS, times, side="right")
        for band, keyframes in enumerate(self._bands):
            chosen = strips[band_of == band]
            if len(chosen):
                keyframes.draw(strips_mesh(chosen))
            else:
                keyframes.clear()


def strips_mesh(strips: np.ndarray) -> Mesh:
    """A mesh of rectangles.

    Args:
        strips: x_min, y_min, x_max, y_max of each, shape (k, 4) [m].
    """
    x0, y0, x1, y1 = strips.T
    points = np.stack([x0, y0, x1, y0, x1, y1, x0, y1], axis=-1).reshape(-1, 2)
    first = 4 * np.arange(len(strips))[:, None]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    return mesh_of(points, faces)


# How long a trail stays, and how long the pieces are that it is made of [s]. A piece is drawn when
# it is complete; until then its robot's body covers most of it.
TRAIL_DURATION = 10.0
PIECE_DURATION = 0.5
_OPACITY = 0.75
# Corners of a trail are at least this far apart [s].
_SAMPLE_PERIOD = 0.1


class Trails:
    """Draws the trails of one team as pieces, each a mesh for the whole team.

    In a recording every piece has a path of its own; on a live page the paths are used again
    when their piece has faded.
    """

    def __init__(self, stage: Stage, layout: Layout, team: str, colour: Rgba) -> None:
        self._stage = stage
        self._folder = f"trails/{team}"
        self._width = 1.5 * layout.line
        self._colour = Rgba(colour.r(), colour.g(), colour.b(), _OPACITY)
        self._samples: list[np.ndarray] = []
        self._sampled = 0.0
        self._tick: int | None = None
        self._pieces: list[int] = []
        self._slots = round(TRAIL_DURATION / PIECE_DURATION) + 1
        stage.raise_to("trails", layout.level("trails"))

    def update(self, time: float, positions: np.ndarray) -> None:
        """Note where the team is.

        Args:
            time: [s].
            positions: Shape (n, 2) [m].
        """
        tick = floor(time / PIECE_DURATION + 1e-6)
        if tick == self._tick:
            if time - self._sampled >= _SAMPLE_PERIOD - 1e-6:
                self._samples.append(positions)
                self._sampled = time
            return
        if self._tick is not None:
            self._samples.append(positions)
            self._finish_piece(tick)
        self._tick, self._sampled = tick, time
        self._samples = [positions]

    def _finish_piece(self, tick: int) -> None:
        track = np.stack(self._samples)
        start, end = track[:-1].reshape(-1, 2), track[1:].reshape(-1, 2)
        moved = (start != end).any(axis=1)
        if moved.any():
            path = self._path(tick)
            self._stage.mesh(path, bar_mesh(start[moved], end[moved], self._width), self._colour)
            self._stage.show(path, True)
            self._pieces.append(tick)
        for piece in self._pieces:
            age = (tick - piece) * PIECE_DURATION
            self._stage.fade(self._path(piece), _OPACITY * max(0.0, 1.0 - age / TRAIL_DURATION))
            if age >= TRAIL_DURATION:
                self._stage.show(self._path(piece), False)
        self._pieces = [p for p in self._pieces if (tick - p) * PIECE_DURATION < TRAIL_DURATION]

    def _path(self, piece: int) -> str:
        return f"{self._folder}/{piece if self._stage.recording else piece % self._slots}"


class SightLines:
    """Draws who sees whom and who chases whom, in one of two ways.

    A live page gets all lines of a kind as one mesh, the cheapest message there is. A recording
    holds no shapes, so there each line is a bar of length 1 that is moved, turned and stretched:
    `sight/I_J` and `chases/I_J` from pursuer I to evader J. A chase that goes over to another
    evader is another bar, for a player would let one and the same sweep across.
    """

    def __init__(self, stage: Stage, layout: Layout) -> None:
        self._stage = stage
        self._widths = {"sight": layout.line, "chases": 2.6 * layout.line}
        self._colours = {"sight": LINE_OF_SIGHT, "chases": CHASE}
        # Not a number equals nothing, so the first lines are always drawn.
        self._drawn = {kind: np.full((1, 4), np.nan) for kind in ("sight", "chases")}
        self._shown: dict[str, set[str]] = {"sight": set(), "chases": set()}
        self._made: set[str] = set()
        stage.raise_to("sight", layout.level("sight"))
        stage.raise_to("chases", layout.level("chases"))

    def update(
        self,
        pursuers: np.ndarray,
        evaders: np.ndarray,
        visibility: np.ndarray,
        assignment: np.ndarray,
    ) -> None:
        """Draw the lines between positions.

        Args:
            pursuers: Positions of the pursuers, shape (Np, 2) [m].
            evaders: Positions of the evaders, shape (Ne, 2) [m].
            visibility: True where pursuer i sees evader j, shape (Np, Ne).
            assignment: The evader that each pursuer chases, or -1, shape (Np,).
        """
        seeing, seen = np.nonzero(visibility)
        chasing = np.flatnonzero(assignment >= 0)
        chased = assignment[chasing]
        if self._stage.recording:
            self._move("sight", _names(seeing, seen), pursuers[seeing], evaders[seen])
            self._move("chases", _names(chasing, chased), pursuers[chasing], evaders[chased])
        else:
            self._redraw("sight", pursuers[seeing], evaders[seen])
            self._redraw("chases", pursuers[chasing], evaders[chased])

    def _redraw(self, kind: str, start: np.ndarray, end: np.ndarray) -> None:
        lines = np.hstack([start, end])
        if np.array_equal(lines, self._drawn[kind]):
            return
        self._drawn[kind] = lines
        self._stage.show(kind, len(lines) > 0)
        if len(lines) > 0:
            self._stage.mesh(kind, bar_mesh(start, end, self._widths[kind]), self._colours[kind])

    def _move(self, kind: str, names: list[str], start: np.ndarray, end: np.ndarray) -> None:
        stage = self._stage
        for name in self._shown[kind].difference(names):
            stage.show(f"{kind}/{name}", False)
        self._shown[kind] = set(names)
        for name, (x, y), (dx, dy) in zip(
            names, start.tolist(), (end - start).tolist(), strict=True
        ):
            path = f"{kind}/{name}"
            if path not in self._made:
                self._made.add(path)
                stage.mesh(f"{path}/bar", unit_bar_mesh(self._widths[kind]), self._colours[kind])
            length = hypot(dx, dy)
            stage.pose(path, x, y, atan2(dy, dx), reach=length)
            stage.stretch(f"{path}/bar", length)
            stage.show(path, True)


def _names(pursuers: np.ndarray, evaders: np.ndarray) -> list[str]:
    return [f"{i}_{j}" for i, j in zip(pursuers.tolist(), evaders.tolist(), strict=True)]
