"""A map for drivers: swaths with numbers and directions, entries, trucks, gates, scale, north."""

import math
from collections.abc import Iterator

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch, Patch, PathPatch, Polygon
from matplotlib.path import Path as Outline

from ...systems.numerics.harvest.carts.cart_plan import CartVisit
from ...systems.numerics.harvest.paths import runs_of
from ...systems.numerics.harvest.plan.plan_files import Swath, path_points, swaths_of
from ...systems.numerics.units import area_text
from .colours import combine_colour
from .job import HarvestJob

# Of the sheet, A4 across [inch].
SHEET = (11.7, 8.3)
CROP, SHUT, NO_GO, WAY = "#f6efd2", "#b7c9d6", "#e8b4ad", "0.35"
# Shorter swaths have no number of their own, as parts of the width of the field [-].
SHORT = 0.012
# Where numbers may be, as parts of the length of a swath [-], and how large they are, as parts of
# the width of the field [-].
NUMBER_AT = (0.2, 0.15, 0.25, 0.1, 0.3, 0.35, 0.4)
NUMBER_SIZE = 0.027
# Of a letter of a name, with its frame, and what is kept free round marks [points].
LETTER, LINE, ROOM = 5.2, 14.0, 7.0
# How far from their marks names may be [points], and in how many directions they are tried.
NAME_AT, NAME_DIRECTIONS = (4.0, 12.0, 22.0, 34.0, 48.0), 16


def draw_map(job: HarvestJob) -> Figure:
    """What a driver needs of a plan, on a sheet: where to begin, what to cut in which order.

    Args:
        job: Whose plan is drawn.
    """
    field, plan = job.field, job.plan
    figure = Figure(figsize=SHEET, layout="constrained")
    axes = figure.subplots()
    axes.add_patch(_patch(field.polygon, facecolor=CROP, edgecolor="black", linewidth=1.4))
    for obstacle in field.obstacles:
        axes.add_patch(_patch(obstacle, facecolor=SHUT, edgecolor="black", hatch="//"))
    for area in field.no_go:
        axes.add_patch(_patch(area, facecolor=NO_GO, edgecolor="darkred", hatch="xx"))
    low_x, low_y, high_x, high_y = field.ground.bounds
    size = max(high_x - low_x, high_y - low_y)
    for n, timed in enumerate(plan.service.plans):
        colour = combine_colour(n)
        lines = [path_points(timed.path, *run) for run in runs_of(~timed.path.cutting)]
        axes.add_collection(
            LineCollection(lines, colors=colour, linewidths=0.6, linestyles=":", alpha=0.7)
        )
    names: list[tuple[tuple[float, float], str]] = []
    marks: list[tuple[float, float]] = []
    for n, timed in enumerate(plan.service.plans):
        colour = combine_colour(n)
        start, end = timed.path.poses[0], timed.path.poses[-1]
        tail = _arrow_into(axes, start, colour, 0.05 * size)
        names.append((tail, f"start {n}"))
        axes.plot(*end[:2], "s", color=colour, markersize=9, markeredgecolor="black", zorder=6)
        marks += [(start[0], start[1]), (end[0], end[1])]
    for visit in plan.service.visits:
        pose = plan.service.plans[visit.combine].pose_at(visit.begin)
        x, y = _draw_visit(axes, pose, visit, job.reach)
        # What is said of it stands to the right.
        marks += [(x, y), (x + NUMBER_SIZE * size, y)]
    for swath in swaths_of(plan):
        _draw_swath(axes, swath, size, marks)
    for k, truck in enumerate(plan.supply.trucks):
        axes.plot(*truck[:2], "P", color="black", markersize=12, markeredgecolor="white", zorder=7)
        names.append(((truck[0], truck[1]), f"truck, cart {k}"))
    for gate in field.gates:
        axes.plot(*gate, "D", color="gold", markersize=10, markeredgecolor="black", zorder=7)
        names.append(((gate[0], gate[1]), "gate"))
    pad = 0.03 * size
    # As the sheet is filled, but for its title and legend [m per point].
    wide, high = high_x - low_x + 2 * pad, high_y - low_y + 2 * pad + 0.08 * size
    scale = max(wide / SHEET[0], high / (0.85 * SHEET[1])) / 72
    _write_names(axes, names, marks, field.outline.centroid, scale)
    axes.set_xlim(low_x - pad, high_x + pad)
    axes.set_ylim(low_y - pad - 0.08 * size, high_y + pad)
    axes.set_aspect("equal")
    axes.set_axis_off()
    _draw_scale(axes, (low_x, low_y - pad - 0.05 * size), size)
    _draw_north(axes, (low_x + 0.4 * size, low_y - pad - 0.08 * size), size, field.place.geographic)
    _write_legend(figure, job)
    return figure


