"""The last resort of route planning: a search over short arcs, as they are driven, in time.

Source: hybrid A*, Dolgov, Thrun, Montemerlo, Diebel (2008), with the time of arrival in each node,
since crop gets cut and combines move meanwhile, and the way over cut
ground as the estimate of what is still to go.
"""

import heapq

import numpy as np

from ...compiled import compiled
from .clearance import crop_under, is_near, outline_at
from .detours import COARSE
from .way import rates

# Cells of a node: side in turning radii, and number of headings.
CELL, HEADINGS = 0.4, 24
# Arcs driven from a node: curvatures in units of 1 / radius; and waiting in place [s].
BENDS = np.array([0.0, 0.5, -0.5, 1.0, -1.0])
WAIT = 3.0
# How much longer than the first to come a cart may wait in a cell [s].
MOST_WAIT = 60.0
# A trailer at such an angle to its tractor is too near to it [rad].
FOLDED = 1.4
# For how long a cart may still stand as badly as it does at the start [s].
BEGIN = 3.0
# How much the distance still to go counts for: more than 1 finds a way sooner, and a longer one.
WEIGHT = 1.5


@compiled
def search_way(
    ground, traffic, points, hitch, speed, radius, start, time, away, near, early, gaps, most
):
    """States and times of a way that ends near some goals, whatever its heading there.

    Args:
        ground: Raster.
        traffic: Combines.
        points: Outline of the cart.
        hitch: Of the cart.
        speed: Of the cart [m/s].
        radius: Of its sharpest turns [m].
        start: x, y, theta, beta.
        time: At the start [s].
        away: How far it is to the goals, from `distances_to` [m].
        near: How near is near enough [m].
        early: See `way_is_clear` [s].
        gaps: To keep from combines, and from other carts, shape (2,) [m].
        most: Number of nodes after which to give up.

    Returns:
        x, y, theta, beta, time, shape (n, 5); empty if there is no way.
    """
    side = CELL * radius
    arc = 0.7 * radius
    substeps = 3
    nodes = np.empty((most + 8, 5))
    parents = np.full(most + 8, -1)
    nodes[0, :4], nodes[0, 4] = start, time
    count = 1
    seen = {(np.int64(1 << 40), np.int64(0), np.int64(0)): np.int64(0)}
    queue = [(0.0, np.int64(0))]
    state = np.empty(4)
    placed = outline_at(points, hitch.length, hitch.hitch_offset, nodes[0, :4])
    under = crop_under(ground, traffic, placed, time, early)
    while queue and count < most:
        _, number = heapq.heappop(queue)
        x, y, theta, beta, now = nodes[number]
        cell = (
            np.int64(np.floor((x - start[0]) / side)),
            np.int64(np.floor((y - start[1]) / side)),
            np.int64(np.floor((theta % (2 * np.pi)) / (2 * np.pi) * HEADINGS)),
        )
        if cell in seen and nodes[seen[cell], 4] < now - 2 * WAIT:
            continue
        if to_go_from(away, ground, x, y) <= near:
            return _trace(nodes, parents, number)
        met = False
        for move in range(len(BENDS) + 1):
            waits = move == len(BENDS)
            if waits and not met:
                continue
            bend = 0.0 if waits else BENDS[move] / radius
            v = 0.0 if waits else speed
            duration = WAIT if waits else arc / speed
            state[0], state[1], state[2], state[3] = x, y, theta, beta
            clear = True
            for k in range(substeps):
                step = duration / substeps
                for _ in range(2):
                    r = rates(state[2], state[3], v, v * bend, hitch)
                    half = step / 4
                    r = rates(state[2] + half * r[2], state[3] + half * r[3], v, v * bend, hitch)
                    for i in range(4):
                        state[i] += step / 2 * r[i]
                at = now + (k + 1) * step
                placed = outline_at(points, hitch.length, hitch.hitch_offset, state)
                # What stands in crop, or is folded up, gets out of it at first.
                begins = at < time + BEGIN
                folded = abs(state[3]) > (max(FOLDED, abs(start[3])) if begins else FOLDED)
                stands_in = crop_under(ground, traffic, placed, at, early)
                if folded or stands_in > (under if begins else 0):
                    clear = False
                    break
                if is_near(traffic, placed, at, gaps) or is_near(traffic, placed, at + early, gaps):
                    clear, met = False, True
                    break
            if not clear:
                continue
            at = now + duration
            cell = (
                np.int64(np.floor((state[0] - start[0]) / side)),
                np.int64(np.floor((state[1] - start[1]) / side)),
                np.int64(np.floor((state[2] % (2 * np.pi)) / (2 * np.pi) * HEADINGS)),
            )
            if cell in seen:
                before = nodes[seen[cell], 4]
                if before <= at and (not waits or at > before + MOST_WAIT):
                    continue
            seen[cell] = np.int64(count)
            for i in range(4):
                nodes[count, i] = state[i]
            nodes[count, 4] = at
            parents[count] = number
            to_go = to_go_from(away, ground, state[0], state[1]) / speed
            if to_go < np.inf:
                heapq.heappush(queue, (at + WEIGHT * to_go, np.int64(count)))
            count += 1
            if count >= most:
                break
    return np.empty((0, 5))


@compiled
def to_go_from(away, ground, x, y):
    """How far it is to the goals from a point [m].

    Args:
        away: How far it is from each coarse cell [m].
        x: Of the point [m].
        y: Of the point [m].
    """
    side = COARSE * ground.cell
    i, j = int((x - ground.corner[0]) / side), int((y - ground.corner[1]) / side)
    if i < 0 or j < 0 or j >= away.shape[0] or i >= away.shape[1]:
        return np.inf
    least = away[j, i]
    if least == np.inf:
        # In the fringe of a coarse cell: as far as from the best cell beside it.
        for b in range(max(j - 1, 0), min(j + 2, away.shape[0])):
            for a in range(max(i - 1, 0), min(i + 2, away.shape[1])):
                least = min(least, away[b, a] + side)
    return least


@compiled
def _trace(nodes, parents, number):
    """A node and those before it, the first one first."""
    count = 0
    k = number
    while k >= 0:
        count += 1
        k = parents[k]
    way = np.empty((count, 5))
    k = number
    for place in range(count - 1, -1, -1):
        way[place] = nodes[k]
        k = parents[k]
    return way
