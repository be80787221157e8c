"""Crop and ground: what is cut and when, what bodies crush, and where machines may be.

The crop is sampled at the points of a square lattice, each of which stands for a square. A point is
cut when a header that is down first covers it, and crushed if a body covers it before that. In the
frame of a machine a point moves along an arc, which is split into pieces that differ from their
chords by less than SAGITTA; the instant at which a chord enters the outline is exact.

The lattice lies at the golden angle to the longest edge of the field, so that no row, headland or
gap between two of them is parallel to it. So the area that is measured of a strip of any width
along the field's edges is right but for about half a square times the square root of the number of
squares on its border. Squares are 0.25 m wide up to some 30 ha.

Whether a header is down between two samples is not logged: it counts as down if it is at either.
So where it is lifted or lowered, the way of one sample at most is cut too much.
"""

import math
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...compiled import compiled, kernel
from .harvest_log import HarvestLog, Site
from .motion import continuous

# An outline may reach this far into an obstacle or beyond the margin without a fault [m].
TOUCH = 0.01

# Number of chords for a quarter circle where the margin goes round a corner.
CHORDS = 32

# Side of the squares [m], and how many points of crop and of the box round it there are at most.
SIDE, CROP_POINTS, ALL_POINTS = 0.25, 5e6, 2.5e7

# Largest distance between an arc and its chord [m].
SAGITTA = 1e-3

# A point that is cut no later than this after a body covers it counts as cut in time [s].
SAME = 1e-6

# Angle of the lattice to the longest edge: its slope is the golden ratio, which is as far as can be
# from the slopes of rows of points [rad].
ANGLE = math.atan((math.sqrt(5) - 1) / 2)


@dataclass(frozen=True, eq=False)
class Ground:
    """The ground of a field, with the crop on it.

    Attributes:
        crop: Where crop grows.
        obstacles: The holes and no-go areas, without the crop that lies in them.
        allowed: All within the margin, obstacles included.
    """

    crop: BaseGeometry
    obstacles: BaseGeometry
    allowed: BaseGeometry

    @property
    def core(self) -> BaseGeometry:
        """The obstacles shrunk by TOUCH all round; those that would vanish stay whole."""
        polygons = shapely.get_parts(self.obstacles)
        thinner = shapely.buffer(polygons, -TOUCH, join_style="mitre")
        return shapely.union_all(np.where(shapely.is_empty(thinner), polygons, thinner))

    @property
    def touched(self) -> BaseGeometry:
        """The allowed ground, grown by TOUCH all round."""
        return self.allowed.buffer(TOUCH, join_style="mitre")


def ground_of(site: Site) -> Ground:
    """The ground of a site; machines may be anywhere no farther from a part than the margin."""
    outlines = [part.boundary for part in site.parts]
    grown = [outline.buffer(site.margin, quad_segs=CHORDS) for outline in outlines]
    crops = [part.boundary.difference(shapely.union_all(part.holes)) for part in site.parts]
    crop = shapely.union_all(crops)
    holes = [hole for part in site.parts for hole in (*part.holes, *part.no_go)]
    return Ground(crop, shapely.union_all(holes).difference(crop), shapely.union_all(grown))


def edges_of(region: BaseGeometry) -> np.ndarray:
    """All edges of a region's rings, x and y of both ends, shape (e, 4) [m]."""
    rings = [
        shapely.get_coordinates(ring)
        for polygon in shapely.get_parts(region)
        if isinstance(polygon, shapely.Polygon)
        for ring in (polygon.exterior, *polygon.interiors)
    ]
    edges = [np.hstack([ring[:-1], ring[1:]]) for ring in rings]
    return np.ascontiguousarray(np.concatenate(edges)) if edges else np.zeros((0, 4))


@dataclass(frozen=True, eq=False)
class CropRecord:
    """What became of the crop.

    Attributes:
        area: Of the crop [m^2].
        cut: Area cut by each sample, never decreasing, shape (T,) [m^2].
        crushed: Area that stood when a body first covered it, by machine and by interval between
            two samples, each shape (T - 1,) [m^2].
        side: Side of the lattice's squares [m].
        grain: Grain of the area cut by each sample, if the site has yields; shape (T,) [kg].
    """

    area: float
    cut: np.ndarray
    crushed: dict[str, np.ndarray]
    side: float
    grain: np.ndarray | None = None


