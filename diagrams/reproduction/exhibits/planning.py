"""Figures 3.9 and 3.10 and Table 3.1: the grain cart's way, by both approaches."""

import math
from dataclasses import replace

import numpy as np

from ....systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from ....systems.numerics.planning.plan import Plan
from ....systems.numerics.planning.planners.thesis_scheme import METHOD as AVERAGING
from ....systems.numerics.planning.planners.thesis_scheme import (
    plan_by_averaging,
    solve_by_averaging,
)
from ....systems.numerics.planning.trailer import Trailer
from ....systems.numerics.planning.value_function.grid import THESIS_STEP, grid_around
from ....systems.numerics.planning.value_function.value_function import ValueFunction
from ...planning.methods import METHODS, VARIANTS, PlanningQuestion
from ...planning.pictures import save_paths_picture, save_sweep_picture
from ...planning.sweep import RATIOS, RISE, sweep_ratios
from ...planning.verdict import ask_methods
from .evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Workshop, judged

# Table 3.1: h_x and h_y [m], h_theta and h_beta [rad].
THESIS_GRID = (0.2, 0.2, 0.251, 0.251)
QUESTION = PlanningQuestion(
    start=(1.0, 1.0, 0.0, 0.0),
    goal=Goal(state=(4.0, 4.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE),
)
OURS, PRIMITIVE = "value-function", "primitive"
REACHED = 1e-3
# Ways that differ by less are as good.
SAME = 1e-3


def _cart_paths(workshop: Workshop) -> Evidence:
    # The averaging scheme takes half a minute.
    methods = [name for name in METHODS if not (workshop.quick and name in VARIANTS)]
    verdict = ask_methods(QUESTION, methods)
    rows = {row.method: row for row in verdict.rows}
    times = {name: row.plan.time for name, row in rows.items()}
    both = (OURS, PRIMITIVE)
    misses = {name: rows[name].violation for name in both}
    arrive = all(rows[name].plan.converged and (misses[name] or 0.0) < REACHED for name in both)
    file = workshop.pictures / "figure_3_9.png"
    save_paths_picture(file, verdict)
    grid = grid_around(QUESTION.trailer, QUESTION.start, QUESTION.goal, THESIS_STEP)
    angles = (math.tau / grid.theta_count, math.tau / grid.beta_count)
    spacing = (grid.step, grid.step, *angles)
    finer = THESIS_STEP * (0.75 if workshop.quick else 0.5)
    fine = METHODS[OURS](
        PlanningQuestion(start=QUESTION.start, goal=QUESTION.goal, grid_step=finer)
    )
    best = verdict.best_time
    errors = times[OURS] / best - 1, fine.time / best - 1
    tables = [abs(_interpolated(plan) / best - 1) for plan in (rows[OURS].plan, fine)]
    return Evidence(
        (Picture(file, "Ways of tractor (full) and trailer (dashed) by every planner."),),
        (
            Finding(
                "Refinement (Table 3.1)",
                "h_x = h_y = 0.2, h_theta = h_beta = 0.251 rad; dt = 0.05, epsilon = 0.005 of the "
                "averaging scheme.",
                "Our grid: " + ", ".join(f"{step:.4g}" for step in spacing) + ".",
                judged(
                    all(
                        math.isclose(ours, theirs, rel_tol=5e-3)
                        for ours, theirs in zip(spacing, THESIS_GRID, strict=True)
                    )
                ),
            ),
            Finding(
                "Both approaches reach the goal",
                "Both paths end in a range of the goal.",
                f"Driven through the Drake plant, the value function's takes {times[OURS]:.3f} s "
                f"and misses by {misses[OURS]:.1e}, the primitives' {times[PRIMITIVE]:.3f} s and "
                f"{misses[PRIMITIVE]:.1e}.",
                judged(arrive),
            ),
            Finding(
                "Finer grids",
                "With smaller refinement parameters the path is more accurate, and takes longer "
                "to compute.",
                f"Driven down the table {errors[0]:+.2%} of the best known time at step "
                f"{THESIS_STEP:g}, {errors[1]:+.2%} at {finer:g}; the table itself, interpolated, "
                f"is off by {tables[0]:.2%} and {tables[1]:.2%}.",
                judged(tables[1] <= tables[0] and errors[1] <= errors[0] + SAME),
            ),
            Finding(
                "Beyond: the optimum" + ("" if workshop.quick else ", and the scheme as printed"),
                "",
                f"The least time into this box is {best:.4f} s."
                + ("" if workshop.quick else _as_printed(rows[AVERAGING].plan, best)),
                SHOWN,
            ),
        ),
    )


def _interpolated(plan: Plan) -> float:
    """The time to go from the start, interpolated in the table [s]."""
    value = plan.notes["value_function"]
    assert isinstance(value, ValueFunction)
    return float(value.interpolated(QUESTION.start))


def _as_printed(plan: Plan, best: float) -> str:
    """What the table by plain averages, (3.15), comes to."""
    if not plan.converged:
        return f" Down the table by plain averages (3.15) the cart is {plan.status}."
    return (
        f" Down the table by plain averages (3.15) {plan.time:.4f} s, {plan.time / best - 1:+.1%}."
    )


CART_PATHS = Exhibit(
    id="figure-3.9",
    covers=("Figure 3.9", "Table 3.1"),
    title="Ways of the grain cart",
    states="Paths of (x, y) from (1, 1, 0, 0) to a range of (4, 4, 0, 0), by the value function on "
    "the grid of Table 3.1 with bang-bang control and by primitives.",
    command="sightfield plan --start 1 1 0 0 --goal 4 4 0 0 --out out/plan",
    make=_cart_paths,
)


OPTIMAL = "polished"
# "Very close", in numbers of our choice; the figure is lost.
CLOSE = 0.05


def _cart_sweep(workshop: Workshop) -> Evidence:
    methods = (
        [OURS, OPTIMAL, PRIMITIVE]
        if workshop.quick
        else [name for name in METHODS if name not in VARIANTS]
    )
    sweep = sweep_ratios(methods, THESIS_TOLERANCE, 5 if workshop.quick else 51)
    if not workshop.quick:
        # The table of the thesis takes minutes.
        sweep = replace(sweep, times={**sweep.times, AVERAGING: _averaged(sweep.ratios)})
    file = workshop.pictures / "figure_3_10.png"
    save_sweep_picture(file, sweep)
    table, primitive = sweep.times[OURS], sweep.times[PRIMITIVE]
    best = np.fmin.reduce([sweep.times[name] for name in methods])
    averaged = sweep.times.get(AVERAGING, np.full(len(best), np.nan))
    arrived = np.isfinite(averaged)
    both = np.isfinite(table) & np.isfinite(primitive)
    gap = primitive[both] / table[both] - 1
    wins = primitive[both] < table[both]
    return Evidence(
        (Picture(file, f"(x_g - x_i) / (y_g - y_i) from {RATIOS[0]:g} to {RATIOS[1]:g}."),),
        (
            Finding(
                "How close the two approaches are",
                "At each ratio the travel times are very close.",
                f"The primitives take {np.median(gap):+.2%} (median) and at most {gap.max():+.2%} "
                f"of the value function's time, at {both.sum()} of {len(both)} ratios; close is "
                f"taken as {CLOSE:.0%}.",
                judged(bool(both.all() and np.abs(gap).max() < CLOSE)),
            ),
            Finding(
                "Where the primitives are better",
                "In some cases they are, because of the numerical approach's error.",
                f"Than our value function, at {wins.sum()} of {both.sum()} ratios"
                + (
                    f"; than the table by plain averages (3.15), at "
                    f"{(primitive < averaged)[arrived].sum()} of the {arrived.sum()} at which "
                    "the cart arrives by it."
                    if not workshop.quick
                    else "."
                ),
                judged(bool(wins.any() or (primitive < averaged)[arrived].any())),
            ),
            Finding(
                "Beyond: the least time",
                "",
                f"Over the best found at each ratio the value function takes "
                f"{np.nanmedian(table / best - 1):+.2%}, the primitives "
                f"{np.nanmedian(primitive / best - 1):+.2%} (medians).",
                SHOWN,
            ),
        ),
    )


def _averaged(ratios: np.ndarray) -> np.ndarray:
    """Times down the table of (3.15), one table for all starts; shape (n,) [s]."""
    trailer, goal = Trailer(), Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
    starts = [(-ratio * RISE, -RISE, 0.0, 0.0) for ratio in ratios.tolist()]
    grid = grid_around(trailer, starts[-1], goal, THESIS_STEP)
    table = solve_by_averaging(trailer, goal, grid)
    plans = [plan_by_averaging(trailer, start, goal, value=table) for start in starts]
    return np.array([plan.time if plan.converged else np.nan for plan in plans])


CART_SWEEP = Exhibit(
    id="figure-3.10",
    covers=("Figure 3.10",),
    title="Travel times of both approaches",
    states="Travel time over (x_g - x_i) / (y_g - y_i) with y_g - y_i = 4, by the value function "
    "and by primitives.",
    command="sightfield plan sweep --out out/sweep",
    make=_cart_sweep,
)
