"""The corner game as a picture: who wins where, and which way the pursuer should run.

Three plans in the corner's frame, in metres: the partition round a given pursuer, the partition
for a given evader, and a pursuit field for that evader. Zhang 2014, Figures 2.1 to 2.3, whose
originals are lost; drawn anew from the inequalities.
"""

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Polygon

from ...systems.numerics.tracking.corner_game import (
    HIDDEN,
    IN_STAR,
    REGION_1,
    REGION_2,
    REGION_3,
    REGION_4,
    REGION_5,
)
from ...systems.numerics.tracking.corner_policies import (
    BLOCKED,
    field_grid,
    partition,
    pursuer_partition,
)

OBSTACLE = "#3a9d5d"
PURSUER = "#215fcc"
EVADER = "#d92e33"

# Code of a region: its colour and what the legend says of it.
REGIONS = {
    BLOCKED: (OBSTACLE, "obstacle"),
    IN_STAR: ("#ffffff", "star region: no threat"),
    REGION_1: ("#f4b6b0", "1: the evader wins"),
    REGION_2: ("#c7dcf5", "2: straight to the star region"),
    REGION_3: ("#dccbf0", "3: mirror the evader"),
    REGION_4: ("#9fc3ec", "4: straight to the star region"),
    REGION_5: ("#d8edc9", "5: turn"),
    HIDDEN: ("#b9bdc2", "hidden already"),
}

# Cells along the side of a partition, and arrows along the side of a field.
CELLS = 400
ARROWS = 25


def draw_corner_game(
    alpha: float,
    a: float,
    pursuer: tuple[float, float],
    evader: tuple[float, float],
    field: str = "margin",
) -> Figure:
    """Draw the partitions and a pursuit field.

    Args:
        alpha: Interior angle of the obstacle, in (0, pi) [rad].
        a: Speed ratio v_e / v_p, in (0, 1).
        pursuer, evader: Positions in the corner's frame [m].
        field: A name out of `FIELDS`.

    Raises:
        InvalidInput: An argument is out of range, or a player is inside the obstacle.
    """
    size = 1.5 * max(math.hypot(*pursuer), math.hypot(*evader))
    # Without a distance between anything, a picture of one metre.
    size = size or 1.0
    middles = size * (2 * np.arange(CELLS) + 1 - CELLS) / CELLS
    points = np.stack(np.meshgrid(middles, middles), axis=-1)
    figure = Figure(figsize=(15, 6), layout="constrained")
    round_pursuer, for_evader, arrows = figure.subplots(1, 3)

    _draw_regions(round_pursuer, partition(pursuer, points, alpha, a), size)
    _draw_sight_ray(round_pursuer, pursuer, size)
    round_pursuer.set_title("Where the evader is: partition of the pursuer")
    _draw_regions(for_evader, pursuer_partition(evader, points, alpha, a), size)
    for_evader.set_title("Where the pursuer is: partition of the evader")
    _draw_field(arrows, field_grid(field, evader, _arrow_places(size), alpha, a), size)
    arrows.set_title(f"Pursuit field `{field}` of the evader")
    _draw_obstacle(arrows, alpha, size)
    for axes in (round_pursuer, for_evader, arrows):
        axes.plot(*pursuer, "o", color=PURSUER, markersize=8, label="pursuer")
        axes.plot(*evader, "s", color=EVADER, markersize=8, label="evader")
        axes.set_xlim(-size, size)
        axes.set_ylim(-size, size)
        axes.set_aspect("equal")
        axes.set_xlabel("x [m]")
        axes.set_ylabel("y [m]")
    patches = [
        Patch(facecolor=colour, edgecolor="#888888", label=label)
        for colour, label in REGIONS.values()
    ]
    players, names = arrows.get_legend_handles_labels()
    labels = [label for _, label in REGIONS.values()]
    figure.legend(
        [*patches, *players], [*labels, *names], loc="outside lower center", ncols=5, frameon=False
    )
    figure.suptitle(f"Corner of {alpha:.3g} rad, evader's speed {a:.3g} of the pursuer's")
    return figure


def save_corner_picture(
    path: Path,
    alpha: float,
    a: float,
    pursuer: tuple[float, float],
    evader: tuple[float, float],
    field: str = "margin",
) -> None:
    """Write what `draw_corner_game` draws as a PNG picture.

    Args:
        path: Of the file.
        alpha: Interior angle of the obstacle [rad].
        a: Speed ratio v_e / v_p.
        pursuer, evader: Positions in the corner's frame [m].
        field: A name in `FIELDS`.
    """
    draw_corner_game(alpha, a, pursuer, evader, field).savefig(path, dpi=110)


def _draw_regions(axes: Axes, codes: np.ndarray, size: float) -> None:
    colours = ListedColormap([colour for colour, _ in REGIONS.values()])
    norm = BoundaryNorm([code - 0.5 for code in REGIONS] + [max(REGIONS) + 0.5], len(REGIONS))
    axes.imshow(
        codes,
        cmap=colours,
        norm=norm,
        origin="lower",
        extent=(-size, size, -size, size),
        interpolation="nearest",
    )


def _draw_sight_ray(axes: Axes, pursuer: tuple[float, float], size: float) -> None:
    """The ray from the pursuer through the corner, behind which it cannot see."""
    distance = math.hypot(*pursuer)
    if distance > 0:
        x, y = (-2 * size * coordinate / distance for coordinate in pursuer)
        axes.plot([pursuer[0], x], [pursuer[1], y], "--", color=PURSUER, linewidth=1)


def _arrow_places(size: float) -> np.ndarray:
    middles = size * (2 * np.arange(ARROWS) + 1 - ARROWS) / ARROWS
    return np.stack(np.meshgrid(middles, middles), axis=-1)


def _draw_field(axes: Axes, vectors: np.ndarray, size: float) -> None:
    places = _arrow_places(size)
    moving = np.hypot(vectors[..., 0], vectors[..., 1]) > 0
    axes.quiver(
        *places[moving].T,
        *vectors[moving][:, :2].T,
        color="#0d7f86",
        pivot="mid",
        angles="xy",
        scale_units="xy",
        scale=ARROWS / (1.6 * size),
        width=0.004,
    )


def _draw_obstacle(axes: Axes, alpha: float, size: float) -> None:
    # A fan of points beyond the picture, from edge A to edge B.
    angles = np.linspace(math.pi, math.pi + alpha, 20)
    rim = 3 * size * np.column_stack([np.cos(angles), np.sin(angles)])
    axes.add_patch(Polygon(np.vstack([[0.0, 0.0], rim]), facecolor=OBSTACLE))
