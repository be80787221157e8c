"""The outline of a set of cells: exact, along cell sides, then simplified within a tolerance.

All rings are simplified together, and keep their topology. A chord from one vertex of a ring to a
later one may replace the chain between them if

1. no vertex of the chain is farther from it than the tolerance, and
2. the area between chain and chord holds no mark: no vertex of another chain, no guard.

Both conditions on a chord are independent of the other chords. So the ring with the fewest chords,
and among those with the least swept area, is a shortest path around the ring (Imai and Iri 1988,
"Polygonal approximations of a curve"). Chords that obey 2. never cross: a chord that crossed
another would enter the area between that chord and its chain. It cannot leave through the chain,
because its own sweep would then hold a vertex of that chain, nor through the chord, because two
straight lines cross only once.

The tolerance test uses wedges (Chan and Chin 1996): the directions from a vertex that pass
within the tolerance of every vertex seen so far. To test 2., the winding numbers of the triangles
between successive chords are added up for every mark.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit


@dataclass(frozen=True, eq=False)
class CellOutline:
    """Rings of lattice corners with the region on the left: its rim, then its holes.

    Where two cells of the region share only a corner, two rings, or two turns of one ring, meet.
    Such a corner is `pinched`. Every ring turns left there, so that the cells that are not in the
    region stay connected across it.

    Attributes:
        corners: [column, row] in cell units, ring after ring, shape (n, 2).
        pinched: Shape (n,).
        starts: Where each ring starts in `corners`, and their end, shape (rings + 1,).
    """

    corners: np.ndarray
    pinched: np.ndarray
    starts: np.ndarray

    @property
    def rings(self) -> list[np.ndarray]:
        """Corners of each ring, shape (m, 2)."""
        return np.split(self.corners, self.starts[1:-1])


def trace_cells(inside: np.ndarray) -> CellOutline:
    """Follow the sides between cells of a region and others.

    Args:
        inside: True for the cells of the region, shape (rows, columns); False in the outermost
            rows and columns.
    """
    around = [inside[:-1, :-1], inside[:-1, 1:], inside[1:, :-1], inside[1:, 1:]]
    odd = np.logical_xor.reduce(around)
    diagonal = (around[0] == around[3]) & (around[1] == around[2]) & (around[0] != around[1])
    count = int(odd.sum() + 2 * diagonal.sum())
    corners = np.empty((count, 2), dtype=np.int64)
    pinched = np.empty(count, dtype=np.bool_)
    starts = np.zeros(count // 4 + 1, dtype=np.int64)
    rings = _trace(np.ascontiguousarray(inside), corners, pinched, starts)
    return CellOutline(corners.astype(float), pinched, starts[: rings + 1].copy())


def without_pinches(outline: CellOutline, leg: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut the region's tip off at every pinched corner, and add candidate vertices.

    The cut joins the points `leg` before and after the corner, so that the cells outside the
    region that meet there diagonally are joined by a bridge 2^0.5 `leg` wide. The points half a
    cell from either end of a side are added, because an oblique wall runs through them and not
    through the corners of its staircase.

    Args:
        outline: As traced.
        leg: In (0, 0.5] [cells].

    Returns:
        points: Corners and added points in order along the rings, shape (n, 2) [cells].
        on_ring: False for the pinched corners, which are now beside the ring, shape (n,).
        starts: Where each ring starts in `points`, and their end, shape (rings + 1,).
    """
    following = np.concatenate([np.roll(np.arange(a, b), -1) for a, b in _spans(outline.starts)])
    here, there = outline.corners, outline.corners[following]
    length = np.abs(there - here).sum(axis=1)
    along = (there - here) / length[:, None]
    leaves, meets = outline.pinched, outline.pinched[following]
    # Up to five points along each side; where two coincide, only the first is kept.
    half = np.full(len(here), 0.5)
    steps = np.stack([0 * half, leg + 0 * half, half, length - half, length - leg], axis=1)
    used = np.stack(
        [
            np.ones(len(here), dtype=bool),
            leaves & (leg < 0.5),
            np.ones(len(here), dtype=bool),
            length > 1,
            meets & (leg < 0.5),
        ],
        axis=1,
    )
    points = here[:, None] + steps[:, :, None] * along[:, None]
    on_ring = np.ones(used.shape, dtype=bool)
    on_ring[:, 0] = ~leaves
    ends = np.concatenate([[0], np.cumsum(used.sum(axis=1))])
    return points[used], on_ring[used], ends[outline.starts]


