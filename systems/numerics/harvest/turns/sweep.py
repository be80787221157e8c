"""Whether a machine stays on its ground all along arcs and straights, with its swing.

Between two poses the outline sweeps no more than the convex hull of both outlines, but for the
arcs' heights above their chords, for which the steps are short. Only where discs leave a doubt are
hulls compared with the ground's edges.
"""

import math

import numpy as np

from ...compiled import compiled, kernel
from .borders import RASTER_ERROR, border_distance, cuts_edge
from .standing_crop import CELL

# How deep an outline may reach over a border: machines drive along borders [m].
TOUCH = 0.01

# How far an arc of the outline's farthest point may stand out of its chord [m].
_ARC_HEIGHT = 0.004

# Longest step on a straight, and spacing of the poses that are looked at first [m].
_STRAIGHT_STEP = 2.0
_FIRST_LOOK = 2.5


@kernel
def stays_on_ground(site, pose, curvatures, lengths, count, room):
    """Whether the outline stays on the ground, and the body off standing crop, all along a path.

    Nothing of the outline is farther than TOUCH + 0.005 m beyond a border where the answer is yes.

    Args:
        site: Ground, standing crop and outline.
        pose: x, y, theta of the start, shape (3,) [m], [m], [rad].
        curvatures: Of the pieces, shape (at least count,) [1/m].
        lengths: Of the pieces, negative backwards; shape (at least count,) [m].
        count: How many pieces there are.
        room: Space to work in, shape (2, 20, 2).
    """
    if border_distance(site.borders, pose[0], pose[1]) < -RASTER_ERROR:
        return False
    if not _may_stay(site.borders, site.footprint, pose, curvatures, lengths, count):
        return False
    x, y, theta = pose[0], pose[1], pose[2]
    if not _clear(site, x, y, theta, 0.0, 0.0, room):
        return False
    for piece in range(count):
        length, curvature = lengths[piece], curvatures[piece]
        if length == 0.0:
            continue
        longest = _STRAIGHT_STEP
        if curvature != 0.0:
            farthest = site.footprint.reach + 1 / abs(curvature)
            longest = min(longest, math.sqrt(8 * _ARC_HEIGHT / farthest) / abs(curvature))
        steps = math.ceil(abs(length) / longest)
        step = length / steps
        for _ in range(steps):
            if not _clear(site, x, y, theta, step, curvature, room):
                return False
            x, y, theta = drive(x, y, theta, step, curvature)
    return True


@kernel
def drive(x, y, theta, way, curvature):
    """Pose after a way, backwards where it is negative."""
    half = curvature * way / 2
    chord = way * (math.sin(half) / half if half != 0.0 else 1.0)
    return (
        x + chord * math.cos(theta + half),
        y + chord * math.sin(theta + half),
        theta + 2 * half,
    )


@kernel
def _may_stay(borders, footprint, pose, curvatures, lengths, count):
    """Whether no disc inside of the outline is over the border at some poses: quick to say no."""
    x, y, theta = pose[0], pose[1], pose[2]
    for piece in range(count):
        steps = math.ceil(abs(lengths[piece]) / _FIRST_LOOK)
        if steps == 0:
            continue
        step = lengths[piece] / steps
        for _ in range(steps):
            x, y, theta = drive(x, y, theta, step, curvatures[piece])
            c, s = math.cos(theta), math.sin(theta)
            for disc in range(len(footprint.inside)):
                ahead, left = footprint.inside[disc, 0], footprint.inside[disc, 1]
                away = border_distance(borders, x + c * ahead - s * left, y + s * ahead + c * left)
                if away + RASTER_ERROR < footprint.inside[disc, 2] - TOUCH:
                    return False
    return True


@kernel
def _clear(site, x, y, theta, step, curvature, room):
    """Whether one step from a pose is clear, and where it leads to as well."""
    borders, footprint, crop = site.borders, site.footprint, site.crop
    nx, ny, heading = drive(x, y, theta, step, curvature)
    c, s = math.cos(heading), math.sin(heading)
    for part in range(len(footprint.corners)):
        ahead, left = footprint.around[part, 0], footprint.around[part, 1]
        away = border_distance(borders, nx + c * ahead - s * left, ny + s * ahead + c * left)
        # A disc round the part moves with its middle, which is no faster than this.
        moved = abs(step) * (1 + abs(curvature) * math.hypot(ahead, left))
        if away - RASTER_ERROR >= footprint.around[part, 2] + moved:
            continue
        if away + RASTER_ERROR <= 0.0 or _hull_cut(
            borders, footprint, part, x, y, theta, nx, ny, heading, room
        ):
            return False
    rows, columns = crop.shape
    for point in range(len(footprint.body)):
        ahead, left = footprint.body[point, 0], footprint.body[point, 1]
        i = math.floor((nx + c * ahead - s * left - site.crop_origin[0]) / CELL)
        j = math.floor((ny + s * ahead + c * left - site.crop_origin[1]) / CELL)
        if 0 <= i < columns and 0 <= j < rows and crop[j, i]:
            return False
    return True


@kernel
def _hull_cut(borders, footprint, part, x, y, theta, nx, ny, heading, room):
    """Whether an edge comes into the hull of a part at two poses."""
    points, hull = room[0], room[1]
    c, s = math.cos(theta), math.sin(theta)
    nc, ns = math.cos(heading), math.sin(heading)
    for k in range(4):
        ahead, left = footprint.corners[part, k, 0], footprint.corners[part, k, 1]
        points[k, 0], points[k, 1] = x + c * ahead - s * left, y + s * ahead + c * left
        points[k + 4, 0] = nx + nc * ahead - ns * left
        points[k + 4, 1] = ny + ns * ahead + nc * left
    return cuts_edge(borders, hull, _hull(points, 8, hull), TOUCH)


@kernel
def _hull(points, count, hull):
    """Convex hull, counterclockwise, by a monotone chain; sorts the points; its size."""
    for k in range(1, count):
        px, py = points[k, 0], points[k, 1]
        j = k - 1
        while j >= 0 and (points[j, 0] > px or (points[j, 0] == px and points[j, 1] > py)):
            points[j + 1, 0], points[j + 1, 1] = points[j, 0], points[j, 1]
            j -= 1
        points[j + 1, 0], points[j + 1, 1] = px, py
    size = 0
    for direction in (1, -1):
        base = size
        for k in range(count):
            p = k if direction > 0 else count - 1 - k
            while size >= base + 2 and _right(hull, size, points[p, 0], points[p, 1]):
                size -= 1
            hull[size, 0], hull[size, 1] = points[p, 0], points[p, 1]
            size += 1
        # Its last point begins the other half.
        size -= 1
    return size


@kernel
def _right(hull, size, x, y):
    """Whether a point is not to the left of the last edge."""
    ax, ay = hull[size - 2, 0], hull[size - 2, 1]
    bx, by = hull[size - 1, 0], hull[size - 1, 1]
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax) <= 0.0


@compiled
def path_stays(site, pose, curvatures, lengths):
    """`stays_on_ground` of one path: pose (3,), curvatures and lengths (n,)."""
    room = np.zeros((2, 20, 2))
    return stays_on_ground(site, pose, curvatures, lengths, len(lengths), room)
