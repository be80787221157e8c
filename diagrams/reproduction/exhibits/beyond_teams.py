"""Beyond the thesis: what studies of teams tell of risk vectors, rank aggregations and radios."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ....systems.numerics.geometry.edge_index import build_edge_index
from ....systems.numerics.geometry.random_arena import Arena
from ....systems.numerics.statistics import holm, paired_difference, share
from ....systems.numerics.tracking.assignment.voting import AGGREGATIONS
from ....systems.numerics.tracking.corner_game import corner_table, least_escape_time
from ....systems.numerics.tracking.risk import RISK_FUNCTIONS, RISK_VECTORS
from ...studies.opponents import Match, cell_name, match_cell, runs_against
from ...studies.records import StudyResult
from ...studies.report import draw_matrix, draw_means
from ...studies.study import Study
from ...studies.summary import StudyGrid, StudyPanel, matrix_of
from ...studies.team_studies import (
    PURSUERS,
    assignment_study,
    thesis_base,
    tracking_grid,
    tracking_study,
)
from ...tracking.game import set_up_game
from .evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Table, Workshop, played

RISK_RUNS = {"adversarial": 1000, "best_response": 300}
QUICK_RISK_RUNS = {"adversarial": 30, "best_response": 8}
# Time of escape that is none [s].
AT_ONCE = 0.1
GAME, THESIS = "urgency", ("uniform", "majority", "proportional")


def _risk_vectors(workshop: Workshop) -> Evidence:
    runs = workshop.runs_against(RISK_RUNS, QUICK_RISK_RUNS)
    study = tracking_study(
        sizes=(1,), vectors=tuple(RISK_VECTORS), opponents=tuple(runs), opponent_runs=runs
    )
    result = played(workshop, study)
    file = workshop.pictures / "beyond_risk_vectors.png"
    draw_matrix(result, tracking_grid(study)).savefig(file, dpi=110)
    bounds = promised_times(result)
    return Evidence(
        (Picture(file, "Restricted means of the tracking time, risk vectors against evaders."),),
        tuple(_longer_kept(result, opponent) for opponent in runs),
        tuple(
            _kept_of_promised(result, opponent, bounds[:number])
            for opponent, number in runs.items()
        ),
    )


def _longer_kept(result: StudyResult, opponent: str) -> Finding:
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


def _kept_of_promised(result: StudyResult, opponent: str, bounds: np.ndarray) -> Table:
    """What each vector keeps of what the game promises; `bounds` [s] of the opponent's runs."""
    # At once, on the sight ray, there is nothing to keep.
    lost, kept_alone = np.isfinite(bounds) & (bounds > AT_ONCE), np.isinf(bounds)
    rows = tuple(
        (vector, *_kept_by_vector(result.times(cell), result.lost(cell), bounds, lost, kept_alone))
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


def _kept_by_vector(
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
    make=_risk_vectors,
)


AGGREGATION_RUNS = {"adversarial": 500, "best_response": 60}
QUICK_AGGREGATION_RUNS = {"adversarial": 6, "best_response": 2}
SIZES, QUICK_SIZES = (2, 3, 4), (2, 4)
SENSES = ("min", "max")
RULES = tuple(f"{name}_{sense}" for sense in SENSES for name in AGGREGATIONS)


def _aggregations(workshop: Workshop) -> Evidence:
    runs = workshop.runs_against(AGGREGATION_RUNS, QUICK_AGGREGATION_RUNS)
    sizes = QUICK_SIZES if workshop.quick else SIZES
    study = assignment_study(rules=RULES, sizes=sizes, opponents=tuple(runs), opponent_runs=runs)
    result = played(workshop, study)
    files = [workshop.pictures / f"beyond_aggregations{name}.png" for name in ("", "_matrix")]
    panels = tuple(
        StudyPanel(
            title=f"{said} total score, against {opponent}",
            series={
                name: {m: cell_name(PURSUERS, m, f"{name}_{sense}", opponent) for m in sizes}
                for name in AGGREGATIONS
            },
        )
        for opponent in runs
        for sense, said in zip(SENSES, ("least", "greatest"), strict=True)
    )
    grid = StudyGrid(means=panels, matrix=matrix_of(study), columns=len(SENSES))
    draw_means(result, grid).savefig(files[0], dpi=110)
    draw_matrix(result, grid).savefig(files[1], dpi=110)
    captions = (
        "Restricted means of the tracking time of three pursuers, by opponent.",
        "The same means, aggregations against evaders.",
    )
    return Evidence(
        tuple(map(Picture, files, captions)),
        tuple(
            finding for opponent in runs for finding in _senses_and_rules(result, opponent, sizes)
        ),
    )


def _senses_and_rules(
    result: StudyResult, opponent: str, sizes: Sequence[int]
) -> tuple[Finding, ...]:
    """What the senses and the aggregations make of it against an opponent."""

    def times(rule: str, evaders: int):
        return result.times(cell_name(PURSUERS, evaders, rule, opponent))

    senses = [(m, paired_difference(times("borda_max", m), times("borda_min", m))) for m in sizes]
    adjusted = holm([d.p_value for _, d in senses])
    others = [
        (rule, m, paired_difference(times(rule, m), times("borda_max", m)))
        for rule in RULES
        if rule.endswith("_max") and rule != "borda_max"
        for m in sizes
    ]
    _, where = max((abs(d.mean), f"{d.mean:+.1f} s, {r}, 3v{m}") for r, m, d in others)
    apart = holm([d.p_value for _, _, d in others]) < 0.05
    return (
        Finding(
            f"Borda: maximised less minimised, against {opponent}",
            "",
            "; ".join(
                f"{PURSUERS}v{m}: {d.mean:+.1f} s [{d.low:+.1f}, {d.high:+.1f}], p = {p:.2g}"
                for (m, d), p in zip(senses, adjusted, strict=True)
            )
            + " (Holm).",
            SHOWN,
        ),
        Finding(
            f"Other aggregations, maximised, less Borda, against {opponent}",
            "",
            f"{apart.sum()} of {len(others)} differences beyond chance (Holm); the largest "
            f"is {where}.",
            SHOWN,
        ),
    )


RANK_AGGREGATIONS = Exhibit(
    id="beyond-aggregations",
    covers=(),
    title="Other rank aggregations",
    states="The thesis aggregates by Borda count and minimises a score that is highest for the "
    "riskiest evader. Here the same team minimises and maximises Borda, Dowdall, Copeland and "
    "Kemeny scores.",
    command="sightfield track thesis_borda_4v3 --set pursuers.assignment=kemeny_max",
    make=_aggregations,
)


RADIO_RUNS = {"adversarial": 500, "best_response": 100}
QUICK_RADIO_RUNS = {"adversarial": 8, "best_response": 2}
RANGES, RULE = (0.0, 1.0, 2.0, math.inf), "borda_max"


def radio_study(runs: Mapping[str, int], sizes: Sequence[int] = SIZES) -> Study:
    """Three pursuers with three risk functions, and radios of several ranges.

    Args:
        runs: Of each cell, by opponent.
        sizes: Of the evaders' team.
    """
    numbers = runs_against(tuple(runs), max(runs.values()), runs)
    return Study(
        name="radio",
        base=thesis_base(),
        arena=Arena(),
        runs=max(numbers.values()),
        cells=tuple(
            match_cell(
                Match(PURSUERS, m, _range_name(reach), opponent),
                (
                    f"pursuers.risk_functions=[{', '.join(RISK_FUNCTIONS)}]",
                    f"pursuers.assignment={RULE}",
                    "pursuers.extra=riskiest",
                    f"pursuers.radio_range={'.inf' if math.isinf(reach) else reach}",
                ),
                numbers,
            )
            for opponent in numbers
            for reach in RANGES
            for m in sizes
        ),
    )


def _range_name(reach: float) -> str:
    return "centre" if math.isinf(reach) else f"{reach:g}m"


def _radio(workshop: Workshop) -> Evidence:
    runs = workshop.runs_against(RADIO_RUNS, QUICK_RADIO_RUNS)
    sizes = QUICK_SIZES if workshop.quick else SIZES
    result = played(workshop, radio_study(runs, sizes))

    def cell(evaders: int, reach: float, opponent: str) -> str:
        return cell_name(PURSUERS, evaders, _range_name(reach), opponent)

    panels = tuple(
        StudyPanel(
            title=f"range of the radio, against {opponent}",
            series={
                _range_name(reach): {m: cell(m, reach, opponent) for m in sizes} for reach in RANGES
            },
        )
        for opponent in runs
    )
    grid = StudyGrid(means=panels, matrix=matrix_of(result.study))
    files = [workshop.pictures / f"beyond_radio{name}.png" for name in ("", "_matrix")]
    draw_means(result, grid).savefig(files[0], dpi=110)
    draw_matrix(result, grid).savefig(files[1], dpi=110)
    captions = (
        "Restricted means of the tracking time of three pursuers, by opponent.",
        "The same means, ranges of the radio against evaders.",
    )
    findings = []
    for opponent in runs:
        times = {
            (m, reach): result.times(cell(m, reach, opponent))
            for m in sizes
            for reach in (0.0, math.inf)
        }
        found = [(m, paired_difference(times[m, math.inf], times[m, 0.0])) for m in sizes]
        said = "; ".join(
            f"{PURSUERS}v{m}: {d.mean:+.1f} s [{d.low:+.1f}, {d.high:+.1f}]" for m, d in found
        )
        subject = f"A centre less no radio at all, against {opponent}"
        findings.append(Finding(subject, "", f"{said}.", SHOWN))
    return Evidence(tuple(map(Picture, files, captions)), tuple(findings))


RADIO = Exhibit(
    id="beyond-radio",
    covers=(),
    title="Pursuers without a centre",
    states="The thesis has a centre that knows everything. Here each pursuer knows what it sees "
    "and what those within radio range tell it, and applies the team's rule to that.",
    command="sightfield track thesis_borda_4v3 --set pursuers.radio_range=1.5",
    make=_radio,
)
