"""The time to go on the floor of the replay: slices that follow a cart, and their key."""

import numpy as np
import shapely
from pydrake.geometry import Rgba

from ...visuals.lighting import paint
from ...visuals.meshes import flat_mesh
from ...visuals.stage import Stage
from ...visuals.text import text_mesh
from .colours import time_colours
from .value_slices import ValueSlice, band_levels, bands


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
        """Show the slice for a moment of the plan [s]."""
        nearest = int(np.abs(self._moments - time).argmin())
        for k in range(len(self._moments)):
            self._stage.show(f"value/{k}", k == nearest)


def _write(stage: Stage, path: str, words: str, letter: float, ink: Rgba) -> None:
    stage.mesh(path, text_mesh(words, letter), ink)
