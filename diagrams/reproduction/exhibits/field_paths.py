"""Figure 3.8: the paths of two combines over a field of eleven rows."""

import numpy as np

from ....systems.numerics.harvest.field.coverage import CoveragePlan
from ...harvest import scenarios
from ...harvest.job import cover_field
from ...harvest.pictures.coverage_picture import save_coverage_picture
from ...harvest.scenario import HarvestScenario
from ...scenario_files import find_scenario, load_scenario
from ..evidence import Evidence, Exhibit, Finding, Picture, Workshop, judged

# Turns are not of equal length on all sides [m].
NEAR = 4.0


def _make(workshop: Workshop) -> Evidence:
    scenario = load_scenario(HarvestScenario, find_scenario("thesis_2", scenarios))
    team = scenario.combines
    plan = cover_field(scenario)
    file = workshop.pictures / "figure_3_8.png"
    save_coverage_picture(file, plan)
    gaps = _side_gaps(plan)
    steps = -np.diff(gaps)
    low, high = plan.field.world.bounds[1::2]
    count = (high - low) / team.header_width
    nearest = min(float(rows[:, 1].min()) for rows in plan.gaps if len(rows))
    return Evidence(
        (Picture(file, "Thick: cutting; dots: starts, squares: ends."),),
        (
            Finding(
                "Rows",
                "400 x 275 units in 11 rows, worked from the edge inwards.",
                f"{count:g} rows of {team.header_width:g} m; {plan.covered_fraction:.2%} of the "
                "crop is cut.",
                judged(count == 11 and plan.covered_fraction > 0.99),
            ),
            Finding(
                "Distance between the combines",
                "It keeps decreasing, by 2 l from one iteration to the next (3.4.1).",
                f"Side by side of a lap {', '.join(f'{gap:.0f}' for gap in gaps)} m: "
                f"{steps.mean():.1f} m less each time; 2 l = {2 * team.header_width:g} m.",
                judged(bool(np.allclose(steps, 2 * team.header_width, atol=NEAR))),
            ),
            Finding(
                "Open space on the left",
                "All combines keep an open space on their left, for unloading.",
                f"The one on the left is always {nearest:.0f} m ahead or more; a header is "
                f"{team.header_width:g} m wide.",
                judged(nearest > team.header_width),
            ),
        ),
    )


def _side_gaps(plan: CoveragePlan) -> np.ndarray:
    """Way by which the first combine is ahead on each side of the second one's first lap [m]."""
    rows = plan.gaps[1]
    ahead = rows[plan.paths[1].loop_at(rows[:, 0]) == plan.paths[1].loops.clip(min=0)[0], 1]
    sides = np.split(ahead, np.flatnonzero(np.abs(np.diff(ahead)) > plan.header_width) + 1)
    # Samples in the turns themselves belong to no side.
    return np.array([np.median(side) for side in sides if len(side) > 3])


FIELD_PATHS = Exhibit(
    id="figure-3.8",
    covers=("Figure 3.8",),
    title="Paths of two combines",
    states="Two combines work on adjacent rows of a field of 400 x 275 units in 11 rows, from the "
    "perimeter inwards.",
    command="sightfield harvest thesis_2 --out out/harvest",
    make=_make,
)
