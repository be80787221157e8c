"""What a camera sees of a shell: the radius of its bottom edge, by two models, and its outline.

Of the two models from the pixel radius of the bottom edge to distance, the thesis's takes the
angle of sight as proportional to the pixel radius; the exact one follows the ray off the sphere
(`omni_optics.floor_range`).

In polar coordinates about the mirror's axis the outline of an upright cylinder is exact: at the
angle t from its bearing a ray meets its near side at the distance

    s(t) = D cos t - sqrt(rho^2 - D^2 sin^2 t),   D = d + rho,   |t| < arcsin(rho / D),

and the shell lies between the pixel radii at which the mirror shows its base and its top at s(t).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ..omni_optics import OmniCamera, floor_range, project_omni

# Names of the models: the thesis's (2.4), and the exact mirror ball.
MODELS = ("thesis", "exact")


def thesis_range(pixel_radius: np.ndarray | float, *, k: float, height: float) -> np.ndarray:
    """Distance d = h tan(p / k) (2.4).

    Args:
        pixel_radius: p, any shape [px].
        k: Pixels per radian of the angle of sight.
        height: h, of the mirror's focus above the shell's bottom edge [m].

    Returns:
        Distances from the axis, same shape [m]; infinite at and above the horizon p = k pi / 2.
    """
    angle = np.asarray(pixel_radius, dtype=float) / k
    below = angle < 0.5 * np.pi
    return np.where(below, height * np.tan(np.where(below, angle, 0.0)), np.inf)


def k_values(
    pixel_radius: np.ndarray | float, distance: np.ndarray | float, *, height: float
) -> np.ndarray:
    """The k that makes (2.4) right at each distance: p / arctan(d / h) [px/rad].

    Args:
        pixel_radius: p, any shape [px].
        distance: True d, same shape [m].
        height: h, of the mirror's focus above the shell's bottom edge [m].
    """
    return np.asarray(pixel_radius) / np.arctan2(distance, height)


def exact_range(pixel_radius: np.ndarray | float, *, camera: OmniCamera, base: float) -> np.ndarray:
    """Distance at which the exact rays meet the plane of the shells' bottom edges.

    Args:
        pixel_radius: p, any shape [px].
        camera: Whose picture.
        base: Height of the plane above the floor [m].

    Returns:
        Distances from the axis, same shape [m]; infinite at and above the horizon and beyond the
        mirror's rim.
    """
    distance = floor_range(camera, pixel_radius, base)
    return np.where(np.isnan(distance), np.inf, distance)


def exact_pixel_radius(
    distance: np.ndarray | Sequence[float], *, camera: OmniCamera, base: float
) -> np.ndarray:
    """The inverse of `exact_range`: pixel radius of a bottom edge, shape (n,) -> (n,) [px].

    Args:
        distance: From the axis, shape (n,) [m].
        camera: Whose picture.
        base: Height of the edge above the floor [m].
    """
    distance = np.asarray(distance, dtype=float)
    zero = np.zeros_like(distance)
    pixels, _ = project_omni(camera, np.column_stack([distance, zero, zero + base]))
    return np.linalg.norm(pixels - camera.axis_pixel, axis=1)


def implied_k(camera: OmniCamera, base: float, distances: np.ndarray) -> np.ndarray:
    """The k at each distance that exact optics imply, with h by F = D / 4, shape (n,) [px/rad].

    Args:
        camera: Whose optics.
        base: Height of the shell's bottom edge above the floor [m].
        distances: Shape (n,) [m].
    """
    radius = exact_pixel_radius(distances, camera=camera, base=base)
    return k_values(radius, distances, height=camera.focus_height - base)


def fit_parabola(distance: np.ndarray, estimate: np.ndarray) -> tuple[float, float, float]:
    """The a [1/m], b [-], c [m] of (2.8): true less estimated distance, e(y) = a y^2 + b y + c.

    Args:
        distance: True distances y, at least three different ones, shape (n,) [m].
        estimate: What the model says, shape (n,) [m].
    """
    # Centred, so that the powers are well apart.
    middle = float(np.mean(distance))
    a, b, c = np.polyfit(distance - middle, distance - estimate, 2).tolist()
    return a, b - 2 * a * middle, c - b * middle + a * middle**2


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
        images: To be filled, shape (n, 8): the share of each pixel that is covered; the same times
            x, the normal's part across the line of sight, and times sqrt(1 - x^2), its part along
            it; the slopes of the share with the four edges [1/px]; and the share that the robot's
            top covers, the disc that is seen over the shell's top edge.
    """
    rho = outline.radius
    reach = place[0] + rho
    half, tangent = math.asin(rho / reach), math.sqrt(reach * reach - rho * rho)
    images[:] = 0.0
    # No part of the outline is nearer to the axis, or farther from it.
    nearest = _edge(outline.base, place[0], outline.base_drop, outline.step) - place[2] - 0.5
    farthest = _edge(outline.top, reach + rho, outline.top_drop, outline.step)
    farthest = max(farthest, _edge(outline.top, tangent, outline.top_drop, outline.step) + place[3])
    farthest += 0.5
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
            far = tangent
            if abs(t) < half and abs(x) < 1.0:
                s = reach * math.cos(t) - rho * math.sqrt(1.0 - x * x)
                far = 2.0 * reach * math.cos(t) - s
            else:
                s, x = tangent, math.copysign(1.0, t)
            low = _edge(outline.base, s, outline.base_drop, outline.step)
            high = _edge(outline.top, s, outline.top_drop, outline.step)
            low -= place[2]
            high += place[3]
            rim = _edge(outline.top, far, outline.top_drop, outline.step)
            over = min(r + 0.5, rim) - max(r - 0.5, high)
            if over > 0.0:
                images[i, 7] += wide * over / _COLUMNS
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