def crop_record(log: HarvestLog, site: Site, crop: BaseGeometry) -> CropRecord:
    """Replay the log: cut the crop under the headers, and find what bodies crush.

    Args:
        log: Of the machines.
        site: Their outlines.
        crop: Where it grows.
    """
    edges = edges_of(crop)
    long = edges[np.argmax(np.hypot(edges[:, 2] - edges[:, 0], edges[:, 3] - edges[:, 1]))]
    back = -(math.atan2(long[3] - long[1], long[2] - long[0]) + ANGLE)
    turned = np.hstack([_turned(edges[:, :2], back), _turned(edges[:, 2:], back)])
    low = turned.reshape(-1, 2).min(axis=0)
    extent = turned.reshape(-1, 2).max(axis=0) - low
    side = max(SIDE, math.sqrt(crop.area / CROP_POINTS), math.sqrt(extent.prod() / ALL_POINTS))
    columns, rows = (np.floor(extent / side).astype(int) + 1).tolist()
    cut_at = _bare(turned, low, side, rows, columns)
    points = np.count_nonzero(cut_at == np.inf)
    area = float(crop.area)
    square = area / points if points else 0.0

    def frames(poses: np.ndarray) -> np.ndarray:
        turned = np.column_stack([_turned(poses[:, :2], back), poses[:, 2] + back])
        return np.ascontiguousarray(continuous(turned))

    combines = [frames(log.combine_pose[:, n]) for n in range(len(site.combines))]
    always = np.ones(len(log.time) - 1, dtype=bool)
    covered = np.zeros(cut_at.shape, dtype=bool)
    crushed = {
        f"{group} {n}": np.zeros(len(always))
        for group, machines in (("combine", site.combines), ("cart", site.carts))
        for n in range(len(machines))
    }

    def drive(name, outline, poses, drives, reach, cuts) -> None:
        for piece in _convex_pieces(outline):
            grid = log.time, reach, low, side, cut_at, covered
            _drive(piece, poses, drives, *grid, crushed[name], cuts)

    # Header and body take the same pieces of arcs, as their front edges lie on one line.
    reaches = [_reach(machine.front, machine.rear) for machine in site.combines]
    for n, machine in enumerate(site.combines):
        down = log.cutting[:, n] > 0
        drives = down[:-1] | down[1:]
        drive(f"combine {n}", machine.front, combines[n], drives, reaches[n], True)
    for n, machine in enumerate(site.combines):
        drive(f"combine {n}", machine.rear, combines[n], always, reaches[n], False)
    for k, machine in enumerate(site.carts):
        tractor, trailer = frames(log.tractor_pose[:, k]), frames(log.trailer_pose[:, k])
        drive(f"cart {k}", machine.front, tractor, always, _reach(machine.front), False)
        drive(f"cart {k}", machine.rear, trailer, always, _reach(machine.rear), False)
    row, column = np.nonzero(np.isfinite(cut_at))
    order = np.argsort(cut_at[row, column])
    count = np.searchsorted(cut_at[row, column][order], log.time, side="right")
    grain = None
    if site.yields is not None:
        places = _turned(low + side * np.column_stack([column + 0.5, row + 0.5]), -back)
        comes = square * site.yields.at(places)[order]
        grain = np.append(0.0, np.cumsum(comes))[count]
    squares = {name: square * each for name, each in crushed.items()}
    return CropRecord(area, square * count, squares, side, grain)


