"""Tables 2.1 and 2.2: who wins around a corner, by which policy, along which field."""

import math
from functools import lru_cache

import numpy as np

from ....systems.numerics.tracking.corner_game import escape_time, margins
from ....systems.numerics.tracking.corner_study.best_response import solve_best_response
from ....systems.numerics.tracking.corner_study.game_solution import solve_corner_game
from ....systems.numerics.tracking.corner_study.moves import CornerValues
from ....systems.numerics.tracking.corner_study.play import play_out
from ...tracking.corner_picture import save_corner_picture
from ..evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Workshop, judged

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


POLICIES = Exhibit(
    id="table-2.1",
    covers=("Table 2.1",),
    title="Policies around one corner",
    states="For each region of the corner game the control law of the side that wins there: the "
    "evader in Region 1, where it runs for the corner or straight down; the pursuer elsewhere, "
    "upwards in Regions 2 and 4, mirroring the evader in 3, turning in 5.",
    command="sightfield corner --out out/corner",
    make=_policies,
)
FIELDS = Exhibit(
    id="table-2.2",
    covers=("Table 2.2",),
    title="Pursuit fields around one corner",
    states="The pursuer's direction in each region as a vector field, in a frame whose y axis "
    "changes its sense between rows (docs/errata.md).",
    command="sightfield corner --alpha 1.0472 --field table --out out/corner",
    make=_fields,
)
