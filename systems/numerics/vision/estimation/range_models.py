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


# Nodes of the radii of one shell's edges.
ROUND = 64
# Step by which their slopes with the range are taken, as a share of it.
_FARTHER = 1e-4
# Where the line of sight grazes a shell more than this, slopes are taken for no steeper.
_GRAZING = 0.02


@kernel
def fill_round(outline: Outline, distance: float, edges: np.ndarray) -> None:
    """Find the pixel radii of base, top and far rim of a shell all round it (kernel).

    Nodes are evenly spaced in sqrt(1 - x^2) from 0 to 1, x the sine of the normal's angle to the
    line of sight: so radii are nearly linear between nodes, even where that line grazes the shell.

    Args:
        outline: Of shells of its size.
        distance: From the axis to the shell's near side [m].
        edges: To be filled, shape (m, 3) [px].
    """
    rho = outline.radius
    reach = distance + rho
    for k in range(len(edges)):
        along = k / (len(edges) - 1)
        middle = math.sqrt(reach * reach - rho * rho * (1.0 - along * along))
        near, far = middle - rho * along, middle + rho * along
        edges[k, 0] = _edge(outline.base, near, outline.base_drop, outline.step)
        edges[k, 1] = _edge(outline.top, near, outline.top_drop, outline.step)
        edges[k, 2] = _edge(outline.top, far, outline.top_drop, outline.step)


@kernel
def radii_at(edges: np.ndarray, along: float, place: np.ndarray) -> tuple[int, float, float, float]:
    """Where a shell's edges appear in one direction (kernel).

    Args:
        edges: Pixel radii by `fill_round`, shape (m, 3) [px].
        along: The part of the normal there along the line of sight, in [0, 1].
        place: As of `draw_cover`; of it the shifts of base and top count [px].

    Returns:
        Number of the node before it; radii of base, top and far rim [px].
    """
    node = along * (ROUND - 1)
    k = min(int(node), ROUND - 2)
    part = node - k
    low = edges[k, 0] + part * (edges[k + 1, 0] - edges[k, 0]) - place[2]
    high = edges[k, 1] + part * (edges[k + 1, 1] - edges[k, 1]) + place[3]
    rim = edges[k, 2] + part * (edges[k + 1, 2] - edges[k, 2])
    return k, low, high, rim


@compiled
def draw_cover(
    outline: Outline,
    bearings: np.ndarray,
    radii: np.ndarray,
    place: np.ndarray,
    images: np.ndarray,
) -> None:
    """Find how much of each pixel a shell covers, and how that changes with the shell's place.

    Args:
        outline: Of shells of its size.
        bearings, radii: Of the pixels about the mirror's axis, each shape (n,) [rad], [px].
        place: Range [m] and bearing [rad] of the shell's near side, and by how much base, top, left
            and right side appear further out than they are [px], shape (6,).
        images: To be filled, shape (n, 16): the share of each pixel that is covered; the same times
            x, the normal's part across the line of sight, and times sqrt(1 - x^2), its part along
            it; the share that the robot's top covers, the disc that is seen over the shell's top
            edge; the slopes of these four with the range [1/m], and with the bearing [1/rad]; the
            slopes of the first with the four edges [1/px].
    """
    rho, farther = outline.radius, _FARTHER * place[0]
    edges, beyond = np.empty((ROUND, 3)), np.empty((ROUND, 3))
    fill_round(outline, place[0], edges)
    fill_round(outline, place[0] + farther, beyond)
    # Slopes with the range; the bearing only turns the shell.
    by_range = (beyond - edges) / farther
    ratio = (place[0] + rho) / rho
    half = math.asin(1 / ratio)
    narrower = -1 / (rho * ratio * math.sqrt(ratio * ratio - 1))
    middle = (place[1] + math.pi) % (2 * math.pi) - math.pi
    images[:] = 0.0
    # No part of the outline is nearer to the axis, or farther from it.
    nearest = edges[-1, 0] - place[2] - 0.5
    farthest = max(edges[-1, 2], edges[0, 1] + place[3]) + 0.5
    for i in range(len(bearings)):
        r = max(radii[i], 0.5)
        if not nearest < r < farthest:
            continue
        off = bearings[i] - middle
        if abs(off) > math.pi:
            off -= math.copysign(2 * math.pi, off)
        if abs(off) > half + (1.0 + abs(place[4]) + abs(place[5])) / r:
            continue
        image = images[i]
        sine_off, cosine_off = math.sin(off), math.cos(off)
        for j in range(_COLUMNS):
            aside = ((j + 0.5) / _COLUMNS - 0.5) / r
            t = off + aside
            side = 4 if t < 0.0 else 5
            inside = 0.5 + _COLUMNS * ((half - abs(t)) * r + place[side])
            wide = min(max(inside, 0.0), 1.0)
            if wide == 0.0:
                continue
            # A pixel is so narrow that two terms of the series will do.
            short = 1.0 - 0.5 * aside * aside
            sine = short * sine_off + aside * cosine_off
            cosine = short * cosine_off - aside * sine_off
            x = ratio * sine
            beside = abs(t) >= half or abs(x) >= 1.0
            if beside:
                x = math.copysign(1.0, t)
            along = math.sqrt(1.0 - x * x)
            k, low, high, rim = radii_at(edges, along, place)
            tall = max(min(r + 0.5, high) - max(r - 0.5, low), 0.0)
            over = max(min(r + 0.5, rim) - max(r - 0.5, high), 0.0)
            share = wide * tall / _COLUMNS
            image[0] += share
            image[1] += share * x
            image[2] += share * along
            image[3] += wide * over / _COLUMNS
            # Which edges cross the column, and end the shell's side or the robot's top in it.
            low_ends, high_ends = tall > 0.0 and low > r - 0.5, tall > 0.0 and high < r + 0.5
            high_begins, rim_ends = over > 0.0 and high > r - 0.5, over > 0.0 and rim < r + 0.5
            for way in range(2):
                x_slope, wide_slope = sine / rho, narrower
                if way == 1:
                    x_slope, wide_slope = -ratio * cosine, math.copysign(1.0, t)
                x_slope = 0.0 if beside else x_slope
                wide_slope = _COLUMNS * r * wide_slope if wide < 1.0 else 0.0
                along_slope = -x * x_slope / max(along, _GRAZING)
                n = 4 + 4 * way
                if wide == 1.0 and not (low_ends or high_ends or high_begins or rim_ends):
                    # No edge is near.
                    image[n + 1] += share * x_slope
                    image[n + 2] += share * along_slope
                    continue
                step = along_slope * (ROUND - 1)
                low_slope = step * (edges[k + 1, 0] - edges[k, 0])
                high_slope = step * (edges[k + 1, 1] - edges[k, 1])
                rim_slope = step * (edges[k + 1, 2] - edges[k, 2])
                if way == 0:
                    low_slope += by_range[k, 0]
                    high_slope += by_range[k, 1]
                    rim_slope += by_range[k, 2]
                tall_slope = high_ends * high_slope - low_ends * low_slope
                over_slope = rim_ends * rim_slope - high_begins * high_slope
                share_slope = (wide_slope * tall + wide * tall_slope) / _COLUMNS
                image[n] += share_slope
                image[n + 1] += share_slope * x + share * x_slope
                image[n + 2] += share_slope * along + share * along_slope
                image[n + 3] += (wide_slope * over + wide * over_slope) / _COLUMNS
            image[12] += low_ends * wide / _COLUMNS
            image[13] += high_ends * wide / _COLUMNS
            if wide < 1.0:
                image[side + 10] += tall
