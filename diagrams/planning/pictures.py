"""Plans and times to go as pictures: ways, states, sweeps, and slices of a value function.

A slice belongs to a moment of a plan, and has the cart's theta and beta at that moment: on it the
time to go where the cart is equals what is left of the plan, up to the table's error.
"""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import matplotlib
import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from matplotlib.ticker import MaxNLocator
from shapely.geometry.base import BaseGeometry

from ...systems.numerics.planning.plan import TrailerPath
from ...systems.numerics.planning.trailer import Trailer, trailer_pose
from ...systems.numerics.planning.value_function.value_function import ValueFunction
from ..world_picture import draw_world
from .sweep import DirectionSweep
from .verdict import PlanningVerdict, Row

# sRGB parts from 0 to 1.
METHOD_COLOURS: dict[str, tuple[float, float, float]] = {
    "casadi": (0.13, 0.37, 0.80),
    "extremal": (0.85, 0.33, 0.10),
    "value-function": (0.10, 0.55, 0.35),
    "polished": (0.88, 0.68, 0.00),
    "primitive": (0.58, 0.22, 0.64),
    "averaging": (0.45, 0.45, 0.45),
}

# How much white is mixed in, so that ways and carts stand out.
_PALENESS = 0.55


def time_colours(count: int) -> ListedColormap:
    """As many colours as bands of time to go, from dark at the goal to pale far away.

    Args:
        count: Number of bands.
    """
    strong = matplotlib.colormaps["viridis"](np.linspace(0.0, 1.0, count))[:, :3]
    return ListedColormap(_PALENESS + (1 - _PALENESS) * strong)


def line_width(number: int, count: int) -> float:
    """Thick for the first planner and thin for the last, so that equal paths all show [pt].

    Args:
        number: Of the planner, from 0.
        count: Of planners.
    """
    return 4.0 - 3.2 * number / max(count - 1, 1)


# Width of both bodies, in trailer lengths.
_WIDTH = 0.42


def tractor_shape(trailer: Trailer) -> shapely.Polygon:
    """The tractor about its rear axle, facing along x, with a narrower bonnet in front [m]."""
    size = trailer.length
    cab, bonnet = _WIDTH / 2 * size, _WIDTH / 3 * size
    return shapely.Polygon(
        [
            (-0.12 * size, -cab),
            (0.18 * size, -cab),
            (0.18 * size, -bonnet),
            (0.45 * size, -bonnet),
            (0.5 * size, 0.0),
            (0.45 * size, bonnet),
            (0.18 * size, bonnet),
            (0.18 * size, cab),
            (-0.12 * size, cab),
        ]
    )


def trailer_shape(trailer: Trailer) -> shapely.Polygon:
    """The trailer about its axle, facing along x [m]."""
    size = trailer.length
    return shapely.box(-0.28 * size, -_WIDTH / 2 * size, 0.58 * size, _WIDTH / 2 * size)


def drawbar_shape(trailer: Trailer) -> shapely.Polygon:
    """From the trailer's body to the hitch, in the trailer's frame [m]."""
    size = trailer.length
    return shapely.box(0.58 * size, -0.025 * size, size, 0.025 * size)


def swept_area(path: TrailerPath, trailer: Trailer) -> shapely.Geometry:
    """What tractor and trailer cover on their way [m]."""
    # Close enough together that the outline looks smooth.
    count = max(
        2, round(float(path.times[-1] - path.times[0]) * trailer.speed / trailer.length * 12)
    )
    times = np.linspace(path.times[0], path.times[-1], count)
    x, y, theta, beta = (np.interp(times, path.times, column) for column in path.states.T)
    towed = trailer_pose(x, y, theta, beta, trailer)
    covered = []
    for shape, poses in ((tractor_shape(trailer), (x, y, theta)), (trailer_shape(trailer), towed)):
        placed = [_placed(shape, *pose) for pose in zip(*poses, strict=True)]
        # From each place to the next, so that there are no notches between them.
        covered += [
            shapely.convex_hull(shapely.union(one, other)) for one, other in pairwise(placed)
        ]
    return shapely.simplify(shapely.union_all(covered), 0.002 * trailer.length)


def _placed(shape: shapely.Polygon, x: float, y: float, angle: float) -> shapely.Polygon:
    c, s = np.cos(angle), np.sin(angle)
    return shapely.transform(shape, lambda at: at @ np.array([[c, s], [-s, c]]) + [x, y])


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
        plan = verdict.shown.get(row.method)
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
        plan, colour = verdict.shown.get(row.method), METHOD_COLOURS[row.method]
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


# Bands of equal colour in a slice, at most.
_BANDS = 20


@dataclass(frozen=True, eq=False)
class ValueSlice:
    """Time to go over (x, y).

    Attributes:
        moment: Of the plan [s].
        state: The cart's at that moment (x, y, theta, beta) [m], [m], [rad], [rad].
        x: Of the nodes, shape (n,) [m].
        y: Of the nodes, shape (m,) [m].
        times: To go, shape (m, n); infinite: unreachable on this grid [s].
    """

    moment: float
    state: tuple[float, float, float, float]
    x: np.ndarray
    y: np.ndarray
    times: np.ndarray


