"""Borda, Dowdall, Copeland and Kemeny, minimised and maximised."""

from ....systems.numerics.statistics.corrections import holm
from ....systems.numerics.statistics.paired import paired_difference
from ....systems.numerics.statistics.survival import restricted_mean
from ....systems.numerics.tracking.assignment.aggregation import AGGREGATIONS
from ...studies.assignment_study import PURSUERS, assignment_study
from ...studies.grid import Grid, Panel
from ...studies.pictures import draw_means
from ...studies.tracking_study import cell_name
from ..evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Table, Workshop
from ..played import played

RUNS, QUICK_RUNS = 500, 6
SIZES = (2, 3, 4)
SENSES = ("min", "max")
RULES = tuple(f"{name}_{sense}" for sense in SENSES for name in AGGREGATIONS)


def _make(workshop: Workshop) -> Evidence:
    runs = workshop.runs_of(RUNS, QUICK_RUNS)
    result = played(workshop, assignment_study(runs=runs, rules=RULES, sizes=SIZES))
    file = workshop.pictures / "beyond_aggregations.png"
    panels = tuple(
        Panel(
            title={"min": "least total score", "max": "greatest total score"}[sense],
            series={
                name: {m: cell_name(PURSUERS, m, f"{name}_{sense}") for m in SIZES}
                for name in AGGREGATIONS
            },
        )
        for sense in SENSES
    )
    draw_means(result, Grid(means=panels, curves=(), pairs=())).savefig(file, dpi=110)

    def times(rule: str, evaders: int):
        return result.times(cell_name(PURSUERS, evaders, rule))

    rows = []
    for rule in RULES:
        means = [
            restricted_mean(times(rule, m), result.lost(cell), result.horizon(cell))
            for m in SIZES
            for cell in [cell_name(PURSUERS, m, rule)]
        ]
        rows.append((rule, *(f"{e.value:.1f} [{e.low:.1f}, {e.high:.1f}]" for e in means)))
    senses = [(m, paired_difference(times("borda_max", m), times("borda_min", m))) for m in SIZES]
    adjusted = holm([d.p_value for _, d in senses])
    others = [
        (rule, m, paired_difference(times(rule, m), times("borda_max", m)))
        for rule in RULES
        if rule.endswith("_max") and rule != "borda_max"
        for m in SIZES
    ]
    _, where = max((abs(d.mean), f"{d.mean:+.1f} s, {r}, 3v{m}") for r, m, d in others)
    apart = holm([d.p_value for _, _, d in others]) < 0.05
    return Evidence(
        (Picture(file, "Restricted means of the tracking time of three pursuers."),),
        (
            Finding(
                "Borda: maximised less minimised",
                "",
                "; ".join(
                    f"{PURSUERS}v{m}: {d.mean:+.1f} s [{d.low:+.1f}, {d.high:+.1f}], p = {p:.2g}"
                    for (m, d), p in zip(senses, adjusted, strict=True)
                )
                + " (Holm).",
                SHOWN,
            ),
            Finding(
                "Other aggregations, maximised, less Borda",
                "",
                f"{apart.sum()} of {len(others)} differences beyond chance (Holm); the largest "
                f"is {where}.",
                SHOWN,
            ),
        ),
        (
            Table(
                f"Restricted means [s] with 95% intervals, {runs} runs",
                ("rule", *(f"{PURSUERS} against {m}" for m in SIZES)),
                tuple(rows),
            ),
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
