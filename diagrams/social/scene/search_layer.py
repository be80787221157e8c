"""What the pursuer knows on the map: where it puts the evader, how surely, and its route."""

import numpy as np
import shapely
import shapely.affinity
from shapely.geometry.base import BaseGeometry

from ...tracking.scene.layout import Layout
from ...visuals.keyframes import Keyframes
from ...visuals.meshes import bar_mesh, disc_mesh, flat_mesh, merged
from ...visuals.stage import Stage
from .palette import ESTIMATE, ROUTE, UNCERTAINTY

# How often the route and the ellipse are drawn afresh [s].
_PERIOD = 0.25
# The ellipse holds the evader with 95 % probability, if the errors are Gaussian.
_CHI = np.sqrt(5.991)
# No larger one is drawn [m].
_LARGEST = 3.0


class SearchLayer:
    """Draws the estimate at `estimate/at`, its ellipse at `doubt`, the route at `route`."""

    def __init__(self, stage: Stage, layout: Layout, free: BaseGeometry) -> None:
        self._stage, self._free = stage, free
        self._line = layout.line
        radius = layout.robot_radius
        stage.raise_to("doubt", layout.level("polygon"))
        stage.raise_to("route", layout.level("ink"))
        stage.raise_to("estimate", 1.2 * layout.robot_height + layout.level("chases"))
        stage.mesh("estimate/at/ring", disc_mesh(1.35 * radius, hole=1.15 * radius), ESTIMATE)
        arms = np.array([[-1.35, 0], [1.35, 0], [0, -1.35], [0, 1.35]]) * radius
        gaps = np.array([[-0.9, 0], [0.9, 0], [0, -0.9], [0, 0.9]]) * radius
        stage.mesh("estimate/at/arms", bar_mesh(arms, gaps, 0.12 * radius), ESTIMATE)
        stage.show("estimate", False)
        self._doubt = Keyframes(stage, "doubt", UNCERTAINTY, period=_PERIOD)
        self._route = Keyframes(stage, "route", ROUTE, period=_PERIOD)

    def update(
        self,
        time: float,
        located: bool,
        evader: np.ndarray,
        covariance: np.ndarray,
        route: np.ndarray,
    ) -> None:
        """Show where the evader may be now.

        Args:
            time: Now [s].
            located: Whether it was ever located.
            evader: Its estimated position, shape (2,) [m].
            covariance: Of it now, shape (2, 2) [m^2].
            route: Corners still to be passed, shape (m, 2) [m].
        """
        self._stage.show("estimate", located)
        if not located:
            return
        self._stage.place("estimate/at", *evader.tolist())
        if self._doubt.due(time):
            area = ellipse(evader, covariance).intersection(self._free)
            parts = [each for each in shapely.get_parts(area) if each.geom_type == "Polygon"]
            if parts:
                self._doubt.draw(flat_mesh(shapely.MultiPolygon(parts)))
            else:
                self._doubt.clear()
        if self._route.due(time):
            start, end = route[:-1], route[1:]
            long = np.hypot(*(end - start).T) > 1e-9
            if long.any():
                width = 2.2 * self._line
                bars = bar_mesh(start[long], end[long], width)
                self._route.draw(merged([bars, *_dots(end[long], 1.4 * width)]))
            else:
                self._route.clear()


def ellipse(middle: np.ndarray, covariance: np.ndarray) -> BaseGeometry:
    """Where something is with 95 % probability, given its mean (2,) [m] and covariance (2, 2).

    Args:
        middle: The mean, shape (2,) [m].
        covariance: Shape (2, 2) [m^2].
    """
    values, axes = np.linalg.eigh(covariance)
    half = np.minimum(_CHI * np.sqrt(np.maximum(values, 1e-8)), _LARGEST)
    circle = shapely.Point(0, 0).buffer(1.0, quad_segs=12)
    (a, b), (c, d) = axes * half
    return shapely.affinity.affine_transform(circle, [a, b, c, d, *middle.tolist()])


def _dots(points: np.ndarray, radius: float):
    return [
        flat_mesh(shapely.Point(*point).buffer(radius, quad_segs=3)) for point in points.tolist()
    ]
