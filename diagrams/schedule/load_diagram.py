"""The load diagram: what every tank holds over time, and where the cart is (Figures 3.4 to 3.6)."""

from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...systems.numerics.harvest.schedule.answer import ScheduleAnswer
from ...systems.numerics.harvest.schedule.periodic_plan import Timetable

# Of combines, in turn; the first three are the thesis's.
COLOURS = (
    "#d62728", "#178a5a", "#215fcc", "#d9722e", "#8b3fa8", "#0f8b9d", "#8c6d1f", "#c2185b",
    "#5b6770", "#6aa84f",
)  # fmt: skip
CAPACITY, OVERFLOW, TRUCK = "#888888", "#000000", "#333333"


def draw_loads(answer: ScheduleAnswer, timetable: Timetable) -> Figure:
    """Loads above, below them a bar for each visit and each way of each cart.

    Args:
        answer: Whose fleet.
        timetable: What is drawn, from its first to its last event.
    """
    carts = len(timetable.carts)
    figure = Figure(figsize=(12, 5.6 + 0.5 * carts), layout="constrained")
    loads, bars = figure.subplots(2, 1, sharex=True, height_ratios=[5, 0.5 + 0.6 * carts])
    _draw_tanks(loads, answer, timetable)
    _draw_carts(bars, timetable)
    loads.set_title(_title(answer))
    start = min(float(line.times[0]) for line in timetable.tanks)
    end = max(float(line.times[-1]) for line in timetable.tanks)
    bars.set_xlim(start, end)
    bars.set_xlabel("time [s]")
    return figure


def save_load_diagram(path: Path, answer: ScheduleAnswer, timetable: Timetable) -> None:
    """Write what `draw_loads` draws as a PNG picture."""
    draw_loads(answer, timetable).savefig(path, dpi=120)


def _draw_tanks(axes: Axes, answer: ScheduleAnswer, timetable: Timetable) -> None:
    handles: list[Line2D] = []
    for capacity in sorted(set(answer.fleet.capacities)):
        axes.axhline(capacity, color=CAPACITY, linestyle="--", linewidth=1)
    handles.append(Line2D([], [], color=CAPACITY, linestyle="--", label="tank capacity"))
    for n, line in enumerate(timetable.tanks):
        handles += axes.plot(line.times, line.loads, color=_colour(n), label=f"combine {n}")
    for n, time in timetable.overflows.items():
        axes.plot(time, answer.fleet.capacities[n], "v", color=OVERFLOW, markersize=8, zorder=4)
    if timetable.overflows:
        mark = Line2D([], [], color=OVERFLOW, marker="v", linestyle="", label="runs over")
        handles.append(mark)
    axes.set_ylim(0, 1.12 * max(answer.fleet.capacities))
    axes.set_ylabel("load of the tank [kg]")
    axes.grid(alpha=0.25)
    # Beside the lines, which fill the axes from edge to edge.
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)


def _draw_carts(axes: Axes, timetable: Timetable) -> None:
    for visit in timetable.visits:
        colour = _colour(visit.combine)
        begin = visit.start_unloading
        axes.barh(visit.cart, visit.emptied - begin, 0.7, begin, color=colour)
        axes.barh(visit.cart, visit.wait, 0.7, visit.emptied, color=colour, alpha=0.35)
    for number in range(len(timetable.carts)):
        visits = timetable.of_cart(number)
        for here, there in pairwise(visits):
            style = ":" if here.by_truck else "-"
            ends = [here.leave, there.arrive]
            axes.plot(ends, [number, number], style, color=TRUCK, linewidth=1.5)
    handles = [
        Patch(color="#555555", label="empties a tank"),
        Patch(color="#555555", alpha=0.35, label="waits beside it"),
        Line2D([], [], color=TRUCK, label="drives"),
    ]
    if any(visit.by_truck for visit in timetable.visits):
        handles.append(Line2D([], [], color=TRUCK, linestyle=":", label="by the truck"))
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    axes.set_yticks(np.arange(len(timetable.carts)))
    axes.set_yticklabels([f"cart {number}" for number in range(len(timetable.carts))])
    axes.set_ylim(len(timetable.carts) - 0.4, -0.6)


def _title(answer: ScheduleAnswer) -> str:
    carts, combines = len(answer.carts), answer.fleet.size
    who = f"{carts} cart{'s' if carts > 1 else ''}, {combines} combine{'s' if combines > 1 else ''}"
    if not answer.feasible:
        return f"{who}: no schedule; here the cart never waits"
    periods = sorted({round(plan.period, 6) for plan in answer.plans})
    return f"{who}: period {', '.join(f'{period:.4g}' for period in periods)} s"


def _colour(combine: int) -> str:
    return COLOURS[combine % len(COLOURS)]
