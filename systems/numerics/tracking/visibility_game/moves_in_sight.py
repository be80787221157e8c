"""Which moves of a pursuer keep sight on the way, for evaders that are followed on nodes.

Let a corner K be in sight of the pursuer. From x, outside its star region, K hides what lies beyond
the ray R(x) that leaves K away from x, on one side of it. Sight is lost behind K when the evader
crosses R. While the pursuer goes from p straight to p', R turns one way.

- If the hidden area *grows*, all that is hidden on the way is hidden from p' as well. The evader
  might stay where it is, so the moves of its node n lead to some node near it. That node is kept
  off R(p') by the slack, so the evader is in sight.
- If it *shrinks*, the evader is within slack + s pace of its node n after the part s of the step.
  So it cannot cross R if, for all s until p(s) is in the star region,

      distance from n to R(p(s)) > slack + s pace.

The left side times |K - p(s)| is linear in s, unless the nearest point of R is K itself. |K - p(s)|
is convex, so its chords lie above it. Between chosen values of s the condition is therefore one on
a quadratic.

If the pursuer turns before it drives, and an evader goes `hold` meanwhile, the evader is within
slack + hold + s (pace - hold) of its node at p(s): callers pass slack + hold and pace - hold.

Far from K and its star region the distance kept in `sight_rows` already ensures this, provided that
the evader could be anywhere in the disc round n that it can reach. The other nodes near R are
tested here move by move.
"""

import numpy as np

from ...compiled import compiled, kernel
from ...geometry.edge_index import EdgeIndex
from .planes import ALL
from .sight_rows import is_close, row_by_ray, star_distances

# Number of parts of a step, in each of which |K - p(s)| is replaced by its chord.
PARTS = 6


