"""A lap: one loop driven once, with its sharp corners cut out square."""

import math

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..track import Track, forward_track, join_tracks, straight_track
from .loops import Loop

# Corners that turn by less are driven round without stopping [rad]: what they miss beside the
# corner, (R + l/2)^2 (tan(a/2) - a/2), is less than 2 % of a header's square.
SQUARE_CORNER = math.radians(40.0)

# What turns by more is the end of a strip, not a corner [rad].
SHARPEST = math.radians(150.0)

# Bends by less than this lie on a straight; corners bend by more than that, somewhere. Both are
# curvatures times the radius.
STRAIGHT = 1e-6
SHARP_BEND = 0.4


def corner_runs(loop: Loop, radius: float) -> list[tuple[int, int, float]]:
    """Sharp right turns of a loop: first point, last point (may exceed n), and turn [rad].

    Args:
        loop: Which.
        radius: Of turns [m].
    """
    count = len(loop.points)
    turns = _turns(loop)
    lengths = np.hypot(*(np.roll(loop.points, -1, axis=0) - loop.points).T)
    bend = -turns / lengths * radius
    turning = bend > STRAIGHT
    if not turning.any() or turning.all():
        return []
    shift = int(np.argmin(turning))
    rolled = np.roll(turning, -shift)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], rolled.astype(int), [0]])))
    runs = []
    for first, last in edges.reshape(-1, 2).tolist():
        within = np.arange(first, last) + shift
        turn = -float(np.take(turns, within, mode="wrap").sum())
        if turn >= SQUARE_CORNER and np.take(bend, within, mode="wrap").max() > SHARP_BEND:
            begin = (first + shift - 1) % count
            runs.append((begin, begin + last - first + 1, turn))
    return runs


def lap(loop: Loop, start: int, header: float, radius: float, ground: BaseGeometry) -> Track:
    """One lap from a point of the loop back to it.

    At a sharp corner the combine cuts straight on to the end of the crop, backs up to where it
    began to leave the line, and only then turns. Ways to obstacles are cut on passing.

    Args:
        loop: The loop.
        start: Number of its point to begin at.
        header: Width of the header [m].
        radius: Least turning radius [m].
        ground: Where the combine's middle may be.
    """
    count = len(loop.points)
    stops: dict[int, list[Track]] = {}
    for first, last, turn in corner_runs(loop, radius):
        pose = _pose(loop, first)
        reach = header + 2 * radius
        if turn < SHARPEST:
            reach = _way_to_corner(pose, _pose(loop, last % count), turn)
            reach += header / 2 * math.tan(turn / 2)
        reach = min(_crop_ahead(pose, reach, header, loop.crop), _room(pose, reach, ground))
        on = straight_track(pose, reach)
        stops.setdefault(first, []).append(join_tracks([on, on.reversed()]))
    for gate in loop.gates:
        stops.setdefault(gate.index, []).append(gate.track)
    order = [(start + k) % count for k in range(count)] + [start]
    points = loop.points[order]
    headings = np.unwrap(loop.headings[order])
    tracks, begun = [], 0
    for place, index in enumerate(order[:-1]):
        if index in stops:
            if place > begun:
                tracks.append(_thinned(points[begun : place + 1], headings[begun : place + 1]))
            tracks += stops[index]
            begun = place
    tracks.append(_thinned(points[begun:], headings[begun:]))
    return join_tracks(tracks)


def _pose(loop: Loop, index: int) -> tuple[float, float, float]:
    x, y = loop.points[index].tolist()
    return x, y, float(loop.headings[index])


def _way_to_corner(
    before: tuple[float, float, float], after: tuple[float, float, float], turn: float
) -> float:
    """How far straight on the corner lies that has been rounded; as far as from there on [m]."""
    x, y = after[0] - before[0], after[1] - before[1]
    middle = before[2] - turn / 2
    return (x * math.cos(middle) + y * math.sin(middle)) / (2 * math.cos(turn / 2))


def _turns(loop: Loop) -> np.ndarray:
    """Turn of the heading on each piece of a loop, shape (n,) [rad]."""
    turns = np.roll(loop.headings, -1) - loop.headings
    return np.remainder(turns + math.pi, 2 * math.pi) - math.pi


def _crop_ahead(
    pose: tuple[float, float, float], reach: float, header: float, crop: shapely.Polygon
) -> float:
    """How far straight on the header has crop before it, no farther than told [m]."""
    along = np.array([math.cos(pose[2]), math.sin(pose[2])])
    left = header / 2 * np.array([-along[1], along[0]])
    near, far = np.array(pose[:2]), np.array(pose[:2]) + reach * along
    swath = shapely.Polygon([near - left, far - left, far + left, near + left])
    found = shapely.get_coordinates(swath.intersection(crop))
    return float(max(((found - near) @ along).max(initial=0.0), 0.0))


def _room(pose: tuple[float, float, float], reach: float, ground: BaseGeometry) -> float:
    """How far a combine can drive straight on before it leaves the ground [m]."""
    x, y, theta = pose
    end = (x + reach * math.cos(theta), y + reach * math.sin(theta))
    way = shapely.LineString([(x, y), end]).intersection(ground)
    first = shapely.get_parts(way)[0] if not way.is_empty else way
    return float(first.length) if shapely.Point(x, y).distance(first) < 1e-6 else 0.0


def _thinned(points: np.ndarray, headings: np.ndarray) -> Track:
    """A line without the points amid its straights."""
    bent = np.abs(np.diff(headings)) > 1e-9
    keep = np.concatenate([[True], bent]) | np.concatenate([bent, [True]])
    return forward_track(points[keep], headings[keep])
