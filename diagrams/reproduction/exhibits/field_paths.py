"""Figure 3.8: the paths of two combines over a field of eleven rows."""

from itertools import pairwise

import numpy as np

from ....systems.numerics.harvest.carts.cut_times import CELL, cut_times
from ....systems.numerics.harvest.plan.combine_plan import CombinePlan, plan_combines
from ...harvest import scenarios
from ...harvest.coverage_picture import save_coverage_picture
from ...harvest.scenario import HarvestScenario
from ...scenario_files import find_scenario, load_scenario
from ..evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Workshop, judged

# Combines that begin side by side need room outside of the field [m].
MARGIN = 34.0


def _make(workshop: Workshop) -> Evidence:
    scenario = load_scenario(
        HarvestScenario, find_scenario("thesis_2", scenarios), [f"field.margin={MARGIN:g}"]
    )
    team, field = scenario.combines, scenario.field.load()
    plan = plan_combines(field, team.machines(), pattern="thesis")
    lands = plan_combines(field, team.machines())
    file = workshop.pictures / "figure_3_8.png"
    save_coverage_picture(file, plan)
    low, high = field.world.bounds[1::2]
    count = (high - low) / team.header_width
    turns = _cutters(plan)
    return Evidence(
        (Picture(file, "Thick: cutting; dots: starts, squares: ends."),),
        (
            Finding(
                "Rows",
                "400 x 275 units in 11 rows, all of which are cut.",
                f"{count:g} rows of {team.header_width:g} m; {plan.coverage.coverage:.2%} of the "
                "crop is cut.",
                judged(count == 11 and plan.coverage.coverage > 0.99),
            ),
            Finding(
                "Order of the rows",
                "From the edge inwards, the combines on adjacent rows.",
                f"From the edge inwards row after row is cut by combine {', '.join(turns)}.",
                judged(all(one != other for one, other in pairwise(turns))),
            ),
            Finding(
                "How long it takes",
                "",
                f"{plan.makespan_over_bound:.2f} times as long as headers that are always full, "
                f"{plan.waiting:.0%} of it waiting for one another; with a land for each combine "
                f"{lands.makespan_over_bound:.2f} times, {lands.waiting:.0%} waiting.",
                SHOWN,
            ),
        ),
    )


def _cutters(plan: CombinePlan) -> list[str]:
    """Who cuts each row from the left edge to the middle, halfway up."""
    cut = cut_times(plan.field, plan.size, plan.paths)
    x_low, y_low, _, y_high = plan.field.world.bounds
    width = plan.size.header_width
    # Where rows are as long as the field is wider than high, the inmost ones run across.
    rows = int((y_high - y_low) / width) // 2
    at = np.array([[x_low + (row + 0.5) * width, (y_low + y_high) / 2] for row in range(rows)])
    column, row = np.floor((at - cut.corner) / CELL).astype(int).T
    return [str(each) for each in cut.cutter[row, column]]


FIELD_PATHS = Exhibit(
    id="figure-3.8",
    covers=("Figure 3.8",),
    title="Paths of two combines",
    states="Two combines work on adjacent rows of a field of 400 x 275 units in 11 rows, from the "
    "perimeter inwards.",
    command=f"sightfield harvest thesis_2 --set pattern=thesis --set field.margin={MARGIN:g} "
    "--out out/harvest",
    make=_make,
)
