"""Tracking: Tables 2.1 and 2.2, Figures 2.5 and 2.6, and 2.16 to 2.19.

Corners, pursuit fields and tracks by risk vector; tracking times over the sizes of the teams.
"""

import math
from functools import lru_cache
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ....systems.numerics.geometry.edge_index import build_edge_index
from ....systems.numerics.geometry.world import World
from ....systems.numerics.tracking.corner_game import corner_table, escape_time, margins
from ....systems.numerics.tracking.corner_policies import FIELDS
from ....systems.numerics.tracking.corner_study.best_response import solve_best_response
from ....systems.numerics.tracking.corner_study.game_solution import solve_corner_game
from ....systems.numerics.tracking.corner_study.moves import CornerValues
from ....systems.numerics.tracking.corner_study.play import play_out
from ....systems.numerics.tracking.risk import RISK_VECTORS
from ....systems.numerics.tracking.team_pursuit import sample_field
from ...scenario_files import find_scenario, load_scenario
from ...studies.claims import judge_everywhere, variants, varied
from ...studies.report import draw_curves, draw_matrix, draw_means
from ...studies.team_studies import assignment_grid, assignment_study, tracking_grid, tracking_study
from ...studies.thesis_claims import TEAMS, VECTORS, judge_allocations, judge_teams
from ...tracking.corner_picture import save_corner_picture
from ...tracking.game import set_up_game
from ...tracking.report import draw_tracks
from ...tracking.run import run_tracking
from ...tracking.scenario import TrackingScenario
from ...world_picture import draw_world
from .evidence import (
    SHOWN,
    Evidence,
    Exhibit,
    Finding,
    Picture,
    Workshop,
    fewest,
    findings_of,
    judged,
    played,
    verdicts_by_assumption,
)

A, STEP = 0.5, 0.005
# A right-angled corner, and one with a left side, about which half of Table 2.2 is.
RIGHT, SHARP = math.pi / 2, math.pi / 3
PURSUER, EVADER = (1.0, -1.5), (-0.2, 0.6)
LEFT, BESIDE = (-0.6, -1.5), (0.4, 0.6)
# Up to here a difference is that of the grid, which halves with its step (BENCHMARKS.md).
AREA, QUICK_AREA, TIME = 0.015, 0.03, 0.05


@lru_cache(maxsize=2)
def _solved(alpha: float, nodes: int) -> CornerValues:
    return solve_corner_game(alpha, nodes)


def _policies(workshop: Workshop) -> Evidence:
    values = _solved(RIGHT, 21 if workshop.quick else 41)
    grid = values.grid
    free = np.maximum(grid.phi_e, RIGHT - math.pi)
    phi_p, phi_e, rho = np.meshgrid(grid.phi_p, free, grid.rho, indexing="ij")
    seen = (grid.gap[:, :, None] > 0) & (phi_p < 0) & (rho > 0)
    states = np.column_stack([phi_p[seen], phi_e[seen], rho[seen]])
    m1, time = _closed_form(states, RIGHT)
    lost, area = m1 < 0, rho[seen]
    differs = (values.lead[seen] < 0) != lost
    apart = float(area[differs].sum() / area[lost].sum())
    error = float(np.abs(values.time[seen] - time)[lost].mean() / time[lost].mean())
    nodes = "x".join(map(str, grid.shape))
    file = workshop.pictures / "table_2_1.png"
    save_corner_picture(file, RIGHT, A, PURSUER, EVADER)
    return Evidence(
        (Picture(file, "Partitions round a pursuer and for an evader, and a pursuit field."),),
        (
            Finding(
                "Who wins",
                "The pursuer, everywhere but in Region 1.",
                f"Dynamic programming on {nodes} nodes, which knows none of the regions, finds "
                f"the same set but for {apart:.2%} of its area.",
                judged(apart < (QUICK_AREA if workshop.quick else AREA)),
            ),
            Finding(
                "How long sight holds in Region 1",
                "The pursuer's policy there keeps sight for as long as can be.",
                f"Its closed form T* is {error:.1%} from the value of the game on that grid.",
                judged(error < TIME),
            ),
        ),
    )


