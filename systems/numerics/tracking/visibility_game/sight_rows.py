"""What each place of a pursuer sees of the evader's grid, as runs along rows.

The visibility polygon of each place is cut with the rows of the grid. Nodes that lie on its rim, up
to rounding, are asked one by one.

For the certified bound a node stands for all places within a slack of it, and sight has to hold on
the way from one place of the pursuer to the next. So nodes are taken away that come too near to
what a corner K hides. Let g(x, w) = (K - x) x (w - K), which is positive where K hides w from x. A
node n is kept that has g(p, n) <= -(slack + bulge) |K - p|, and the same at p', for all nodes to
which n leads. In between g is linear in the pursuer's place and |K - x| is convex. So the evader,
within slack + s pace of n after the part s of the step, is in sight if

    bulge >= pace s (1 - s) (|K - p| - |K - p'|) / |K - p(s)|   for all s.

Near K, and where K may hide nothing any more after the step, the whole step's pace is kept off.
"""

import numpy as np

from ...compiled import compiled, kernel
from ...geometry.edge_index import TOLERANCE, EdgeIndex, point_is_free
from ...geometry.segment_sight import segment_is_clear
from ...geometry.visibility_polygon import _visibility_polygon
from ..corner_frame import to_corner_frame
from .sweeps import COLUMN, COLUMNS, ROW, ROWS, SLOT, TILE

# So often at most a row crosses the rim of what is seen; else its nodes are asked one by one.
MOST_CROSSINGS = 64

# As near to a rim as this a node is asked by itself [cells].
NEAR = 1e-6