def _spans(starts: np.ndarray) -> list[tuple[int, int]]:
    return list(zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True))


@njit(cache=True)
def _trace(inside, corners, pinched, starts):
    """Write the rings, each from its first side that runs east; return their number."""
    rows, columns = inside.shape
    seen = np.zeros((rows, columns), dtype=np.bool_)
    count, rings = 0, 0
    for first_row in range(1, rows):
        for first_column in range(columns):
            if (
                seen[first_row, first_column]
                or not inside[first_row, first_column]
                or inside[first_row - 1, first_column]
            ):
                continue
            row, column, heading = first_row, first_column, 0
            while True:
                # One step along a side, then the two cells ahead: on the left, on the right.
                if heading == 0:
                    seen[row, column] = True
                    column += 1
                    left, right = inside[row, column], inside[row - 1, column]
                elif heading == 1:
                    row += 1
                    left, right = inside[row, column - 1], inside[row, column]
                elif heading == 2:
                    column -= 1
                    left, right = inside[row - 1, column - 1], inside[row, column - 1]
                else:
                    row -= 1
                    left, right = inside[row - 1, column], inside[row - 1, column - 1]
                if not left or right:
                    corners[count, 0] = column
                    corners[count, 1] = row
                    pinched[count] = right and not left
                    count += 1
                    heading = (heading + (3 if left else 1)) % 4
                if row == first_row and column == first_column and heading == 0:
                    break
            rings += 1
            starts[rings] = count
    return rings


# Most vertices that one chord may replace. It bounds the work where a tolerance is very coarse.
REACH = 250

# Allowance for rounding in a direction [rad] or at the end of an interval.
ROUNDING = 1e-9


@njit(cache=True)
def fewest_chords(points, on_ring, first, last, start, marks, tolerance):
    """Choose the vertices of one ring to keep.

    Coordinates are multiples of 1/4, except near pinched corners, so that orientations are exact.

    Args:
        points: Points of all rings, shape (n, 2).
        on_ring: False for points that must stay within the tolerance without being on the ring.
        first, last: The ring is points[first:last].
        start: A vertex to keep, counted from `first`.
        marks: `MarkGrid`: on-ring points (numbered as in `points`) and guards.
        tolerance: Inclusive.

    Returns:
        keep: Shape (last - first,).
        swept: Sum of the areas between chords and chains.
    """
    size = last - first
    chords = np.full(size + 1, size + 1)
    swept = np.full(size + 1, np.inf)
    previous = np.full(size + 1, -1)
    chords[0], swept[0] = 0, 0.0
    for a in range(size):
        tail = first + (a + start) % size
        if not on_ring[tail]:
            continue
        ax, ay = points[tail]
        marks.serial[0] += 1
        enclosed, area, farthest = 0, 0.0, 0.0
        middle, low, high = 0.0, -np.inf, np.inf
        corner = tail
        for b in range(a + 1, min(size, a + REACH) + 1):
            head = first + (b + start) % size
            dx, dy = points[head, 0] - ax, points[head, 1] - ay
            distance = np.hypot(dx, dy)
            direction = np.arctan2(dy, dx) - middle
            if direction > np.pi:
                direction -= 2.0 * np.pi
            elif direction < -np.pi:
                direction += 2.0 * np.pi
            if on_ring[head]:
                area += _turn(points, tail, corner, head)
                if marks.stamp[head] == marks.serial[0] and marks.winding[head] != 0:
                    enclosed -= 1
                change, touched = _sweep(
                    points, tail, corner, head, first, size, start, a, b, marks
                )
                enclosed += change
                corner = head
                better = chords[a] + 1 < chords[b] or (
                    chords[a] + 1 == chords[b] and swept[a] + abs(area) < swept[b]
                )
                if (
                    better
                    and enclosed == 0
                    and not touched
                    and low - ROUNDING <= direction <= high + ROUNDING
                ):
                    # A chord well inside the wedge, with no vertex beyond its end, needs no check.
                    safe = farthest <= distance and low + ROUNDING < direction < high - ROUNDING
                    if safe or _within(points, first, size, start, a, b, tolerance):
                        chords[b] = chords[a] + 1
                        swept[b] = swept[a] + abs(area)
                        previous[b] = a
            # From here on, `head` is a vertex to pass by.
            farthest = max(farthest, distance)
            if distance > tolerance:
                spread = np.arcsin(tolerance / distance)
                if low == -np.inf:
                    middle, low, high = np.arctan2(dy, dx), -spread, spread
                else:
                    low, high = max(low, direction - spread), min(high, direction + spread)
                if low > high + ROUNDING:
                    break
    keep = np.zeros(size, dtype=np.bool_)
    b = size
    while b > 0:
        b = previous[b]
        keep[(b + start) % size] = True
    return keep, swept[size]


