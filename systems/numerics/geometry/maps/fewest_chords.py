"""The fewest chords that replace a ring within a tolerance, sweeping over nothing.

A chord from one vertex of the ring to a later one may replace the chain between them if

1. no vertex of the chain is farther from it than the tolerance, and
2. the area between chain and chord holds no mark: no vertex of another chain, no guard.

Both hold of a chord whatever the other chords are, so the fewest of them, and among those the
ones that sweep the least area, are a shortest path around the ring (Imai and Iri 1988, "Polygonal
approximations of a curve"). And chords that obey 2. never cross. One that crossed another would
enter the area between it and its chain; it cannot leave through the chain, because then its own
sweep would hold a vertex of that chain, nor through the chord, which two straight lines cross
only once.

The tolerance test is by wedges (Chan and Chin 1996): the directions from a vertex that pass
within the tolerance of every vertex seen so far. The sweep is followed by adding up, for every
mark, how often the triangles between successive chords wind around it.
"""

import numpy as np
from numba import njit

# Vertices that one chord may replace: bounds the work where a tolerance is very coarse.
REACH = 250

# What rounding may do to a direction [rad] or to the end of an interval.
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
                    # Well inside the wedge, with nothing beyond its end, a chord needs no look.
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
    """How a ray east from (x, y) crosses an edge: 1 upwards, -1 downwards, 0 not at all."""
    side = (bx - ax) * (y - ay) - (by - ay) * (x - ax)
    if ay <= y:
        return 1 if by > y and side > 0 else 0
    return -1 if by <= y and side < 0 else 0


@njit(cache=True)
def _extent(ax, ay, bx, by, bottom, top, left, right):
    """Widen an interval of x by the part of a segment between two heights."""
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
    """Wind the triangle between two successive chords around the marks in it.

    Returns:
        change: By how many more marks, not of the chain itself, the sweep winds around.
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
