"""Curves that a header's middle follows: polylines smoothed to radii that a combine drives."""

import math

import numpy as np
import shapely

from ..machines.combine import Combine
from ..paths.machine_path import TRANSIT, MachinePath

# Edges of the polylines that are driven along [m].
SPACING = 1.0


def cutting_radius(combine: Combine) -> float:
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
        line: Its ends stay where they are, if they are farther than the radius from any turn.
        radius: [m].
    """
    smoothed = line
    for side in (radius, -radius):
        inner = smoothed.offset_curve(side, quad_segs=24)
        if not isinstance(inner, shapely.LineString) or inner.is_empty:
            continue
        outer = inner.offset_curve(-side, quad_segs=24)
        if not isinstance(outer, shapely.LineString) or outer.is_empty:
            continue
        ends = np.hypot(*(np.array(outer.coords)[[0, -1]] - np.array(smoothed.coords)[[0, -1]]).T)
        if ends.max() < 0.05:
            smoothed = outer
    return smoothed


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