def _fields(workshop: Workshop) -> Evidence:
    count, nodes = (400, 11) if workshop.quick else (4000, 21)
    rng = np.random.default_rng(1)
    phi_p = rng.uniform(SHARP - math.pi, 0, count)
    phi_e = rng.uniform(SHARP - math.pi, math.pi + phi_p)
    states = np.column_stack([phi_p, phi_e, rng.uniform(0, 2, count)])
    winnable = _closed_form(states, SHARP)[0] >= 0
    kept = {}
    for field in ("table", "margin"):
        evaders = [(None, "lead")]
        for values in (_solved(SHARP, nodes), solve_best_response(field, SHARP, A, nodes)):
            evaders += [(values, "lead"), (values, "time")]
        plays = [play_out(field, states, SHARP, A, *each, STEP, 10.0, 0.02) for each in evaders]
        kept[field] = float(np.isinf(np.min(plays, axis=0))[winnable].mean())
    pictures = []
    for field in kept:
        file = workshop.pictures / f"table_2_2_{field}.png"
        save_corner_picture(file, SHARP, A, LEFT, BESIDE, field)
        pictures.append(Picture(file, f"On the right the field `{field}`."))
    return Evidence(
        tuple(pictures),
        (
            Finding(
                "States that the pursuer can win",
                "The fields are those of optimal navigation around the corner.",
                "Around a corner of 60 degrees, against the worst of five evaders, the table keeps "
                f"{kept['table']:.1%} of {winnable.sum()} winnable states.",
                judged(kept["table"] == 1.0),
            ),
            Finding(
                "The same two directions, blended by the margins that they protect",
                "",
                f"The field `margin` of this project keeps {kept['margin']:.1%} of them.",
                SHOWN,
            ),
        ),
    )


def _closed_form(states: np.ndarray, alpha: float) -> tuple[np.ndarray, np.ndarray]:
    """M1 / a and T* v_p / r_p of states (phi_p, phi_e, rho)."""
    m1 = [margins(1.0, p, r, e, alpha, 1.0)[0] for p, e, r in states]
    time = [escape_time(1.0, p, r, e, alpha, 1.0, 1.0) for p, e, r in states]
    return np.array(m1), np.array(time)


CORNER_POLICIES = Exhibit(
    id="table-2.1",
    covers=("Table 2.1",),
    title="Policies around one corner",
    states="For each region of the corner game the control law of the side that wins there: the "
    "evader in Region 1, where it runs for the corner or straight down; the pursuer elsewhere, "
    "upwards in Regions 2 and 4, mirroring the evader in 3, turning in 5.",
    command="sightfield corner --out out/corner",
    make=_policies,
)
CORNER_FIELDS = Exhibit(
    id="table-2.2",
    covers=("Table 2.2",),
    title="Pursuit fields around one corner",
    states="The pursuer's direction in each region as a vector field, in a frame whose y axis "
    "changes its sense between rows (docs/errata.md).",
    command="sightfield corner --alpha 1.0472 --field table --out out/corner",
    make=_fields,
)


THESIS = ("uniform", "majority", "proportional")
# Fewer arrows than this along a side hide the field, more blacken it.
ARROWS = 27
# Directions closer than this look the same [rad].
ALIKE = np.radians(5.0)


