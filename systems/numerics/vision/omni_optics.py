"""A camera that looks up into a mirror ball: from pixels to rays, and from points to pixels.

The camera frame stands on the floor under the camera: x forward, y left, z up, the mirror's axis
being the z axis. The picture's top is forward. Because the camera looks up, the picture's right is
the robot's LEFT; the mirror keeps azimuths, so the bearing of pixel (u, v), counter-clockwise from
the robot's front, is

    bearing = atan2(u - u_0, v_0 - v),   (u_0, v_0) the picture's centre.

Pixels are (column, row), whole numbers at the centres of the pixels. Reflection is exact: the rays
of different pixels have no point in common (the camera is not central).

Source: Zhang 2014, 2.2.4.1 and Figure 2.7 (F = D / 4); the optics of a pinhole before a sphere.

Rays of all pixels are worked out once, as a table. A ray off a ball stays in the vertical plane of
its bearing, so it is a line in that plane: height as a function of the distance from the axis.
What lies in the plane is found on the map.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..checked import Checked, PositiveSized
from ..errors import require
from .camera_models.camera_model import require_near_picture, require_size

# Halvings of the angle at the mirror's centre: more than a double has bits.
_HALVINGS = 60


@dataclass(frozen=True, kw_only=True)
class OmniCamera(Checked):
    """A pinhole camera under a spherical mirror, on the axis of both.

    The defaults are a testbed robot's: it sees the floor, its horizon and shells from 15 to 60
    inches (0.38 to 1.52 m) well inside a picture of 640 x 480 pixels.

    Raises:
        InvalidInput: A length is not positive, or a number is out of its range.
    """

    # Of the mirror ball [m]; its diameter is D = 2 mirror_radius.
    mirror_radius: PositiveSized = 0.05
    # From the pinhole up to the lowest point of the ball [m].
    mirror_distance: PositiveSized = 0.15
    # Of the pinhole above the floor [m].
    pinhole_height: PositiveSized = 0.22
    # Of the pinhole, in pixels.
    focal_length: PositiveSized = 860.0
    # Of the picture, in pixels.
    width: int = 640
    height: int = 480
    # Where the mirror's axis meets the picture (column, row); None: the middle of the picture.
    centre: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        require_size(self.width, self.height)
        if self.centre is not None:
            require(len(self.centre) == 2, "centre", "be (column, row)", self.centre)
            require_near_picture("centre", *self.centre)

    @property
    def axis_pixel(self) -> np.ndarray:
        """Where the mirror's axis meets the picture, (column, row), shape (2,)."""
        if self.centre is not None:
            return np.array(self.centre, dtype=float)
        return np.array([0.5 * (self.width - 1), 0.5 * (self.height - 1)])

    @property
    def mirror_height(self) -> float:
        """Height of the mirror's centre above the floor [m]."""
        return self.pinhole_height + self.mirror_distance + self.mirror_radius

    @property
    def focus_height(self) -> float:
        """Height of the mirror's focus above the floor [m]: F = D / 4 above its lowest point.

        The h of (2.4) is this less the height of the shell's bottom edge.
        """
        return self.mirror_height - 0.5 * self.mirror_radius

    @property
    def rim_radius(self) -> float:
        """Pixel radius of the ball's outline, where rays graze it."""
        gap, ball = self.mirror_distance, self.mirror_radius
        return self.focal_length * ball / math.sqrt(gap * (gap + 2 * ball))


def bearing_of(camera: OmniCamera, pixels: np.ndarray) -> np.ndarray:
    """Bearings of pixels, shape (n, 2) -> (n,), counter-clockwise from the front [rad]."""
    right, down = (np.asarray(pixels, dtype=float) - camera.axis_pixel).T
    return np.arctan2(right, -down)


