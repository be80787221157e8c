"""The timetable of a plan: who does what when, and below it what is in every tank."""

import itertools

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, MultipleLocator

from ...systems.numerics.harvest.paths.timed_path import TimedPath
from .colours import combine_colour
from .job import HarvestJob

# Between two looks at a plan [s].
STEP = 1.0
# Between ticks of the clock [s], and how many of them fit.
TICKS = (10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0, 7200.0, 14400.0)
MOST_TICKS = 16
# Labels of bars nearer to each other than this part of the time would be one on another.
APART = 0.05
# Slower is standing [m/s].
SLOW = 1e-3
TURNING, STANDING, DRIVING, TRUCK = 0.35, "#d9d9d9", "#8c8c8c", "black"
_TONNE = 1000.0
# What combines and carts do, in bars.
_STANDS, _TURNS, _CUTS = range(3)


def draw_timetable(job: HarvestJob) -> Figure:
    """A row for each machine with what it does, and one for each tank with what is in it.

    Args:
        job: Whose plan is drawn.
    """
    work = job.work
    combines, carts = len(work.plans), len(work.motions)
    rows = combines + carts
    heights = [0.5 * rows + 0.4, *[1.1] * combines, 1.3]
    figure = Figure(figsize=(14, sum(heights) + 1.6), layout="constrained")
    axes = figure.subplots(combines + 2, 1, sharex=True, height_ratios=heights)
    _draw_rows(axes[0], job)
    times = np.arange(0.0, work.end + STEP, STEP)
    tanks, loads = work.tanks_at(times) / _TONNE, work.loads_at(times) / _TONNE
    for n, row in enumerate(axes[1:-1]):
        capacity = work.combines[n].capacity / _TONNE
        colour = combine_colour(n)
        row.fill_between(times, tanks[:, n], color=colour, alpha=0.25, linewidth=0)
        row.plot(times, tanks[:, n], color=colour, linewidth=1.2)
        row.axhline(capacity, color="black", linewidth=0.8, linestyle="--")
        for visit in work.visits:
            if visit.combine == n:
                row.axvspan(visit.begin, visit.end, color="0.75", linewidth=0, zorder=0)
        row.set_ylim(0, 1.15 * capacity)
        row.set_ylabel(f"tank {n}\n[t]")
    for k in range(carts):
        style = ("-", "--", ":", "-.")[k % 4]
        axes[-1].plot(times, loads[:, k], style, color="black", linewidth=1.2, label=f"cart {k}")
    axes[-1].set_ylim(bottom=0)
    axes[-1].set_ylabel("carts\n[t]")
    axes[-1].legend(loc="upper left", frameon=False, ncols=4)
    for row in axes:
        row.grid(axis="x", alpha=0.3)
    axes[-1].set_xlim(0, 1.01 * work.end)
    every = next((each for each in TICKS if work.end / each <= MOST_TICKS), TICKS[-1])
    axes[-1].xaxis.set_major_locator(MultipleLocator(every))
    axes[-1].xaxis.set_major_formatter(FuncFormatter(lambda time, _: clock(time)))
    axes[-1].set_xlabel("time from the start [h:min:s]")
    return figure


def clock(time: float) -> str:
    """A time as hours, minutes and seconds.

    Args:
        time: [s].
    """
    whole = round(time)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


def _draw_rows(axes: Axes, job: HarvestJob) -> None:
    work = job.work
    combines = len(work.plans)
    names = [f"combine {n}" for n in range(combines)]
    names += [f"cart {k}" for k in range(len(work.motions))]
    for n, timed in enumerate(work.plans):
        colour = combine_colour(n)
        looks = {
            _CUTS: {"color": colour},
            _TURNS: {"color": colour, "alpha": TURNING},
            _STANDS: {"color": STANDING},
        }
        for what, begin, end in _spells(timed):
            axes.barh(n, end - begin, 0.7, begin, linewidth=0, **looks[what])
    for k, motion in enumerate(work.motions):
        for what, begin, end in _spells(motion.timed):
            look = STANDING if what == _STANDS else DRIVING
            axes.barh(combines + k, end - begin, 0.25, begin, color=look, linewidth=0)
    told = np.full(len(work.motions), -np.inf)
    for visit in sorted(work.visits, key=lambda each: each.begin):
        row, colour = combines + visit.cart, combine_colour(visit.combine)
        lasts = visit.end - visit.begin
        axes.barh(row, lasts, 0.8, visit.begin, color=colour, edgecolor="black", linewidth=0.6)
        middle = (visit.begin + visit.end) / 2
        said = f"{visit.combine}: {visit.taken / _TONNE:.1f} t"
        if middle - told[visit.cart] > APART * work.end:
            axes.annotate(said, (middle, row - 0.42), ha="center", va="bottom", fontsize=7)
            told[visit.cart] = middle
        # A line through the combine's own row shows when it is served.
        axes.barh(visit.combine, lasts, 0.14, visit.begin, color="black", linewidth=0)
    for trip in work.trips:
        row = combines + trip.cart
        for begin, end, _ in trip.flows:
            axes.barh(row, end - begin, 0.8, begin, color=TRUCK)
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    handles: list[Patch | Line2D] = [
        Patch(color="0.3", label="cuts"),
        Patch(color="0.3", alpha=TURNING, label="turns, drives"),
        Patch(color=STANDING, label="stands"),
        Line2D([], [], color="black", linewidth=3, label="is emptied"),
        Line2D([], [], color=DRIVING, linewidth=4, label="cart drives"),
        Patch(facecolor="white", edgecolor="black", label="cart takes grain of (colour, number)"),
        Patch(color=TRUCK, label="cart is emptied at its truck"),
    ]
    axes.legend(
        handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=7, frameon=False,
        fontsize="small", columnspacing=1.2, handlelength=1.6,
    )  # fmt: skip
    axes.set_title(f"all done after {clock(work.end)}", loc="right", fontsize="medium", pad=28)


def _spells(timed: TimedPath) -> list[tuple[int, float, float]]:
    """What a machine does, from when to when [s]."""
    if timed.end <= timed.times[0]:
        return []
    count = max(2, int(np.ceil((timed.end - timed.times[0]) / STEP)) + 1)
    edges = np.linspace(timed.times[0], timed.end, count)
    middles = (edges[:-1] + edges[1:]) / 2
    path = timed.path
    does = np.where(path.cutting[path.piece_at(timed.station_at(middles))], _CUTS, _TURNS)
    does[np.diff(timed.station_at(edges)) < SLOW * np.diff(edges)] = _STANDS
    changes = [0, *(np.flatnonzero(np.diff(does)) + 1).tolist(), len(does)]
    return [
        (int(does[first]), float(edges[first]), float(edges[last]))
        for first, last in itertools.pairwise(changes)
    ]
