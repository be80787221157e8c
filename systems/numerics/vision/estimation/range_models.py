"""From the pixel radius of a shell's bottom edge to its distance, by two models.

The thesis's takes the angle of sight as proportional to the pixel radius; the exact one follows
the ray off the sphere (`omni_optics.floor_range`).
"""

from collections.abc import Sequence

import numpy as np

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
