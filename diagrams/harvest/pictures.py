"""Plots of a plan: paths of combines over a field, as in Figure 3.8, and the timetable.

The timetable shows who does what when, and below it what is in every tank.
"""

import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, MultipleLocator

from ...systems.numerics.harvest.carts.cart_plan import CartVisit
from ...systems.numerics.harvest.carts.cut_times import CELL, CutTimes, cut_times
from ...systems.numerics.harvest.field.field import Field
from ...systems.numerics.harvest.paths import TimedPath, runs_of
from ...systems.numerics.harvest.plan.harvest_plan import CombinePlan
from ...systems.numerics.harvest.plan.plan_files import path_points
from ..world_picture import OBSTACLE, OUTSIDE
from .colours import combine_colour
from .job import HarvestJob

_SIZE = 120
_STANDING = "#e3b341"

# How much white is mixed into what a combine has cut, so that its path stands out.
_PALENESS = 0.78

# Between two looks at a plan [s].
STEP = 1.0
# Between ticks of the clock [s], and how many of them fit.
TICKS = (10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0, 7200.0, 14400.0)
MOST_TICKS = 16
# Labels of bars nearer to each other than this part of the time would be one on another.
APART = 0.045
# Height of bars in rows of height 1, so that labels have room between them.
BAR = 0.6
# Slower is standing [m/s].
SLOW = 1e-3
TURNING, STANDING, DRIVING, TRUCK = 0.35, "#d9d9d9", "#8c8c8c", "black"
_TONNE = 1000.0
# What combines and carts do, in bars.
_STANDS, _TURNS, _CUTS = range(3)


def save_coverage_picture(path: Path, plan: CombinePlan) -> None:
    """Draw who drives where and cuts what, and the crop that is left standing."""
    width, height = np.ptp(plan.field.world.bounds.reshape(2, 2), axis=0)
    wide, high = np.maximum(10.0 * np.array([width, height]) / max(width, height), 4.0)
    figure = Figure(figsize=(wide + 0.6, high + 1.2), layout="constrained")
    axes = figure.add_subplot()
    draw_coverage(axes, plan)
    covered = plan.coverage
    full = covered.area / plan.size.header_width
    axes.set_title(
        f"Combines: {len(plan.paths)}. {100 * covered.coverage:.2f} % covered, "
        f"{covered.area - covered.covered_area:.0f} m² missed, "
        f"{covered.length / full:.2f} times as far as headers that are always full",
        fontsize="medium",
    )
    figure.legend(loc="outside lower center", ncols=len(plan.paths) + 5, edgecolor="none")
    figure.savefig(path, dpi=_SIZE, bbox_inches="tight")


def draw_coverage(axes: Axes, plan: CombinePlan) -> None:
    """Draw paths over the field: thick while cutting, thin on the way, dotted backwards.

    Args:
        axes: Where to; its aspect, limits and labels are set.
        plan: What.
    """
    colours = [combine_colour(n) for n in range(len(plan.paths))]
    draw_cut(axes, plan.field, cut_times(plan.field, plan.size, plan.paths), colours)
    for n, (timed, colour) in enumerate(zip(plan.paths, colours, strict=True)):
        path = timed.path
        for pieces, style in (
            (path.cutting, {"linewidths": 1.5}),
            (~path.cutting & (path.gears > 0), {"linewidths": 0.8, "linestyles": "--"}),
            (~path.cutting & (path.gears < 0), {"linewidths": 0.8, "linestyles": ":"}),
        ):
            lines = [path_points(path, *run) for run in runs_of(pieces)]
            axes.add_collection(LineCollection(lines, color=colour, **style))
        axes.plot([], [], color=colour, label=f"combine {n}")
        axes.plot(*path.poses[0, :2], "o", color=colour, markersize=6, markeredgecolor="black")
        axes.plot(*path.poses[-1, :2], "s", color=colour, markersize=6, markeredgecolor="black")
    axes.plot([], [], color="gray", linestyle="--", linewidth=0.8, label="on the way")
    axes.plot([], [], color="gray", linestyle=":", linewidth=0.8, label="backwards")
    x_low, y_low, x_high, y_high = plan.field.ground.bounds
    axes.set_xlim(x_low, x_high)
    axes.set_ylim(y_low, y_high)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]; dots: starts, squares: ends")
    axes.set_ylabel("y [m]")


