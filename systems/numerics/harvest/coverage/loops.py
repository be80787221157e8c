"""Headland rounds and rings round holes: closed lines with radii that combines can drive.

Rounds are split at convex corners. The curves that a header's middle follows are smoothed
polylines.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from ..field.field import Field
from ..machines import CombineSize
from ..paths import MachinePath, rounded_path
from .cut_ground import GAP

# Edges of the polylines that are driven along [m].
SPACING = 1.0

# Ends nearer to one another than this count as the same [m].
SAME_ENDS = 0.05

# At sharper corners loops are split: combines drive straight on and turn outside the crop [rad].
SPLIT_TURN = math.radians(50.0)

# How far a header's middle drives on past the crop, besides half the header's depth [m].
CLEAR = 0.2

# Least radius of loops over that of turns: polylines turn a little more sharply than curves [-].
SPARE = 1.05

# How far outside of the field rounds may go round reflex corners, as a part of the margin [-], and
# how many radii are tried.
OUTSIDE = 0.5
RADII = 9

# Lines are simplified by this much [m].
TOLERANCE = 0.05


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
        line: The line. Its ends stay where they are if they are farther than the radius from any
            turn; else they move aside, onto the rounded line. It may return to where it began, and
            go on over its own beginning.
        radius: [m].
    """
    smoothed = _smoothed(line, radius)
    tips = shapely.get_coordinates(line)[[0, -1]]
    comes_round = line.length > 16 * radius and math.dist(*tips) < 4 * radius
    if not comes_round or _apart(smoothed, line) < SAME_ENDS:
        return smoothed
    # Offset curves cross where it overlaps itself, and may end anywhere near: smooth each half by
    # itself.
    middle, more = line.length / 2, 4 * radius
    place = line.interpolate(middle)
    first, last = (
        _smoothed(shapely.LineString(shapely.get_coordinates(half)), radius)
        for half in (
            substring(line, 0.0, middle + more),
            substring(line, middle - more, line.length),
        )
    )
    parts = (
        substring(first, 0.0, first.project(place)),
        substring(last, last.project(place), last.length),
    )
    points = [shapely.get_coordinates(part) for part in parts]
    return shapely.LineString(np.concatenate([points[0], points[1][1:]]))


def _smoothed(line: shapely.LineString, radius: float) -> shapely.LineString:
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
    """The part of a line from the point nearest to another's first point to that nearest its last.

    Both are sought only within `reach` of the line's ends, as it may return to where it began.
    """
    first, last = (
        substring(each, 0.0, reach).project(shapely.Point(other.coords[k]))
        for k, each in ((0, line), (-1, shapely.reverse(line)))
    )
    part = substring(line, first, line.length - last)
    ordered = first + last < line.length - SPACING
    return part if ordered and isinstance(part, shapely.LineString) else None


def _apart(line: shapely.LineString, other: shapely.LineString) -> float:
    """Largest distance between corresponding ends of two lines [m]."""
    ends = np.array(line.coords)[[0, -1]] - np.array(other.coords)[[0, -1]]
    return float(np.hypot(*ends.T).max())


def drive_line(points: np.ndarray, *, cutting: bool) -> MachinePath:
    """The path along a polyline, its corners rounded by the widest arcs that fit.

    The polyline is divided into even edges first; each corner's arc touches both edges in their
    middles, so that a polyline along an arc gives nearly that arc.

    Args:
        points: At least two, shape (n, 2) [m].
        cutting: Whether the header is down.
    """
    line = shapely.LineString(points)
    # Even edges: where short ones meet long ones, arcs would be sharper than the curve.
    count = max(1, math.ceil(line.length / SPACING))
    points = shapely.get_coordinates(
        shapely.line_interpolate_point(line, np.linspace(0.0, line.length, count + 1))
    )
    return rounded_path(points, cutting=cutting)