@njit(cache=True)
def _turn(points, a, b, c):
    """Twice the signed area of a triangle of points, positive if counter-clockwise."""
    return (points[b, 0] - points[a, 0]) * (points[c, 1] - points[a, 1]) - (
        points[b, 1] - points[a, 1]
    ) * (points[c, 0] - points[a, 0])


@njit(cache=True)
def _crossing(ax, ay, bx, by, x, y):
    """Whether an edge crosses the ray east from (x, y) upwards (1), downwards (-1) or not (0)."""
    side = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
    if ay <= y:
        return 1 if by > y and side > 0 else 0
    return -1 if by <= y and side < 0 else 0


@njit(cache=True)
def _extent(ax, ay, bx, by, bottom, top, left, right):
    """Widen the x interval [left, right] to cover a segment's part between two heights."""
    if ay > by:
        ax, ay, bx, by = bx, by, ax, ay
    if by < bottom or ay > top:
        return left, right
    low = ax if ay >= bottom else ax + (bx - ax) * (bottom - ay) / (by - ay)
    high = bx if by <= top else ax + (bx - ax) * (top - ay) / (by - ay)
    return min(left, low, high), max(right, low, high)


@njit(cache=True)
def _within(points, first, size, start, a, b, tolerance):
    """Whether every point between two of a ring lies within the tolerance of their chord."""
    tail, head = first + (a + start) % size, first + (b + start) % size
    ax, ay = points[tail]
    dx, dy = points[head, 0] - ax, points[head, 1] - ay
    square = dx * dx + dy * dy
    if square == 0.0:
        return False
    limit = tolerance * tolerance * (1.0 + 1e-12)
    for c in range(a + 1, b):
        i = first + (c + start) % size
        x, y = points[i, 0] - ax, points[i, 1] - ay
        t = min(1.0, max(0.0, (x * dx + y * dy) / square))
        if (x - t * dx) ** 2 + (y - t * dy) ** 2 > limit:
            return False
    return True


@njit(cache=True)
def _sweep(points, tail, corner, head, first, size, start, a, b, marks):
    """Add the triangle between two successive chords to the winding numbers of the marks in it.

    Returns:
        change: Change in the number of enclosed marks, those of the chain itself not counted.
        touched: Whether a mark lies on the new chord.
    """
    ax, ay = points[tail]
    cx, cy = points[corner]
    bx, by = points[head]
    x_low, x_high = min(ax, bx, cx), max(ax, bx, cx)
    y_low, y_high = min(ay, by, cy), max(ay, by, cy)
    change, touched = 0, False
    for row in range(int((y_low - marks.y) / marks.cell), int((y_high - marks.y) / marks.cell) + 1):
        # Only the buckets that a slanted sliver passes in this row.
        bottom = marks.y + row * marks.cell
        left, right = _extent(ax, ay, bx, by, bottom, bottom + marks.cell, np.inf, -np.inf)
        left, right = _extent(bx, by, cx, cy, bottom, bottom + marks.cell, left, right)
        left, right = _extent(cx, cy, ax, ay, bottom, bottom + marks.cell, left, right)
        for column in range(
            int((max(left - ROUNDING, x_low) - marks.x) / marks.cell),
            int((min(right + ROUNDING, x_high) - marks.x) / marks.cell) + 1,
        ):
            k = row * marks.columns + column
            for j in range(marks.starts[k], marks.starts[k + 1]):
                mark = marks.items[j]
                x, y = marks.points[mark]
                if x < x_low or x > x_high or y < y_low or y > y_high:
                    continue
                own = False
                if first <= mark < first + size:
                    place = (mark - first - start) % size
                    own = a <= place <= b or (place == 0 and b == size)
                side = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
                on_box = min(ax, bx) <= x <= max(ax, bx) and min(ay, by) <= y <= max(ay, by)
                if not own and side == 0.0 and on_box:
                    touched = True
                turns = (
                    _crossing(ax, ay, cx, cy, x, y)
                    + _crossing(cx, cy, bx, by, x, y)
                    + _crossing(bx, by, ax, ay, x, y)
                )
                if turns == 0:
                    continue
                before = marks.winding[mark] if marks.stamp[mark] == marks.serial[0] else 0
                marks.stamp[mark] = marks.serial[0]
                marks.winding[mark] = before + turns
                if not own:
                    change += int(before + turns != 0) - int(before != 0)
    return change, touched