@compiled
def moves_that_keep_sight(
    index: EdgeIndex,
    places: np.ndarray,
    neighbour_starts: np.ndarray,
    neighbours: np.ndarray,
    lattice: tuple,
    runs: np.ndarray,
    ends: np.ndarray,
    by_rim: np.ndarray,
    corners: np.ndarray,
    step: float,
    slack: float,
    pace: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The evader nodes from which some moves of the pursuer may lose sight on the way.

    Args:
        index: Edges that block sight.
        places: The pursuer's nodes, shape (n, 2) [m].
        neighbour_starts, neighbours: Where it may go from each, as in `Rules`, shapes (n + 1,),
            (w,); at most 32 from each, one per bit.
        lattice: The evader's grid.
        runs, ends: What each place sees, from `see_runs`, shapes (m, 3), (n,).
        by_rim: Nodes near which evaders cannot go everywhere, shape (rows, columns), bool.
        corners: From `corner_table`, shape (k, 6).
        step: How far the pursuer goes in a step [m].
        slack, pace: Largest distance of an evader from its node, and its move in a step [m].

    Returns:
        Where the nodes of each place begin, shape (n + 1,); row and column of each, shape (m, 2);
        and the moves that keep sight, bit k standing for neighbour k, shape (m,).
    """
    rows, columns = by_rim.shape
    allowed = np.zeros((rows, columns), dtype=np.uint32)
    starts = np.zeros(len(places) + 1, dtype=np.int64)
    nodes, moves = np.empty((1024, 2), dtype=np.int32), np.empty(1024, dtype=np.uint32)
    count, begin = 0, 0
    for p in range(len(places)):
        px, py = places[p, 0], places[p, 1]
        low, high = 0, -1
        if begin < ends[p]:
            low, high = int(runs[begin, 0]), int(runs[ends[p] - 1, 0])
        for k in range(begin, ends[p]):
            allowed[runs[k, 0], runs[k, 1] : runs[k, 2]] = ALL
        around = neighbours[neighbour_starts[p] : neighbour_starts[p + 1]]
        for c in range(len(corners)):
            distance, to_star, mirrored = star_distances(index, px, py, corners, c)
            if distance > 0.0:
                close = is_close(distance, to_star, step)
                args = px, py, distance, mirrored, places, around, lattice, by_rim, close
                _forbid(args, corners[c], slack, pace, allowed[: high + 1], low)
        for k in range(begin, ends[p]):
            j = runs[k, 0]
            if count + runs[k, 2] - runs[k, 1] > len(nodes):
                more = 2 * len(nodes) + columns
                wider, longer = np.empty((more, 2), np.int32), np.empty(more, np.uint32)
                wider[:count], longer[:count] = nodes[:count], moves[:count]
                nodes, moves = wider, longer
            for i in range(runs[k, 1], runs[k, 2]):
                if allowed[j, i] != ALL:
                    nodes[count, 0], nodes[count, 1], moves[count] = j, i, allowed[j, i]
                    count += 1
            allowed[j, runs[k, 1] : runs[k, 2]] = 0
        begin = ends[p]
        starts[p + 1] = count
    return starts, nodes[:count].copy(), moves[:count].copy()


@kernel
def _forbid(args, corner, slack, pace, allowed, low):
    """Clear the bits of moves that may lose sight behind one corner, from row `low` on."""
    px, py, distance, mirrored, places, around, lattice, by_rim, close = args
    x0, y0, h, _, _ = lattice
    cx, cy = corner[0], corner[1]
    ux, uy = (cx - px) / distance, (cy - py) / distance
    width = slack + pace
    for j in range(low, len(allowed)):
        begin, end = row_by_ray(cx, cy, ux, uy, lattice, width, j)
        for i in range(begin, end):
            if allowed[j, i] == 0 or not (close or by_rim[j, i]):
                continue
            x, y = x0 + i * h, y0 + j * h
            if _is_far_from_ray(x - cx, y - cy, ux, uy, width):
                continue
            for k in range(len(around)):
                bit = np.uint32(1) << np.uint32(k)
                if allowed[j, i] & bit:
                    q = places[around[k]]
                    if not _keeps_off(px, py, q[0], q[1], x, y, corner, mirrored, slack, pace):
                        allowed[j, i] &= ~bit


@compiled
def keeps_sight(
    index: EdgeIndex,
    pursuer: np.ndarray,
    to: np.ndarray,
    evader: np.ndarray,
    corners: np.ndarray,
    pace: float,
    hold: float,
) -> bool:
    """Whether a step of the pursuer keeps sight on the way, wherever the evader goes meanwhile.

    It is assumed that the evader is in sight at the end of the step, wherever it then is.

    Args:
        index: Edges that block sight.
        pursuer, to: The pursuer's place and where it goes, shape (2,) [m].
        evader: In sight of the pursuer, shape (2,) [m].
        corners: From `corner_table`, shape (k, 6).
        pace: Distance that the evader can go during the step [m].
        hold: Part of that distance while the pursuer still stands [m].
    """
    px, py, qx, qy, ex, ey = pursuer[0], pursuer[1], to[0], to[1], evader[0], evader[1]
    for c in range(len(corners)):
        distance, _, mirrored = star_distances(index, px, py, corners, c)
        if distance == 0.0:
            continue
        dx, dy = corners[c, 0] - px, corners[c, 1] - py
        if _is_far_from_ray(ex - px - dx, ey - py - dy, dx / distance, dy / distance, pace):
            continue
        if not _keeps_off(px, py, qx, qy, ex, ey, corners[c], mirrored, hold, pace - hold):
            return False
    return True


@kernel
def _is_far_from_ray(x, y, ux, uy, width):
    """Whether a point at (x, y) from a corner is at least `width` from the corner's ray u.

    Then an evader there cannot be lost behind this corner. On the visible side a shrinking shadow
    moves away from it; on the other side, past the obstacle, it would be lost behind another
    corner first.
    """
    along = max(x * ux + y * uy, 0.0)
    return x * x + y * y - along * along >= width * width


@kernel
def _keeps_off(px, py, qx, qy, nx, ny, corner, mirrored, slack, pace):
    """Whether the ray behind a corner keeps the required distance from a node, from p to q."""
    cx, cy = corner[0], corner[1]
    side = -1.0 if mirrored else 1.0
    px, py, qx, qy, nx, ny = px - cx, py - cy, qx - cx, qy - cy, nx - cx, ny - cy
    if side * (px * qy - py * qx) <= 0.0:
        return True
    # Heights over the rim of the star region; see `to_corner_frame`.
    angle = corner[2] + (corner[3] if mirrored else 0.0)
    sine, cosine = side * np.sin(angle), side * np.cos(angle)
    low, high = py * cosine - px * sine, qy * cosine - qx * sine
    last = low / (low - high) if high >= 0.0 else 1.0
    away = np.sqrt(nx * nx + ny * ny)
    for part in range(PARTS):
        a, b = last * part / PARTS, last * (part + 1) / PARTS
        ax, ay, bx, by = (
            px + a * (qx - px),
            py + a * (qy - py),
            px + b * (qx - px),
            py + b * (qy - py),
        )
        near_a, near_b = slack + a * pace, slack + b * pace
        if ax * nx + ay * ny >= 0.0 and bx * nx + by * ny >= 0.0 and away >= near_b:
            continue
        # near |K - p| - (n beside the ray) |K - p| has to stay below 0.
        far_a, far_b = np.sqrt(ax * ax + ay * ay), np.sqrt(bx * bx + by * by)
        beside_a, beside_b = side * (ax * ny - ay * nx), side * (bx * ny - by * nx)
        curve = (near_b - near_a) * (far_b - far_a)
        start, end = near_a * far_a - beside_a, near_b * far_b - beside_b
        if start > 0.0 or end > 0.0:
            return False
        slope = end - start - curve
        if curve < 0.0 and 0.0 < slope < -2.0 * curve and start - slope * slope / (4 * curve) > 0.0:
            return False
    return True