def pixel_rays(camera: OmniCamera, pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where the rays of pixels leave the mirror, and where they go.

    Args:
        camera: Whose.
        pixels: (column, row), shape (n, 2).

    Returns:
        Points on the mirror, shape (n, 3) [m], and unit directions away from it, shape (n, 3), in
        the camera frame; NaN for pixels beyond the mirror's rim.
    """
    right, down = (np.asarray(pixels, dtype=float) - camera.axis_pixel).T / camera.focal_length
    sight = np.stack([-down, right, np.ones_like(right)], axis=1)
    sight /= np.linalg.norm(sight, axis=1, keepdims=True)
    gap, ball = camera.mirror_distance, camera.mirror_radius
    # Written so that a far pinhole costs no digits.
    square = ball**2 - (gap + ball) ** 2 * np.sum(sight[:, :2] ** 2, axis=1)
    missed = square < 0
    along = (gap + ball) * sight[:, 2]
    length = gap * (gap + 2 * ball) / (along + np.sqrt(np.where(missed, 0.0, square)))
    points = length[:, None] * sight
    # From the ball's centre, in units of its radius: the outward normal.
    normals = (points - [0.0, 0.0, gap + ball]) / ball
    directions = sight - 2.0 * np.sum(sight * normals, axis=1, keepdims=True) * normals
    points[:, 2] += camera.pinhole_height
    points[missed], directions[missed] = np.nan, np.nan
    return points, directions


def project_omni(camera: OmniCamera, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where points appear in the picture: the exact inverse of `pixel_rays`.

    The point of reflection is found by halving: there the normal halves the angle between the
    pinhole and the point (Alhazen's problem).

    Args:
        camera: Whose.
        points: In the camera frame, shape (n, 3) [m].

    Returns:
        Pixels, shape (n, 2), and whether each lies in the picture, shape (n,). Pixels are NaN
        where the mirror shows the point nowhere: in its shadow, or inside the ball.
    """
    points = np.asarray(points, dtype=float).reshape(-1, 3)
    gap, ball = camera.mirror_distance, camera.mirror_radius
    distance = np.hypot(points[:, 0], points[:, 1])
    # The meridian plane, seen from the ball's centre, heights counted downwards.
    depth = camera.mirror_height - points[:, 2]
    low = np.zeros(len(points))
    rim = math.acos(ball / (gap + ball))
    high = np.full(len(points), rim)
    reflected = (_lean(camera, high, distance, depth) <= 0) & (np.hypot(distance, depth) > ball)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        short = _lean(camera, middle, distance, depth) > 0
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    angle = 0.5 * (low + high)
    radius = camera.focal_length * ball * np.sin(angle) / (gap + ball * (1 - np.cos(angle)))
    azimuth = np.arctan2(points[:, 1], points[:, 0])
    offsets = radius[:, None] * np.stack([np.sin(azimuth), -np.cos(azimuth)], axis=1)
    pixels = camera.axis_pixel + offsets
    pixels[~reflected] = np.nan
    last = np.array([camera.width, camera.height]) - 0.5
    visible = reflected & ((pixels >= -0.5) & (pixels < last)).all(axis=1)
    return pixels, visible


def _lean(
    camera: OmniCamera, angle: np.ndarray, distance: np.ndarray, depth: np.ndarray
) -> np.ndarray:
    """Angle at a point of the mirror by which points lie outside the ray that leaves there.

    Args:
        camera: Whose mirror.
        angle: Of the point of the mirror, from the ball's lowest, shape (n,) [rad].
        distance, depth: Of the points outwards and down from the ball's centre, shape (n,) [m].

    Returns:
        Angle to the normal less the angle of incidence, shape (n,) [rad]; it falls with `angle`.
    """
    ball, pinhole = camera.mirror_radius, camera.mirror_distance + camera.mirror_radius
    sine, cosine = np.sin(angle), np.cos(angle)
    outgoing = np.arctan2(distance * cosine - depth * sine, distance * sine + depth * cosine - ball)
    return outgoing - np.arctan2(pinhole * sine, pinhole * cosine - ball)


def floor_range(
    camera: OmniCamera, pixel_radius: np.ndarray | float, height: float = 0.0
) -> np.ndarray:
    """Ground distance at which the rays of a pixel radius meet a horizontal plane.

    Args:
        camera: Whose.
        pixel_radius: Distances from the axis in the picture, any shape, in pixels.
        height: Of the plane above the floor, as of a shell's bottom edge [m].

    Returns:
        Distances from the axis, same shape [m]: infinite at and above the horizon, NaN beyond the
        mirror's rim.
    """
    radius = np.asarray(pixel_radius, dtype=float)
    up = np.stack([np.zeros(radius.size), -radius.ravel()], axis=1)
    points, directions = pixel_rays(camera, camera.axis_pixel + up)
    drop = points[:, 2] - height
    falling = directions[:, 2] < 0
    slope = np.where(falling, directions[:, 0] / np.where(falling, -directions[:, 2], 1.0), np.inf)
    distance = np.where(np.isnan(drop), np.nan, points[:, 0] + drop * slope)
    return np.abs(distance).reshape(radius.shape)


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
