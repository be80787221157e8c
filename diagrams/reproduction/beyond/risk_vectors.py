"""How far each risk vector is from what the corner game promises."""

import numpy as np

from ....systems.numerics.geometry.edge_index import build_edge_index
from ....systems.numerics.statistics.estimate import share
from ....systems.numerics.statistics.paired import paired_difference
from ....systems.numerics.tracking.corner_study.polygon_bound import least_escape_time
from ....systems.numerics.tracking.corner_table import corner_table
from ....systems.numerics.tracking.risk import RISK_VECTORS
from ...studies.records import StudyResult
from ...studies.tracking_study import cell_name, tracking_study
from ...tracking.game import set_up_game
from ..evidence import SHOWN, Evidence, Exhibit, Finding, Table, Workshop
from ..played import played

RUNS, QUICK_RUNS = 1000, 30
# Time of escape that is none [s].
AT_ONCE = 0.1


def _make(workshop: Workshop) -> Evidence:
    runs = workshop.runs_of(RUNS, QUICK_RUNS)
    result = played(workshop, tracking_study(runs=runs, sizes=(1,), vectors=tuple(RISK_VECTORS)))
    bounds = promised_times(result)
    # At once, on the sight ray, there is nothing to keep.
    lost, held_at_all = np.isfinite(bounds) & (bounds > AT_ONCE), np.isinf(bounds)
    rows, kept = [], {}
    for vector in RISK_VECTORS:
        times = result.times(cell_name(1, 1, vector))
        kept[vector] = np.minimum(times[lost] / bounds[lost], 1.0)
        held = ~result.lost(cell_name(1, 1, vector))[held_at_all]
        found = share(int(held.sum()), len(held))
        rows.append(
            (
                vector,
                f"{kept[vector].mean():.3f}",
                f"{np.mean(times[lost] > bounds[lost] * 1.01):.0%}",
                f"{found.value:.0%} [{found.low:.0%}, {found.high:.0%}]",
            )
        )
    best = max(("least_margin", "urgency"), key=lambda name: kept[name].mean())
    compared = [
        (name, paired_difference(kept[best], kept[name]))
        for name in ("uniform", "majority", "proportional")
    ]
    return Evidence(
        (),
        (
            Finding(
                f"`{best}`, made of the game's own margins, against the thesis's vectors",
                "",
                "Share of T* kept, paired: "
                + "; ".join(
                    f"{d.mean:+.3f} [{d.low:+.3f}, {d.high:+.3f}] against {name}"
                    for name, d in compared
                )
                + ".",
                SHOWN,
            ),
        ),
        (
            Table(
                f"One pursuer, one evader, {runs} runs: {lost.sum()} in which the evader wins at "
                f"some corner, and {held_at_all.sum()} in which each corner alone can be held",
                (
                    "risk vector",
                    "share of the least T* kept",
                    "sight held longer than T*",
                    "sight held to the horizon where each corner can be",
                ),
                tuple(rows),
            ),
        ),
    )


def promised_times(result: StudyResult) -> np.ndarray:
    """The least T* of any corner at the start of each run of one against one, shape (runs,) [s]."""
    study = result.study
    found = []
    for run in range(study.runs):
        scenario = study.scenario(study.cells[0], run)
        game = set_up_game(scenario)
        found.append(
            least_escape_time(
                build_edge_index(game.world),
                corner_table(game.world),
                game.pursuer_starts[0, :2],
                game.evader_starts[0, :2],
                scenario.speed_ratio,
                scenario.pursuers.top_speed,
            )
        )
    return np.array(found)


RISK_VECTOR_GAPS = Exhibit(
    id="beyond-risk-vectors",
    covers=(),
    title="Risk vectors and the optimum of the corner game",
    states="The thesis weighs corners by the evader's distance alone. The corner game knows more: "
    "which corners are lost, and how soon (T*), and by which margin M1 the others can be held. "
    "Edges are taken as infinite there, so that T* is no strict bound among polygons.",
    command="sightfield track thesis_3v4 --set 'pursuers.risk_vectors=[urgency]'",
    make=_make,
)
