"""The pursuers' pictures beside the map, and on it where the evaders are and may be."""

from typing import Any

import numpy as np
import shapely
from pydrake.geometry import Meshcat, Rgba
from pydrake.systems.framework import Context, EventStatus, LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from ...systems.drake_parts import AbstractValue, read
from ...systems.numerics.vision.omni_optics import OmniCamera
from ...systems.numerics.vision.whereabouts.reachable_set import PlaceGrid, make_place_grid
from ..tracking.scene.layout import FAINT_INK, PAPER, Layout, make_layout
from ..visuals.lighting import paint, picture_square
from ..visuals.meshes import disc_mesh, flat_mesh
from ..visuals.stage import Stage
from ..visuals.text import text_mesh
from .scenario import PictureGame

# Where everything is, in Meshcat's tree.
ROOT = "/pictures"
# Shares of the view's height: the strip right of the map, a title's letters, gaps.
_STRIP, _LETTER, _GAP = 0.345, 0.019, 0.02
# Side of the images in a recording, which holds a few for each second.
_PIXELS = 240
# Opacity of the places where an evader may be.
_TINT = 0.35
# How far a replay may pass from where things were, relative to the view.
_TOLERANCE = 5e-5


class PictureScene(LeafSystem):
    """Shows each pursuer's picture, a ring where an evader is believed to be, and where it may be.

    .. pydrake_system::

        name: PictureScene
        input_ports:
        - image_0
        - image_1
        - evader_estimate
        - evader_known
        - evader_set
        output_ports: []

    ===============  ===========  ====  =======
    port             size         unit  frame
    ===============  ===========  ====  =======
    image_0          ImageRgba8U  -     picture
    image_1          ImageRgba8U  -     picture
    evader_estimate  2 Ne         m     world
    evader_known     Ne           -     -
    evader_set       Ne Nc        -     world
    ===============  ===========  ====  =======

    There is an image for each pursuer; two are shown. A picture's top is the robot's front, its
    right the robot's left. The pictures stand right of the map, where Meshcat's own controls
    unfold. `evader_set` has a number for each cell of the grid of places, 1 where an evader may be:
    these cells are tinted in its colour once it has been seen.

    Source: Zhang 2014, Figures 2.26 and 2.27.
    """

    def __init__(
        self,
        game: PictureGame,
        meshcat: Meshcat,
        *,
        publish_period: float,
        shown_period: float,
        recording: bool,
    ) -> None:
        """Draw the frames; the pictures follow at each publish event.

        Args:
            game: Whose cameras and evaders.
            meshcat: Where to draw: beside a TrackingScene made before with the same period, whose
                recording this joins.
            publish_period: Time between pictures of the map [s].
            shown_period: Time between changes of the pictures, rounded up to that [s].
            recording: Record what is drawn.
        """
        super().__init__()
        scenario = game.scenario
        self.meshcat = meshcat
        self._grid = make_place_grid(game.evader_regions)
        self._recording = recording
        self._camera = scenario.vision.optics
        self._colours = [
            paint(*(value / 255 for value in shell.colour))
            for shell in scenario.vision.evader_shells
        ]
        self._cameras = scenario.pursuers.size
        self._publish_period = publish_period
        self._stride = max(round(shown_period / publish_period), 1)
        self._layout = make_layout(game.world.bounds, scenario.pursuers.radius)
        self._images = [
            self.DeclareAbstractInputPort(
                f"image_{i}",
                AbstractValue.Make(ImageRgba8U(self._camera.width, self._camera.height)),
            )
            for i in range(self._cameras)
        ]
        evaders = scenario.evaders.size
        self._estimate = self.DeclareVectorInputPort("evader_estimate", 2 * evaders)
        self._known = self.DeclareVectorInputPort("evader_known", evaders)
        cells = len(self._grid.usable)
        self._set = self.DeclareVectorInputPort("evader_set", evaders * cells)
        self._begin()
        self.DeclareInitializationPublishEvent(lambda context: self._restart())
        self.DeclarePeriodicPublishEvent(publish_period, 0.0, self._publish)
        self.DeclareForcedPublishEvent(self._publish)

    def finish_recording(self) -> None:
        """End the recording with the last picture."""
        self._stage.finish_recording()

    def _restart(self) -> EventStatus:
        if self._drawn:
            self._begin()
        return EventStatus.Succeeded()

    def _begin(self) -> None:
        """Draw what does not move, on a clean sheet."""
        self._drawn = False
        self._tick = -1
        self._shown: list[str | None] = [None] * self._cameras
        self._tinted: list[tuple[str, bytes] | None] = [None] * len(self._colours)
        span = self._layout.span
        # The map's scene has begun the recording; this one only adds to it.
        self._stage = Stage(
            self.meshcat,
            ROOT,
            recording=False,
            period=self._publish_period,
            tolerance=_TOLERANCE * span,
        )
        self._stage.recording = self._recording
        for folder, layer in (
            ("frames", "ink"),
            ("views", "sight"),
            ("sets", "sight"),
            ("estimates", "chases"),
        ):
            self._stage.raise_to(folder, self._layout.level(layer))
        self._frames = _frames(self._layout, self._cameras)
        for i, (left, bottom, side) in enumerate(self._frames):
            title = f"pursuer {i}'s camera"
            self._stage.mesh(f"frames/{i}/title", text_mesh(title, _LETTER * span), FAINT_INK)
            self._stage.place(f"frames/{i}/title", left, bottom + side + 0.5 * _LETTER * span)
            sheet = shapely.box(left, bottom, left + side, bottom + side)
            self._stage.mesh(f"frames/{i}/sheet", flat_mesh(sheet.buffer(0.004 * span)), PAPER)
        radius = self._layout.robot_radius
        for j, colour in enumerate(self._colours):
            ring = disc_mesh(1.5 * radius, hole=1.2 * radius)
            self._stage.mesh(f"estimates/{j}/ring", ring, colour)
            self._stage.mesh(f"estimates/{j}/dot", disc_mesh(0.2 * radius), colour)

    def _publish(self, context: Context) -> EventStatus:
        time = context.get_time()
        self._stage.begin(time)
        tick = round(time / self._publish_period)
        if tick != self._tick and tick % self._stride == 0:
            for i, port in enumerate(self._images):
                image: Any = port.Eval(context)
                self._show(i, tick, image.data)
        known = read(self._known, context) > 0.5
        if tick != self._tick and tick % self._stride == 0:
            sets = read(self._set, context).reshape(len(known), -1) > 0.5
            for j in np.flatnonzero(known):
                self._tint(int(j), tick, sets[j])
        self._tick = tick
        for j, (x, y) in enumerate(read(self._estimate, context).reshape(-1, 2).tolist()):
            self._stage.show(f"estimates/{j}", bool(known[j]))
            if known[j]:
                self._stage.place(f"estimates/{j}/ring", x, y)
                self._stage.place(f"estimates/{j}/dot", x, y)
        self._drawn = True
        return EventStatus.Succeeded()

    def _show(self, camera: int, tick: int, image: np.ndarray) -> None:
        """Put a picture in its frame: a new path for each in a recording."""
        left, bottom, side = self._frames[camera]
        path = f"views/{camera}/{tick if self._recording else 0}"
        square = picture_square(mirror_square(image, self._camera), side, pixels=_PIXELS)
        self.meshcat.SetObject(f"{ROOT}/{path}/square", square, Rgba(1, 1, 1, 1))
        before = self._shown[camera]
        if before is not None and before != path:
            self._stage.show(before, False)
        if before != path:
            self._stage.place(f"{path}/square", left + 0.5 * side, bottom + 0.5 * side)
            self._stage.show(path, True)
        self._shown[camera] = path

    def _tint(self, evader: int, tick: int, cells: np.ndarray) -> None:
        """Show where an evader may be: a new path for each change in a recording."""
        before = self._tinted[evader]
        if before is not None and before[1] == cells.tobytes():
            return
        path = f"sets/{evader}/{tick if self._recording else 0}"
        shape = cells_shape(self._grid, cells)
        if cells.any():
            colour = self._colours[evader]
            tint = Rgba(colour.r(), colour.g(), colour.b(), _TINT)
            self._stage.mesh(f"{path}/cells", flat_mesh(shape), tint)
        if before is not None and before[0] != path:
            self._stage.show(before[0], False)
        self._stage.show(path, True)
        self._tinted[evader] = (path, cells.tobytes())