@compiled
def see_runs(
    index: EdgeIndex,
    places: np.ndarray,
    lattice: tuple,
    free: np.ndarray,
    spots: np.ndarray,
    spot_nodes: np.ndarray,
    corners: np.ndarray,
    step: float,
    slack: float,
    pace: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Runs of the nodes in sight from each place.

    Args:
        index: Edges that block sight.
        places: Of the pursuer, shape (n, 2) [m].
        lattice: The evader's.
        free: Where evaders can be, shape (rows, columns), bool.
        spots: Points that have to be seen instead of a node near them, shape (m, 2) [m].
        spot_nodes: Row and column of that node, shape (m, 2).
        corners: From `corner_table`, shape (k, 6), those that nodes keep off; none for a bound
            that is not certified.
        step: How far the pursuer goes in a step [m].
        slack, pace: How far an evader may be from its node, and goes in a step [m].

    Returns:
        Windows as in `Planes`, but for the slots; row, first column and first one no more of each
        run, shape (m, 3); where the runs of each place end in it, shape (n,); and how many nodes
        each place sees, those taken away included, shape (n,).
    """
    rows, columns = lattice[3], lattice[4]
    seen = np.zeros((rows, columns), dtype=np.uint8)
    crossings = np.zeros((rows, MOST_CROSSINGS + 1))
    windows = np.zeros((len(places), 5), dtype=np.int64)
    runs = np.empty((1024, 3), dtype=np.int32)
    ends, sighted = np.zeros(len(places), dtype=np.int64), np.zeros(len(places), dtype=np.int64)
    count = 0
    for p in range(len(places)):
        px, py = places[p, 0], places[p, 1]
        if not point_is_free(index, px, py):
            ends[p] = count
            continue
        polygon = _visibility_polygon(index, px, py)
        _see_nodes(index, px, py, polygon, lattice, crossings, seen)
        for k in range(len(spots)):
            seen[spot_nodes[k, 0], spot_nodes[k, 1]] = 1
        for k in range(len(spots)):
            row, column = spot_nodes[k, 0], spot_nodes[k, 1]
            if seen[row, column]:
                seen[row, column] = segment_is_clear(index, px, py, spots[k, 0], spots[k, 1])
        for j in range(rows):
            for i in range(columns):
                if not free[j, i]:
                    seen[j, i] = 0
                sighted[p] += seen[j, i]
        _keep_off_corners(index, px, py, corners, lattice, step, slack, pace, seen)
        if count + seen.size // 2 + rows > len(runs):
            more = np.empty((2 * len(runs) + seen.size, 3), dtype=np.int32)
            more[:count] = runs[:count]
            runs = more
        count = _add_runs(seen, windows[p], runs, count)
        ends[p] = count
    return windows, runs[:count].copy(), ends, sighted


@compiled
def lay_out(
    windows: np.ndarray, runs: np.ndarray, ends: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Give a slot to each place of each window, and a tile to those with a run; see `Planes`.

    Args:
        windows, runs, ends: From `see_runs`, shapes (n, 5), (m, 3), (n,); where slots begin is
            filled in.

    Returns:
        Slots, starts of rows, starts of runs, number of tiles.
    """
    slot_count, row_count = 0, 0
    row_starts = np.zeros(len(windows), dtype=np.int64)
    for p in range(len(windows)):
        windows[p, SLOT], row_starts[p] = slot_count, row_count
        slot_count += windows[p, ROWS] * windows[p, COLUMNS]
        row_count += windows[p, ROWS] * TILE
    slots = np.full(slot_count, -1, dtype=np.int32)
    run_starts = np.zeros(row_count + 1, dtype=np.int64)
    tiles, k = 0, 0
    for p in range(len(windows)):
        for j in range(windows[p, ROWS] * TILE):
            run_starts[row_starts[p] + j] = k
            while k < ends[p] and runs[k, 0] == windows[p, ROW] * TILE + j:
                for c in range(runs[k, 1] // TILE, (runs[k, 2] - 1) // TILE + 1):
                    at = j // TILE * windows[p, COLUMNS] + c - windows[p, COLUMN]
                    if slots[windows[p, SLOT] + at] < 0:
                        slots[windows[p, SLOT] + at] = tiles
                        tiles += 1
                k += 1
    run_starts[row_count] = k
    return slots, row_starts, run_starts, tiles


@kernel
def _see_nodes(index, px, py, polygon, lattice, crossings, seen):
    """Mark the nodes in a visibility polygon; the last column of `crossings` counts."""
    x0, y0, h, rows, columns = lattice
    n = len(polygon)
    crossings[:, MOST_CROSSINGS] = 0
    for k in range(n):
        ax, ay = polygon[k, 0], polygon[k, 1]
        bx, by = polygon[(k + 1) % n, 0], polygon[(k + 1) % n, 1]
        j = int(np.round((ay - y0) / h))
        if 0 <= j < rows and abs(y0 + j * h - ay) <= NEAR * h:
            # A row through a vertex is in doubt as a whole.
            crossings[j, MOST_CROSSINGS] = 2 * MOST_CROSSINGS
        if ay > by:
            ax, ay, bx, by = bx, by, ax, ay
        first = max(0, int(np.ceil((ay - y0) / h)))
        last = min(rows - 1, int(np.floor((by - y0) / h)))
        slope = (bx - ax) / (by - ay) if by > ay else 0.0
        for j in range(first, last + 1):
            count = int(crossings[j, MOST_CROSSINGS])
            if count < MOST_CROSSINGS:
                crossings[j, count] = ax + slope * (y0 + j * h - ay)
            crossings[j, MOST_CROSSINGS] += 1
    for j in range(rows):
        count = int(crossings[j, MOST_CROSSINGS])
        y, row = y0 + j * h, crossings[j]
        if count > MOST_CROSSINGS:
            for i in range(columns):
                seen[j, i] = segment_is_clear(index, px, py, x0 + i * h, y)
            continue
        seen[j] = 0
        _sort(row, count)
        for a in range(0, count - 1, 2):
            first = max(0, int(np.ceil((row[a] - x0) / h)))
            last = min(columns - 1, int(np.floor((row[a + 1] - x0) / h)))
            for i in range(first, last + 1):
                seen[j, i] = 1
        for a in range(count):
            i = int(np.round((row[a] - x0) / h))
            if 0 <= i < columns and abs(x0 + i * h - row[a]) <= NEAR * h:
                seen[j, i] = segment_is_clear(index, px, py, x0 + i * h, y)


@kernel
def _sort(row, count):
    """Sort the first few of a row by insertion."""
    for a in range(1, count):
        value, b = row[a], a - 1
        while b >= 0 and row[b] > value:
            row[b + 1] = row[b]
            b -= 1
        row[b + 1] = value


@kernel
def _keep_off_corners(index, px, py, corners, lattice, step, slack, pace, seen):
    """Take away the nodes that come too near to what corners hide, as the certified bound asks."""
    for c in range(len(corners)):
        width = _kept_off(index, px, py, corners, c, step, slack, pace)
        if width > 0.0:
            cx, cy = corners[c, 0], corners[c, 1]
            _hide_near_ray(px, py, cx, cy, lattice, width, slack + pace, seen)


@compiled
def keeps_off_corners(
    index: EdgeIndex,
    px: float,
    py: float,
    ex: float,
    ey: float,
    corners: np.ndarray,
    step: float,
    pace: float,
) -> bool:
    """Whether an evader keeps off what corners hide as nodes do, from where it really is.

    Args:
        index: Edges that block sight.
        px, py, ex, ey: The pursuer's place and the evader's [m].
        corners: From `corner_table`, shape (k, 6).
        step, pace: See `see_runs` [m].
    """
    for c in range(len(corners)):
        width = _kept_off(index, px, py, corners, c, step, 0.0, pace)
        if width > 0.0:
            cx, cy = corners[c, 0], corners[c, 1]
            length = np.hypot(cx - px, cy - py)
            ux, uy = (cx - px) / length, (cy - py) / length
            if _is_near_ray(ex - cx, ey - cy, ux, uy, width, pace):
                return False
    return True


@kernel
def _kept_off(index, px, py, corners, c, step, slack, pace):
    """How far nodes keep off what corner c hides from p [m]; 0 where it hides nothing."""
    cx, cy = corners[c, 0], corners[c, 1]
    r_p, phi_p, _, _, _ = to_corner_frame(px, py, cx, cy, cx, cy, corners[c, 2], corners[c, 3])
    if r_p <= index.frame[TOLERANCE] or phi_p >= 0.0:
        return 0.0
    if not segment_is_clear(index, px, py, cx, cy):
        return 0.0
    to_star = -r_p * np.sin(phi_p) if phi_p >= -0.5 * np.pi else r_p
    return slack + pace if to_star <= step else slack + pace * _bulge(step / r_p)


@kernel
def _bulge(k):
    """Largest k s (1 - s) / (1 - k s) over s in [0, 1], k < 1, no unit."""
    s = (1.0 - np.sqrt(1.0 - k)) / k
    return k * s * (1.0 - s) / (1.0 - k * s)


@kernel
def _hide_near_ray(px, py, cx, cy, lattice, width, round_corner, seen):
    """Take away nodes nearer than `width` to the ray from p through c, beyond c, or round c."""
    x0, y0, h, rows, columns = lattice
    length = np.hypot(cx - px, cy - py)
    ux, uy = (cx - px) / length, (cy - py) / length
    far = h * (rows + columns)
    most = max(width, round_corner)
    ends = (min(cy, cy + far * uy), max(cy, cy + far * uy))
    first = max(0, int(np.floor((ends[0] - most - y0) / h)))
    last = min(rows - 1, int(np.ceil((ends[1] + most - y0) / h)))
    for j in range(first, last + 1):
        y = y0 + j * h
        low, high = 0.0, far
        if abs(uy) > 1e-12:
            # The part of the ray within `most` of this row's height.
            a, b = (y - most - cy) / uy, (y + most - cy) / uy
            low, high = min(max(min(a, b), 0.0), far), min(max(max(a, b), 0.0), far)
        left = min(cx + low * ux, cx + high * ux) - most
        right = max(cx + low * ux, cx + high * ux) + most
        begin = max(0, int(np.floor((left - x0) / h)))
        for i in range(begin, min(columns, int(np.ceil((right - x0) / h)) + 1)):
            if _is_near_ray(x0 + i * h - cx, y - cy, ux, uy, width, round_corner):
                seen[j, i] = 0


@kernel
def _is_near_ray(dx, dy, ux, uy, width, round_corner):
    """Whether a point, from a corner, is near the ray u beyond the corner, or near the corner."""
    along, square = dx * ux + dy * uy, dx * dx + dy * dy
    beyond = along > 0.0 and square - along * along < width * width
    return beyond or square < round_corner * round_corner


@kernel
def _add_runs(seen, window, runs, count):
    """Append the runs of a raster and fill in its window; return how many runs there are now."""
    rows, columns = seen.shape
    low_row, high_row, low_column, high_column = rows, -1, columns, -1
    for j in range(rows):
        i = 0
        while i < columns:
            if seen[j, i] == 0:
                i += 1
                continue
            begin = i
            while i < columns and seen[j, i] != 0:
                i += 1
            runs[count, 0], runs[count, 1], runs[count, 2] = j, begin, i
            count += 1
            low_row, high_row = min(low_row, j), max(high_row, j)
            low_column, high_column = min(low_column, begin), max(high_column, i - 1)
    if high_row >= 0:
        window[ROW], window[COLUMN] = low_row // TILE, low_column // TILE
        window[ROWS] = high_row // TILE + 1 - window[ROW]
        window[COLUMNS] = high_column // TILE + 1 - window[COLUMN]
    return count
