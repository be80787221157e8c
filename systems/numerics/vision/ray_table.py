"""The rays of all pixels of a camera, worked out once.

A ray off a ball stays in the vertical plane of its bearing, so it is a line in that plane: height
as a function of the distance from the axis. What lies in the plane is found on the map.
"""

from typing import NamedTuple

import numpy as np

from .omni_optics import OmniCamera, pixel_rays

# Bearings are sorted into this many equal sectors.
SECTORS = 1024


class RayTable(NamedTuple):
    """Rays of the pixels that show the mirror, row by row.

    Attributes:
        pixels: Numbers of the pixels, row * width + column, shape (n,).
        sines, cosines: Of the bearing from the robot's front, shape (n,).
        sectors: Sector of the bearing, shape (n,).
        starts: Distance from the axis at which the ray leaves the mirror, shape (n,) [m].
        heights: Height at which it does, shape (n,) [m].
        slopes: Rise per distance from the axis, shape (n,); very steep on the axis.
    """

    pixels: np.ndarray
    sines: np.ndarray
    cosines: np.ndarray
    sectors: np.ndarray
    starts: np.ndarray
    heights: np.ndarray
    slopes: np.ndarray


def make_ray_table(camera: OmniCamera) -> RayTable:
    """Trace the ray of every pixel's centre off the mirror."""
    rows, columns = np.divmod(np.arange(camera.width * camera.height), camera.width)
    points, directions = pixel_rays(camera, np.stack([columns, rows], axis=1))
    hit = np.flatnonzero(~np.isnan(points[:, 0]))
    points, directions = points[hit], directions[hit]
    outwards = np.hypot(directions[:, 0], directions[:, 1])
    # The pixel on the axis looks straight down and has no bearing: any will do.
    on_axis = outwards == 0
    scale = np.where(on_axis, 1.0, outwards)
    cosines = np.where(on_axis, 1.0, directions[:, 0] / scale)
    sines = np.where(on_axis, 0.0, directions[:, 1] / scale)
    turns = np.arctan2(sines, cosines) / (2 * np.pi) + 0.5
    return RayTable(
        pixels=hit.astype(np.int32),
        sines=sines,
        cosines=cosines,
        sectors=np.minimum((turns * SECTORS).astype(np.int32), SECTORS - 1),
        starts=np.hypot(points[:, 0], points[:, 1]),
        heights=points[:, 2].copy(),
        slopes=directions[:, 2] / np.maximum(outwards, 1e-12),
    )
