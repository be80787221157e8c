"""Figures 3.4 to 3.6 and 3.8: how one cart serves combines, and their paths over a field."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ....systems.numerics.harvest.carts.cut_times import CELL, cut_times
from ....systems.numerics.harvest.plan.harvest_plan import CombinePlan, plan_combines
from ....systems.numerics.harvest.schedule.answer import (
    answer_schedule,
    answer_timetable,
    drawn_timetable,
    first_loads,
)
from ....systems.numerics.harvest.schedule.closed_forms import (
    EqualCombines,
    loads_at_start,
    travel_time_max,
    waiting_sum,
)
from ...harvest import scenarios
from ...harvest.pictures import save_coverage_picture
from ...harvest.scenario import HarvestScenario
from ...scenario_files import find_scenario, load_scenario
from ...schedule.load_diagram import save_load_diagram
from .evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Workshop, judged

# Of our choice, the figures having no numbers: kg, kg/s.
CAPACITY, FILL, UNLOAD = 9000.0, 20.0, 150.0
# As parts: from the longest way to one that is surely shorter or longer, and what rounding costs.
SIDE, ROUNDING = 1e-6, 1e-9
# Rounds that are simulated.
ROUNDS = 40


def _limit_as_printed(combines: int) -> float:
    """(3.1), (3.7) and (3.10): the longest way between neighbours [s]."""
    c, f, u = CAPACITY, FILL, UNLOAD
    if combines == 2:
        return (u * c - 2 * f * c) / (2 * f * (u - f))
    if combines == 3:
        return (u - 3 * f) * c / (4 * f * (u - f))
    return (u - combines * f) * c / ((2 * combines - 2) * f * (u - f))


def _unloading(workshop: Workshop, combines: int, number: str) -> Evidence:
    limit = _limit_as_printed(combines)
    equal = EqualCombines(combines, CAPACITY, FILL, UNLOAD, 0.8 * limit)
    answer = answer_schedule(equal.fleet())
    drawn = drawn_timetable(answer, 2)
    file = workshop.pictures / f"figure_{number.replace('.', '_')}.png"
    save_load_diagram(file, answer, drawn)
    within, beyond = (
        replace(equal, travel_time=limit * (1 + side)).fleet() for side in (-SIDE, SIDE)
    )
    overflows = answer_timetable(answer_schedule(within), ROUNDS).overflows
    refused = not answer_schedule(beyond).feasible
    loads, expected = first_loads(equal.fleet(), drawn), loads_at_start(equal)
    apart = max(abs(a - b) for a, b in zip(loads, expected, strict=True))
    return Evidence(
        (Picture(file, f"Loads of {combines} tanks, and below them what the cart does."),),
        (
            Finding(
                "The longest way between neighbours",
                f"Printed bound on dT, here {limit:.4f} s.",
                f"Our closed form {travel_time_max(equal):.4f} s. By linear programming a "
                f"schedule exists a millionth below it and {'none' if refused else 'one too'} "
                f"above; simulated for {ROUNDS} rounds, "
                f"{'no tank runs' if not overflows else 'a tank runs'} over.",
                judged(
                    abs(travel_time_max(equal) / limit - 1) < ROUNDING and refused and not overflows
                ),
            ),
            Finding(
                "The first round",
                "The first and the last combine are full when the cart comes; those between hold "
                "C' of their own.",
                f"Loads found: {', '.join(f'{load:.0f}' for load in loads)} kg, by the closed "
                f"form to {apart:.1g} kg; waiting times sum to {waiting_sum(equal):.1f} s.",
                judged(apart < CAPACITY * ROUNDING),
            ),
        ),
    )


def _exhibit(number: str, combines: int, equations: str) -> Exhibit:
    command = (
        f"sightfield schedule --combines {combines} --capacity {CAPACITY:g} --fill-rate {FILL:g} "
        f"--unload-rate {UNLOAD:g} --travel-time {0.8 * _limit_as_printed(combines):.2f} "
        "--out out/schedule"
    )
    return Exhibit(
        id=f"figure-{number}",
        covers=(f"Figure {number}",),
        title=f"Scheduling for {'N' if number == '3.6' else combines} combines",
        states="The load of each tank over time, and the cart's waiting times; from it the "
        f"conditions {equations}. The figure has no numbers: ours are C = {CAPACITY:g} kg, "
        f"r_f = {FILL:g} and r_u = {UNLOAD:g} kg/s"
        + (f", N = {combines}." if number == "3.6" else "."),
        command=command,
        make=lambda workshop: _unloading(workshop, combines, number),
    )


UNLOADING = (
    _exhibit("3.4", 2, "(3.1)"),
    _exhibit("3.5", 3, "(3.2) to (3.7)"),
    _exhibit("3.6", 5, "(3.8) to (3.10)"),
)


# Combines that begin side by side need room outside of the field [m].
MARGIN = 34.0


def _field_paths(workshop: Workshop) -> Evidence:
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
    make=_field_paths,
)
