"""What a camera sees of a shell: which share of each pixel it covers, and how that changes.

In polar coordinates about the mirror's axis the outline of an upright cylinder is exact: at the
angle t from its bearing a ray meets its near side at the distance

    s(t) = D cos t - sqrt(rho^2 - D^2 sin^2 t),   D = d + rho,   |t| < arcsin(rho / D),

and the shell lies between the pixel radii at which the mirror shows its base and its top at s(t).
"""

import math
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ..omni_optics import OmniCamera
from .range_models import exact_pixel_radius

# Columns into which a pixel is cut; along them its share is exact.
_COLUMNS = 3
# Nodes of the tables, over angles of sight up to this share of the horizon.
_NODES, _HIGHEST = 400, 0.995


class Outline(NamedTuple):
    """Where the mirror shows the edges of shells of one size.

    Attributes:
        radius: Of the shells, rho [m].
        step: Angle of sight between the nodes of the tables [rad].
        base, top: Pixel radii of the bottom and top edge at the angles of sight 0, step, ..., each
            shape (n,) [px].
        base_drop, top_drop: Heights of the mirror's centre above these edges [m].
        ranges, middles: Ranges, rising, and the pixel radius between base and top there, each
            shape (m,) [m], [px].
    """

    radius: float
    step: float
    base: np.ndarray
    top: np.ndarray
    base_drop: float
    top_drop: float
    ranges: np.ndarray
    middles: np.ndarray


def make_outline(camera: OmniCamera, *, radius: float, base: float, top: float) -> Outline:
    """Work out where a camera shows the edges of shells.

    Args:
        camera: Whose picture.
        radius: Of the shells [m].
        base: Height of their bottom edges above the floor [m].
        top: Height of their top edges above the floor [m].
    """
    angles, step = np.linspace(0.0, 0.5 * math.pi * _HIGHEST, _NODES, retstep=True)
    drops = [camera.mirror_height - height for height in (base, top)]
    # On the axis itself there is no bearing to look along.
    edges = [
        exact_pixel_radius(np.maximum(drop * np.tan(angles), 1e-6), camera=camera, base=height)
        for drop, height in zip(drops, (base, top), strict=True)
    ]
    ranges = np.geomspace(0.02, 50.0, _NODES)
    middles = np.mean(
        [exact_pixel_radius(ranges, camera=camera, base=height) for height in (base, top)], axis=0
    )
    return Outline(radius, float(step), edges[0], edges[1], drops[0], drops[1], ranges, middles)


@kernel
def _edge(table: np.ndarray, distance: float, drop: float, step: float) -> float:
    """Pixel radius of an edge at a distance, between the nodes of its table."""
    node = math.atan(distance / drop) / step
    k = min(int(node), len(table) - 2)
    return table[k] + (node - k) * (table[k + 1] - table[k])


@compiled
def draw_cover(
    outline: Outline,
    bearings: np.ndarray,
    radii: np.ndarray,
    place: np.ndarray,
    images: np.ndarray,
) -> None:
    """Find how much of each pixel a shell covers.

    Args:
        outline: Of shells of its size.
        bearings, radii: Of the pixels about the mirror's axis, each shape (n,) [rad], [px].
        place: Range [m] and bearing [rad] of the shell's near side, and by how much base, top, left
            and right side appear further out than they are [px], shape (6,).
        images: To be filled, shape (n, 7): the share of each pixel that is covered; the same times
            x, the normal's part across the line of sight, and times sqrt(1 - x^2), its part along
            it; and the slopes of the share with the four edges [1/px].
    """
    rho = outline.radius
    reach = place[0] + rho
    half, tangent = math.asin(rho / reach), math.sqrt(reach * reach - rho * rho)
    images[:] = 0.0
    # No part of the outline is nearer to the axis, or farther from it.
    nearest = _edge(outline.base, place[0], outline.base_drop, outline.step) - place[2] - 0.5
    farthest = _edge(outline.top, tangent, outline.top_drop, outline.step) + place[3] + 0.5
    for i in range(len(bearings)):
        r = max(radii[i], 0.5)
        if not nearest < r < farthest:
            continue
        off = (bearings[i] - place[1] + math.pi) % (2 * math.pi) - math.pi
        if abs(off) > half + (1.0 + abs(place[4]) + abs(place[5])) / r:
            continue
        for j in range(_COLUMNS):
            t = off + ((j + 0.5) / _COLUMNS - 0.5) / r
            side = 4 if t < 0.0 else 5
            inside = 0.5 + _COLUMNS * ((half - abs(t)) * r + place[side])
            wide = min(max(inside, 0.0), 1.0)
            if wide == 0.0:
                continue
            x = reach * math.sin(t) / rho
            if abs(t) < half and abs(x) < 1.0:
                s = reach * math.cos(t) - rho * math.sqrt(1.0 - x * x)
            else:
                s, x = tangent, math.copysign(1.0, t)
            low = _edge(outline.base, s, outline.base_drop, outline.step)
            high = _edge(outline.top, s, outline.top_drop, outline.step)
            low -= place[2]
            high += place[3]
            tall = min(r + 0.5, high) - max(r - 0.5, low)
            if tall <= 0.0:
                continue
            share = wide * tall / _COLUMNS
            images[i, 0] += share
            images[i, 1] += share * x
            images[i, 2] += share * math.sqrt(max(1.0 - x * x, 0.0))
            if low > r - 0.5:
                images[i, 3] += wide / _COLUMNS
            if high < r + 0.5:
                images[i, 4] += wide / _COLUMNS
            if wide < 1.0:
                images[i, side + 1] += tall
