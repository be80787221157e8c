"""How far each risk vector is from what the corner game promises."""

import numpy as np

from ....systems.numerics.geometry.edge_index import build_edge_index
from ....systems.numerics.statistics import paired_difference, share
from ....systems.numerics.tracking.corner_game import corner_table
from ....systems.numerics.tracking.corner_study.polygon_bound import least_escape_time
from ....systems.numerics.tracking.risk import RISK_VECTORS
from ...studies.opponents import cell_name
from ...studies.records import StudyResult
from ...studies.report import draw_matrix
from ...studies.team_studies import tracking_grid, tracking_study
from ...tracking.game import set_up_game
from ..evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Table, Workshop
from ..played import played

RUNS = {"adversarial": 1000, "best_response": 300}
QUICK_RUNS = {"adversarial": 30, "best_response": 8}
# Time of escape that is none [s].
AT_ONCE = 0.1
GAME, THESIS = "urgency", ("uniform", "majority", "proportional")


def _make(workshop: Workshop) -> Evidence:
    runs = workshop.runs_against(RUNS, QUICK_RUNS)
    study = tracking_study(
        sizes=(1,), vectors=tuple(RISK_VECTORS), opponents=tuple(runs), opponent_runs=runs
    )
    result = played(workshop, study)
    file = workshop.pictures / "beyond_risk_vectors.png"
    draw_matrix(result, tracking_grid(study)).savefig(file, dpi=110)
    bounds = promised_times(result)
    return Evidence(
        (Picture(file, "Restricted means of the tracking time, risk vectors against evaders."),),
        tuple(_finding(result, opponent) for opponent in runs),
        tuple(_table(result, opponent, bounds[:number]) for opponent, number in runs.items()),
    )


def _finding(result: StudyResult, opponent: str) -> Finding:
    """How much longer the game's own vector keeps an evader."""

    def times(vector: str) -> np.ndarray:
        return result.times(cell_name(1, 1, vector, opponent))

    compared = [(name, paired_difference(times(GAME), times(name))) for name in THESIS]
    return Finding(
        f"`{GAME}`, made of the game's own margins, less the thesis's vectors, against {opponent}",
        "",
        "Restricted means, run by run: "
        + "; ".join(
            f"{d.mean:+.1f} s [{d.low:+.1f}, {d.high:+.1f}] against {name}" for name, d in compared
        )
        + ".",
        SHOWN,
    )


def _table(result: StudyResult, opponent: str, bounds: np.ndarray) -> Table:
    """What each vector keeps of what the game promises; `bounds` [s] of the opponent's runs."""
    # At once, on the sight ray, there is nothing to keep.
    lost, kept_alone = np.isfinite(bounds) & (bounds > AT_ONCE), np.isinf(bounds)
    rows = tuple(
        (vector, *_row(result.times(cell), result.lost(cell), bounds, lost, kept_alone))
        for vector in RISK_VECTORS
        for cell in [cell_name(1, 1, vector, opponent)]
    )
    return Table(
        f"One pursuer, one evader, {opponent}, {len(bounds)} runs: {lost.sum()} in which the "
        f"evader wins at some corner, {kept_alone.sum()} in which each corner alone can be held",
        (
            "risk vector",
            "share of the least T* kept",
            "sight held longer than T*",
            "sight held to the horizon where each corner can be",
        ),
        rows,
    )


def _row(
    times: np.ndarray,
    lost_times: np.ndarray,
    bounds: np.ndarray,
    lost: np.ndarray,
    kept_alone: np.ndarray,
) -> tuple[str, str, str]:
    """Share of T* kept, how often more, and how often sight was kept where each corner can be."""
    share_kept, beyond, held = "-", "-", "-"
    if lost.any():
        parts = times[lost] / bounds[lost]
        share_kept, beyond = f"{np.minimum(parts, 1).mean():.3f}", f"{np.mean(parts > 1.01):.0%}"
    if kept_alone.any():
        found = share(int((~lost_times[kept_alone]).sum()), int(kept_alone.sum()))
        held = f"{found.value:.0%} [{found.low:.0%}, {found.high:.0%}]"
    return share_kept, beyond, held


def promised_times(result: StudyResult) -> np.ndarray:
    """The least T* of any corner at the start of each run of one against one, shape (runs,) [s]."""
    study = result.study
    longest = max(study.cells, key=study.runs_of)
    found = []
    for run in range(study.runs):
        scenario = study.scenario(longest, run)
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