def followed_row(verdict: PlanningVerdict) -> Row | None:
    """Whose way the slices follow: the value function's own, else the fastest; None without any."""
    rows = [row for row in verdict.rows if row.plan.path is not None]
    own = [row for row in rows if "value_function" in row.plan.notes]
    return min(own or rows, key=lambda row: row.plan.time, default=None)


def slices_along(
    value: ValueFunction, path: TrailerPath | None, start, bounds: np.ndarray, count: int
) -> list[ValueSlice]:
    """Slices at equally spaced moments of a plan; without a plan, one at the start.

    Times are interpolated, as the bands of a picture between them are: to look thousands up by
    words would take a minute, and show the same.

    Args:
        value: The table.
        path: Of the plan, as it is shown; None: there is none.
        start: x, y, theta, beta of the question [m], [m], [rad], [rad].
        bounds: x_min, y_min, x_max, y_max of the slices, shape (4,) [m].
        count: How many, at least two.
    """
    moments, states = np.zeros(1), np.array([start], dtype=float)
    if path is not None:
        moments = np.linspace(path.times[0], path.times[-1], count)
        states = np.array([np.interp(moments, path.times, column) for column in path.states.T]).T
    x, y = (
        np.linspace(low, high, max(2, round((high - low) / value.grid.step) + 1))
        for low, high in (bounds[::2], bounds[1::2])
    )
    slices = []
    for moment, (at_x, at_y, theta, beta) in zip(moments.tolist(), states.tolist(), strict=True):
        nodes = np.empty((len(y), len(x), 4))
        nodes[..., 0], nodes[..., 1] = np.meshgrid(x, y)
        nodes[..., 2:] = theta, beta
        state = (at_x, at_y, theta, beta)
        slices.append(ValueSlice(moment, state, x, y, value.interpolated(nodes)))
    return slices


def extent(value: ValueFunction) -> np.ndarray:
    """Bounds of the table in the world: x_min, y_min, x_max, y_max, shape (4,) [m]."""
    x_low, y_low, x_high, y_high = value.grid.bounds
    corners = np.array([(x_low, y_low), (x_high, y_low), (x_high, y_high), (x_low, y_high)])
    x, y, heading = value.placement
    c, s = np.cos(heading), np.sin(heading)
    placed = corners @ np.array([[c, s], [-s, c]]) + [x, y]
    return np.array([*placed.min(axis=0), *placed.max(axis=0)])


def band_levels(slices: list[ValueSlice]) -> np.ndarray:
    """Round times that part the bands of all slices, from zero up, shape (k,) [s]."""
    finite = [each.times[np.isfinite(each.times)] for each in slices]
    longest = max((float(times.max()) for times in finite if times.size), default=0.0)
    return np.asarray(
        MaxNLocator(_BANDS, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, longest or 1.0)
    )


def bands(piece: ValueSlice, levels: np.ndarray) -> list[BaseGeometry]:
    """For each two levels in turn, where the time to go lies between them [m].

    Args:
        piece: The slice.
        levels: Rising, shape (k,) [s].
    """
    times = np.ma.masked_invalid(piece.times)
    if times.count() == 0:
        return [shapely.Polygon() for _ in levels[1:]]
    filled = Figure().add_subplot().contourf(piece.x, piece.y, times, levels)
    areas = []
    for path in filled.get_paths():
        # Rings within rings are holes.
        outlines = [np.asarray(outline) for outline in path.to_polygons()]
        rings = [shapely.LinearRing(outline) for outline in outlines if len(outline) > 3]
        areas.append(shapely.build_area(shapely.MultiLineString(rings)))
    return areas


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
    way = None if row is None else verdict.shown[row.method]
    slices = slices_along(value, way, verdict.question.start, extent(value), _COLUMNS * _ROWS)
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
    if row is not None:
        way = verdict.shown[row.method]
        done = way.states[way.times <= piece.moment + 1e-9]
        points = np.vstack([done[:, :2], [(x, y)]])
        axes.plot(*points.T, color=METHOD_COLOURS[row.method], linewidth=2.0)
    trailer = verdict.question.trailer
    size, back = trailer.length, trailer.hitch_offset
    axes.plot([x, x + 0.8 * size * np.cos(theta)], [y, y + 0.8 * size * np.sin(theta)], "k-", lw=2)
    # By the hitch to the trailer's axle.
    towed_x, towed_y, _ = trailer_pose(x, y, theta, beta, trailer)
    hitch_x, hitch_y = x - back * np.cos(theta), y - back * np.sin(theta)
    axes.plot([x, hitch_x, float(towed_x)], [y, hitch_y, float(towed_y)], "k-", lw=1)
    axes.plot(x, y, "ko", markersize=4)
    axes.plot(*verdict.question.goal.state[:2], "ks", markersize=4, fillstyle="none")
    axes.set_aspect("equal")
    axes.set_title(
        f"{piece.moment:.2f} s: theta {theta:.2f}, beta {beta:.2f} rad", fontsize="medium"
    )