@dataclass(frozen=True, eq=False)
class Loop:
    """A closed line that the header's middle follows, its outside on the left.

    Attributes:
        line: Closed; clockwise along the boundary, counterclockwise round a hole.
        corners: Stations at which it is split, ascending, shape (c,) [m].
        turns: Absolute change of heading at the corners, shape (c,) [rad].
        number: Of the round: 0 along the boundary, from there inwards.
        hole: Whether it goes round holes.
    """

    line: shapely.LineString
    corners: np.ndarray
    turns: np.ndarray
    number: int
    hole: bool

    @cached_property
    def length(self) -> float:
        """Of the line [m]."""
        return float(self.line.length)

    def pose(self, station: float, side: int = 1, *, arriving: bool = False) -> np.ndarray:
        """x, y, theta at a station, with the heading to drive on from there [m], [m], [rad].

        Args:
            station: [m].
            side: 1 along the line, -1 against it.
            arriving: Whether the heading is that of a machine that has driven up to there.
        """
        other = station + side * (-SPACING if arriving else SPACING)
        at, beside = (
            np.array(self.line.interpolate(each % self.length).coords[0])
            for each in (station, other)
        )
        along = at - beside if arriving else beside - at
        return np.array([*at, math.atan2(along[1], along[0])])

    def station(self, point: np.ndarray) -> float:
        """Station of the point of the line that is nearest to a point [m]."""
        return float(self.line.project(shapely.Point(point[:2])))

    def corners_within(self, begin: float, end: float) -> np.ndarray:
        """Stations of corners above begin and below end, unwrapped, ascending [m]."""
        turns = np.arange(math.floor(begin / self.length), math.floor(end / self.length) + 1)
        every = (self.corners[None, :] + self.length * turns[:, None]).ravel()
        return every[(every > begin + 1e-6) & (every < end - 1e-6)]

    def part(self, begin: float, end: float) -> np.ndarray:
        """The line's points between stations, which may lie beyond its ends, shape (n, 2).

        Args:
            begin: Station [m].
            end: Station above it [m].
        """
        pieces = []
        at = begin
        while at < end - 1e-9:
            turn = math.floor(at / self.length + 1e-12)
            upto = min(end, (turn + 1) * self.length)
            piece = substring(self.line, at - turn * self.length, upto - turn * self.length)
            pieces.append(np.array(piece.coords))
            at = upto
        return np.concatenate(pieces)


def crop_to_offset(field: Field, combine: CombineSize) -> BaseGeometry:
    """The region whose inward offsets are rounds that a combine can drive.

    Reflex corners of the boundary are rounded outside of the field, and holes are grown, so that no
    round bends more sharply than the header cuts cleanly, as far as the margin has room for that.
    No-go areas beside the field are grown like holes.
    """
    outline = _rounded_outside(field, combine)
    closed = [_drivable_hole(area, combine) for area in (*field.obstacles, *field.no_go)]
    return outline.difference(shapely.union_all(closed)) if closed else outline


def _rounded_outside(field: Field, combine: CombineSize) -> BaseGeometry:
    half = combine.header_width / 2
    widest = cutting_radius(combine) - half
    least = SPARE * combine.turning_radius - half
    room = field.outline.buffer(OUTSIDE * field.margin)
    outline: BaseGeometry = field.outline
    for radius in np.linspace(widest, min(least, widest), RADII):
        if radius > 0:
            grown = field.outline.buffer(radius, join_style="mitre", mitre_limit=10.0)
            fillets = shapely.get_parts(grown.buffer(-radius, quad_segs=24) - field.outline)
            # With the least radius all corners are rounded, whatever room they need.
            fits = shapely.covered_by(fillets, room) | (radius <= least)
            outline = outline.union(shapely.union_all(fillets[fits]))
    return outline


