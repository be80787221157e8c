"""The visibility polygon of a chosen pursuer, laid over the floor."""

from collections.abc import Callable

import numpy as np

from ...visuals.keyframes import Keyframes
from ...visuals.meshes import fan_mesh
from ...visuals.stage import Stage
from .layout import Layout
from .palette import POLYGON

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