# Side of a bucket of marks; 4 to 16 are equally fast [cells].
BUCKET = 4.0

# Rings of at most this many points are searched from every vertex of a first solution.
SMALL_RING = 100


class MarkGrid(NamedTuple):
    """Points that no chord may sweep over, in buckets of a square grid.

    Attributes:
        points: Shape (m, 2) [cells].
        x, y, cell: Corner of the grid, side of a bucket [cells].
        columns: Buckets in a row.
        starts: Where each bucket starts in `items`, row by row, and their end,
            shape (buckets + 1,).
        items: Numbers of points, shape (m,).
        winding, stamp: Scratch of the search: winding number of the area swept from the current
            tail around each point, valid where the stamp equals `serial`; shape (m,).
        serial: Current serial number, shape (1,).
    """

    points: np.ndarray
    x: float
    y: float
    cell: float
    columns: int
    starts: np.ndarray
    items: np.ndarray
    winding: np.ndarray
    stamp: np.ndarray
    serial: np.ndarray


def simplify_outline(
    outline: CellOutline, guards: np.ndarray, tolerance: float
) -> list[np.ndarray]:
    """Replace each ring by the ring with the fewest vertices within a tolerance.

    The new rings cross neither themselves nor each other, enclose each other as before and keep
    every guard on its side. They do not touch either: where old rings met in a pinched corner, a
    bridge now joins the cells outside the region. Every point of a new ring is within the
    tolerance of the old one, and vice versa.

    Args:
        outline: The rings.
        guards: Points that no chord may sweep over, shape (n, 2) [cells].
        tolerance: Positive [cells].

    Returns:
        One array of vertices for each ring, shape (k, 2) [cells].
    """
    # A cut of the largest leg is off by 0.35 cells; a finer tolerance allows only a smaller one.
    points, on_ring, starts = without_pinches(outline, min(0.5, tolerance))
    marks = _mark_grid(np.concatenate([points, guards]), len(points), on_ring)
    spans = zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True)
    return [_shortest_ring(points, on_ring, span, marks, tolerance) for span in spans]


def _shortest_ring(
    points: np.ndarray,
    on_ring: np.ndarray,
    span: tuple[int, int],
    marks: MarkGrid,
    tolerance: float,
) -> np.ndarray:
    """The ring with the fewest vertices, and among those the one that sweeps the least area.

    The search needs a start vertex, and the best ring through it may have one vertex more than
    the best of all. So the result from the first corner only serves to choose better starts: all
    its vertices for a small ring, the vertex half a turn away for a large one.
    """
    first, last = span

    def search(start: int) -> tuple[np.ndarray, float]:
        keep, swept = fewest_chords(points, on_ring, first, last, start, marks, tolerance)
        return keep, float(swept)

    start = int(np.argmax(on_ring[first:last]))
    keep, _ = search(start)
    starts = np.flatnonzero(keep)
    if last - first > SMALL_RING:
        onwards = np.flatnonzero(np.roll(keep, -start))
        starts = (onwards[[len(onwards) // 2]] + start) % (last - first)
    rings = [search(int(place)) for place in starts]
    keep, _ = min(rings, key=lambda ring: (ring[0].sum(), ring[1]))
    return points[first:last][keep]


def _mark_grid(points: np.ndarray, ring_points: int, on_ring: np.ndarray) -> MarkGrid:
    """Put the guards, and the ring points that are on their ring, into buckets."""
    low = points.min(axis=0)
    place = np.floor((points - low) / BUCKET).astype(np.int64)
    columns, rows = (place.max(axis=0) + 1).tolist()
    bucket = place[:, 1] * columns + place[:, 0]
    items = np.argsort(bucket, kind="stable")
    items = items[(items >= ring_points) | on_ring[np.minimum(items, ring_points - 1)]]
    counts = np.bincount(bucket[items], minlength=columns * rows)
    starts = np.concatenate([[0], np.cumsum(counts)])
    winding, stamp = np.zeros((2, len(points)), dtype=np.int64)
    serial = np.zeros(1, dtype=np.int64)
    corner = (float(low[0]), float(low[1]))
    return MarkGrid(points, *corner, BUCKET, columns, starts, items, winding, stamp, serial)
