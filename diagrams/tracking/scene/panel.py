"""The panel beside the map: the clock, the state of the game, who sees whom, and a legend."""

from math import ceil

import numpy as np
import shapely

from ...visuals.meshes import Mesh, arrow_mesh, bar_mesh, disc_mesh, flat_mesh, line_mesh
from ...visuals.stage import Stage
from ...visuals.text import Digits, advance, text_mesh
from .floor_layers import BANDS
from .layout import (
    CHASE,
    EVADER,
    FAINT_INK,
    FIELD,
    GROWN_BOUNDARY,
    IN_SIGHT,
    INK,
    LINE_OF_SIGHT,
    LOSING,
    LOST,
    OBSTACLE,
    PAPER,
    POLYGON,
    PURSUER,
    Layout,
)
from .robots import draw_ghost, numeral

# Height of a letter, relative to the view's height.
_LEGEND_LETTER = 0.0145


def draw_legend(
    stage: Stage,
    layout: Layout,
    corner: tuple[float, float, float],
    top: float,
    *,
    losing: bool = False,
) -> None:
    """Draw samples with their names, in two columns.

    Args:
        stage: Where to draw.
        layout: Sizes.
        corner: Left edge, bottom and right edge [m].
        top: Top [m].
        losing: Name the places where an evader is lost, too.
    """
    left, bottom, right = corner
    size = _LEGEND_LETTER * layout.span
    width = 2.2 * size
    patch = shapely.box(0.0, -0.6 * size, width, 0.6 * size)
    outline = line_mesh([shapely.get_coordinates(patch)], 1.3 * layout.line)
    arrow = arrow_mesh(np.array([[0.5 * width, 0.0]]), np.array([[1.0, 0.0]]), width)
    samples = [
        ("line of sight", _stroke(width, layout.line), LINE_OF_SIGHT),
        ("chase", _stroke(width, 2.6 * layout.line), CHASE),
        ("obstacle", flat_mesh(patch), OBSTACLE),
        ("grown boundary", outline, GROWN_BOUNDARY),
        ("visible area", flat_mesh(patch), POLYGON),
        ("pursuit field", arrow, FIELD),
    ]
    if losing:
        words = [*(f"lost within {time:g} s" for time in BANDS), "lost later"]
        samples += [
            (each, flat_mesh(patch), colour) for each, colour in zip(words, LOSING, strict=True)
        ]
    step = (top - bottom) / ceil(len(samples) / 2)
    for k, (words, mesh, colour) in enumerate(samples):
        x = left if k % 2 == 0 else left + 0.48 * (right - left)
        y = top - (k // 2 + 0.5) * step
        stage.mesh(f"legend/{k}/sample", mesh, colour)
        stage.mesh(f"legend/{k}/words", text_mesh(words, size), INK)
        stage.place(f"legend/{k}/words", width + 0.7 * size, -0.5 * size)
        stage.place(f"legend/{k}", x, y)


def _stroke(width: float, thickness: float) -> Mesh:
    return bar_mesh(np.array([[0.0, 0.0]]), np.array([[width, 0.0]]), thickness)


class SightGraph:
    """Draws the bipartite graph of who sees whom (black) and who chases whom (purple).

    Numbers of pursuers are on the left, of evaders on the right.
    Edges are at `graph/sight/I_J` and `graph/chases/I_J`, made when first needed.
    """

    def __init__(
        self,
        stage: Stage,
        layout: Layout,
        bounds: tuple[float, float, float, float],
        *,
        pursuers: int,
        evaders: int,
    ) -> None:
        """Fit the graph into bounds [x_min, y_min, x_max, y_max] [m]."""
        self._stage = stage
        self._line = layout.line
        self._shown: dict[str, set[tuple[int, int]]] = {"sight": set(), "chases": set()}
        self._made: set[str] = set()
        x_min, y_min, x_max, y_max = bounds
        row = (y_max - y_min) / max(pursuers, evaders)
        row = min(row, 0.085 * layout.span)
        self._radius = min(0.021 * layout.span, 0.42 * row)
        inset = 1.2 * self._radius
        self._nodes = {
            "pursuers": _column(x_min + inset, y_min, y_max, row, pursuers),
            "evaders": _column(x_max - inset, y_min, y_max, row, evaders),
        }
        for k, folder in enumerate(("sight", "chases", "nodes", "numerals", "ghosts")):
            stage.raise_to(f"graph/{folder}", layout.level("ink") + 0.0006 * k * layout.span)
        for team, colour in (("pursuers", PURSUER), ("evaders", EVADER)):
            for k, (x, y) in enumerate(self._nodes[team].tolist()):
                for folder, mesh, paint in (
                    ("nodes", disc_mesh(self._radius), colour),
                    ("numerals", numeral(k, self._radius), PAPER),
                ):
                    stage.mesh(f"graph/{folder}/{team}/{k}", mesh, paint)
                    stage.place(f"graph/{folder}/{team}/{k}", x, y)
        for k, (x, y) in enumerate(self._nodes["evaders"].tolist()):
            draw_ghost(stage, f"graph/ghosts/{k}", k, self._radius, EVADER)
            stage.place(f"graph/ghosts/{k}", x, y)

    def update(self, visibility: np.ndarray, assignment: np.ndarray) -> None:
        """Show the edges of a visibility matrix, shape (Np, Ne), and an assignment, (Np,)."""
        seeing, seen = np.nonzero(visibility)
        self._show("sight", set(zip(seeing.tolist(), seen.tolist(), strict=True)))
        self._show("chases", {(i, j) for i, j in enumerate(assignment.tolist()) if j >= 0})
        for j, in_sight in enumerate(np.any(visibility, axis=0)):
            self._stage.show(f"graph/ghosts/{j}", not bool(in_sight))

    def _show(self, kind: str, edges: set[tuple[int, int]]) -> None:
        for i, j in self._shown[kind] - edges:
            self._stage.show(f"graph/{kind}/{i}_{j}", False)
        for i, j in edges - self._shown[kind]:
            path = f"graph/{kind}/{i}_{j}"
            if path not in self._made:
                self._made.add(path)
                ends = self._nodes["pursuers"][i : i + 1], self._nodes["evaders"][j : j + 1]
                if kind == "chases":
                    self._stage.mesh(path, bar_mesh(*ends, 2.4 * self._line), CHASE)
                else:
                    self._stage.mesh(path, bar_mesh(*ends, 0.8 * self._line), LINE_OF_SIGHT)
            self._stage.show(path, True)
        self._shown[kind] = edges


def _column(x: float, y_min: float, y_max: float, row: float, count: int) -> np.ndarray:
    """Places of a column of nodes, from the top down about the middle, shape (count, 2)."""
    middle = 0.5 * (y_min + y_max)
    y = middle + row * (0.5 * (count - 1) - np.arange(count))
    return np.column_stack([np.full(count, x), y])


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
            certificate: For how long all evaders can be kept [s]; infinite if for ever.
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