def _draw_swath(axes: Axes, swath: Swath, size: float, marks: list[tuple[float, float]]) -> None:
    """Draw a swath with its number, which keeps off all marks, and becomes one."""
    colour = combine_colour(swath.combine)
    axes.plot(*swath.points.T, color=colour, linewidth=1.5, solid_capstyle="butt", zorder=3)
    line = shapely.LineString(swath.points)
    if line.length < SHORT * size:
        return
    arrow_at = line.length * 0.6
    places = [_point(line, part * line.length) for part in NUMBER_AT]
    gaps = [min((math.dist(place, each) for each in marks), default=math.inf) for place in places]
    free = [place for place, gap in zip(places, gaps, strict=True) if gap >= NUMBER_SIZE * size]
    x, y = free[0] if free else places[int(np.argmax(gaps))]
    marks.append((x, y))
    font = 8
    axes.text(
        x, y, str(swath.number), color="white", fontsize=font, weight="bold", ha="center",
        va="center", zorder=5, bbox={"boxstyle": "circle,pad=0.15", "fc": colour, "ec": "none"},
    )  # fmt: skip
    step = min(line.length * 0.05, 2.0)
    here, there = (_point(line, arrow_at + each) for each in (-step, step))
    head = FancyArrowPatch(
        here, there, arrowstyle="-|>", mutation_scale=16, color=colour, linewidth=0, zorder=4
    )
    axes.add_patch(head)


def _draw_visit(
    axes: Axes, pose: np.ndarray, visit: CartVisit, reach: float
) -> tuple[float, float]:
    """Mark where a cart comes beside a combine, with its number and the minute; that place."""
    x, y = pose[:2] + reach * np.array([-math.sin(pose[2]), math.cos(pose[2])])
    axes.plot(
        x, y, "^", color="white", markersize=7, zorder=6,
        markeredgecolor=combine_colour(visit.combine), markeredgewidth=1.4,
    )  # fmt: skip
    axes.annotate(
        f"{visit.cart}: {visit.begin / 60:.0f}'", (x, y), xytext=(5, -3), fontsize=6, zorder=6,
        textcoords="offset points", bbox={"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none",
        "alpha": 0.75},
    )  # fmt: skip
    return x, y


def _point(line: shapely.LineString, along: float) -> tuple[float, float]:
    point = line.interpolate(along)
    return point.x, point.y


def _arrow_into(axes: Axes, pose: np.ndarray, colour: str, length: float) -> tuple[float, float]:
    """Draw an arrow to where a combine begins; the arrow's tail."""
    x, y, heading = pose.tolist()
    tail = (x - length * math.cos(heading), y - length * math.sin(heading))
    arrow = FancyArrowPatch(
        tail, (x, y), arrowstyle="-|>", mutation_scale=22, color=colour, linewidth=3.5, zorder=6,
        shrinkA=0, shrinkB=0,
    )  # fmt: skip
    axes.add_patch(arrow)
    axes.plot(x, y, "o", color=colour, markersize=8, markeredgecolor="black", zorder=6)
    return tail


def _ways_to_names(half: np.ndarray, outwards: float, scale: float) -> Iterator[np.ndarray]:
    """Ways from a mark to the middle of its name, those liked most first, shape (2,) [m].

    Args:
        half: Of the name's width and height, shape (2,) [m].
        outwards: The direction that is liked most [rad].
        scale: Of the sheet [m per point].
    """
    turns = sorted(
        (math.tau * k / NAME_DIRECTIONS for k in range(NAME_DIRECTIONS)),
        key=lambda turn: abs(math.remainder(turn, math.tau)),
    )
    for gap in NAME_AT:
        for turn in turns:
            ahead = np.array([math.cos(outwards + turn), math.sin(outwards + turn)])
            # So far that the name's frame is beyond the mark by the gap.
            yield ahead * np.min((half + (ROOM + gap) * scale) / np.maximum(np.abs(ahead), 1e-9))