def cells_shape(grid: PlaceGrid, cells: np.ndarray) -> shapely.Geometry:
    """The union of cells of a grid.

    Args:
        grid: Whose.
        cells: Which, shape (cells,), bool.
    """
    row, column = np.divmod(np.flatnonzero(cells), grid.columns)
    left, low = grid.corner[0] + column * grid.cell, grid.corner[1] + row * grid.cell
    return shapely.union_all(shapely.box(left, low, left + grid.cell, low + grid.cell))


def mirror_square(image: np.ndarray, camera: OmniCamera) -> np.ndarray:
    """The part of a picture around the mirror, red, green, blue, shape (n, n, 3); black beyond.

    Args:
        image: The picture, shape (height, width, 3 or 4).
        camera: Which took it.
    """
    half = int(np.ceil(camera.rim_radius)) + 3
    column, row = np.rint(camera.axis_pixel).astype(int)
    square = np.zeros((2 * half, 2 * half, 3), dtype=np.uint8)
    top, left = max(row - half, 0), max(column - half, 0)
    part = image[top : row + half, left : column + half, :3]
    at_row, at_column = top - (row - half), left - (column - half)
    square[at_row : at_row + part.shape[0], at_column : at_column + part.shape[1]] = part
    return square


def _frames(layout: Layout, count: int) -> list[tuple[float, float, float]]:
    """Left, bottom and side of the squares in the strip right of the map, from the top down."""
    span = layout.span
    _, south, east, north = layout.map_bounds
    left = east + layout.wall + _GAP * span
    title = 2.2 * _LETTER * span
    room = (north - south) / count - title - _GAP * span
    side = min((_STRIP - 2 * _GAP) * span, room)
    # Below Meshcat's bar of controls, which lies over the top of the page.
    pitch = side + title + _GAP * span
    return [(left, north - title - side - k * pitch, side) for k in range(count)]
