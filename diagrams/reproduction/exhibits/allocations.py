"""Figure 2.19: ranking and aggregation against pursuers that choose for themselves."""

from ...studies.assignment_study import assignment_grid, assignment_study
from ...studies.claims.allocation_claims import TEAMS, judge_allocations
from ...studies.claims.variants import judge_everywhere, variants, varied
from ...studies.pictures import draw_means
from ..evidence import Evidence, Exhibit, Picture, Workshop
from ..played import findings_of, played, verdicts_by_assumption

# As of Figures 2.16 to 2.18; the claims are about one evader, some, and more than pursuers.
RUNS, VARIED, SIZES = 1000, 60, (1, 2, 3, 4)
QUICK_RUNS, QUICK_VARIED, QUICK_SIZES = 8, 2, (1, 3, 4)


def _make(workshop: Workshop) -> Evidence:
    runs = workshop.runs_of(RUNS, QUICK_RUNS)
    fewer = min(runs, QUICK_VARIED if workshop.quick else VARIED)
    sizes = QUICK_SIZES if workshop.quick else SIZES
    main = played(workshop, assignment_study(runs=runs, rules=TEAMS))
    file = workshop.pictures / "figure_2_19.png"
    draw_means(main, assignment_grid(main.study)).savefig(file, dpi=110)
    results = {f"adversarial, {main.horizon(main.study.cells[0].name):g} s": main}
    for each in variants(workshop.world):
        study = varied(assignment_study, each, runs=fewer, sizes=sizes, rules=TEAMS)
        results[each.name] = played(workshop, study)
    everywhere = judge_everywhere(judge_allocations, results)
    return Evidence(
        (Picture(file, "Restricted means of the tracking time of three pursuers."),),
        findings_of(next(iter(everywhere.values()))),
        (verdicts_by_assumption(everywhere),),
    )


ALLOCATIONS = Exhibit(
    id="figure-2.19",
    covers=("Figure 2.19",),
    title="Tracking times with different allocations",
    states="Average tracking times of three pursuers with three risk functions against one to four "
    "evaders: ranked and aggregated (Algorithm 1), random targets, and each pursuer's own "
    "riskiest. Which risk functions is not stated; ours are total, nearest and mean.",
    command="sightfield study assignment --runs 1000 --workers 2 --out out/assignment",
    make=_make,
)
