"""Where a chosen pursuer would lose an evader some day, laid over the floor."""

from collections.abc import Callable

import numpy as np

from ...visuals.keyframes import Keyframes
from ...visuals.meshes import Mesh, mesh_of
from ...visuals.stage import Stage
from .layout import Layout
from .palette import LOSING
from .visibility_layer import NOWHERE

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
