"""Evader nodes that each place of a pursuer sees, as runs along the rows of the grid.

The visibility polygon of each place is intersected with the rows of the grid. Nodes on its rim, up
to rounding, are tested one by one. Nothing is seen beyond the sight range.

A place at a wall is not seen from behind the wall. Where nodes beside a wall also stand for a place
at the wall (`ground`), they count as seen from behind the wall only if that place is seen.

For the certified bound a node stands for all places within a slack of it, and sight has to be kept
on the way from one place of the pursuer to the next. So nodes too near to the area that a corner K
hides are removed. Let g(x, w) = (K - x) x (w - K), which is positive where K hides w from x. A
node n is kept that has g(p, n) <= -(slack + bulge) |K - p|, and the same at p', for all nodes to
which n leads. In between g is linear in the pursuer's place and |K - x| is convex. So the evader,
within slack + s pace of n after the part s of the step, is in sight if

    bulge >= pace s (1 - s) (|K - p| - |K - p'|) / |K - p(s)|   for all s.

Near K, and where K may hide nothing any more after the step, the distance kept is only the slack,
and each move is tested individually. The same test is made where walls restrict the evader's motion
near its node (`moves_in_sight`).

With a sight range R a node is kept that has |p - n| <= R - (slack + pace / 4), and the same at p',
for all nodes to which n leads. Let the evader be at w after the part s of the step, within slack +
s pace of n, so |p - w| <= R + (s - 1/4) pace. It might stay at w, and be followed on a node within
slack of w, so |p' - w| <= R - pace / 4. The distance to w is convex along the pursuer's way:

    |p(s) - w| <= (1 - s) |p - w| + s |p' - w| <= R + (s (1 - s) - 1/4) pace <= R.
"""

import numpy as np

from ...compiled import compiled, kernel
from ...geometry.edge_index import TOLERANCE, EdgeIndex, point_is_free
from ...geometry.segment_sight import segment_is_clear
from ...geometry.visibility_polygon import _visibility_polygon
from ..corner_game import to_corner_frame
from .ground import WallPlaces
from .planes import COLUMN, COLUMNS, ROW, ROWS, SLOT, TILE

# Most crossings of a row with the rim of what is seen; with more, its nodes are tested one by one.
MOST_CROSSINGS = 126

# Distance between place and corner, in steps, up to which nodes keep only the slack.
NEXT = 2.0

# Nodes nearer than this to the rim are tested one by one [cells].
NEAR = 1e-6


