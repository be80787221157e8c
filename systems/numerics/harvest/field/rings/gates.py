"""Gates: ways that the first loop cuts to obstacles amid the crop."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from ..track import Track, join_tracks, straight_track, turn_track

# Spacing of the places tried for a gate [m].
SPACING = 2.0


@dataclass(frozen=True, eq=False)
class Gate:
    """A straight way from a loop to an obstacle, at a right angle to the loop.

    Attributes:
        index: Point of the loop where the way leaves it.
        line: From beside the loop to the obstacle.
        track: On along the loop, back, to the right into the crop and to the obstacle, and all
            of that back again.
        obstacle: Number of the obstacle.
    """

    index: int
    line: shapely.LineString
    track: Track
    obstacle: int


def find_gates(
    points: np.ndarray,
    headings: np.ndarray,
    inside: shapely.Polygon,
    obstacles: Sequence[shapely.Polygon],
    header: float,
    radius: float,
) -> tuple[Gate, ...]:
    """The shortest way from a loop to each obstacle inside of it, clear of other obstacles.

    An obstacle that none leads to is left out, and so are obstacles that the loop itself passes.

    Args:
        points: Of the loop, shape (n, 2) [m].
        headings: At them, shape (n,) [rad].
        inside: The loop's region.
        obstacles: To get to.
        header: Its width [m].
        radius: Of turns [m].
    """
    gates = []
    step = max(1, int(SPACING / math.dist(points[0], points[1])))
    places = np.arange(0, len(points), step)
    forward = np.stack([np.cos(headings[places]), np.sin(headings[places])], axis=1)
    right = np.stack([forward[:, 1], -forward[:, 0]], axis=1)
    starts = points[places] + radius * (forward + right)
    far = math.dist(inside.bounds[:2], inside.bounds[2:])
    rays = shapely.linestrings(np.stack([starts, starts + far * right], axis=1))
    for k, obstacle in enumerate(obstacles):
        if not inside.contains(obstacle):
            continue
        zone = obstacle.buffer(max(radius, header / 2), quad_segs=24)
        others = shapely.union_all([o for j, o in enumerate(obstacles) if j != k])
        core = obstacle.buffer(header / 4)
        best, best_length = None, math.inf
        for place, start, ray in zip(places, starts, shapely.get_parts(rays), strict=True):
            if not ray.intersects(core):
                continue
            length = shapely.Point(start).distance(ray.intersection(zone))
            if length >= best_length:
                continue
            line = shapely.LineString([start, shapely.line_interpolate_point(ray, length)])
            if length > 0 and inside.covers(line) and not line.buffer(header).intersects(others):
                best, best_length = (int(place), line), length
        if best is not None:
            index, line = best
            pose = (points[index, 0], points[index, 1], headings[index])
            # The crop is parted from the loop's line on, and from the obstacle's edge.
            (x, y), (u, v) = line.coords
            back = 1 + (radius + header) / max(math.dist((x, y), (u, v)), header)
            line = shapely.LineString([(u + back * (x - u), v + back * (y - v)), (u, v)])
            gates.append(Gate(index, line, _gate_track(pose, best_length, radius), k))
    return tuple(gates)


def _gate_track(pose: tuple[float, float, float], length: float, radius: float) -> Track:
    along = straight_track(pose, 2 * radius)
    back = straight_track(along.end, -2 * radius)
    turn = turn_track(pose, -math.pi / 2, radius)
    into = straight_track(turn.end, length)
    tracks = [along, back, turn, into]
    return join_tracks([*tracks, into.reversed(), turn.reversed()])