def _turned(points: np.ndarray, angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return points @ np.array([[c, s], [-s, c]])


def _reach(*outlines: np.ndarray) -> float:
    return max(float(np.hypot(*outline.T).max()) for outline in outlines)


def _convex_pieces(outline: np.ndarray) -> list[np.ndarray]:
    """Edges of each convex piece: a, b, c, with a x + b y + c >= 0 inside, and a corner; (m, 5)."""
    whole = shapely.Polygon(outline)
    pieces = [whole]
    if whole.convex_hull.area - whole.area > 1e-9 * whole.area:
        pieces = list(shapely.constrained_delaunay_triangles(whole).geoms)
    lines = []
    for piece in pieces:
        ring = shapely.get_coordinates(shapely.orient_polygons(piece))
        begin, way = ring[:-1], np.diff(ring, axis=0)
        normals = np.column_stack([-way[:, 1], way[:, 0]]) / np.hypot(*way.T)[:, None]
        offsets = -np.einsum("ij,ij->i", normals, begin)
        # A hair wider, so that rounding leaves no points between two rows that adjoin.
        lines.append(np.column_stack([normals, offsets + 1e-9, begin]))
    return lines


@compiled
def _bare(edges, low, side, rows, columns):
    """Initial cut times: infinity on crop, -infinity elsewhere; shape (rows, columns) [s]."""
    cut_at = np.full((rows, columns), -np.inf)
    crossings = np.empty(len(edges))
    for row in range(rows):
        y = low[1] + side * (row + 0.5)
        count = 0
        for e in range(len(edges)):
            if (edges[e, 1] > y) != (edges[e, 3] > y):
                share = (y - edges[e, 1]) / (edges[e, 3] - edges[e, 1])
                crossings[count] = edges[e, 0] + share * (edges[e, 2] - edges[e, 0])
                count += 1
        ordered = np.sort(crossings[:count])
        for pair in range(count // 2):
            first = max(0, int(np.ceil((ordered[2 * pair] - low[0]) / side - 0.5)))
            last = min(columns - 1, int(np.floor((ordered[2 * pair + 1] - low[0]) / side - 0.5)))
            for column in range(first, last + 1):
                cut_at[row, column] = np.inf
    return cut_at


@kernel
def _enters(lines, x0, y0, x1, y1):
    """Share of the way between two points at which it enters a convex piece; 2: it does not."""
    enter, leave = 0.0, 1.0
    for i in range(len(lines)):
        begin = lines[i, 0] * x0 + lines[i, 1] * y0 + lines[i, 2]
        end = lines[i, 0] * x1 + lines[i, 1] * y1 + lines[i, 2]
        if begin < 0.0:
            if end < 0.0:
                return 2.0
            enter = max(enter, begin / (begin - end))
        elif end < 0.0:
            leave = min(leave, begin / (begin - end))
        if enter > leave:
            return 2.0
    return enter


@kernel
def _between(poses, k, share):
    dx, dy = poses[k + 1, 0] - poses[k, 0], poses[k + 1, 1] - poses[k, 1]
    turn = poses[k + 1, 2] - poses[k, 2]
    half, part = turn / 2, turn * share / 2
    scale = share
    if abs(half) > 1e-9:
        scale = math.sin(part) / math.sin(half)
    # The chord of the first part of the arc, turned back from that of the whole.
    back = part - half
    c, s = scale * math.cos(back), scale * math.sin(back)
    x = poses[k, 0] + c * dx - s * dy
    y = poses[k, 1] + s * dx + c * dy
    return x, y, poses[k, 2] + turn * share


@kernel
def _pieces(poses, k, reach):
    """Number of pieces for which points within reach stay within SAGITTA of their chords."""
    dx, dy = poses[k + 1, 0] - poses[k, 0], poses[k + 1, 1] - poses[k, 1]
    turn = abs(poses[k + 1, 2] - poses[k, 2])
    # A point moves by the chord and with the turn; an arc of a chord bulges by chord turn / 8.
    way = math.sqrt(dx * dx + dy * dy) * (1.0 + turn) + turn * reach
    return 1 + int(math.sqrt(way * turn / (8.0 * SAGITTA)))


@kernel
def _box(lines, x0, y0, t0, x1, y1, t1, low, side, shape, box):
    """Write which rows and columns a piece may cover on its way; return whether there are any."""
    left, bottom, right, top = math.inf, math.inf, -math.inf, -math.inf
    for end in range(2):
        x, y, theta = (x0, y0, t0) if end == 0 else (x1, y1, t1)
        c, s = math.cos(theta), math.sin(theta)
        for i in range(len(lines)):
            px = x + c * lines[i, 3] - s * lines[i, 4]
            py = y + s * lines[i, 3] + c * lines[i, 4]
            left, right = min(left, px), max(right, px)
            bottom, top = min(bottom, py), max(top, py)
    bulge = 2 * SAGITTA
    box[0] = max(0, math.ceil((bottom - bulge - low[1]) / side - 0.5))
    box[1] = min(shape[0] - 1, math.floor((top + bulge - low[1]) / side - 0.5))
    box[2] = max(0, math.ceil((left - bulge - low[0]) / side - 0.5))
    box[3] = min(shape[1] - 1, math.floor((right + bulge - low[0]) / side - 0.5))
    return box[0] <= box[1] and box[2] <= box[3]


@compiled
def _drive(lines, poses, drives, time, reach, low, side, cut_at, covered, crushed, cuts):
    """Let an outline cut what it first covers or, if it does not cut, count what it crushes."""
    box = np.empty(4, dtype=np.int64)
    slack = 0.0 if cuts else SAME
    for k in range(len(poses) - 1):
        if not drives[k]:
            continue
        count = _pieces(poses, k, reach)
        for piece in range(count):
            x0, y0, t0 = _between(poses, k, piece / count)
            x1, y1, t1 = _between(poses, k, (piece + 1) / count)
            if not _box(lines, x0, y0, t0, x1, y1, t1, low, side, cut_at.shape, box):
                continue
            c0, s0, c1, s1 = math.cos(t0), math.sin(t0), math.cos(t1), math.sin(t1)
            since = time[k] + piece / count * (time[k + 1] - time[k])
            lasts = (time[k + 1] - time[k]) / count
            for row in range(box[0], box[1] + 1):
                y = low[1] + side * (row + 0.5)
                for column in range(box[2], box[3] + 1):
                    if cut_at[row, column] <= since + slack or covered[row, column]:
                        continue
                    x = low[0] + side * (column + 0.5)
                    ax, ay, bx, by = x - x0, y - y0, x - x1, y - y1
                    share = _enters(
                        lines,
                        c0 * ax + s0 * ay,
                        c0 * ay - s0 * ax,
                        c1 * bx + s1 * by,
                        c1 * by - s1 * bx,
                    )
                    if share > 1.0:
                        continue
                    moment = since + share * lasts
                    if cuts:
                        cut_at[row, column] = min(cut_at[row, column], moment)
                    elif moment < cut_at[row, column] - SAME:
                        covered[row, column] = True
                        crushed[k] += 1.0
