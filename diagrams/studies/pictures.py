"""Pictures of a study: restricted means with their intervals, and survival curves."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...systems.numerics.statistics.survival import kaplan_meier, restricted_mean
from .grid import Grid, Panel
from .records import StudyResult
from .summary import CONFIDENCE

_COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:purple", "tab:brown", "tab:gray")
_MARKERS = "osD^vP"


def draw_means(result: StudyResult, grid: Grid) -> Figure:
    """Mean tracking time up to the horizon over the number of evaders, a panel for each figure."""
    panels = grid.means
    figure = Figure(figsize=(1.2 + 4.0 * len(panels), 4.6), layout="constrained")
    axes = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for axis, panel in zip(axes, panels, strict=True):
        _draw_panel(axis, result, panel)
    axes[0].set_ylabel("restricted mean of the tracking time [s]")
    if len(panels) > 1:
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
    else:
        axes[0].legend(frameon=False)
    figure.suptitle(
        f"{result.study.runs} runs a cell, bars: {CONFIDENCE:.0%} confidence", fontsize=10
    )
    return figure


def _draw_panel(axis: Axes, result: StudyResult, panel: Panel) -> None:
    top = 0.0
    for k, (label, cells) in enumerate(panel.series.items()):
        means = [
            restricted_mean(result.times(c), result.lost(c), result.horizon(c), CONFIDENCE)
            for c in cells.values()
        ]
        top = max(top, *(result.horizon(cell) for cell in cells.values()))
        values = np.array([mean.value for mean in means])
        below = values - [mean.low for mean in means]
        above = [mean.high for mean in means] - values
        # Side by side, so that no bar hides another.
        places = np.array(list(cells)) + 0.08 * (k - 0.5 * (len(panel.series) - 1))
        axis.errorbar(
            places,
            values,
            yerr=np.array([below, above]),
            color=_COLOURS[k % len(_COLOURS)],
            marker=_MARKERS[k % len(_MARKERS)],
            markersize=5,
            linewidth=1.0,
            capsize=3,
            label=label,
        )
    axis.axhline(top, color="0.5", linewidth=0.8, linestyle=":")
    axis.set_ylim(0.0, 1.05 * top)
    axis.set_xticks(sorted({m for cells in panel.series.values() for m in cells}))
    axis.set_xlabel("evaders")
    axis.set_title(panel.title)
    axis.grid(axis="y", alpha=0.3)


def draw_curves(result: StudyResult, grid: Grid) -> Figure:
    """Share of runs in which every evader is still in sight, over time, a panel for each team."""
    panels = grid.curves
    columns = min(4, math.ceil(math.sqrt(len(panels))))
    rows = math.ceil(len(panels) / columns)
    figure = Figure(figsize=(0.8 + 2.9 * columns, 0.9 + 2.3 * rows), layout="constrained")
    axes = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axis in axes.ravel()[len(panels) :]:
        axis.set_axis_off()
    for axis, panel in zip(axes.ravel(), panels, strict=False):
        for k, (label, cells) in enumerate(panel.series.items()):
            for cell in cells.values():
                _draw_curve(axis, result, cell, label, _COLOURS[k % len(_COLOURS)])
        axis.set_title(panel.title, fontsize=10)
        axis.grid(alpha=0.3)
    axes[0, 0].set_ylim(-0.02, 1.02)
    figure.supxlabel("time [s]", fontsize=10)
    figure.supylabel("share of runs with every evader in sight", fontsize=10)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    return figure


def _draw_curve(axis: Axes, result: StudyResult, cell: str, label: str, colour: str) -> None:
    curve = kaplan_meier(result.times(cell), result.lost(cell), CONFIDENCE)
    end = result.horizon(cell)
    times = np.concatenate([[0.0], curve.times, [end]])
    steps = [
        np.concatenate([[1.0], values, values[-1:]])
        for values in (curve.survival, curve.low, curve.high)
    ]
    axis.step(times, steps[0], where="post", color=colour, linewidth=1.2, label=label)
    axis.fill_between(times, steps[1], steps[2], step="post", color=colour, alpha=0.2, linewidth=0)
