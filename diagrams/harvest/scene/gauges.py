"""Rows of the panel: who, a bar, how many tonnes, and what it is doing."""

import shapely
from pydrake.geometry import Rgba

from ...tracking.scene.layout import FAINT_INK, INK, PAPER
from ...visuals.meshes import flat_mesh, unit_bar_mesh
from ...visuals.stage import Stage
from ...visuals.text import Digits, advance, text_mesh
from .palette import EMPTY, GRAIN

# Where things are in a row, in its width: the bar, the end of the digits, the words.
_BAR, _DIGITS, _WORDS = (0.12, 0.40), 0.615, 0.65
_LEAST = 1e-3


class Gauge:
    """One machine's row at `PATH`: `fill/at/bar`, `digits/PLACE/DIGIT`, `words/K`."""

    def __init__(
        self,
        stage: Stage,
        path: str,
        at: tuple[float, float, float],
        letter: float,
        badge: tuple[str, Rgba],
        words: tuple[str, ...],
    ) -> None:
        """Draw an empty row.

        Args:
            stage: Where to draw.
            path: Of the row.
            at: Left end, baseline and width [m].
            letter: Height of its letters [m].
            badge: Number of the machine and its colour.
            words: What it may be doing.
        """
        self._stage, self._path = stage, path
        left, y, width = at
        name, colour = badge
        stage.place(path, left, y)
        box = shapely.box(0.0, -0.5 * letter, 0.085 * width, 1.5 * letter)
        pill = box.buffer(-0.5 * letter).buffer(0.5 * letter, quad_segs=6)
        stage.mesh(f"{path}/badge", flat_mesh(pill), colour)
        stage.raise_to(f"{path}/ink", 0.05 * letter)
        stage.mesh(f"{path}/ink/name", text_mesh(name, letter, bold=True, align="centre"), PAPER)
        stage.place(f"{path}/ink/name", 0.0425 * width, 0.5 * letter)
        start, end = (share * width for share in _BAR)
        trough = shapely.box(start, -0.15 * letter, end, 1.15 * letter)
        stage.mesh(f"{path}/trough", flat_mesh(trough), EMPTY)
        stage.place(f"{path}/ink/fill", start, 0.5 * letter)
        stage.mesh(f"{path}/ink/fill/bar", unit_bar_mesh(1.3 * letter), GRAIN)
        self._length = end - start
        unit = _DIGITS * width - advance("t") * letter
        stage.mesh(f"{path}/unit", text_mesh("t", letter), FAINT_INK)
        stage.place(f"{path}/unit", unit, 0.0)
        self._digits = Digits(stage, f"{path}/digits", letter, INK, places=4, decimals=1)
        stage.place(f"{path}/digits", unit - 0.3 * letter - self._digits.width, 0.0)
        for k, each in enumerate(words):
            stage.mesh(f"{path}/words/{k}", text_mesh(each, 0.82 * letter), FAINT_INK)
            stage.show(f"{path}/words/{k}", False)
        stage.place(f"{path}/words", _WORDS * width, 0.0)
        self._word: int | None = None

    def update(self, fill: float, tonnes: float, word: int) -> None:
        """Show how full it is, from 0 to 1, what is in it [t], and which of its words holds."""
        bar = self._length * max(min(fill, 1.0), _LEAST)
        self._stage.stretch(f"{self._path}/ink/fill/bar", bar)
        self._digits.show(max(tonnes, 0.0))
        if word != self._word:
            if self._word is not None:
                self._stage.show(f"{self._path}/words/{self._word}", False)
            self._stage.show(f"{self._path}/words/{word}", True)
            self._word = word
