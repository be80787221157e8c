"""The visibility game of a map as a picture, and games that were played by its promises.

What can be kept in sight from one place, and for how long; what each place is worth as one to watch
from; and how long sight lasted in games of certified pursuers, against what they had promised.
"""

import math
from collections.abc import Sequence
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
from .certified_games import CertifiedGame

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


# A colour and a mark for each policy, in order.
STYLES = (
    ("#215fcc", "o"),
    ("#d92e33", "s"),
    ("#2e8b57", "^"),
    ("#8b3fb0", "D"),
    ("#e08a00", "v"),
    ("#555555", "P"),
)


def draw_promises(games: Sequence[CertifiedGame], seconds: float) -> Figure:
    """Draw for each game how long sight lasted from a moment on, against the certificate then.

    Of each game that certificate is drawn that stood and was tried hardest, see `Promises`.

    Args:
        games: Of any number of policies.
        seconds: Horizon of the games [s].
    """
    figure = Figure(figsize=(7.6, 6.4), layout="constrained")
    axes = figure.subplots()
    finite = [g.promises.claimed for g in games if 0.0 < g.promises.claimed < math.inf]
    longest = max([*finite, 0.25 * seconds])
    ever = 1.12 * longest
    axes.axvline(ever, color="#cccccc", linewidth=40, zorder=0)
    axes.plot([0.0, longest], [0.0, longest], color="black", linewidth=1.2, label="T = C")
    axes.fill_between([0.0, longest], [0.0, longest], color="#d92e33", alpha=0.10, linewidth=0)
    # So that games for ever do not hide each other.
    spread = np.random.default_rng(0)
    for k, policy in enumerate(dict.fromkeys(game.policy for game in games)):
        colour, mark = STYLES[k % len(STYLES)]
        axes.plot([], [], mark, color=colour, label=policy)
        for game in games:
            claimed, promises = game.promises.claimed, game.promises
            if game.policy != policy or claimed == 0.0:
                continue
            x = ever + spread.uniform(-0.05, 0.05) * longest if math.isinf(claimed) else claimed
            lost = game.lost_evader is not None
            axes.plot(
                x,
                promises.lasted,
                mark,
                color=colour,
                markerfacecolor=colour if lost else "none",
                markersize=11 if promises.breach else 6,
                markeredgewidth=1.2,
            )
    axes.set_xlim(0.0, 1.2 * longest)
    axes.set_ylim(0.0, None)
    ticks = [tick for tick in axes.get_xticks() if tick <= longest]
    axes.set_xticks([*ticks, ever], [*(f"{tick:g}" for tick in ticks), "for ever"])
    axes.set_xlabel("certificate C while it stood [s]")
    axes.set_ylabel("sight lasted T from then on [s]")
    axes.set_title("T against C; hollow: to the end of the game")
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(0.0, -0.1), ncols=4)
    axes.grid(alpha=0.3)
    return figure


def save_promises_picture(path: Path, games: Sequence[CertifiedGame], seconds: float) -> None:
    """Write `draw_promises` to a PNG.

    Args:
        path: Of the file.
        games, seconds: See `draw_promises`.
    """
    draw_promises(games, seconds).savefig(path, dpi=110)
