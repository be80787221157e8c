"""Borda, Dowdall, Copeland and Kemeny, minimised and maximised."""

from collections.abc import Sequence

from ....systems.numerics.statistics import holm, paired_difference
from ....systems.numerics.tracking.assignment.voting import AGGREGATIONS
from ...studies.opponents import cell_name
from ...studies.records import StudyResult
from ...studies.report import draw_matrix, draw_means
from ...studies.summary import StudyGrid, StudyPanel, matrix_of
from ...studies.team_studies import PURSUERS, assignment_study
from ..evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Workshop
from ..played import played

RUNS = {"adversarial": 500, "best_response": 60}
QUICK_RUNS = {"adversarial": 6, "best_response": 2}
SIZES, QUICK_SIZES = (2, 3, 4), (2, 4)
SENSES = ("min", "max")
RULES = tuple(f"{name}_{sense}" for sense in SENSES for name in AGGREGATIONS)


def _make(workshop: Workshop) -> Evidence:
    runs = workshop.runs_against(RUNS, QUICK_RUNS)
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
        tuple(finding for opponent in runs for finding in _findings(result, opponent, sizes)),
    )


def _findings(result: StudyResult, opponent: str, sizes: Sequence[int]) -> tuple[Finding, ...]:
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
    make=_make,
)
