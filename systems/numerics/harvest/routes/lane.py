"""Lanes: where a cart drives beside a combine on one loop, always in cut crop or on the margin."""

import math
from dataclasses import dataclass

import numpy as np
import shapely

from ...compiled import compiled
from ..field.combine_path import CombinePath

# Spacing of a lane's points, and of the stations of which it knows the place beside [m].
STEP = 1.0
# How far a lane goes on beyond the place where its loop ends [m].
BEYOND = 60.0
# By how much the lane keeps off where a header turns at the end of the crop [m].
BULGE = 4.0
# How far the lane of a combine that has finished begins before its place [m].
BEFORE = 20.0
# How far lanes over the field are from one, in the usual distance.
WIDER = 1.3
# A loop whose ends are closer than such a part of its way goes round something.
CLOSED = 0.2


@dataclass(frozen=True, eq=False)
class Lane:
    """The line of one loop that a cart follows.

    Attributes:
        begin: Station at which the combine begins the loop [m].
        end: Station at which it leaves it [m].
        points: x, y, theta, theta unwrapped, spaced STEP apart, shape (m, 3).
        stations: Of the combine, shape (k,) [m].
        slots: Way along the lane to the place beside it then, never decreasing, shape (k,) [m].
    """

    begin: float
    end: float
    points: np.ndarray
    stations: np.ndarray
    slots: np.ndarray

    @property
    def length(self) -> float:
        """Of the line [m]."""
        return STEP * (len(self.points) - 1)

    def slot_at(self, station: float) -> float:
        """Way along the lane to the place beside a combine at a station [m]."""
        return float(np.interp(station, self.stations, self.slots))

    def pose_at(self, way: float) -> np.ndarray:
        """x, y, theta after a way along the lane, shape (3,)."""
        at = min(max(way / STEP, 0.0), len(self.points) - 1.001)
        k = int(at)
        return self.points[k] + (at - k) * (self.points[k + 1] - self.points[k])


def lanes_beside(
    path: CombinePath, ground: shapely.Geometry, header: float, reach: float, radius: float
) -> tuple[Lane, ...]:
    """The lanes of all loops of a path, in its order, and those where the combine ends.

    Straight passes at the end have none: others still turn where their lanes would be.

    Args:
        path: Of the combine.
        ground: What may be driven on.
        header: Its width [m].
        reach: From the combine's middle to the lane [m].
        radius: The cart's least turning radius [m].
    """
    # Runs of pieces of one loop; what lies between loops has no lane.
    edges = np.flatnonzero(np.diff(path.loops)) + 1
    bounds = np.concatenate([[0], edges, [len(path.loops)]])
    lanes = []
    for first, last in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        points = path.points[first : last + 1]
        if path.loops[first] >= 0 and _goes_round(points, radius):
            lanes.append(_lane(path, first, last, header, reach, radius))
    return (*lanes, *_parked(path, ground, reach))


def _goes_round(points: np.ndarray, radius: float) -> bool:
    """Whether a line is a loop rather than a straight pass."""
    way = float(np.hypot(*np.diff(points, axis=0).T).sum())
    gap = math.dist(points[0], points[-1])
    return len(points) > 3 and gap <= CLOSED * way and way > 8 * radius


def _parked(path: CombinePath, ground: shapely.Geometry, reach: float) -> list[Lane]:
    """Straights beside a combine that has finished, those first that are best on the ground.

    Its auger reaches round it, so that a cart may come from either side, pass ahead or behind, and
    go either way; one of these ways is open where the one on the left is not.
    """
    x, y, theta = path.pose_at(path.length)
    along = np.arange(-BEFORE, BEFORE + STEP, STEP)
    ends = np.array([path.length, path.length + 1.0])
    found: list[tuple[float, Lane]] = []
    for turn, far in ((math.pi / 2, 1.0), (-math.pi / 2, WIDER), (0.0, WIDER), (math.pi, WIDER)):
        a = x + far * reach * math.cos(theta + turn)
        b = y + far * reach * math.sin(theta + turn)
        for back in (0.0, math.pi):
            way = theta + turn - math.pi / 2 + back
            line = np.column_stack(
                [a + along * math.cos(way), b + along * math.sin(way), np.full(len(along), way)]
            )
            inside = float(shapely.contains_xy(ground, line[:, 0], line[:, 1]).mean())
            slots = np.full(2, BEFORE)
            lane = Lane(path.length, path.length + 1.0, line, ends, slots)
            found.append((inside, lane))
    best = max(inside for inside, _ in found)
    order = sorted(found, key=lambda each: -each[0])
    return [lane for inside, lane in order if inside == best or inside == 1.0]