def _vector_fields(workshop: Workshop) -> Evidence:
    scenario = load_scenario(TrackingScenario, find_scenario("risk_vectors"))
    world, evader = scenario.world.load(), np.array(scenario.evaders.positions[0])
    (x, y), points = evader.tolist(), _places(world)
    fields = {
        name: sample_field(
            build_edge_index(world),
            points,
            x,
            y,
            corner_table(world),
            FIELDS["margin"],
            RISK_VECTORS[name],
            scenario.speed_ratio,
        )
        for name in THESIS
    }
    file = workshop.pictures / "figure_2_5.png"
    _draw(file, world, evader, points, fields)
    moving = np.all([np.hypot(*field.T) > 0 for field in fields.values()], axis=0)
    parts = []
    for first, second in (("uniform", "majority"), ("uniform", "proportional"), THESIS[1:]):
        cosine = np.sum(fields[first][moving] * fields[second][moving], axis=1)
        share = np.mean(np.arccos(np.clip(cosine, -1, 1)) > ALIKE)
        parts.append(f"{first} and {second} in {share:.0%}")
    return Evidence(
        (Picture(file, "Where a pursuer would run for the red evader, from each place."),),
        (
            Finding(
                "Three risk vectors, three fields",
                "The techniques generate different vector fields in one environment.",
                f"They differ by more than 5 degrees: {', '.join(parts)} of the "
                f"{moving.sum()} places from which a corner threatens. (Where one corner threatens "
                "alone they cannot.)",
                judged(all(not part.endswith(" 0%") for part in parts)),
            ),
        ),
    )


def _places(world: World) -> np.ndarray:
    low, high = world.bounds[:2], world.bounds[2:]
    steps = (np.arange(ARROWS) + 0.5) / ARROWS
    x, y = (low[k] + steps * (high[k] - low[k]) for k in range(2))
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def _draw(
    file: Path, world: World, evader: np.ndarray, points: np.ndarray, fields: dict[str, np.ndarray]
) -> None:
    figure = Figure(figsize=(15, 5.3), layout="constrained")
    for axes, (name, field) in zip(figure.subplots(1, 3), fields.items(), strict=True):
        draw_world(axes, world)
        moving = np.hypot(*field.T) > 0
        axes.quiver(
            *points[moving].T,
            *field[moving].T,
            color="#215fcc",
            pivot="mid",
            angles="xy",
            scale_units="xy",
            scale=ARROWS / 3.4,
            width=0.004,
        )
        axes.plot(*evader, "s", color="#d92e33", markersize=9)
        axes.set_title(f"{name} risk")
    figure.savefig(file, dpi=100)


VECTOR_FIELDS = Exhibit(
    id="figure-2.5",
    covers=("Figure 2.5",),
    title="Vector fields of the risk vectors",
    states="Three fields in an environment with polygons, for uniform, majority and proportional "
    "risk (2.2). The environment is not described; ours is the arena of 2.2.8.",
    command="sightfield reproduce --only figure-2.5",
    make=_vector_fields,
)


def _risk_tracks(workshop: Workshop) -> Evidence:
    scenario = load_scenario(TrackingScenario, find_scenario("risk_vectors"))
    run = run_tracking(set_up_game(scenario))
    file = workshop.pictures / "figure_2_6.png"
    draw_tracks(run).savefig(file, dpi=110)
    ways = run.log["pursuer_position"]
    seen = run.log["visibility"][:, :, 0]
    shares = ", ".join(
        f"{name} {part:.0%}"
        for name, part in zip(scenario.pursuers.risk_vectors, seen.mean(axis=0), strict=True)
    )
    apart = max(
        float(np.hypot(*(ways[:, i] - ways[:, j]).T).max()) for i in range(3) for j in range(i)
    )
    return Evidence(
        (
            Picture(
                file, "Green, black and blue: uniform, majority, proportional; red: the evader."
            ),
        ),
        (
            Finding(
                "One start, three tracks",
                "Pursuers with the three risk vectors start on one spot and go different ways.",
                f"They are up to {apart:.2f} m apart.",
                judged(apart > 0.1),
            ),
            Finding(
                "Who sees the evader, of the time",
                "",
                f"{shares} of {run.tracking_time:g} s.",
                SHOWN,
            ),
        ),
    )


RISK_TRACKS = Exhibit(
    id="figure-2.6",
    covers=("Figure 2.6",),
    title="Tracks with the three risk vectors",
    states="Trajectories of three pursuers that start on one spot and follow the same evader, "
    "each with its risk vector. Map and evader's path are not described.",
    command="sightfield track risk_vectors --out out/risk_vectors",
    make=_risk_tracks,
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