def _drivable_hole(hole: shapely.Polygon, combine: CombineSize) -> shapely.Polygon:
    """A hole, grown until the ring round it, half a header away, can be driven."""
    half, radius = combine.header_width / 2, SPARE * combine.turning_radius
    kept = hole.buffer(GAP)
    widest = max(GAP, radius - half) + TOLERANCE
    for around in np.linspace(GAP + TOLERANCE, widest, 6):
        ring = hole.buffer(half + around, quad_segs=24)
        ring = ring.buffer(-radius, quad_segs=24).buffer(radius, quad_segs=24)
        inner = ring.buffer(-half, quad_segs=24)
        if inner.geom_type == "Polygon" and inner.contains(kept):
            return inner
    return hole.buffer(widest, quad_segs=24)


def lay_out_loops(
    region: BaseGeometry,
    combine: CombineSize,
    number: int,
    has_room: Callable[[np.ndarray], bool],
) -> list[Loop]:
    """The loops of one round, those along the boundary first, then those round holes.

    Corners beyond which combines have no room to drive on and turn, for instance beside a no-go
    area that touches the field, are rounded and driven with the header down.

    Args:
        region: What rounds are offsets of.
        combine: The combine.
        number: Of the round, 0 along the edge.
        has_room: Whether its outline at a pose, shape (3,), is on the ground, crop or not.
    """
    loops = []
    for shape, hole in rings_inside(region, (number + 0.5) * combine.header_width):
        if shape.area < 1.0:
            continue
        radius = cutting_radius(combine) if hole else SPARE * combine.turning_radius
        loop = _make_loop(shape, number, hole=hole, radius=radius)
        closed = () if loop is None else _closed_corners(loop, combine, has_room)
        if len(closed):
            rounded = _with_round_corners(shape, closed, cutting_radius(combine))
            loop = _make_loop(rounded, number, hole=hole, radius=radius)
        if loop is not None:
            loops.append(loop)
    return sorted(loops, key=lambda loop: loop.hole)


def rings_inside(region: BaseGeometry, depth: float) -> Iterator[tuple[shapely.Polygon, bool]]:
    """Rings at a distance from the edges of polygons, filled, and whether they go round holes.

    Args:
        region: The polygons.
        depth: The distance [m].
    """
    for part in shapely.get_parts(region.buffer(-depth, quad_segs=24)):
        if isinstance(part, shapely.Polygon) and not part.is_empty:
            yield shapely.Polygon(part.exterior), False
            yield from ((shapely.Polygon(ring), True) for ring in part.interiors)


def turned_ring(points: np.ndarray, *, hole: bool) -> np.ndarray:
    """Points of a ring, clockwise, or counterclockwise round a hole, shape (n, 2).

    Args:
        points: Of the ring, shape (n, 2) [m].
        hole: Whether it goes round a hole.
    """
    return points if shapely.LinearRing(points).is_ccw == hole else points[::-1]


def room_beyond(
    loop: Loop,
    station: float,
    side: int,
    combine: CombineSize,
    has_room: Callable[[np.ndarray], bool],
) -> float | None:
    """How far a straight may go on beyond a corner [m]; None if there is no room.

    Args:
        loop: The loop.
        station: Of the corner [m].
        side: 1 for the edge that ends there, -1 for the one that begins.
        combine: The combine.
        has_room: See `lay_out_loops`.
    """
    away = (loop.corners - station + loop.length / 2) % loop.length - loop.length / 2
    asked = drive_on(float(loop.turns[np.argmin(np.abs(away))]), combine)
    tip = loop.pose(station, arriving=side > 0)
    for way in np.arange(asked, 0.0, -1.0):
        pose = tip + np.array([math.cos(tip[2]), math.sin(tip[2]), 0.0]) * (side * way)
        if has_room(pose):
            return float(way)
    return None


def _closed_corners(
    loop: Loop, combine: CombineSize, has_room: Callable[[np.ndarray], bool]
) -> list[shapely.Point]:
    """Corners beyond which there is no room for one of their edges."""
    return [
        shapely.Point(loop.pose(station)[:2])
        for station in loop.corners
        if any(room_beyond(loop, station, side, combine, has_room) is None for side in (1, -1))
    ]