def _write_names(
    axes: Axes,
    names: list[tuple[tuple[float, float], str]],
    marks: list[tuple[float, float]],
    middle: shapely.Point,
    scale: float,
) -> None:
    """Write names beside what they name, away from the field where there is room.

    They keep off each other and off all marks; a line leads to those that are farther away.

    Args:
        axes: Written to.
        names: Places and what they are called [m].
        marks: What else is to be seen [m].
        middle: Of the field [m].
        scale: Of the sheet [m per point].
    """
    taken = [shapely.Point(each).buffer(ROOM * scale) for each in marks]
    taken += [shapely.Point(point).buffer(ROOM * scale) for point, _ in names]
    for (x, y), said in names:
        half = np.array([len(said) * LETTER / 2, LINE / 2]) * scale
        outwards = math.atan2(y - middle.y, x - middle.x)
        least, at = math.inf, np.zeros(2)
        for off in _ways_to_names(half, outwards, scale):
            place = np.array([x, y]) + off
            frame = shapely.box(*place - half, *place + half)
            hidden = sum(frame.intersection(each).area for each in taken)
            if hidden < least:
                least, at = hidden, place
            if not hidden:
                break
        taken.append(shapely.box(*at - half, *at + half))
        axes.annotate(
            said, (x, y), xytext=(at[0], at[1]), fontsize=8, weight="bold", ha="center",
            va="center", zorder=8, arrowprops={"arrowstyle": "-", "lw": 0.6, "shrinkB": 5},
            bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.8},
        )  # fmt: skip


def _draw_scale(axes: Axes, corner: tuple[float, float], size: float) -> None:
    """A bar of a round length, half of it black."""
    power = 10.0 ** math.floor(math.log10(size / 4))
    length = max(each * power for each in (1, 2, 5) if each * power <= size / 4)
    x, y = corner
    high = 0.008 * size
    for k, colour in enumerate(("black", "white")):
        left = x + k * length / 2
        box = [(left, y), (left + length / 2, y), (left + length / 2, y + high), (left, y + high)]
        axes.add_patch(Polygon(box, facecolor=colour, edgecolor="black", linewidth=0.8))
    for k, said in enumerate(("0", f"{length / 2:g}", f"{length:g} m")):
        axes.text(x + k * length / 2, y - high / 2, said, ha="center", va="top", fontsize=9)


def _draw_north(axes: Axes, foot: tuple[float, float], size: float, known: bool) -> None:
    """An arrow to the north, or where nobody knows it along y."""
    x, y = foot
    tip = (x, y + 0.07 * size)
    arrow = FancyArrowPatch(foot, tip, arrowstyle="-|>", mutation_scale=20, color="black", lw=2.5)
    axes.add_patch(arrow)
    said = "N" if known else "y (north unknown)"
    axes.text(x + 0.012 * size, y + 0.035 * size, said, va="center", fontsize=13, weight="bold")


def _write_legend(figure: Figure, job: HarvestJob) -> None:
    field, combine = job.field, job.scenario.combines
    name = f"{field.name}: " if field.name else ""
    figure.suptitle(
        f"{name}{area_text(field.area)}, header {combine.header_width:g} m; "
        "each combine cuts its swaths in the order of their numbers",
        fontsize="large",
    )
    handles: list[Line2D | Patch] = [
        Line2D([], [], color=combine_colour(n), linewidth=2.5, label=f"combine {n}")
        for n in range(len(job.plan.service.plans))
    ]
    handles += [
        Line2D([], [], color=WAY, linewidth=0.8, linestyle=":", label="turn, header up"),
        Line2D([], [], color=WAY, marker="s", linestyle="", label="end"),
        Line2D([], [], color="black", marker="P", linestyle="", label="truck"),
        Line2D(
            *([], []),
            color="white",
            marker="^",
            linestyle="",
            markeredgecolor=WAY,
            label="cart comes: its number and the minute",
        ),
    ]
    if len(field.gates):
        handles.append(
            Line2D(
                [],
                [],
                marker="D",
                linestyle="",
                color="gold",
                markeredgecolor="black",
                label="gate",
            )
        )
    if field.obstacles:
        handles.append(Patch(facecolor=SHUT, edgecolor="black", hatch="//", label="obstacle"))
    if field.no_go:
        handles.append(Patch(facecolor=NO_GO, edgecolor="darkred", hatch="xx", label="no-go"))
    figure.legend(handles=handles, loc="outside lower center", ncols=6, frameon=False)


def _patch(polygon: shapely.Polygon, **look: object) -> PathPatch:
    rings = [np.array(ring.coords)[:, :2] for ring in (polygon.exterior, *polygon.interiors)]
    outlines = Outline.make_compound_path(*(Outline(ring, closed=True) for ring in rings))
    return PathPatch(outlines, **look)