def draw_cut(axes: Axes, field: Field, cut: CutTimes, colours: Sequence[str]) -> None:
    """Draw who cuts what, pale, what is left standing, obstacles, boundary and margin.

    Args:
        axes: Where to.
        field: What is cut.
        cut: When and by whom.
        colours: Of the combines.
    """
    axes.set_facecolor(OUTSIDE)
    pale = [tuple(_PALENESS + (1 - _PALENESS) * np.array(to_rgb(colour))) for colour in colours]
    rows, columns = cut.cutter.shape
    x, y = cut.corner
    axes.imshow(
        np.ma.masked_where(np.isneginf(cut.times), cut.cutter + 1),
        origin="lower",
        extent=(x, x + columns * CELL, y, y + rows * CELL),
        cmap=ListedColormap([to_rgb(_STANDING), *pale]),
        vmin=-0.5,
        vmax=len(colours) + 0.5,
        interpolation="nearest",
    )
    for obstacle in field.obstacles:
        axes.fill(*np.array(obstacle.exterior.coords).T, color=OBSTACLE)
    for name, area, style in (("boundary", field.outline, "-"), ("margin", field.ground, ":")):
        ring = np.array(area.exterior.coords).T
        axes.plot(*ring, color="gray", linewidth=0.7, linestyle=style, label=name)
    axes.plot([], [], "s", color=_STANDING, markersize=7, label="left standing")


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
        # Whoever has parked with grain waits for the last cart.
        last = max((visit.end for visit in work.visits if visit.combine == n), default=0.0)
        parked = [(_STANDS, timed.end, last)] if last > timed.end else []
        for what, begin, end in [*_spells(timed), *parked]:
            axes.barh(n, end - begin, BAR, begin, linewidth=0, **looks[what])
    for k, motion in enumerate(work.motions):
        for what, begin, end in _spells(motion.timed):
            look = STANDING if what == _STANDS else DRIVING
            axes.barh(combines + k, end - begin, 0.25, begin, color=look, linewidth=0)
    for visit in work.visits:
        row, colour = combines + visit.cart, combine_colour(visit.combine)
        lasts = visit.end - visit.begin
        axes.barh(row, lasts, BAR, visit.begin, color=colour, edgecolor="black", linewidth=0.6)
        # A line through the combine's own row shows when it is served.
        axes.barh(visit.combine, lasts, 0.14, visit.begin, color="black", linewidth=0)
    for visit in _told(work.visits, APART * work.end):
        said = f"{visit.combine}: {visit.taken / _TONNE:.1f} t"
        above = combines + visit.cart - BAR / 2 - 0.02
        middle = (visit.begin + visit.end) / 2
        axes.annotate(said, (middle, above), ha="center", va="bottom", fontsize=7)
    for trip in work.trips:
        row = combines + trip.cart
        for each in trip.fillings:
            axes.barh(row, each.end - each.begin, BAR, each.begin, color=TRUCK)
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


def _told(visits: Sequence[CartVisit], apart: float) -> list[CartVisit]:
    """Visits that there is room to tell of, those that take more before others.

    Args:
        visits: All.
        apart: Between the middles of two of one cart at least [s].
    """
    told: list[CartVisit] = []
    for visit in sorted(visits, key=lambda each: -each.taken):
        if all(
            abs(visit.begin + visit.end - other.begin - other.end) >= 2 * apart
            for other in told
            if other.cart == visit.cart
        ):
            told.append(visit)
    return told


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
