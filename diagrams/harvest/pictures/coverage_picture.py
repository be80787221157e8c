"""Paths of combines over a field, as in Figure 3.8."""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.figure import Figure

from ....systems.numerics.harvest.field.combine_path import CombinePath
from ....systems.numerics.harvest.field.coverage import CoveragePlan
from ...world_picture import OBSTACLE, OUTSIDE

_SIZE = 120
_STANDING = "#e3b341"

# How much white is mixed into what a combine has cut, so that its path stands out.
_PALENESS = 0.78


def save_coverage_picture(path: Path, plan: CoveragePlan) -> None:
    """Draw who drives where and cuts what, and the crop that is left standing."""
    width, height = np.ptp(plan.field.world.bounds.reshape(2, 2), axis=0)
    wide, high = np.maximum(10.0 * np.array([width, height]) / max(width, height), 4.0)
    figure = Figure(figsize=(wide + 0.6, high + 1.2), layout="constrained")
    axes = figure.add_subplot()
    draw_coverage(axes, plan)
    axes.set_title(
        f"Combines: {len(plan.paths)}. {100 * plan.covered_fraction:.2f} % covered, "
        f"{plan.missed_area:.0f} m² missed, {plan.overlap_area:.0f} m² gone over again",
        fontsize="medium",
    )
    figure.legend(loc="outside lower center", ncols=len(plan.paths) + 2, edgecolor="none")
    figure.savefig(path, dpi=_SIZE, bbox_inches="tight")


def draw_coverage(axes: Axes, plan: CoveragePlan) -> None:
    """Draw paths over the field: thick while cutting, thin on the way, dotted backwards.

    Args:
        axes: Where to; its aspect, limits and labels are set.
        plan: What.
    """
    colours = [matplotlib.colormaps["tab10"](n % 10) for n in range(len(plan.paths))]
    _draw_field(axes, plan, colours)
    for n, (path, colour) in enumerate(zip(plan.paths, colours, strict=True)):
        cutting = (path.loops >= 0) & (path.gears > 0)
        for pieces, style in (
            (cutting, {"linewidths": 1.5}),
            (~cutting & (path.gears > 0), {"linewidths": 0.8, "linestyles": "--"}),
            (path.gears < 0, {"linewidths": 0.8, "linestyles": ":"}),
        ):
            axes.add_collection(LineCollection(_runs(path, pieces), color=colour, **style))
        axes.plot([], [], color=colour, label=f"combine {n}")
        axes.plot(*path.points[0], "o", color=colour, markersize=6, markeredgecolor="black")
        axes.plot(*path.points[-1], "s", color=colour, markersize=6, markeredgecolor="black")
    axes.plot([], [], color="gray", linestyle="--", linewidth=0.8, label="on the way")
    axes.plot([], [], color="gray", linestyle=":", linewidth=0.8, label="backwards")
    x_low, y_low, x_high, y_high = plan.field.ground.bounds
    axes.set_xlim(x_low, x_high)
    axes.set_ylim(y_low, y_high)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]; dots: starts, squares: ends")
    axes.set_ylabel("y [m]")


def _draw_field(axes: Axes, plan: CoveragePlan, colours: list) -> None:
    axes.set_facecolor(OUTSIDE)
    pale = [tuple(_PALENESS + (1 - _PALENESS) * np.array(to_rgb(colour))) for colour in colours]
    cells = plan.cells
    rows, columns = cells.crop_area.shape
    x, y = cells.origin
    axes.imshow(
        np.ma.masked_where(~cells.has_crop, cells.cut_by + 1),
        origin="lower",
        extent=(x, x + columns * cells.size, y, y + rows * cells.size),
        cmap=ListedColormap([to_rgb(_STANDING), *pale]),
        vmin=-0.5,
        vmax=len(colours) + 0.5,
        interpolation="nearest",
    )
    for obstacle in plan.field.obstacles:
        axes.fill(*np.array(obstacle.exterior.coords).T, color=OBSTACLE)
    margin = np.array(plan.field.ground.exterior.coords)
    axes.plot(*margin.T, color="gray", linewidth=0.6, linestyle=":")


def _runs(path: CombinePath, pieces: np.ndarray) -> list[np.ndarray]:
    """Lines through the pieces that are marked, each as long as they follow on each other."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], pieces.astype(int), [0]])))
    return [path.points[first : last + 1] for first, last in edges.reshape(-1, 2).tolist()]
