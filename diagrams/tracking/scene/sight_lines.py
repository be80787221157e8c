"""Black lines of sight and purple chases across the map (Zhang 2014, 2.2.8)."""

from math import atan2, hypot

import numpy as np

from ...visuals.meshes import bar_mesh, unit_bar_mesh
from ...visuals.stage import Stage
from .layout import Layout
from .palette import CHASE, LINE_OF_SIGHT


class SightLines:
    """Draws who sees whom and who chases whom, in one of two ways.

    A live page gets all lines of a kind as one mesh, the cheapest message there is. A recording
    holds no shapes, so there each line is a bar of length 1 that is moved, turned and stretched:
    `sight/I_J` and `chases/I_J` from pursuer I to evader J. A chase that goes over to another
    evader is another bar, for a player would let one and the same sweep across.
    """

    def __init__(self, stage: Stage, layout: Layout) -> None:
        self._stage = stage
        self._widths = {"sight": layout.line, "chases": 2.6 * layout.line}
        self._colours = {"sight": LINE_OF_SIGHT, "chases": CHASE}
        # Not a number equals nothing, so the first lines are always drawn.
        self._drawn = {kind: np.full((1, 4), np.nan) for kind in ("sight", "chases")}
        self._shown: dict[str, set[str]] = {"sight": set(), "chases": set()}
        self._made: set[str] = set()
        stage.raise_to("sight", layout.level("sight"))
        stage.raise_to("chases", layout.level("chases"))

    def update(
        self,
        pursuers: np.ndarray,
        evaders: np.ndarray,
        visibility: np.ndarray,
        assignment: np.ndarray,
    ) -> None:
        """Draw the lines between positions.

        Args:
            pursuers: Positions of the pursuers, shape (Np, 2) [m].
            evaders: Positions of the evaders, shape (Ne, 2) [m].
            visibility: True where pursuer i sees evader j, shape (Np, Ne).
            assignment: The evader that each pursuer chases, or -1, shape (Np,).
        """
        seeing, seen = np.nonzero(visibility)
        chasing = np.flatnonzero(assignment >= 0)
        chased = assignment[chasing]
        if self._stage.recording:
            self._move("sight", _names(seeing, seen), pursuers[seeing], evaders[seen])
            self._move("chases", _names(chasing, chased), pursuers[chasing], evaders[chased])
        else:
            self._redraw("sight", pursuers[seeing], evaders[seen])
            self._redraw("chases", pursuers[chasing], evaders[chased])

    def _redraw(self, kind: str, start: np.ndarray, end: np.ndarray) -> None:
        lines = np.hstack([start, end])
        if np.array_equal(lines, self._drawn[kind]):
            return
        self._drawn[kind] = lines
        self._stage.show(kind, len(lines) > 0)
        if len(lines) > 0:
            self._stage.mesh(kind, bar_mesh(start, end, self._widths[kind]), self._colours[kind])

    def _move(self, kind: str, names: list[str], start: np.ndarray, end: np.ndarray) -> None:
        stage = self._stage
        for name in self._shown[kind].difference(names):
            stage.show(f"{kind}/{name}", False)
        self._shown[kind] = set(names)
        for name, (x, y), (dx, dy) in zip(
            names, start.tolist(), (end - start).tolist(), strict=True
        ):
            path = f"{kind}/{name}"
            if path not in self._made:
                self._made.add(path)
                stage.mesh(f"{path}/bar", unit_bar_mesh(self._widths[kind]), self._colours[kind])
            length = hypot(dx, dy)
            stage.pose(path, x, y, atan2(dy, dx), reach=length)
            stage.stretch(f"{path}/bar", length)
            stage.show(path, True)


def _names(pursuers: np.ndarray, evaders: np.ndarray) -> list[str]:
    return [f"{i}_{j}" for i, j in zip(pursuers.tolist(), evaders.tolist(), strict=True)]
