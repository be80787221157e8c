"""The panel beside the map: the clock, the state of the game, who sees whom, and a legend."""

import numpy as np
import shapely

from ...visuals.digits import Digits
from ...visuals.meshes import flat_mesh
from ...visuals.stage import Stage
from ...visuals.text import advance, text_mesh
from .layout import Layout
from .legend import draw_legend
from .palette import EVADER, FAINT_INK, IN_SIGHT, INK, LOST, PAPER, PURSUER
from .sight_graph import SightGraph

# Heights of letters and places of rows below the panel's top, relative to the view's height.
_PAD = 0.025
_LETTER = 0.019
_CLOCK_ROW, _CLOCK_LETTER = 0.070, 0.044
_COUNT_ROW = 0.122
_GAP_ROW = 0.153
_CERTIFICATE_ROW = 0.184
_BANNER_ROW, _BANNER_HEIGHT = 0.223, 0.046
_HEADING_ROW = 0.275
# What follows a row more moves down by this.
_MORE = 0.031
_LEGEND_HEIGHT = 0.155


class Panel:
    """Shows at a glance what the map shows in place.

    The clock's digits are at `clock/PLACE/DIGIT`, the number of evaders in sight at
    `in_sight/PLACE/DIGIT`, the least gap between two bodies at `gap/PLACE/DIGIT`; of
    `state/in_sight` and `state/lost` one is visible.

    Args:
        stage: Where to draw.
        layout: Sizes.
        pursuers, evaders: How many.
        certificate: What the row of the certificate begins with; None for no such row. Its
            digits are at `certificate/digits/PLACE/DIGIT`; of `certificate/digits` and
            `certificate/ever` one is visible.
    """

    def __init__(
        self,
        stage: Stage,
        layout: Layout,
        *,
        pursuers: int,
        evaders: int,
        certificate: str | None = None,
    ) -> None:
        self._stage = stage
        span = layout.span
        self._left, bottom, self._right, self._top = layout.panel_bounds
        self._pad, self._letter = _PAD * span, _LETTER * span
        self._span = span
        sheet = shapely.box(self._left, bottom, self._right, self._top)
        stage.mesh("panel/sheet", flat_mesh(sheet), PAPER)
        for folder in ("panel", "clock", "in_sight", "gap", "certificate", "state", "legend"):
            stage.raise_to(folder, layout.level("ink"))
        stage.raise_to("panel/sheet", -layout.level("ink"))
        self._clock = self._draw_clock()
        self._count = self._draw_count(evaders)
        self._gap = self._draw_gap()
        self._certificate = None if certificate is None else self._draw_certificate(certificate)
        self._more = 0.0 if certificate is None else _MORE
        self._draw_banner("in_sight", "ALL EVADERS IN SIGHT" if evaders > 1 else "EVADER IN SIGHT")
        self._draw_banner("lost", "EVADER OUT OF SIGHT")
        heading = self._row(_HEADING_ROW + self._more)
        width = advance("evaders") * self._letter
        self._write("panel/pursuers", "pursuers", self._left + self._pad, heading, PURSUER)
        self._write("panel/evaders", "evaders", self._right - self._pad - width, heading, EVADER)
        legend_top = bottom + _LEGEND_HEIGHT * span
        self._graph = SightGraph(
            stage,
            layout,
            (
                self._left + self._pad,
                legend_top + 0.5 * self._pad,
                self._right - self._pad,
                heading - 0.5 * self._pad,
            ),
            pursuers=pursuers,
            evaders=evaders,
        )
        draw_legend(
            stage,
            layout,
            (self._left + self._pad, bottom + 0.8 * self._pad, self._right - 0.5 * self._pad),
            legend_top,
            losing=certificate is not None,
        )

    def update(
        self,
        time: float,
        visibility: np.ndarray,
        assignment: np.ndarray,
        gap: float,
        certificate: float | None = None,
    ) -> None:
        """Show the state of the game.

        Args:
            time: [s].
            visibility: True where pursuer i sees evader j, shape (Np, Ne).
            assignment: The evader that each pursuer chases, or -1, shape (Np,).
            gap: Least gap between two bodies [m]; shown as zero where they overlap.
            certificate: For how long all evaders can be kept [s]; infinite for ever.
        """
        in_sight = visibility.any(axis=0)
        self._clock.show(time)
        self._count.show(int(in_sight.sum()))
        self._gap.show(max(gap, 0.0))
        if self._certificate is not None and certificate is not None:
            ever = np.isinf(certificate)
            if not ever:
                self._certificate.show(certificate)
            self._stage.show("certificate/digits", not ever)
            self._stage.show("certificate/ever", bool(ever))
        self._stage.show("state/in_sight", bool(in_sight.all()))
        self._stage.show("state/lost", not in_sight.all())
        self._graph.update(visibility, assignment)

    def _draw_clock(self) -> Digits:
        height = _CLOCK_LETTER * self._span
        row = self._row(_CLOCK_ROW)
        unit = self._right - self._pad - advance("s") * self._letter
        self._write("panel/time", "time", self._left + self._pad, row, FAINT_INK)
        self._write("panel/seconds", "s", unit, row, FAINT_INK)
        clock = Digits(self._stage, "clock/digits", height, INK, places=5, decimals=1)
        self._stage.place("clock/digits", unit - 0.4 * self._letter - clock.width, row)
        return clock

    def _draw_count(self, evaders: int) -> Digits:
        row = self._row(_COUNT_ROW)
        total = f"of {evaders}"
        right = self._right - self._pad - advance(total) * self._letter
        self._write("panel/count", "evaders in sight", self._left + self._pad, row, FAINT_INK)
        self._write("panel/total", total, right, row, FAINT_INK)
        count = Digits(self._stage, "in_sight/digits", 1.15 * self._letter, INK, places=2)
        self._stage.place("in_sight/digits", right - 0.5 * self._letter - count.width, row)
        return count

    def _draw_gap(self) -> Digits:
        row = self._row(_GAP_ROW)
        unit = self._right - self._pad - advance("m") * self._letter
        self._write("panel/gap", "least gap of robots", self._left + self._pad, row, FAINT_INK)
        self._write("panel/metres", "m", unit, row, FAINT_INK)
        gap = Digits(self._stage, "gap/digits", self._letter, INK, places=4, decimals=2)
        self._stage.place("gap/digits", unit - 0.4 * self._letter - gap.width, row)
        return gap

    def _draw_certificate(self, words: str) -> Digits:
        row = self._row(_CERTIFICATE_ROW)
        unit = self._right - self._pad - advance("s") * self._letter
        self._write("panel/certificate", words, self._left + self._pad, row, FAINT_INK)
        path = "certificate/digits"
        digits = Digits(self._stage, path, self._letter, INK, places=4, decimals=1)
        self._stage.mesh(f"{path}/unit", text_mesh("s", self._letter), FAINT_INK)
        start = unit - 0.4 * self._letter - digits.width
        self._stage.place(f"{path}/unit", unit - start, 0.0)
        self._stage.place(path, start, row)
        ever = "for ever"
        self._stage.mesh("certificate/ever", text_mesh(ever, self._letter, bold=True), INK)
        width = advance(ever, bold=True) * self._letter
        self._stage.place("certificate/ever", self._right - self._pad - width, row)
        return digits

    def _draw_banner(self, state: str, words: str) -> None:
        height = _BANNER_HEIGHT * self._span
        left, right, row = (
            self._left + self._pad,
            self._right - self._pad,
            self._row(_BANNER_ROW + self._more),
        )
        core = shapely.box(left, row, right, row + height).buffer(-0.25 * height)
        colour = IN_SIGHT if state == "in_sight" else LOST
        self._stage.mesh(
            f"state/{state}/pill", flat_mesh(core.buffer(0.25 * height, quad_segs=6)), colour
        )
        self._stage.raise_to(f"state/{state}/pill", -0.0003 * self._span)
        words_path = f"state/{state}/words"
        self._stage.mesh(
            words_path, text_mesh(words, self._letter, bold=True, align="centre"), PAPER
        )
        self._stage.place(words_path, 0.5 * (left + right), row + 0.5 * height)

    def _row(self, share: float) -> float:
        return self._top - share * self._span

    def _write(self, path: str, words: str, x: float, y: float, colour=INK) -> None:
        self._stage.mesh(path, text_mesh(words, self._letter), colour)
        self._stage.place(path, x, y)
