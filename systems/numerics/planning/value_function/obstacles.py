"""Which steps a cart among walls must not take: its discs are followed all along each step."""

import math
from typing import NamedTuple

import numpy as np

from ...compiled import compiled
from ...geometry.world import World
from ..minimum_time.clearance import signed_distance
from ..minimum_time.footprint import Discs
from ..trailer import Trailer
from .grid import Grid
from .motions import MULTIPLES, control_set, hold_beta

# Places that are looked at in one angle between theta nodes.
LOOKS = 2


class Walls(NamedTuple):
    """Free distance on a raster, and the discs that must keep it.

    Attributes:
        distance: Signed, shape (n_y, n_x) [m].
        origin: (x, y) of its first node [m].
        step: Of the raster [m].
        discs: Offset, radius, and 1 for the trailer, shape (n, 3) [m], [m].
        length, hitch: Of the trailer [m].
    """

    distance: np.ndarray
    origin: np.ndarray
    step: float
    discs: np.ndarray
    length: float
    hitch: float


def make_walls(world: World, discs: Discs, grid: Grid) -> Walls:
    """Sample the free distance over the grid, at half its step."""
    x_min, y_min, x_max, y_max = grid.bounds
    step = grid.step / 2
    x, y = np.arange(x_min, x_max + step, step), np.arange(y_min, y_max + step, step)
    points = np.stack([each.ravel() for each in np.meshgrid(x, y)], axis=1)
    distance = signed_distance(world, points).reshape(len(y), len(x))
    table = np.column_stack([discs.offsets, discs.radii, discs.bodies]).astype(float)
    return Walls(distance, np.array([x_min, y_min]), step, table, discs.length, discs.hitch_offset)


@compiled
def overlaps(walls, x, y, theta, beta):
    """Whether a disc reaches into a wall, or beyond the raster."""
    c, s = math.cos(theta), math.sin(theta)
    heading = theta - beta
    back_x = x - walls.hitch * c - walls.length * math.cos(heading)
    back_y = y - walls.hitch * s - walls.length * math.sin(heading)
    rows, columns = walls.distance.shape
    for n in range(len(walls.discs)):
        offset = walls.discs[n, 0]
        if walls.discs[n, 2] == 0.0:
            px, py = x + offset * c, y + offset * s
        else:
            px, py = back_x + offset * math.cos(heading), back_y + offset * math.sin(heading)
        u = (px - walls.origin[0]) / walls.step
        w = (py - walls.origin[1]) / walls.step
        i, j = math.floor(u), math.floor(w)
        if i < 0 or j < 0 or i >= columns - 1 or j >= rows - 1:
            return True
        a, b = u - i, w - j
        low = (1 - a) * walls.distance[j, i] + a * walls.distance[j, i + 1]
        high = (1 - a) * walls.distance[j + 1, i] + a * walls.distance[j + 1, i + 1]
        if (1 - b) * low + b * high < walls.discs[n, 1]:
            return True
    return False


def shut_ways(grid: Grid, trailer: Trailer, walls: Walls, scale: float) -> np.ndarray:
    """Which steps lead through a wall, one bit for each control of `make_motions`.

    Args:
        grid: Where the nodes are [m].
        trailer: Normalised.
        walls: What is in the way.
        scale: Length of a turning radius [m].

    Returns:
        Shape of the grid, uint32; all bits at nodes that overlap a wall themselves.
    """
    shut = np.zeros(grid.shape, dtype=np.uint32)
    _, _, thetas, betas = grid.axes()
    longest = max(MULTIPLES)
    for group, (v, omega) in enumerate(control_set(trailer)):
        path = hold_beta(betas, v, omega, longest * grid.theta_step, 8 * longest, trailer)
        path = path[:: 8 // LOOKS]
        # Which bits are lost when the first overlap is at each look.
        looks = LOOKS * np.array(MULTIPLES)
        bits = np.uint32(1) << np.arange(len(looks), dtype=np.uint32) + len(looks) * group
        lost = np.array([bits[looks >= k].sum() for k in range(len(path))], dtype=np.uint32)
        pace = grid.theta_step / LOOKS
        place = np.array([grid.x_min, grid.y_min, grid.step])
        _shut(shut, walls, thetas, path, int(v), int(omega), pace, scale, place, lost)
    return shut


@compiled
def _shut(shut, walls, thetas, path, v, omega, pace, scale, place, lost):
    theta_count, beta_count, y_count, x_count = shut.shape
    for t in range(theta_count):
        for k in range(len(path) - 1, -1, -1):
            half = omega * k * pace / 2
            chord = v * k * pace * (math.sin(half) / half if half != 0.0 else 1.0) * scale
            dx, dy = chord * math.cos(thetas[t] + half), chord * math.sin(thetas[t] + half)
            for b in range(beta_count):
                for j in range(y_count):
                    y = place[1] + j * place[2] + dy
                    for i in range(x_count):
                        # A longer look has nothing to add where all of its bits are lost.
                        if shut[t, b, j, i] & lost[k] == lost[k]:
                            continue
                        x = place[0] + i * place[2] + dx
                        if overlaps(walls, x, y, thetas[t] + 2 * half, path[k, b]):
                            shut[t, b, j, i] |= lost[k]
