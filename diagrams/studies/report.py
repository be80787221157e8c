"""What a study leaves in its folder beside its table: numbers and pictures."""

import math
from dataclasses import asdict
from pathlib import Path

import numpy as np
import yaml
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from ...systems.numerics.statistics import kaplan_meier, restricted_mean
from ..outputs import write_json
from ..tracking.scenario import TrackingScenario
from .opponents import runs_in_words
from .records import StudyResult
from .summary import (
    CONFIDENCE,
    StudyGrid,
    StudyPanel,
    mean_matrix,
    mean_tables,
    to_markdown,
    worst_of,
)

_COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:purple", "tab:brown", "tab:gray")
_MARKERS = "osD^vP"


def draw_means(result: StudyResult, grid: StudyGrid) -> Figure:
    """Mean tracking time up to the horizon over the number of evaders, a panel for each figure."""
    panels = grid.means
    columns = grid.columns or len(panels)
    rows = math.ceil(len(panels) / columns)
    figure = Figure(figsize=(1.2 + 4.0 * columns, 0.6 + 4.0 * rows), layout="constrained")
    axes = figure.subplots(rows, columns, sharey=True, squeeze=False)
    for axis, panel in zip(axes.ravel(), panels, strict=True):
        _draw_panel(axis, result, panel)
    for axis in axes[:, 0]:
        axis.set_ylabel("restricted mean of the tracking time [s]")
    if len(panels) > 1:
        handles, labels = axes[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False)
    else:
        axes[0, 0].legend(frameon=False)
    figure.suptitle(
        f"{runs_in_words(result.study)}, bars: {CONFIDENCE:.0%} confidence", fontsize=10
    )
    return figure


def draw_matrix(result: StudyResult, grid: StudyGrid) -> Figure:
    """Restricted means with their intervals, pursuers over evaders, for each pair of teams.

    A frame is round the evaders that are worst for the pursuers of the row (`worst_of`).
    """
    matrix = mean_matrix(result, grid)
    names = list(dict.fromkeys(name for rows in matrix.values() for name in rows))
    opponents = list(
        dict.fromkeys(o for rows in matrix.values() for row in rows.values() for o in row)
    )
    columns = min(4, math.ceil(math.sqrt(len(matrix))))
    lines = math.ceil(len(matrix) / columns)
    size = (1.5 + 1.2 * len(opponents) * columns, 1.3 + (0.7 + 0.55 * len(names)) * lines)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots(lines, columns, squeeze=False)
    for axis in axes.ravel()[len(matrix) :]:
        axis.set_axis_off()
    top = max(result.horizon(cell.name) for cell in result.study.cells)
    for k, (axis, (title, rows)) in enumerate(zip(axes.ravel(), matrix.items(), strict=False)):
        values = np.array(
            [[row[opponent].value for opponent in opponents] for row in rows.values()]
        )
        axis.imshow(values, cmap="YlGn", vmin=0.0, vmax=top, aspect="auto")
        cells = list(grid.matrix[title].values())
        for i, row in enumerate(rows.values()):
            if len(worst := worst_of(result, cells[i])) == 1:
                place = (opponents.index(worst[0]) - 0.47, i - 0.45)
                axis.add_patch(Rectangle(place, 0.94, 0.9, fill=False, linewidth=2))
            for j, opponent in enumerate(opponents):
                mean = row[opponent]
                # Dark cells have long times.
                colour = "white" if mean.value > 0.6 * top else "black"
                said = f"{mean.value:.1f}\n({mean.low:.1f} to {mean.high:.1f})"
                axis.text(j, i, said, ha="center", va="center", fontsize=7, color=colour)
        axis.set_title(title, fontsize=10)
        axis.set_xticks(range(len(opponents)), opponents, fontsize=8)
        axis.set_yticks(range(len(rows)), list(rows) if k % columns == 0 else [""] * len(rows))
        axis.tick_params(axis="y", labelsize=8)
        axis.tick_params(length=0)
    figure.suptitle(
        f"restricted means of the tracking time [s] ({CONFIDENCE:.0%} confidence)\n"
        f"pursuers against evaders, the worst framed\n{runs_in_words(result.study)}",
        fontsize=10,
    )
    return figure


def _draw_panel(axis: Axes, result: StudyResult, panel: StudyPanel) -> None:
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


def draw_curves(result: StudyResult, grid: StudyGrid) -> Figure:
    """Share of runs in which every evader is still in sight, over time, a panel for each team."""
    panels = grid.curves
    columns = min(4, math.ceil(math.sqrt(len(panels))))
    rows = math.ceil(len(panels) / columns)
    figure = Figure(figsize=(0.8 + 2.9 * columns, 0.9 + 2.3 * rows), layout="constrained")
    # Limits are set rather than shared: Matplotlib asks all axes that share for each one's.
    axes = figure.subplots(rows, columns, squeeze=False)
    for axis in axes.ravel()[len(panels) :]:
        axis.set_axis_off()
    shown = {cell for panel in panels for cells in panel.series.values() for cell in cells.values()}
    end = max(result.horizon(cell) for cell in shown)
    for axis, panel in zip(axes.ravel(), panels, strict=False):
        axis.set(xlim=(-0.05 * end, 1.05 * end), ylim=(-0.02, 1.02))
        axis.label_outer()
        for k, (label, cells) in enumerate(panel.series.items()):
            for cell in cells.values():
                _draw_curve(axis, result, cell, label, _COLOURS[k % len(_COLOURS)])
        axis.set_title(panel.title, fontsize=10)
        axis.grid(alpha=0.3)
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


def write_study_report(
    result: StudyResult, grid: StudyGrid, summary: dict[str, object], folder: Path
) -> list[str]:
    """Write numbers and pictures of a finished study; return the names of the files.

    Args:
        result: A finished study.
        grid: What is drawn with what; what it has nothing of is not drawn.
        summary: From `summarise_study`.
        folder: Exists.
    """
    write_json(folder / "summary.json", summary)
    tables = to_markdown(mean_tables(summary, grid))
    (folder / "tables.md").write_text(tables, encoding="utf-8")
    pictures = {
        "means.png": (grid.means, draw_means),
        "matrix.png": (grid.matrix, draw_matrix),
        "curves.png": (grid.curves, draw_curves),
    }
    names = [name for name, (shown, _) in pictures.items() if shown]
    for name in names:
        pictures[name][1](result, grid).savefig(folder / name, dpi=120)
    return ["summary.json", "tables.md", *names]


def write_scenario(scenario: TrackingScenario, file: Path) -> None:
    """Write a scenario that `sightfield track` plays."""
    file.write_text(yaml.safe_dump(asdict(scenario), sort_keys=False), encoding="utf-8")
