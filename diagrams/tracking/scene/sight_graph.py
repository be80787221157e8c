"""The graph beside the map: pursuers left, evaders right, an edge for a sight or a chase."""

import numpy as np

from ...visuals.meshes import bar_mesh, disc_mesh
from ...visuals.stage import Stage
from .layout import Layout
from .palette import CHASE, EVADER, LINE_OF_SIGHT, PAPER, PURSUER
from .robots import draw_ghost, numeral


class SightGraph:
    """Draws the bipartite graph of who sees whom (black) and who chases whom (purple).

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
