"""The panel beside the field: clock, harvested share, tanks, carts, and where the grain is.

A row has who, a bar, how many tonnes, and what it is doing.
"""

from dataclasses import dataclass

import numpy as np
import shapely
from pydrake.geometry import Rgba

from ..tracking.scene.layout import FAINT_INK, INK, PAPER, Layout
from ..visuals.meshes import flat_mesh, unit_bar_mesh
from ..visuals.stage import Stage
from ..visuals.text import Digits, advance, text_mesh
from .colours import (
    CROP,
    EMPTY,
    GRAIN,
    MARGIN_GROUND,
    STUBBLE,
    TRACTOR,
    TRUCK_BED,
    combine_paint,
    crop_paint,
)

# Where things are in a row, in its width: the bar, the end of the digits, the words.
_BAR, _DIGITS, _WORDS = (0.12, 0.40), 0.615, 0.65
_LEAST = 1e-3

# Heights of letters and places of rows below the panel's top, relative to the view's height.
_PAD, _LETTER, _CLOCK_LETTER = 0.025, 0.0175, 0.036
_CLOCK_ROW, _SHARE_ROW, _SHARE_BAR, _FIRST_ROW = 0.066, 0.122, 0.148, 0.205
# Between rows at most, and before a heading, in rows.
_ROW_STEP, _HEADING = 0.042, 1.2
# Rows of grain below the carts: name of the folder, words.
_GRAIN = (("delivered", "delivered to trucks"), ("lost", "lost on the ground"))
_TONNE = 1000.0
# What combines do, in the order of `machines.MODES`.
_MODES = ("not begun", "cutting", "unloading", "full: waits", "waits", "finished")
# Between rows of what the ground's colours mean.
_LEGEND_STEP = 0.034


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


@dataclass(frozen=True, eq=False)
class HarvestMoment:
    """What the panel tells.

    Attributes:
        time: [s].
        share: Of the crop's area that is harvested, in [0, 1].
        tanks: In each combine, shape (N,) [kg].
        tank_fills: In [0, 1], shape (N,).
        modes: Of the combines, numbers in `machines.MODES`, shape (N,).
        loads: In each cart, shape (K,) [kg].
        load_fills: In [0, 1], shape (K,).
        doing: Number of the words for what each cart does: N "to combine", N "at combine", "to the
            truck", "at the truck", "resting"; K of them.
        delivered: To all trucks [kg].
        lost: [kg].
    """

    time: float
    share: float
    tanks: np.ndarray
    tank_fills: np.ndarray
    modes: np.ndarray
    loads: np.ndarray
    load_fills: np.ndarray
    doing: list[int]
    delivered: float
    lost: float


