"""The visibility game of a map as a picture: what can be kept in sight from one place, and for how
long; and what each place is worth as one to watch from."""

from pathlib import Path

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.colors import Normalize, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...systems.numerics.geometry.world import World
from ...systems.numerics.tracking.visibility_game.guaranteed_times import GuaranteedTimes
from ...systems.numerics.tracking.visibility_game.lattice import Lattice
from ..world_picture import OBSTACLE

PURSUER = "#215fcc"
EVADER = "#d92e33"
KEPT, HIDDEN, BARRIER = "#d8edc9", "#b9bdc2", "#5b2a86"

# Colours end there at the latest [s].
LONGEST = 20.0

# Where no place keeps that part of the floor for ever, times say more.
LITTLE = 0.05


def draw_guarantee(
    table: GuaranteedTimes,
    world: World,
    pursuer: np.ndarray,
    evader: np.ndarray | None = None,
) -> Figure:
    """Draw both maps, in metres.

    Args:
        table: The game, solved.
        world: Whose obstacles are drawn.
        pursuer: From where the evader is watched, shape (2,) [m].
        evader: Drawn where given, shape (2,) [m].

    Raises:
        InvalidInput: The pursuer cannot be there.
    """
    width, height = world.bounds[2:] - world.bounds[:2]
    figure = Figure(figsize=(13.0, 1.3 + 5.0 * min(height / width, 1.6)), layout="constrained")
    times, places = figure.subplots(1, 2)
    barrier = _draw_times(times, table, pursuer)
    if evader is not None:
        times.plot(
            *evader, "o", color=EVADER, markeredgecolor="white", markersize=9, label="evader"
        )
    _draw_places(places, table)
    for axes in (times, places):
        _draw_world(axes, world)
        axes.plot(
            *pursuer, "o", color=PURSUER, markeredgecolor="white", markersize=9, label="pursuer"
        )
    handles = [
        Patch(facecolor=KEPT, label="kept in sight for ever"),
        Patch(facecolor=HIDDEN, label="hidden already"),
        *([Line2D([], [], color=BARRIER, linewidth=1.6, label="barrier")] if barrier else []),
        Patch(facecolor=OBSTACLE, label="obstacle, or outside"),
        Patch(facecolor="white", edgecolor="#888888", label="no room for the robot"),
    ]
    robots, _ = times.get_legend_handles_labels()
    figure.legend(handles=[*robots, *handles], loc="outside lower center", ncols=7, frameon=False)
    return figure


def save_guarantee_picture(
    path: Path,
    table: GuaranteedTimes,
    world: World,
    pursuer: np.ndarray,
    evader: np.ndarray | None = None,
) -> None:
    """Write `draw_guarantee` to a PNG.

    Args:
        path: Of the file.
        table, world, pursuer, evader: See `draw_guarantee`.
    """
    draw_guarantee(table, world, pursuer, evader).savefig(path, dpi=110)


def _draw_times(axes: Axes, table: GuaranteedTimes, pursuer: np.ndarray) -> bool:
    """How long an evader at each place is kept in sight; whether there is a barrier to draw."""
    times, grid = table.times_from(pursuer), table.evader_grid
    extent = _extent(grid)
    shades = np.where(np.isnan(times), np.nan, np.where(np.isinf(times), 1.0, 0.0))
    kept = np.zeros((*times.shape, 4))
    kept[np.isinf(times)] = to_rgba(KEPT)
    kept[times == 0.0] = to_rgba(HIDDEN)
    axes.imshow(kept, origin="lower", extent=extent, interpolation="nearest")
    finite = np.where(np.isfinite(times) & (times > 0.0), times, np.nan)
    longest = min(np.nanmax(finite), LONGEST) if np.isfinite(finite).any() else 1.0
    image = axes.imshow(
        finite,
        origin="lower",
        extent=extent,
        interpolation="nearest",
        cmap="plasma",
        norm=Normalize(0.0, longest),
    )
    barrier = bool(0.0 < np.nanmean(shades) < 1.0)
    if barrier:
        xs, ys = grid.at(0, np.arange(grid.columns))[:, 0], grid.at(np.arange(grid.rows), 0)[:, 1]
        axes.contour(xs, ys, shades, levels=[0.5], colors=BARRIER, linewidths=1.6)
    beyond = "max" if np.nanmax(finite, initial=0.0) > longest else "neither"
    axes.figure.colorbar(image, ax=axes, shrink=0.8, extend=beyond, label="kept in sight for [s]")
    axes.set_title(f"An evader there, a pursuer here ({table.bound} bound)")
    return barrier


def _draw_places(axes: Axes, table: GuaranteedTimes) -> None:
    """What each place is worth: the part of the floor that it keeps for ever, or where that is
    little, for how long it keeps an evader that may be anywhere."""
    grid, floor = table.pursuer_grid, np.count_nonzero(table.evader_nodes)
    for_ever = table.kept * table.sighted / floor
    if for_ever.max(initial=0.0) >= LITTLE:
        worth, words = 100.0 * for_ever, "of the floor, kept for ever [%]"
    else:
        worth, words = table.watched, "an evader anywhere is kept for [s], in the mean"
    shown = np.full((grid.rows, grid.columns), np.nan)
    shown[grid.nearest(table.places)] = np.where(table.sighted > 0, worth, np.nan)
    image = axes.imshow(
        shown,
        origin="lower",
        extent=_extent(grid),
        interpolation="nearest",
        cmap="viridis",
        norm=Normalize(0.0, max(worth.max(initial=0.0), 1e-3)),
    )
    axes.figure.colorbar(image, ax=axes, shrink=0.8, label=words)
    axes.set_title("Places to watch from")


def _draw_world(axes: Axes, world: World) -> None:
    for ring in world.obstacles:
        axes.fill(*ring.T, color=OBSTACLE, zorder=2)
    outside = shapely.box(*world.bounds).difference(shapely.Polygon(world.boundary))
    for part in shapely.get_parts(outside):
        axes.fill(*shapely.get_coordinates(part.exterior).T, color=OBSTACLE, zorder=2)
    closed = np.vstack([world.boundary, world.boundary[:1]])
    axes.plot(*closed.T, color=OBSTACLE, linewidth=2.0, zorder=2)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def _extent(grid: Lattice) -> tuple[float, float, float, float]:
    """Edges of the outermost cells [m]."""
    low = grid.at(0, 0) - 0.5 * grid.spacing
    high = grid.at(grid.rows - 1, grid.columns - 1) + 0.5 * grid.spacing
    return low[0], high[0], low[1], high[1]
