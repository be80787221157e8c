"""The pursuit field around a chosen pursuer, as arrows on a lattice that stays put."""

from collections.abc import Callable, Sequence

import numpy as np
import shapely

from ....systems.numerics.geometry.world import World
from ...visuals.keyframes import Keyframes
from ...visuals.meshes import arrow_mesh
from ...visuals.stage import Stage
from .layout import Layout
from .palette import FIELD

# How often the arrows are drawn afresh [s].
FIELD_PERIOD = 0.5
# Least and greatest distance between arrows, relative to the view's height; in between, a robot's
# radius. And the radius of the disc that they fill, in such distances.
_SPACING = (0.02, 0.034)
_RADIUS = 6.0

# (pursuer, points (m, 2) [m], evaders (Ne, 2) [m], assignment (Np,)) -> vectors (m, 2).
PursuitField = Callable[[int, np.ndarray, np.ndarray, np.ndarray], np.ndarray]


class FieldLayer:
    """Draws which way a pursuer would go if it were at each point of a lattice around it."""

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
