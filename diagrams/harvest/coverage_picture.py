"""Paths of combines over a field, as in Figure 3.8."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.figure import Figure

from ...systems.numerics.harvest.carts.cut_times import CELL, CutTimes, cut_times
from ...systems.numerics.harvest.field.field import Field
from ...systems.numerics.harvest.paths.machine_path import MachinePath
from ...systems.numerics.harvest.plan.combine_plan import CombinePlan
from ..world_picture import OBSTACLE, OUTSIDE
from .colours import combine_colour

_SIZE = 120
_STANDING = "#e3b341"

# How much white is mixed into what a combine has cut, so that its path stands out.
_PALENESS = 0.78

# Of points on the lines that are drawn [m].
_STEP = 0.5


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
    figure.legend(loc="outside lower center", ncols=len(plan.paths) + 2, edgecolor="none")
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
            axes.add_collection(LineCollection(_runs(path, pieces), color=colour, **style))
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
    """Draw who cuts what, pale, and obstacles and margin.

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
    axes.plot(*np.array(field.ground.exterior.coords).T, color="gray", linewidth=0.6, linestyle=":")


def _runs(path: MachinePath, pieces: np.ndarray) -> list[np.ndarray]:
    """Lines through the pieces that are marked, each as long as they follow on each other."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], pieces.astype(int), [0]])))
    fine = np.unique(np.concatenate([path.stations, path.stations_every(_STEP)]))
    lines = []
    for first, last in edges.reshape(-1, 2).tolist():
        begin, end = path.stations[first], path.stations[last]
        lines.append(path.pose_at(fine[(fine >= begin) & (fine <= end)])[:, :2])
    return lines
