"""A world as a picture: what is free, what is not, and where something can hide."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline

from ..systems.numerics.geometry.world import World

OUTSIDE = "#d9dcdf"
FREE = "#ffffff"
OBSTACLE = "#3a9d5d"
EDGE = "#1d5c36"
CORNER = "#d62728"


def draw_world(axes: Axes, world: World, *, corners: bool = True) -> None:
    """Draw a world in metres: obstacles green, its reflex corners red, what lies beyond gray.

    Args:
        axes: Where to; its aspect, limits and labels are set.
        world: What.
        corners: Whether to mark the corners.
    """
    axes.set_facecolor(OUTSIDE)
    axes.add_patch(PathPatch(_outline([world.boundary]), facecolor=FREE, edgecolor=EDGE, lw=0.8))
    if world.obstacles:
        obstacles = _outline(list(world.obstacles))
        axes.add_patch(PathPatch(obstacles, facecolor=OBSTACLE, edgecolor=EDGE, lw=0.8))
    if corners:
        axes.plot(*world.corners.points.T, ".", color=CORNER, markersize=3, label="corners")
    x_low, y_low, x_high, y_high = world.bounds
    margin = 0.03 * world.size
    axes.set_xlim(x_low - margin, x_high + margin)
    axes.set_ylim(y_low - margin, y_high + margin)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")


def save_world_picture(path: Path, world: World, title: str) -> None:
    """Write a PNG picture of a world, 1600 pixels along its longer side.

    Args:
        path: Of the file.
        world: Which.
        title: Stands above it.
    """
    width, height = np.ptp(world.bounds.reshape(2, 2), axis=0)
    size = 10.0 * np.array([width, height]) / max(width, height)
    # A figure of its own, without pyplot: no window, no global state.
    figure = Figure(figsize=tuple(np.maximum(size, 3.0)), layout="constrained")
    axes = figure.add_subplot()
    draw_world(axes, world)
    axes.set_title(title, parse_math=False)
    figure.savefig(path, dpi=160)


def _outline(rings: list[np.ndarray]) -> Outline:
    """Closed rings as one path."""
    return Outline.make_compound_path(
        *[Outline(np.vstack([ring, ring[:1]]), closed=True) for ring in rings]
    )
