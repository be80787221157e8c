"""A value function as a picture: slices at moments of a plan, with contours."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...world_picture import draw_world
from ..verdict import PlanningVerdict
from .colours import METHOD_COLOURS, time_colours
from .value_slices import ValueSlice, band_levels, extent, followed_row, slices_along

_SIZE = 120
_COLUMNS, _ROWS = 3, 2


def save_value_picture(path: Path, verdict: PlanningVerdict) -> bool:
    """Draw the time to go over (x, y) with the cart's theta and beta at moments of a plan.

    Returns:
        Whether there is a picture: a verdict without a value function has none.
    """
    value = verdict.value_function
    if value is None:
        return False
    row = followed_row(verdict)
    start = verdict.question.start
    slices = slices_along(value, row, start, extent(value), _COLUMNS * _ROWS)
    levels = band_levels(slices)
    columns, rows = (_COLUMNS, _ROWS) if len(slices) > 1 else (1, 1)
    figure = Figure(figsize=(4.2 * columns + 0.8, 4.2 * rows + 0.5), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    colours = time_colours(len(levels) - 1)
    filled = None
    for axes, piece in zip(panels.flat, slices, strict=True):
        if verdict.question.world is not None:
            draw_world(axes, verdict.question.world, corners=False)
        times = np.ma.masked_invalid(piece.times)
        if times.count():
            filled = axes.contourf(piece.x, piece.y, times, levels, cmap=colours)
            lines = axes.contour(piece.x, piece.y, times, levels, colors="black", linewidths=0.4)
            axes.clabel(lines, levels[::2], fontsize=7, fmt="%g")
        _draw_cart(axes, verdict, piece)
        axes.set_xlabel("x [m]")
        axes.set_ylabel("y [m]")
        axes.label_outer()
    whose = "the start" if row is None else row.method
    between = " " if columns > 1 else "\n"
    figure.suptitle(f"Time to go at heading theta and{between}trailer angle beta of {whose}")
    if filled is not None:
        figure.colorbar(filled, ax=panels, label="time to go [s]", shrink=0.8)
    figure.savefig(path, dpi=_SIZE)
    return True


def _draw_cart(axes: Axes, verdict: PlanningVerdict, piece: ValueSlice) -> None:
    """The way so far, where the cart is, its heading and its trailer, and the goal."""
    row = followed_row(verdict)
    x, y, theta, beta = piece.state
    if row is not None and row.plan.path is not None:
        done = row.plan.path.states[row.plan.path.times <= piece.moment + 1e-9]
        way = np.vstack([done[:, :2], [(x, y)]])
        axes.plot(*way.T, color=METHOD_COLOURS[row.method], linewidth=2.0)
    size = verdict.question.trailer.length
    axes.plot([x, x + 0.8 * size * np.cos(theta)], [y, y + 0.8 * size * np.sin(theta)], "k-", lw=2)
    axes.plot(
        [x, x - size * np.cos(theta - beta)], [y, y - size * np.sin(theta - beta)], "k-", lw=1
    )
    axes.plot(x, y, "ko", markersize=4)
    axes.plot(*verdict.question.goal.state[:2], "ks", markersize=4, fillstyle="none")
    axes.set_aspect("equal")
    axes.set_title(
        f"{piece.moment:.2f} s: theta {theta:.2f}, beta {beta:.2f} rad", fontsize="medium"
    )