@compiled
def see_runs(
    index: EdgeIndex,
    places: np.ndarray,
    lattice: tuple,
    free: np.ndarray,
    spots: np.ndarray,
    spot_nodes: np.ndarray,
    walls: WallPlaces,
    corners: np.ndarray,
    sight_range: float,
    step: float,
    slack: float,
    pace: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Runs of the nodes in sight from each place.

    Args:
        index: Edges that block sight.
        places: Of the pursuer, shape (n, 2) [m].
        lattice: The evader's grid.
        free: Where evaders can be, shape (rows, columns), bool.
        spots: Points that have to be seen instead of a node near them, shape (m, 2) [m].
        spot_nodes: Row and column of that node, shape (m, 2).
        walls: Places at walls that have to be seen too, from behind the wall.
        corners: From `corner_table`, shape (k, 6): corners near whose shadows nodes are removed;
            none for a bound that is not certified.
        sight_range: How far the pursuer sees, or infinity [m].
        step: Distance that the pursuer moves in a step [m].
        slack, pace: Largest distance of an evader from its node, and its move in a step [m].

    Returns:
        Windows as in `Planes`, without the slots; row, first column and end column (exclusive) of
        each run, shape (m, 3); where the runs of each place end in that list, shape (n,); and the
        number of nodes that each place sees, including removed ones, shape (n,).
    """
    rows, columns = lattice[3], lattice[4]
    seen = np.zeros((rows, columns), dtype=np.uint8)
    crossings = np.zeros((rows, MOST_CROSSINGS + 1))
    windows = np.zeros((len(places), 5), dtype=np.int64)
    view = np.zeros(4, dtype=np.int64)
    runs = np.empty((1024, 3), dtype=np.int16)
    ends, sighted = np.zeros(len(places), dtype=np.int64), np.zeros(len(places), dtype=np.int64)
    count = 0
    for p in range(len(places)):
        px, py = places[p, 0], places[p, 1]
        if not point_is_free(index, px, py):
            ends[p] = count
            continue
        polygon = _visibility_polygon(index, px, py)
        _look_round(polygon, px, py, sight_range, slack, lattice, view)
        _see_nodes(index, px, py, polygon, lattice, crossings, view, seen)
        _see_spots(index, px, py, spots, spot_nodes, view, seen)
        _see_walls(index, px, py, walls, view, seen)
        if sight_range < np.inf:
            _hide_far(px, py, lattice, sight_range, view, seen)
        low_row, high_row, low_column, high_column = view
        for j in range(low_row, high_row + 1):
            for i in range(low_column, high_column + 1):
                if not free[j, i]:
                    seen[j, i] = 0
                sighted[p] += seen[j, i]
        if slack > 0.0 and sight_range < np.inf:
            _hide_far(px, py, lattice, sight_range - slack - 0.25 * pace, view, seen)
        reaches = step, slack, pace
        _keep_off_corners(index, px, py, corners, lattice, reaches, view, seen)
        most = (high_row + 1 - low_row) * ((high_column + 1 - low_column) // 2 + 1)
        if count + most > len(runs):
            more = np.empty((len(runs) + len(runs) // 2 + most, 3), dtype=np.int16)
            more[:count] = runs[:count]
            runs = more
        count = _add_runs(seen, view, windows[p], runs, count)
        ends[p] = count
    return windows, runs[:count].copy(), ends, sighted


@compiled
def lay_out(windows: np.ndarray, runs: np.ndarray, ends: np.ndarray) -> tuple[np.ndarray, int]:
    """Give a slot to each place of each window, and a tile to those with a run; see `Planes`.

    Args:
        windows, runs, ends: From `see_runs`, shapes (n, 5), (m, 3), (n,); the column SLOT of the
            windows is filled in.

    Returns:
        Slots, number of tiles.
    """
    slot_count = 0
    for p in range(len(windows)):
        windows[p, SLOT] = slot_count
        slot_count += windows[p, ROWS] * windows[p, COLUMNS]
    slots = np.full(slot_count, -1, dtype=np.int32)
    tiles, k = 0, 0
    for p in range(len(windows)):
        while k < ends[p]:
            row = runs[k, 0] // TILE - windows[p, ROW]
            start = windows[p, SLOT] + row * windows[p, COLUMNS] - windows[p, COLUMN]
            for c in range(runs[k, 1] // TILE, (runs[k, 2] - 1) // TILE + 1):
                if slots[start + c] < 0:
                    slots[start + c] = tiles
                    tiles += 1
            k += 1
    return slots, tiles


@compiled
def fill_tiles(
    windows: np.ndarray,
    slots: np.ndarray,
    runs: np.ndarray,
    ends: np.ndarray,
    tiles: np.ndarray,
    value: int,
) -> None:
    """Write a value where a place sees a node; see `Planes`.

    Args:
        windows, runs, ends: From `see_runs`, shapes (n, 5), (m, 3), (n,).
        slots: From `lay_out`, shape (s,).
        tiles: Written to, shape (k, TILE * TILE).
        value: From 1 to 255.
    """
    k = 0
    for p in range(len(windows)):
        while k < ends[p]:
            row = runs[k, 0] // TILE - windows[p, ROW]
            start = windows[p, SLOT] + row * windows[p, COLUMNS] - windows[p, COLUMN]
            for i in range(runs[k, 1], runs[k, 2]):
                tiles[slots[start + i // TILE], runs[k, 0] % TILE * TILE + i % TILE] = value
            k += 1


@kernel
def _look_round(polygon, px, py, sight_range, slack, lattice, view):
    """Write to `view` first and last row and column of nodes that may be seen, spots included."""
    x0, y0, h, rows, columns = lattice
    low_x = high_x = px
    low_y = high_y = py
    for k in range(len(polygon)):
        low_x, high_x = min(low_x, polygon[k, 0]), max(high_x, polygon[k, 0])
        low_y, high_y = min(low_y, polygon[k, 1]), max(high_y, polygon[k, 1])
    low_x, high_x = max(low_x, px - sight_range), min(high_x, px + sight_range)
    low_y, high_y = max(low_y, py - sight_range), min(high_y, py + sight_range)
    # A spot is within the slack of its node; a margin covers the polygon drawn for the disc.
    more = 1.01 * slack / h + NEAR
    view[0] = max(0, int(np.ceil((low_y - y0) / h - more)))
    view[1] = min(rows - 1, int(np.floor((high_y - y0) / h + more)))
    view[2] = max(0, int(np.ceil((low_x - x0) / h - more)))
    view[3] = min(columns - 1, int(np.floor((high_x - x0) / h + more)))


@kernel
def _see_spots(index, px, py, spots, spot_nodes, view, seen):
    """Mark nodes with spots as seen if all their spots are seen."""
    low_row, high_row, low_column, high_column = view
    for k in range(len(spots)):
        row, column = spot_nodes[k, 0], spot_nodes[k, 1]
        if low_row <= row <= high_row and low_column <= column <= high_column:
            seen[row, column] = 1
    for k in range(len(spots)):
        row, column = spot_nodes[k, 0], spot_nodes[k, 1]
        if low_row <= row <= high_row and low_column <= column <= high_column and seen[row, column]:
            seen[row, column] = segment_is_clear(index, px, py, spots[k, 0], spots[k, 1])


@kernel
def _see_walls(index, px, py, walls, view, seen):
    """For a pursuer behind a wall, unmark nodes beside that wall whose place at it is hidden."""
    low_row, high_row, low_column, high_column = view
    for k in range(len(walls.nodes)):
        row, column = walls.nodes[k, 0], walls.nodes[k, 1]
        if not (low_row <= row <= high_row and low_column <= column <= high_column):
            continue
        x, y = walls.points[k, 0], walls.points[k, 1]
        aside = walls.along[k, 0] * (py - y) - walls.along[k, 1] * (px - x)
        if seen[row, column] and aside < -index.frame[TOLERANCE]:
            seen[row, column] = segment_is_clear(index, px, py, x, y)


@kernel
def _hide_far(px, py, lattice, most, view, seen):
    """Unmark the nodes farther away than `most`."""
    x0, y0, h, _, _ = lattice
    square = most * abs(most) * (1.0 + 1e-9)
    for j in range(view[0], view[1] + 1):
        dy = y0 + j * h - py
        for i in range(view[2], view[3] + 1):
            dx = x0 + i * h - px
            if dx * dx + dy * dy > square:
                seen[j, i] = 0


@kernel
def _see_nodes(index, px, py, polygon, lattice, crossings, view, seen):
    """Mark the nodes in a visibility polygon; `crossings` is scratch, its last column a count."""
    x0, y0, h, _, _ = lattice
    low_row, high_row, low_column, high_column = view
    n, near = len(polygon), NEAR * h
    crossings[low_row : high_row + 1, MOST_CROSSINGS] = 0
    for k in range(n):
        ax, ay, bx, by, slope = _upwards(polygon, k, (k + 1) % n)
        # A row through a vertex crosses the edge above it.
        first = max(low_row, int(np.floor((ay - y0) / h)))
        last = min(high_row, int(np.ceil((by - y0) / h)))
        for j in range(first, last + 1):
            if ay <= y0 + j * h < by:
                count = int(crossings[j, MOST_CROSSINGS])
                if count < MOST_CROSSINGS:
                    crossings[j, count] = ax + slope * (y0 + j * h - ay)
                crossings[j, MOST_CROSSINGS] += 1
    for j in range(low_row, high_row + 1):
        count, row = int(crossings[j, MOST_CROSSINGS]), crossings[j]
        if count > MOST_CROSSINGS:
            for i in range(low_column, high_column + 1):
                seen[j, i] = segment_is_clear(index, px, py, x0 + i * h, y0 + j * h)
            continue
        seen[j, low_column : high_column + 1] = 0
        _sort(row, count)
        for a in range(0, count - 1, 2):
            first = max(low_column, int(np.ceil((row[a] - x0) / h)))
            last = min(high_column, int(np.floor((row[a + 1] - x0) / h)))
            for i in range(first, last + 1):
                seen[j, i] = 1
    # Nodes near an edge.
    for k in range(n):
        ax, ay, bx, by, slope = _upwards(polygon, k, (k + 1) % n)
        first = max(low_row, int(np.ceil((ay - near - y0) / h)))
        last = min(high_row, int(np.floor((by + near - y0) / h)))
        for j in range(first, last + 1):
            y = y0 + j * h
            a = ax if y - near <= ay else ax + slope * (y - near - ay)
            b = bx if y + near >= by else ax + slope * (y + near - ay)
            left = max(low_column, int(np.ceil((min(a, b) - near - x0) / h)))
            right = min(high_column, int(np.floor((max(a, b) + near - x0) / h)))
            for i in range(left, right + 1):
                seen[j, i] = segment_is_clear(index, px, py, x0 + i * h, y)


@kernel
def _upwards(polygon, a, b):
    """Lower and upper end of an edge, and its slope dx/dy (0 if horizontal)."""
    if polygon[a, 1] > polygon[b, 1]:
        a, b = b, a
    ax, ay, bx, by = polygon[a, 0], polygon[a, 1], polygon[b, 0], polygon[b, 1]
    return ax, ay, bx, by, (bx - ax) / (by - ay) if by > ay else 0.0


@kernel
def _sort(row, count):
    """Sort the first `count` entries of a row by insertion."""
    for a in range(1, count):
        value, b = row[a], a - 1
        while b >= 0 and row[b] > value:
            row[b + 1] = row[b]
            b -= 1
        row[b + 1] = value


@kernel
def _keep_off_corners(index, px, py, corners, lattice, reaches, view, seen):
    """Unmark nodes too near to the area that corners hide, as the certified bound requires."""
    step, slack, pace = reaches
    for c in range(len(corners)):
        distance, to_star, _ = star_distances(index, px, py, corners, c)
        if distance == 0.0:
            continue
        cx, cy = corners[c, 0], corners[c, 1]
        width = slack
        if distance > NEXT * step:
            width += pace * _bulge(step / distance)
        round_corner = width if is_close(distance, to_star, step) else width + pace
        _hide_near_ray(px, py, cx, cy, lattice, width, round_corner, view, seen)


@kernel
def star_distances(
    index: EdgeIndex, px: float, py: float, corners: np.ndarray, c: int
) -> tuple[float, float, bool]:
    """Distances from a place to a corner and its star region, if the corner hides anything.

    Args:
        index: Edges that block sight.
        px, py: The place [m].
        corners: From `corner_table`, shape (k, 6).
        c: Number of the corner.

    Returns:
        Both distances [m], 0 where it hides nothing; whether the corner game is mirrored there.
    """
    cx, cy = corners[c, 0], corners[c, 1]
    r_p, phi_p, _, _, mirrored = to_corner_frame(
        px, py, cx, cy, cx, cy, corners[c, 2], corners[c, 3]
    )
    if r_p <= index.frame[TOLERANCE] or phi_p >= 0.0:
        return 0.0, 0.0, False
    if not segment_is_clear(index, px, py, cx, cy):
        return 0.0, 0.0, False
    return r_p, -r_p * np.sin(phi_p) if phi_p >= -0.5 * np.pi else r_p, mirrored


@kernel
def is_close(distance: float, to_star: float, step: float) -> bool:
    """Whether the corner or its star region is so near that each move is tested individually.

    Args:
        distance, to_star: From `star_distances` [m].
        step: Distance that the pursuer moves in a step [m].
    """
    return to_star <= step or distance <= (NEXT + 1.0) * step


@kernel
def _bulge(k):
    """Largest k s (1 - s) / (1 - k s) over s in [0, 1], k < 1, no unit."""
    s = (1.0 - np.sqrt(1.0 - k)) / k
    return k * s * (1.0 - s) / (1.0 - k * s)


@kernel
def _hide_near_ray(px, py, cx, cy, lattice, width, round_corner, view, seen):
    """Unmark nodes within `width` of the ray from p beyond c, or within `round_corner` of c."""
    x0, y0, h, rows, columns = lattice
    length = np.hypot(cx - px, cy - py)
    ux, uy = (cx - px) / length, (cy - py) / length
    far = h * (rows + columns)
    most = max(width, round_corner)
    first = max(view[0], int(np.floor((min(cy, cy + far * uy) - most - y0) / h)))
    last = min(view[1], int(np.ceil((max(cy, cy + far * uy) + most - y0) / h)))
    for j in range(first, last + 1):
        begin, end = row_by_ray(cx, cy, ux, uy, lattice, most, j)
        for i in range(max(begin, view[2]), min(end, view[3] + 1)):
            if _is_near_ray(x0 + i * h - cx, y0 + j * h - cy, ux, uy, width, round_corner):
                seen[j, i] = 0


@kernel
def row_by_ray(
    cx: float, cy: float, ux: float, uy: float, lattice: tuple, width: float, j: int
) -> tuple[int, int]:
    """The part of a row in which nodes may be within `width` of a ray.

    Args:
        cx, cy: Where the ray begins [m].
        ux, uy: Its direction, no unit.
        lattice: The nodes.
        width: Of the strip on either side [m].
        j: The row.

    Returns:
        First column and end column (exclusive).
    """
    x0, y0, h, rows, columns = lattice
    y, far = y0 + j * h, h * (rows + columns)
    low, high = 0.0, far
    if abs(uy) > 1e-12:
        # The part of the ray within the width of this row's height.
        a, b = (y - width - cy) / uy, (y + width - cy) / uy
        low, high = max(min(a, b), 0.0), min(max(a, b), far)
    elif abs(y - cy) > width:
        high = -1.0
    if low > high:
        return 0, 0
    left = min(cx + low * ux, cx + high * ux) - width
    right = max(cx + low * ux, cx + high * ux) + width
    end = min(columns, int(np.ceil((right - x0) / h)) + 1)
    return min(max(0, int(np.floor((left - x0) / h))), max(end, 0)), max(end, 0)


@kernel
def _is_near_ray(dx, dy, ux, uy, width, round_corner):
    """Whether a point, from a corner, is near the ray u beyond the corner, or near the corner."""
    along, square = dx * ux + dy * uy, dx * dx + dy * dy
    beyond = along > 0.0 and square - along * along < width * width
    return beyond or square < round_corner * round_corner


@kernel
def _add_runs(seen, view, window, runs, count):
    """Append the runs of a raster and fill in its window; return how many runs there are now."""
    rows, columns = seen.shape
    low_row, high_row, low_column, high_column = rows, -1, columns, -1
    for j in range(view[0], view[1] + 1):
        i = view[2]
        while i <= view[3]:
            if seen[j, i] == 0:
                i += 1
                continue
            begin = i
            while i <= view[3] and seen[j, i] != 0:
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
