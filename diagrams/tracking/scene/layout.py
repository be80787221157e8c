"""Where the map, the panel beside it and the camera are, and the colours of the tracking scene."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from pydrake.geometry import Meshcat

from ...visuals.lighting import paint, set_lights

# Shares of the height of the view.
_MARGIN = 0.035
_PANEL_WIDTH = 0.46
# Meshcat's own controls unfold over the right edge of the page: 245 pixels, here of 720.
_CONTROLS_WIDTH = 0.345
_ASPECT = 16 / 9
# Thickness of the wall drawn around a world.
_WALL = 0.012
# The camera leans back a little, so that obstacles and robots show that they have a height [rad].
_TILT = 0.24


@dataclass(frozen=True)
class Layout:
    """Places and sizes of the parts of the scene, all in the world's frame and unit [m].

    Attributes:
        span: Height of the view; the scale of widths, letters and markers.
        map_bounds: [x_min, y_min, x_max, y_max] of the world.
        panel_bounds: The same of the panel, left of the map.
        robot_radius: Radius at which robots are drawn: their own, or the least legible one
            [m].
    """

    span: float
    map_bounds: tuple[float, float, float, float]
    panel_bounds: tuple[float, float, float, float]
    robot_radius: float

    @property
    def line(self) -> float:
        """Width of a thin line: finer where robots are small and many lines meet."""
        return min(max(0.12 * self.robot_radius, 0.0018 * self.span), 0.0032 * self.span)

    @property
    def wall(self) -> float:
        """Thickness of the wall around the map."""
        return _WALL * self.span

    @property
    def obstacle_height(self) -> float:
        """Height of obstacles: low, for the camera sees little behind them."""
        return 0.4 * self.robot_radius

    @property
    def robot_height(self) -> float:
        """Height of robots: the highest of all, so that lines end under them."""
        return 0.5 * self.robot_radius

    def level(self, layer: str) -> float:
        """Height of a layer; the order of the layers decides what covers what."""
        if layer in _ABOVE:
            return self.obstacle_height + 0.0004 * self.span * (1 + _ABOVE.index(layer))
        return 0.0006 * self.span * _FLOOR.index(layer)


# What lies on the floor, from below; and above the obstacles, where lines that graze one are not
# hidden by it.
_FLOOR = ("paper", "polygon", "losing", "field", "trails", "boundaries", "ink")
_ABOVE = ("sight", "chases")


def make_layout(world_bounds: Iterable[float], robot_radius: float) -> Layout:
    """Put the panel left of a world and choose the scale of the view.

    Args:
        world_bounds: x_min, y_min, x_max, y_max [m].
        robot_radius: The robots' own [m].
    """
    x_min, y_min, x_max, y_max = (float(value) for value in world_bounds)
    width, height = x_max - x_min, y_max - y_min
    room = _ASPECT - _PANEL_WIDTH - _CONTROLS_WIDTH - 2 * _MARGIN - 2 * _WALL
    span = max(height / (1 - 2 * _MARGIN - 2 * _WALL), width / room)
    right = x_min - (_MARGIN + _WALL) * span
    # The panel is as high as the walls, and high enough for its contents where the map is flat.
    middle, half = 0.5 * (y_min + y_max), max(0.5 * height + _WALL * span, 0.4 * span)
    return Layout(
        span=span,
        map_bounds=(x_min, y_min, x_max, y_max),
        panel_bounds=(right - _PANEL_WIDTH * span, middle - half, right, middle + half),
        robot_radius=max(robot_radius, 0.011 * span),
    )


def set_camera(meshcat: Meshcat, layout: Layout) -> None:
    """Look down on the map and its panel through an orthographic camera, in plain daylight.

    Meshcat keeps the left edge of such a view and lets the page's width decide the right one, so
    the panel and the map keep their places and a wide page has room for Meshcat's controls.
    """
    span = layout.span
    left = layout.panel_bounds[0] - _MARGIN * span
    centre = np.array([left + 0.5 * _ASPECT * span, 0.5 * sum(layout.map_bounds[1::2]), 0.0])
    meshcat.SetCamera(
        Meshcat.OrthographicCamera(
            left=-0.5 * _ASPECT * span,
            right=0.5 * _ASPECT * span,
            bottom=-0.5 * span,
            top=0.5 * span,
            near=0.01 * span,
            far=8.0 * span,
        )
    )
    camera = centre + 4.0 * span * np.array([0.0, -np.sin(_TILT), np.cos(_TILT)])
    # Drake's stubs put the dtype of an array where its shape belongs.
    meshcat.SetCameraPose(camera, centre)  # pyright: ignore[reportArgumentType]
    for part in ("/Grid", "/Axes"):
        meshcat.SetProperty(part, "visible", False)
    for colour in ("top_color", "bottom_color"):
        meshcat.SetProperty("/Background/<object>", colour, BACKGROUND)
    set_lights(meshcat)


# Meshcat's background is shown as it is, without light.
BACKGROUND = [0.914, 0.925, 0.941]
PAPER = paint(0.985, 0.985, 0.985)
INK = paint(0.11, 0.13, 0.17)
FAINT_INK = paint(0.40, 0.44, 0.50)

OBSTACLE = paint(0.30, 0.66, 0.37)
GROWN_BOUNDARY = paint(0.95, 0.55, 0.13)

PURSUER = paint(0.13, 0.37, 0.80)
PURSUER_NOSE = paint(0.06, 0.20, 0.50)
EVADER = paint(0.85, 0.18, 0.20)
EVADER_NOSE = paint(0.52, 0.06, 0.09)
CHOSEN = paint(0.96, 0.74, 0.25)

LINE_OF_SIGHT = paint(0.06, 0.06, 0.08)
CHASE = paint(0.58, 0.22, 0.84)
POLYGON = paint(0.98, 0.86, 0.42, 0.45)
# Where an evader is lost some day: within 2 s, within 5 s, later.
LOSING = (
    paint(0.84, 0.13, 0.16, 0.60),
    paint(0.95, 0.45, 0.13, 0.50),
    paint(0.62, 0.36, 0.74, 0.40),
)
FIELD = paint(0.05, 0.52, 0.58)

IN_SIGHT = paint(0.16, 0.60, 0.30)
LOST = paint(0.80, 0.13, 0.15)
