"""Curves that a header's middle follows: polylines smoothed to radii that a combine drives."""

import math

import numpy as np
import shapely
from shapely.ops import substring

from ..machines.combine import CombineSize
from ..paths.machine_path import TRANSIT, MachinePath

# Edges of the polylines that are driven along [m].
SPACING = 1.0

# Ends that are nearer are the same [m].
SAME_ENDS = 0.05


def cutting_radius(combine: CombineSize) -> float:
    """Least radius of turns on which the body keeps to what the header has just cut [m].

    The outer rear corner of the body runs on no wider circle than the header's outer end.
    """
    half, reach = combine.header_width / 2, combine.width / 2
    spare = half - reach
    if spare <= 0:
        return math.inf
    # (r + reach)^2 + length^2 = (r + half)^2
    least = (reach**2 + combine.length**2 - half**2) / (2 * spare)
    return max(combine.turning_radius, least)


def smooth_line(line: shapely.LineString, radius: float) -> shapely.LineString:
    """A line whose turns to either side are rounded to a radius where they are sharper.

    Args:
        line: Its ends stay where they are, if they are farther than the radius from any turn; else
            they come to lie beside, on the line that is rounded.
        radius: [m].
    """
    smoothed = line
    for side in (radius, -radius):
        rounded = _rounded(smoothed, side)
        if rounded is None or _apart(rounded, smoothed) >= SAME_ENDS:
            rounded = _rounded(_longer(smoothed, 2 * radius), side)
            rounded = None if rounded is None else _between(rounded, smoothed, 4 * radius)
        smoothed = smoothed if rounded is None else rounded
    return smoothed


def _rounded(line: shapely.LineString, side: float) -> shapely.LineString | None:
    """The line with its turns to one side rounded; None where nothing is left of it."""
    for distance in (side, -side):
        moved = line.offset_curve(distance, quad_segs=24)
        if not isinstance(moved, shapely.LineString) or moved.is_empty:
            return None
        line = moved
    return line


def _longer(line: shapely.LineString, by: float) -> shapely.LineString:
    """The line, going on straight at both ends."""
    points = shapely.get_coordinates(line)
    ends = [
        tip + (tip - beside) * (by / np.hypot(*(tip - beside)))
        for tip, beside in ((points[0], points[1]), (points[-1], points[-2]))
    ]
    return shapely.LineString(np.vstack([ends[0], points, ends[1]]))


def _between(
    line: shapely.LineString, other: shapely.LineString, reach: float
) -> shapely.LineString | None:
    """The part of a line from beside another one's first point to beside its last.

    Both are looked for no farther than a reach from the line's ends: it may come round to where it
    began.
    """
    first, last = (
        substring(each, 0.0, reach).project(shapely.Point(other.coords[k]))
        for k, each in ((0, line), (-1, shapely.reverse(line)))
    )
    part = substring(line, first, line.length - last)
    ordered = first + last < line.length - SPACING
    return part if ordered and isinstance(part, shapely.LineString) else None


def _apart(line: shapely.LineString, other: shapely.LineString) -> float:
    """How far the ends of two lines are apart at most [m]."""
    ends = np.array(line.coords)[[0, -1]] - np.array(other.coords)[[0, -1]]
    return float(np.hypot(*ends.T).max())


def drive_line(points: np.ndarray, *, cutting: bool, work: int = TRANSIT) -> MachinePath:
    """The path along a polyline, its corners rounded by the widest arcs that fit.

    The polyline is divided into even edges first; each corner's arc touches both edges in their
    middles, so that a polyline along an arc gives nearly that arc.

    Args:
        points: At least two, shape (n, 2) [m].
        cutting: Whether the header is down.
        work: Number of the piece of work.
    """
    line = shapely.LineString(points)
    # Even edges: where short ones meet long ones, arcs would be sharper than the curve.
    count = max(1, math.ceil(line.length / SPACING))
    points = shapely.get_coordinates(
        shapely.line_interpolate_point(line, np.linspace(0.0, line.length, count + 1))
    )
    steps = np.diff(points, axis=0)
    lengths = np.hypot(*steps.T)
    headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    poses = [(points[0, 0], points[0, 1], headings[0])]

    def drive_to(x: float, y: float, theta: float) -> None:
        last = poses[-1]
        if math.hypot(x - last[0], y - last[1]) > 1e-6:
            poses.append((x, y, theta))

    for k in range(1, len(points) - 1):
        turn = headings[k] - headings[k - 1]
        if abs(turn) < 1e-6:
            continue
        tangent = min(lengths[k - 1], lengths[k]) / 2
        x, y = points[k]
        before, after = headings[k - 1], headings[k]
        drive_to(x - tangent * math.cos(before), y - tangent * math.sin(before), before)
        drive_to(x + tangent * math.cos(after), y + tangent * math.sin(after), after)
    drive_to(points[-1, 0], points[-1, 1], headings[-1])
    if len(poses) == 1:
        poses.append(poses[0])
    count = len(poses) - 1
    return MachinePath(
        np.array(poses), np.ones(count, dtype=int), np.full(count, cutting), np.full(count, work)
    )
