"""Figures 2.16 to 2.18: tracking times over the sizes of the teams, by each risk vector."""

from ...studies.claims.team_claims import VECTORS, judge_teams
from ...studies.claims.variants import judge_everywhere, variants, varied
from ...studies.pictures import draw_curves, draw_means
from ...studies.tracking_study import tracking_grid, tracking_study
from ..evidence import Evidence, Exhibit, Picture, Workshop
from ..played import findings_of, played, verdicts_by_assumption

# Runs of each cell, runs of each cell of each variant, and sizes of the teams there.
RUNS, VARIED, SIZES = 1000, 60, (1, 2, 3, 4)
QUICK_RUNS, QUICK_VARIED, QUICK_SIZES = 8, 4, (1, 4)


def _make(workshop: Workshop) -> Evidence:
    runs = workshop.runs_of(RUNS, QUICK_RUNS)
    fewer = min(runs, QUICK_VARIED if workshop.quick else VARIED)
    sizes = QUICK_SIZES if workshop.quick else SIZES
    main = played(workshop, tracking_study(runs=runs, vectors=tuple(VECTORS)))
    grid = tracking_grid(main.study)
    means, curves = (workshop.pictures / f"figure_2_16_{name}.png" for name in ("means", "curves"))
    draw_means(main, grid).savefig(means, dpi=100)
    draw_curves(main, grid).savefig(curves, dpi=100)
    results = {f"adversarial, {main.horizon('1v1-uniform'):g} s": main}
    for each in variants(workshop.world):
        study = varied(tracking_study, each, runs=fewer, sizes=sizes, vectors=tuple(VECTORS))
        results[each.name] = played(workshop, study)
    everywhere = judge_everywhere(judge_teams, results)
    return Evidence(
        (
            Picture(means, "Restricted means of t1, t2, t3 (Figures 2.16, 2.17, 2.18)."),
            Picture(curves, "Kaplan-Meier curves of the same runs."),
        ),
        findings_of(next(iter(everywhere.values()))),
        (verdicts_by_assumption(everywhere),),
    )


TEAM_TIMES = Exhibit(
    id="figure-2.16",
    covers=("Figure 2.16", "Figure 2.17", "Figure 2.18"),
    title="Tracking times with the three risk vectors",
    states="Average tracking times t1, t2, t3 of 1000 runs for one to four pursuers and evaders, "
    "a = 0.3, v_p = 300 mm per time unit, random starts at which every evader is seen. Obstacles, "
    "the evaders' policy and the longest time counted are not stated: ours are five random "
    "rectangles, the game's best play, and 120 s.",
    command="sightfield study tracking --runs 1000 --workers 2 --out out/tracking",
    make=_make,
)
