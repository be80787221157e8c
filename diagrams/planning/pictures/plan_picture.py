"""Plans over time and over the plane, as pictures."""

from pathlib import Path
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from ....systems.numerics.planning.trailer import trailer_pose
from ...world_picture import draw_world
from ..sweep import DirectionSweep
from ..verdict import PlanningVerdict
from .colours import METHOD_COLOURS, line_width

_SIZE = 120


def save_paths_picture(path: Path, verdict: PlanningVerdict) -> None:
    """Draw the ways of tractor and trailer of every planner over the plane (Figure 3.9)."""
    figure = Figure(figsize=(7.0, 6.4), layout="constrained")
    axes = figure.add_subplot()
    _draw_paths(axes, verdict)
    axes.legend(edgecolor="none", framealpha=0.8)
    # Equal scales leave room above and below a wide plan.
    figure.savefig(path, dpi=_SIZE, bbox_inches="tight")


def save_states_picture(path: Path, verdict: PlanningVerdict) -> None:
    """Draw x, y, theta, beta and omega of every planner over time.

    The switching function too, where a planner knows it: omega is at the bound of its sign.
    """
    switching = [row for row in verdict.rows if "switching_function" in row.plan.notes]
    count = 5 if switching else 4
    figure = Figure(figsize=(11.0, 6.4), layout="constrained")
    grid = figure.add_gridspec(count, 2)
    plane = figure.add_subplot(grid[:, 0])
    _draw_paths(plane, verdict)
    first = figure.add_subplot(grid[0, 1])
    rows = [first, *(figure.add_subplot(grid[k, 1], sharex=first) for k in range(1, count))]
    position, theta, beta, omega = rows[:4]
    for k, row in enumerate(verdict.rows):
        plan = row.plan.path
        if plan is None:
            continue
        style: Any = {
            "color": METHOD_COLOURS[row.method],
            "linewidth": line_width(k, len(verdict.rows)),
        }
        position.plot(plan.times, plan.states[:, 0], **style)
        position.plot(plan.times, plan.states[:, 1], linestyle="--", **style)
        theta.plot(plan.times, plan.states[:, 2], **style)
        beta.plot(plan.times, plan.states[:, 3], **style)
        if len(plan.controls):
            omega.stairs(plan.controls[:, 1], plan.times, baseline=None, **style)
    for row in switching:
        times, values = (
            np.asarray(cast(Any, row.plan.notes[key]), dtype=float)
            for key in ("switching_times", "switching_function")
        )
        rows[4].plot(times, values, color=METHOD_COLOURS[row.method])
    labels = (
        "x, y [m]\n(y dashed)",
        "theta\n[rad]",
        "beta\n[rad]",
        "omega\n[rad/s]",
        "switching\nfunction",
    )
    for axes, label in zip(rows, labels[:count], strict=True):
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
        axes.tick_params(labelbottom=axes is rows[-1])
    figure.align_ylabels(rows)
    rows[-1].set_xlabel("time [s]")
    plane.legend(edgecolor="none", framealpha=0.8)
    figure.savefig(path, dpi=_SIZE)


def save_sweep_picture(path: Path, sweep: DirectionSweep) -> None:
    """Draw travel times over the ratio (Figure 3.10)."""
    figure = Figure(figsize=(7.0, 4.6), layout="constrained")
    axes = figure.add_subplot()
    for k, (name, times) in enumerate(sweep.times.items()):
        colour, width = METHOD_COLOURS[name], line_width(k, len(sweep.times))
        axes.plot(sweep.ratios, times, marker=".", color=colour, linewidth=width, label=name)
    # Above the methods' lines, which may cover it, and shaded where no path can be.
    axes.plot(sweep.ratios, sweep.lower_bounds, "k--", linewidth=1.2, label="lower bound")
    floor = axes.get_ylim()[0]
    axes.fill_between(sweep.ratios, floor, sweep.lower_bounds, color="black", alpha=0.08)
    axes.set_ylim(bottom=floor)
    axes.set_xlabel("(x_g - x_i) / (y_g - y_i)")
    axes.set_ylabel("travel time [s]")
    widths = ", ".join(f"{width:g}" for width in sweep.tolerance)
    axes.set_title(f"Into a box of half-widths {widths}", fontsize="medium")
    axes.grid(alpha=0.3)
    axes.legend(edgecolor="none", framealpha=0.8)
    figure.savefig(path, dpi=_SIZE)


def _draw_paths(axes: Axes, verdict: PlanningVerdict) -> None:
    question = verdict.question
    if question.world is not None:
        draw_world(axes, question.world, corners=False)
    for k, row in enumerate(verdict.rows):
        plan, colour = row.plan.path, METHOD_COLOURS[row.method]
        if plan is None:
            axes.plot([], [], color=colour, label=f"{row.method}, no path")
            continue
        x, y, theta, beta = plan.states.T
        label = f"{row.method}, {row.plan.time:.4f} s"
        width = line_width(k, len(verdict.rows))
        axes.plot(x, y, color=colour, linewidth=width, label=label)
        towed_x, towed_y, _ = trailer_pose(x, y, theta, beta, question.trailer)
        axes.plot(towed_x, towed_y, color=colour, linewidth=0.9, linestyle="--")
    wide, high = question.goal.tolerance[:2]
    if 0 < wide < np.inf and 0 < high < np.inf:
        # Where paths may end.
        axes.add_patch(Polygon(question.goal.corners(), fill=False, ls=":", lw=0.9))
    for name, state, mark in (("start", question.start, "o"), ("goal", question.goal.state, "s")):
        axes.plot(state[0], state[1], mark, color="black", markersize=5)
        axes.annotate(name, state[:2], xytext=(6, -12), textcoords="offset points")
        reach = 0.35 * question.trailer.length
        nose = reach * np.array([np.cos(state[2]), np.sin(state[2])])
        axes.plot(*np.array([state[:2], state[:2] + nose]).T, color="black", linewidth=1.2)
    if question.world is None:
        axes.margins(0.1)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]; dashed: the trailer's axle")
    axes.set_ylabel("y [m]")