class Panel:
    """Numbers at `numbers/ROW/PLACE/DIGIT`, machines at `tanks/N` and `loads/K` (see `Gauge`)."""

    def __init__(
        self, stage: Stage, layout: Layout, combines: int, carts: int, speed_up: float | None
    ) -> None:
        """Draw what does not change.

        Args:
            stage: Where to draw.
            layout: Sizes.
            combines, carts: How many.
            speed_up: Factor by which a replay is faster than the work; None for a live page.
        """
        self._stage, self._combines = stage, combines
        span = self._span = layout.span
        left, bottom, right, top = layout.panel_bounds
        self._left, self._right, self._top = left + _PAD * span, right - _PAD * span, top
        self._letter = _LETTER * span
        stage.mesh("panel/sheet", flat_mesh(shapely.box(left, bottom, right, top)), PAPER)
        for folder in ("panel", "numbers", "tanks", "loads", "share"):
            stage.raise_to(folder, layout.level("ink"))
        stage.raise_to("panel/sheet", -layout.level("ink"))
        y = top - _CLOCK_ROW * span
        self._clock = self._number("time", "min", y, _CLOCK_LETTER * span, decimals=1, places=4)
        self._write("panel/time", "time", self._left, y)
        if speed_up is not None:
            pace = f"replay: {speed_up:g} times as fast as the work"
            self._write("panel/pace", pace, self._left, y - 1.3 * self._letter, 0.66 * self._letter)
        y = top - _SHARE_ROW * span
        self._share = self._number("share", "%", y, self._letter, decimals=1, places=4)
        self._write("panel/share", "harvested", self._left, y)
        self._draw_share(top - _SHARE_BAR * span)
        rows = combines + carts + len(_GRAIN) + 3 * _HEADING
        step = min(_ROW_STEP * span, (top - _FIRST_ROW * span - bottom - _PAD * span) / rows)
        at = (self._left, self._right - self._left, step)
        y = top - _FIRST_ROW * span
        badges = [(str(n), combine_paint(n)) for n in range(combines)]
        self._tanks, y = self._gauges("tanks", "combines", badges, _MODES, at, y)
        words = (
            *(f"to combine {n}" for n in range(combines)),
            *(f"at combine {n}" for n in range(combines)),
            "to the truck",
            "at the truck",
            "resting",
        )
        badges = [(str(k), TRACTOR) for k in range(carts)]
        self._loads, y = self._gauges("loads", "carts", badges, words, at, y)
        self._write("panel/grain", "grain", self._left, y, bold=True)
        self._grain: dict[str, Digits] = {}
        for name, words_ in _GRAIN:
            y -= step
            self._write(f"panel/{name}", words_, self._left, y)
            self._grain[name] = self._number(name, "t", y, self._letter, decimals=1, places=5)
        if y - bottom > (_PAD + 2 * _LEGEND_STEP + 0.5 * _ROW_STEP) * span:
            self._draw_legend(bottom + (_PAD + _LEGEND_STEP) * span)

    def update(self, moment: HarvestMoment) -> None:
        """Show a moment."""
        self._clock.show(moment.time / 60.0)
        self._share.show(100.0 * moment.share)
        width = self._right - self._left
        self._stage.stretch("share/ink/at/bar", width * max(moment.share, 1e-3))
        for n, gauge in enumerate(self._tanks):
            tonnes = float(moment.tanks[n]) / _TONNE
            gauge.update(float(moment.tank_fills[n]), tonnes, int(moment.modes[n]))
        for k, gauge in enumerate(self._loads):
            load = float(moment.loads[k]) / _TONNE
            gauge.update(float(moment.load_fills[k]), load, moment.doing[k])
        self._grain["delivered"].show(moment.delivered / _TONNE)
        self._grain["lost"].show(moment.lost / _TONNE)

    def _gauges(
        self,
        folder: str,
        heading: str,
        badges: list,
        words: tuple[str, ...],
        at: tuple[float, float, float],
        y: float,
    ) -> tuple[list[Gauge], float]:
        """A heading with a row for each badge, and where the next heading goes."""
        left, width, step = at
        self._write(f"panel/{folder}", heading, left, y, bold=True)
        letter = min(self._letter, 0.5 * step)
        gauges = []
        for k, badge in enumerate(badges):
            y -= step
            row = (left, y, width)
            gauges.append(Gauge(self._stage, f"{folder}/{k}", row, letter, badge, words))
        return gauges, y - _HEADING * step

    def _draw_share(self, y: float) -> None:
        letter = self._letter
        trough = shapely.box(self._left, y - 0.5 * letter, self._right, y + 0.5 * letter)
        self._stage.mesh("share/crop", flat_mesh(trough), CROP)
        self._stage.raise_to("share/ink", 0.05 * letter)
        self._stage.mesh("share/ink/at/bar", unit_bar_mesh(letter), STUBBLE[1])
        self._stage.place("share/ink/at", self._left, y)

    def _draw_legend(self, y: float) -> None:
        """Colours of the ground and of trucks, in two rows from a baseline down.

        Lands have tints, which lie side by side in a patch.
        """
        size = 0.8 * self._letter
        crops = tuple(crop_paint(n) for n in range(self._combines))
        legend = (
            ("crop", crops),
            ("stubble", STUBBLE[: self._combines]),
            ("margin", (MARGIN_GROUND,)),
            ("truck", (TRUCK_BED,)),
        )
        for k, (words, colours) in enumerate(legend):
            x = self._left + (k % 2) * 0.5 * (self._right - self._left)
            row = y - (k // 2) * _LEGEND_STEP * self._span
            wide = 1.8 * size / len(colours)
            part = flat_mesh(shapely.box(0.0, -0.1 * size, wide, 1.1 * size))
            for place, colour in enumerate(colours):
                path = f"panel/legend/{k}/patch/{place}"
                self._stage.mesh(path, part, colour)
                self._stage.place(path, x + place * wide, row)
            self._write(f"panel/legend/{k}/words", words, x + 2.6 * size, row, size)

    def _number(
        self, name: str, unit: str, y: float, letter: float, *, decimals: int, places: int
    ) -> Digits:
        """A number with its unit at the panel's right."""
        right = self._right - advance(unit) * self._letter
        self._write(f"panel/{name}_unit", unit, right, y)
        path = f"numbers/{name}"
        digits = Digits(self._stage, path, letter, INK, places=places, decimals=decimals)
        self._stage.place(path, right - 0.4 * self._letter - digits.width, y)
        return digits

    def _write(
        self,
        path: str,
        words: str,
        x: float,
        y: float,
        letter: float | None = None,
        *,
        bold: bool = False,
    ) -> None:
        mesh = text_mesh(words, letter or self._letter, bold=bold)
        self._stage.mesh(path, mesh, FAINT_INK)
        self._stage.place(path, x, y)
