"""Figure 3.10: travel time of the numerical and the primitive approach over the direction."""

from dataclasses import replace

import numpy as np

from ....systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from ....systems.numerics.planning.planners.thesis_scheme import METHOD as AVERAGING
from ....systems.numerics.planning.planners.thesis_scheme import (
    plan_by_averaging,
    solve_by_averaging,
)
from ....systems.numerics.planning.trailer import Trailer
from ....systems.numerics.planning.value_function.grid import THESIS_STEP, grid_around
from ...planning.methods import METHODS, VARIANTS
from ...planning.pictures import save_sweep_picture
from ...planning.sweep import RATIOS, RISE, sweep_ratios
from ..evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Workshop, judged

NUMERICAL, PRIMITIVE, OPTIMAL = "value-function", "primitive", "polished"
# "Very close", in numbers of our choice; the figure is lost.
CLOSE = 0.05


def _make(workshop: Workshop) -> Evidence:
    methods = (
        [NUMERICAL, OPTIMAL, PRIMITIVE]
        if workshop.quick
        else [name for name in METHODS if name not in VARIANTS]
    )
    sweep = sweep_ratios(methods, THESIS_TOLERANCE, 5 if workshop.quick else 51)
    if not workshop.quick:
        # The table of the thesis takes minutes.
        sweep = replace(sweep, times={**sweep.times, AVERAGING: _averaged(sweep.ratios)})
    file = workshop.pictures / "figure_3_10.png"
    save_sweep_picture(file, sweep)
    table, primitive = sweep.times[NUMERICAL], sweep.times[PRIMITIVE]
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
    make=_make,
)
