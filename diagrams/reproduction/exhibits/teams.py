"""Figures 2.16 to 2.19: tracking times over the sizes of the teams, by vector and allocation."""

from ...studies.claims import judge_everywhere, variants, varied
from ...studies.report import draw_curves, draw_matrix, draw_means
from ...studies.team_studies import assignment_grid, assignment_study, tracking_grid, tracking_study
from ...studies.thesis_claims import TEAMS, VECTORS, judge_allocations, judge_teams
from .evidence import (
    Evidence,
    Exhibit,
    Picture,
    Workshop,
    fewest,
    findings_of,
    played,
    verdicts_by_assumption,
)

# Runs of each cell, runs of each cell of each variant, and sizes of the teams there; where it has
# to be quick the study itself has the corners of the figures alone.
RUNS = {"adversarial": 1000, "best_response": 100, "optimal": 100, "optimal_distance": 100}
VARIED, SIZES = {"adversarial": 60, "best_response": 20, "random_walk": 60}, (1, 2, 3, 4)
QUICK_RUNS = {"adversarial": 8, "best_response": 3, "optimal": 2, "optimal_distance": 2}
QUICK_VARIED, QUICK_SIZES = {"adversarial": 4, "best_response": 2, "random_walk": 4}, (1, 3)
CORNERS = (1, 4)


def _team_times(workshop: Workshop) -> Evidence:
    runs = workshop.runs_against(RUNS, QUICK_RUNS)
    sizes = QUICK_SIZES if workshop.quick else SIZES
    main = played(
        workshop,
        tracking_study(
            sizes=CORNERS if workshop.quick else SIZES,
            vectors=tuple(VECTORS),
            opponents=tuple(runs),
            opponent_runs=runs,
        ),
    )
    grid = tracking_grid(main.study)
    files = []
    for name, draw in (("means", draw_means), ("matrix", draw_matrix), ("curves", draw_curves)):
        files.append(workshop.pictures / f"figure_2_16_{name}.png")
        draw(main, grid).savefig(files[-1], dpi=100)
    results = {f"{main.study.base.seconds:g} s": main}
    fewer = fewest(runs, QUICK_VARIED if workshop.quick else VARIED)
    for each in variants(workshop.world):
        study = varied(
            tracking_study, each, opponent_runs=fewer, sizes=sizes, vectors=tuple(VECTORS)
        )
        results[each.name] = played(workshop, study)
    everywhere = judge_everywhere(judge_teams, results)
    captions = (
        "Restricted means of t1, t2, t3 (Figures 2.16, 2.17, 2.18), against each opponent.",
        "The same means, risk vectors against evaders.",
        "Kaplan-Meier curves of the same runs.",
    )
    return Evidence(
        tuple(map(Picture, files, captions)),
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
    "rectangles, evaders that play the corner game, that know the pursuers' rule or that know the "
    "solved visibility game, and 120 s. A claim holds if it does against the strongest.",
    command="sightfield study tracking --runs 1000 --opponent-runs best_response=100 --workers 2 "
    "--out out/tracking",
    make=_team_times,
)


# Figure 2.19 takes the runs of the figures before, and its own where it has to be quick. Its claims
# are about one evader, some, and more than pursuers.
QUICK_ALLOCATION_RUNS = {"adversarial": 8, "best_response": 2, "optimal": 2, "optimal_distance": 2}
QUICK_ALLOCATION_VARIED = {"adversarial": 2, "best_response": 2, "random_walk": 2}
QUICK_ALLOCATION_SIZES = (1, 3, 4)


def _allocations(workshop: Workshop) -> Evidence:
    runs = workshop.runs_against(RUNS, QUICK_ALLOCATION_RUNS)
    sizes = QUICK_ALLOCATION_SIZES if workshop.quick else SIZES
    main = played(
        workshop,
        assignment_study(sizes=sizes, rules=TEAMS, opponents=tuple(runs), opponent_runs=runs),
    )
    grid = assignment_grid(main.study)
    means, matrix = (workshop.pictures / f"figure_2_19{name}.png" for name in ("", "_matrix"))
    draw_means(main, grid).savefig(means, dpi=110)
    draw_matrix(main, grid).savefig(matrix, dpi=110)
    results = {f"{main.study.base.seconds:g} s": main}
    fewer = fewest(runs, QUICK_ALLOCATION_VARIED if workshop.quick else VARIED)
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
    make=_allocations,
)