def _lane(
    path: CombinePath, first: int, last: int, header: float, reach: float, radius: float
) -> Lane:
    points = path.points[first : last + 1]
    room = _corner_room(path, first, last, header)
    line = _beside(points, room, header, reach, radius)
    begin, end = float(path.stations[first]), float(path.stations[last])
    count = max(2, math.ceil((end - begin) / STEP) + 1)
    stations = np.linspace(begin, end, count)
    combine = path.pose_at(stations)
    slots = _projections(line, combine[:, :2], STEP)
    return Lane(begin, end, line, stations, slots)


def _corner_room(path: CombinePath, first: int, last: int, header: float) -> shapely.Geometry:
    """What headers need at the corners that they cut out square, with room for a cart's turn."""
    back = path.gears[first:last] < 0
    edges = np.flatnonzero(np.diff(np.concatenate([[0], back.astype(int), [0]])))
    boxes = []
    for a, b in edges.reshape(-1, 2).tolist():
        x, y = path.points[first + a]
        u, v = path.points[first + b]
        on = shapely.LineString([(u, v), (x, y)])
        if on.length < STEP:
            continue
        boxes.append(on.buffer(header / 2, cap_style="flat"))
        c, s = (x - u) / on.length, (y - v) / on.length
        bulge = shapely.LineString([(x - BULGE * c, y - BULGE * s), (x + BULGE * c, y + BULGE * s)])
        boxes.append(bulge.buffer(header / 2 + BULGE, cap_style="flat"))
    return shapely.union_all(boxes)


def _beside(
    points: np.ndarray,
    room: shapely.Geometry,
    header: float,
    reach: float,
    radius: float,
) -> np.ndarray:
    """The line on the left of a loop's line, gently enough curved; x, y, theta, shape (m, 3)."""
    region = shapely.Polygon(points).buffer(0.0)
    if isinstance(region, shapely.MultiPolygon):
        region = max(region.geoms, key=lambda part: part.area)
    swept = region.buffer(header / 2, join_style="mitre", mitre_limit=1.5).union(room)
    wide = swept.buffer(reach - header / 2, join_style="mitre", mitre_limit=2.0)
    # Corners of either kind get the cart's radius, and half as much again.
    gentle = 1.5 * radius
    wide = wide.buffer(gentle, quad_segs=32).buffer(-2 * gentle, quad_segs=32)
    wide = wide.buffer(gentle, quad_segs=32)
    if isinstance(wide, shapely.MultiPolygon):
        wide = max(wide.geoms, key=lambda part: part.area)
    assert isinstance(wide, shapely.Polygon)
    ring = np.array(shapely.Polygon(wide.exterior).exterior.coords)[:-1]
    if shapely.is_ccw(wide.exterior):
        ring = ring[::-1]
    ring = _resampled(np.vstack([ring, ring[:1]]))[:, :2]
    # Begin beside the loop's first point.
    start = int(np.argmin(np.hypot(*(ring - points[0]).T)))
    rolled = np.roll(ring[:-1], -start, axis=0)
    further = int(BEYOND / STEP)
    repeats = math.ceil(further / len(rolled))
    return _resampled(np.vstack([rolled, np.tile(rolled, (repeats, 1))[:further]]))


def _resampled(line: np.ndarray) -> np.ndarray:
    """Poses at equal ways along a line, shape (n, 2) -> (m, 3)."""
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    at = np.arange(0.0, way[-1], STEP)
    x, y = (np.interp(at, way, column) for column in line.T)
    course = np.unwrap(np.arctan2(np.gradient(y), np.gradient(x)))
    return np.stack([x, y, course], axis=1)


@compiled
def _projections(line, points, step):
    """Way along a line to the point nearest to each of a row of points; never decreasing."""
    ways = np.empty(len(points))
    place = 0
    for k in range(len(points)):
        best, nearest = np.inf, place
        for j in range(place, min(place + 80, len(line))):
            gap = (line[j, 0] - points[k, 0]) ** 2 + (line[j, 1] - points[k, 1]) ** 2
            if gap < best:
                best, nearest = gap, j
        place = nearest
        course = line[place, 2]
        ahead = (points[k, 0] - line[place, 0]) * np.cos(course)
        ahead += (points[k, 1] - line[place, 1]) * np.sin(course)
        ways[k] = step * place + min(max(ahead, -0.5 * step), 0.5 * step)
        if k > 0:
            ways[k] = max(ways[k], ways[k - 1])
    return ways