def _with_round_corners(
    shape: shapely.Polygon, corners: Sequence[shapely.Point], radius: float
) -> shapely.Polygon:
    """A polygon with some of its convex corners rounded."""
    opened = shape.buffer(-radius, quad_segs=24).buffer(radius, quad_segs=24)
    sharp = shapely.get_parts(shape.difference(opened))
    kept = [part for part in sharp if all(part.distance(each) > 1.0 for each in corners)]
    # Rounding errors leave seams where the parts are joined again: they are closed.
    rounded = shapely.union_all([opened, *kept]).buffer(TOLERANCE, join_style="mitre")
    rounded = rounded.buffer(-TOLERANCE, join_style="mitre")
    return max(shapely.get_parts(rounded), key=lambda part: part.area)


def _make_loop(shape: shapely.Polygon, number: int, *, hole: bool, radius: float) -> Loop | None:
    if hole:
        # Notches between holes are passed by.
        grown = shape.buffer(radius, quad_segs=24).buffer(-radius, quad_segs=24)
        shape = max(shapely.get_parts(grown), key=lambda part: part.area)
    ring = shape.exterior.simplify(0.01 if hole else TOLERANCE)
    points = shapely.get_coordinates(ring)[:-1]
    if len(points) < 3:
        return None
    points = turned_ring(points, hole=hole)
    steps = np.roll(points, -1, axis=0) - points
    before = np.roll(steps, 1, axis=0)
    # Positive to the right: with the crop on the right these are convex corners.
    turns = -np.arctan2(
        before[:, 0] * steps[:, 1] - before[:, 1] * steps[:, 0],
        np.einsum("ij,ij->i", before, steps),
    )
    sharp = np.flatnonzero(turns > SPLIT_TURN) if not hole else np.zeros(0, dtype=int)
    if len(sharp):
        points = np.roll(points, -sharp[0], axis=0)
        turns = np.roll(turns, -sharp[0])
        sharp -= sharp[0]
    elif not hole:
        opened = shape.buffer(-radius, quad_segs=24).buffer(radius, quad_segs=24)
        if opened.geom_type != "Polygon" or opened.is_empty:
            return None
        points = shapely.get_coordinates(opened.exterior.simplify(0.02))[:-1]
        points = turned_ring(points, hole=False)
    line = shapely.LineString([*points, points[0]])
    stations = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line.coords, axis=0).T))])
    return Loop(line, stations[sharp], turns[sharp], number, hole)


def drive_on(turn: float, combine: CombineSize) -> float:
    """How far past a corner of a loop the header's middle drives straight on [m].

    Args:
        turn: Of the loop at the corner, absolute [rad].
        combine: The combine.
    """
    half = combine.header_width / 2
    corner = half * math.tan(min(turn, math.radians(150.0)) / 2)
    return corner + combine.header_depth / 2 + CLEAR


def drive_edge(
    loop: Loop,
    begin: float,
    end: float,
    extensions: tuple[float, float],
    combine: CombineSize,
) -> MachinePath:
    """The path along a part of a loop without split corners, with straights at its ends.

    Args:
        loop: The loop.
        begin: Station [m].
        end: Station above it [m].
        extensions: Of the straights before and behind [m].
        combine: The combine.
    """
    points = loop.part(begin, end)
    points = points[np.concatenate([[True], np.hypot(*np.diff(points, axis=0).T) > 1e-6])]
    first, last = points[0] - points[1], points[-1] - points[-2]
    ahead = points[-1] + last / np.hypot(*last) * extensions[1]
    behind = points[0] + first / np.hypot(*first) * extensions[0]
    lines = [points]
    if extensions[0] > 0:
        lines.insert(0, behind[None])
    if extensions[1] > 0:
        lines.append(ahead[None])
    radius = SPARE * combine.turning_radius
    line = smooth_line(shapely.LineString(np.concatenate(lines)), radius)
    return drive_line(np.array(line.coords), cutting=True)
