"""Figure 2.19: ranking and aggregation against pursuers that choose for themselves."""

from ...studies.claims import judge_everywhere, variants, varied
from ...studies.report import draw_matrix, draw_means
from ...studies.team_studies import assignment_grid, assignment_study
from ...studies.thesis_claims import TEAMS, judge_allocations
from ..evidence import Evidence, Exhibit, Picture, Workshop
from ..played import fewest, findings_of, played, verdicts_by_assumption

# As of Figures 2.16 to 2.18; the claims are about one evader, some, and more than pursuers.
RUNS = {"adversarial": 1000, "best_response": 100, "optimal": 100, "optimal_distance": 100}
VARIED, SIZES = {"adversarial": 60, "best_response": 20, "random_walk": 60}, (1, 2, 3, 4)
QUICK_RUNS = {"adversarial": 8, "best_response": 2, "optimal": 2, "optimal_distance": 2}
QUICK_VARIED, QUICK_SIZES = {"adversarial": 2, "best_response": 2, "random_walk": 2}, (1, 3, 4)


def _make(workshop: Workshop) -> Evidence:
    runs = workshop.runs_against(RUNS, QUICK_RUNS)
    sizes = QUICK_SIZES if workshop.quick else SIZES
    main = played(
        workshop,
        assignment_study(sizes=sizes, rules=TEAMS, opponents=tuple(runs), opponent_runs=runs),
    )
    grid = assignment_grid(main.study)
    means, matrix = (workshop.pictures / f"figure_2_19{name}.png" for name in ("", "_matrix"))
    draw_means(main, grid).savefig(means, dpi=110)
    draw_matrix(main, grid).savefig(matrix, dpi=110)
    results = {f"{main.study.base.seconds:g} s": main}
    fewer = fewest(runs, QUICK_VARIED if workshop.quick else VARIED)
    for each in variants(workshop.world, few=workshop.quick):
        study = varied(assignment_study, each, opponent_runs=fewer, sizes=sizes, rules=TEAMS)
        results[each.name] = played(workshop, study)
    everywhere = judge_everywhere(judge_allocations, results)
    return Evidence(
        (
            Picture(means, "Restricted means of the tracking time of three pursuers, by opponent."),
            Picture(matrix, "The same means, assignment rules against evaders."),
        ),
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
    command="sightfield study assignment --runs 1000 --opponent-runs best_response=100 --workers 2 "
    "--out out/assignment",
    make=_make,
)
