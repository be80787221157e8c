"""Turns: the quickest way found from one pose to another that stays on the ground.

Where no word fits, a lattice of short arcs and straights is searched; a word completes the way.

It is a hybrid A* search: poses are exact, and of those in one cell of place, heading and gear only
the first is expanded. The time that remains from a pose is estimated by the longer of the quickest
word and the way round obstacles on a coarse raster. The way found is shortened by words between its
own poses.

Source: Dolgov, Thrun, Montemerlo and Diebel, Path planning for autonomous vehicles in unknown
semi-structured environments, 2010.
"""

import heapq
import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from ...compiled import compiled, kernel
from ..machines import Combine, CombineSize, combine_outline
from ..paths import MachinePath
from .borders import CELL, CROP_CELL, StandingCrop, border_distance
from .ground import Footprint, Ground, Motion, make_footprint
from .words import (
    PIECES,
    WORD_COUNT,
    drive,
    driving_time,
    fitting_word,
    path_stays,
    quickest_time,
    quickest_times,
    stays_on_ground,
)

# How many poses the search may expand, unless told otherwise.
EXPANSIONS = 6000

# Headings of the lattice.
_HEADINGS = 24

# Side of the lattice's cells, and way of a long move, both in ways of a short move.
_CELL_SHARE = 0.6
_LONG_MOVE = 4.0

# Weight of the estimate: a larger one finds a way sooner, a smaller one a quicker way.
_GREED = 1.6

# A word to the goal is tried once in so many expansions.
_SHOT_EVERY = 8

# Nodes of the borders' raster from one node of the coarse raster to the next.
_STRIDE = 4

# Poses between which the way found is shortened, at most.
_WAYPOINTS = 32

# Size of the hash table of cells, a power of two.
_TABLE = 1 << 17

# Not Python's own: Numba would compile what takes them for each constant.
_WITHOUT_RUNS, _ONE = np.bool_(False), np.int64(1)

# Longest arc between two poses of a path [rad].
_LONGEST_ARC = math.pi / 2


@compiled
def search_lattice(site, motion, start, goal, gears, expansions):
    """Search for a way that stays on the ground.

    Args:
        site: Ground, standing crop and outline.
        motion: Of the machine.
        start: x, y, theta, shape (3,) [m], [m], [rad].
        goal: The same.
        gears: In which the machine arrives and goes on at full speed; 0: it stands.
        expansions: How many poses may be expanded, at most.

    Returns:
        Curvatures of the pieces [1/m] and their lengths, negative backwards [m], shape (n,); n is
        0 where no way was found.
    """
    bends, ways = np.zeros(PIECES), np.zeros(PIECES)
    ahead = _ways_to_goal(site, start, goal)
    poses, moves, parents, last = _explore(
        site, motion, start, goal, gears, expansions, ahead, bends, ways
    )
    if last < 0:
        return np.zeros(0), np.zeros(0)
    count, node = 0, last
    while parents[node] >= 0:
        count += 1
        node = parents[node]
    # Poses on the way, and the moves that lead to them; at the end the word and the goal.
    track = np.zeros((count + 2, 3))
    steps = np.zeros((count, 2))
    node = last
    for k in range(count, -1, -1):
        track[k] = poses[node]
        if k > 0:
            steps[k - 1] = moves[node]
        node = parents[node]
    track[count + 1] = goal
    return _shortened(site, motion, track, steps, bends, ways, gears)


@compiled
def _explore(site, motion, start, goal, gears, expansions, ahead, bends, ways):
    """The nodes, and the number of the one from which the word written leads to the goal, or -1."""
    most = 8 * expansions + 1
    poses, moves = np.zeros((most, 3)), np.zeros((most, 2))
    parents, costs = np.full(most, -1, dtype=np.int64), np.zeros(most)
    driven = np.zeros(most, dtype=np.int64)
    table = np.full(_TABLE, -1, dtype=np.int64)
    turns, pieces = np.zeros((WORD_COUNT, 3)), np.zeros((WORD_COUNT, 3))
    room, bend, way = np.zeros((2, 20, 2)), np.zeros(1), np.zeros(1)
    step = motion.radius * math.tau / _HEADINGS
    stop = motion.speed / motion.acceleration
    poses[0], driven[0] = start, gears[0]
    count = 1
    expanded, closed = 0, 0
    queue = [(0.0, 0)]
    while len(queue) > 0 and expanded < expansions and 2 * closed < _TABLE:
        node = heapq.heappop(queue)[1]
        place = _table_place(table, _key(poses[node], driven[node], start, _CELL_SHARE * step))
        if place < 0:
            continue
        table[place] = _key(poses[node], driven[node], start, _CELL_SHARE * step)
        closed += 1
        expanded += 1
        if expanded % _SHOT_EVERY == 1:
            task = (driven[node], gears[1])
            shot = fitting_word(
                site, motion, poses[node], goal, task, np.inf, _WITHOUT_RUNS, bends, ways
            )
            if shot < np.inf:
                return poses, moves, parents, node
        for gear in (1, -1):
            for kind in range(4):
                curvature = (kind % 3 - 1) / motion.radius if kind < 3 else 0.0
                bend[0] = curvature
                way[0] = gear * step * (_LONG_MOVE if kind == 3 else 1.0)
                x, y, theta = drive(
                    poses[node, 0], poses[node, 1], poses[node, 2], way[0], curvature
                )
                poses[count, 0], poses[count, 1], poses[count, 2] = x, y, theta
                key = _key(poses[count], gear, start, _CELL_SHARE * step)
                if _table_place(table, key) < 0:
                    continue
                cost = costs[node] + abs(way[0]) / motion.speed
                if driven[node] != gear:
                    cost += stop if driven[node] != 0 else stop / 2
                rest = _rest(site, motion, poses[count], goal, gear, gears[1], ahead, turns, pieces)
                if rest == np.inf or not stays_on_ground(site, poses[node], bend, way, _ONE, room):
                    continue
                costs[count], driven[count], parents[count] = cost, gear, node
                moves[count, 0], moves[count, 1] = curvature, way[0]
                heapq.heappush(queue, (cost + _GREED * rest, count))
                count += 1
    return poses, moves, parents, -1


@kernel
def _key(pose, gear, start, cell):
    """Number of a cell of place, heading and gear."""
    i = math.floor((pose[0] - start[0]) / cell) + (1 << 20)
    j = math.floor((pose[1] - start[1]) / cell) + (1 << 20)
    heading = math.floor((pose[2] - start[2]) / math.tau * _HEADINGS + 0.5) % _HEADINGS
    return ((i * (1 << 21) + j) * _HEADINGS + heading) * 3 + gear + 1


@kernel
def _table_place(table, key):
    """Place of a key in the hash table; -1: it is there already."""
    place = (key * 7046029254386353131 >> 20) & (len(table) - 1)
    while table[place] >= 0:
        if table[place] == key:
            return -1
        place = (place + 1) & (len(table) - 1)
    return place


@kernel
def _rest(site, motion, pose, goal, gear, after, ahead, turns, pieces):
    """Estimate of the time to the goal; infinite where there is no way [s]."""
    u = (pose[0] - site.borders.origin[0]) / (CELL * _STRIDE)
    v = (pose[1] - site.borders.origin[1]) / (CELL * _STRIDE)
    i, j = math.floor(u), math.floor(v)
    rows, columns = ahead.shape
    if i < 0 or j < 0 or i >= columns - 1 or j >= rows - 1:
        return np.inf
    near = min(
        min(ahead[j, i], ahead[j, i + 1]),
        min(ahead[j + 1, i], ahead[j + 1, i + 1]),
    )
    if near == np.inf:
        return np.inf
    quickest = quickest_time(motion, pose, goal, gear, after, turns, pieces)
    return max(quickest, near / motion.speed)


@compiled
def _ways_to_goal(site, start, goal):
    """Ways to the goal round obstacles, on a coarse raster of eight neighbours; infinite: none [m].

    A machine's middle has to be on the ground and off standing crop. The search ends a little
    farther away than the start.
    """
    fine = site.borders.distances.shape
    rows, columns = fine[0] // _STRIDE + 2, fine[1] // _STRIDE + 2
    side = CELL * _STRIDE
    ahead = np.full((rows, columns), np.inf)
    done = np.zeros((rows, columns), dtype=np.bool_)
    origin = site.borders.origin
    goal_i, goal_j = round((goal[0] - origin[0]) / side), round((goal[1] - origin[1]) / side)
    start_i, start_j = round((start[0] - origin[0]) / side), round((start[1] - origin[1]) / side)
    queue = [(0.0, goal_j * columns + goal_i)]
    ahead[goal_j, goal_i] = 0.0
    farthest = np.inf
    while len(queue) > 0:
        way, number = heapq.heappop(queue)
        if way > farthest:
            break
        j, i = number // columns, number % columns
        if done[j, i]:
            continue
        done[j, i] = True
        if abs(i - start_i) <= 1 and abs(j - start_j) <= 1 and farthest == np.inf:
            farthest = 1.2 * way + 60.0
        for dj in range(-1, 2):
            for di in range(-1, 2):
                nj, ni = j + dj, i + di
                if nj < 0 or ni < 0 or nj >= rows or ni >= columns or done[nj, ni]:
                    continue
                further = way + side * math.hypot(di, dj)
                if further >= ahead[nj, ni]:
                    continue
                x, y = origin[0] + ni * side, origin[1] + nj * side
                if border_distance(site.borders, x, y) < 0.0 or _in_crop(site, x, y):
                    continue
                ahead[nj, ni] = further
                heapq.heappush(queue, (further, nj * columns + ni))
    return ahead


@kernel
def _in_crop(site, x, y):
    i = math.floor((x - site.crop_origin[0]) / CROP_CELL)
    j = math.floor((y - site.crop_origin[1]) / CROP_CELL)
    rows, columns = site.crop.shape
    return 0 <= i < columns and 0 <= j < rows and site.crop[j, i]


@compiled
def _shortened(site, motion, track, steps, bends, ways, gears):
    """The quickest way along some of the poses, by words between them and by the moves found."""
    last = len(track) - 1
    stride = (last + _WAYPOINTS - 1) // _WAYPOINTS
    numbers = [0]
    while numbers[-1] + stride < last:
        numbers.append(numbers[-1] + stride)
    if numbers[-1] != last - 1:
        numbers.append(last - 1)
    numbers.append(last)
    # In which gear each pose is left.
    leaving = np.zeros(last + 1, dtype=np.int64)
    for k in range(last - 1):
        leaving[k] = 1 if steps[k, 1] > 0 else -1
    leaving[last - 1] = leaving[last - 2] if last > 1 else 1
    for k in range(PIECES):
        if ways[k] != 0.0:
            leaving[last - 1] = 1 if ways[k] > 0 else -1
            break
    leaving[0], leaving[last] = gears[0], gears[1]
    count = len(numbers)
    best, origin = np.full(count, np.inf), np.zeros(count, dtype=np.int64)
    words = np.zeros((count, 2, PIECES))
    by_word = np.zeros(count, dtype=np.bool_)
    best[0] = 0.0
    for j in range(1, count):
        begin, end = numbers[j - 1], numbers[j]
        after = leaving[end]
        # As it was found.
        if end == last:
            moved = driving_time(
                ways, PIECES, motion.speed, motion.acceleration, leaving[begin], after
            )
            words[j, 0], words[j, 1], by_word[j] = bends, ways, True
        else:
            lengths = np.ascontiguousarray(steps[begin:end, 1])
            moved = driving_time(
                lengths, end - begin, motion.speed, motion.acceleration, leaving[begin], after
            )
        best[j], origin[j] = best[j - 1] + moved, j - 1
        for i in range(j):
            task = (leaving[numbers[i]], after)
            time = fitting_word(
                site,
                motion,
                track[numbers[i]],
                track[end],
                task,
                best[j] - best[i] - 1e-6,
                _WITHOUT_RUNS,
                words[j, 0],
                words[j, 1],
            )
            if time < best[j] - best[i] - 1e-6:
                best[j], origin[j], by_word[j] = best[i] + time, i, True
    found = [(0.0, 0.0)]
    j = count - 1
    while j > 0:
        i = origin[j]
        if by_word[j]:
            for piece in range(PIECES - 1, -1, -1):
                found.append((words[j, 0, piece], words[j, 1, piece]))
        else:
            for k in range(numbers[j] - 1, numbers[i] - 1, -1):
                found.append((steps[k, 0], steps[k, 1]))
        j = i
    return _joined(found)


@compiled
def _joined(found):
    """Pieces in the order of driving, from a list in reverse; equal neighbours are joined."""
    curvatures, lengths = np.zeros(len(found)), np.zeros(len(found))
    count = 0
    for k in range(len(found) - 1, -1, -1):
        curvature, length = found[k]
        if length == 0.0:
            continue
        if count > 0 and curvatures[count - 1] == curvature and lengths[count - 1] * length > 0:
            lengths[count - 1] += length
        else:
            curvatures[count], lengths[count] = curvature, length
            count += 1
    return curvatures[:count], lengths[:count]


def motion_of(combine: Combine) -> Motion:
    """How a combine moves."""
    return Motion(combine.turning_radius, combine.speed, combine.acceleration)


def turn_times(starts: np.ndarray, goals: np.ndarray, combine: Combine) -> np.ndarray:
    """Time of the quickest turn of each pair of poses where nothing is in the way, shape (...) [s].

    Args:
        starts: x, y, theta, shape (..., 3) [m], [m], [rad].
        goals: The same; shapes are broadcast.
        combine: Which turns; it arrives and goes on forwards, at full speed.
    """
    pair = np.broadcast_arrays(np.asarray(starts, dtype=float), np.asarray(goals, dtype=float))
    flat = (np.ascontiguousarray(each.reshape(-1, 3)) for each in pair)
    return quickest_times(motion_of(combine), *flat).reshape(pair[0].shape[:-1])


def turn_between(
    start: Sequence[float],
    goal: Sequence[float],
    ground: Ground,
    combine: Combine,
    *,
    crop: StandingCrop | None = None,
    expansions: int = EXPANSIONS,
) -> MachinePath | None:
    """The quickest turn found whose outline stays on the ground; None where none is found.

    The combine arrives at the start and goes on from the goal forwards, at full speed.
    Words are tried, quickest first, then words with straights before and after them, and where
    none of them fits, a search on a lattice.

    Args:
        start: x, y, theta [m], [m], [rad].
        goal: The same.
        ground: Which no part of the outline leaves.
        combine: Which turns.
        crop: Where its body must not be; the raised header may be over it.
        expansions: How many poses the search may expand; 0: there is no search.
    """
    site = ground.site(combine_footprint(combine), crop)
    motion = motion_of(combine)
    first, last = np.array(start, dtype=float), np.array(goal, dtype=float)
    still = np.zeros(0)
    if not (path_stays(site, first, still, still) and path_stays(site, last, still, still)):
        return None
    curvatures, lengths = np.zeros(PIECES), np.zeros(PIECES)
    task = site, motion, first, last, (1, 1)
    time = fitting_word(*task, np.inf, False, curvatures, lengths)
    if time > turn_times(first, last, combine) + 1e-9:
        time = fitting_word(*task, time, True, curvatures, lengths)
    if np.isfinite(time):
        return path_of_pieces(first, last, curvatures, lengths)
    if not expansions:
        return None
    pieces = search_lattice(*task, expansions)
    return path_of_pieces(first, last, *pieces) if len(pieces[0]) else None


@lru_cache(maxsize=32)
def combine_footprint(combine: CombineSize) -> Footprint:
    """What a combine covers."""
    return make_footprint(combine_outline(combine))


def path_of_pieces(
    start: np.ndarray, goal: np.ndarray, curvatures: np.ndarray, lengths: np.ndarray
) -> MachinePath:
    """A transit along arcs and straights, which ends at the goal exactly.

    Args:
        start: x, y, theta, shape (3,) [m], [m], [rad].
        goal: Where the pieces lead but for rounding and whole turns, shape (3,).
        curvatures: Shape (n,) [1/m].
        lengths: Negative backwards, shape (n,) [m].
    """
    poses, gears = [tuple(map(float, start))], []
    for curvature, length in zip(curvatures.tolist(), lengths.tolist(), strict=True):
        if length == 0.0:
            continue
        steps = math.ceil(abs(curvature * length) / _LONGEST_ARC) or 1
        for _ in range(steps):
            x, y, theta = poses[-1]
            poses.append(drive(x, y, theta, length / steps, curvature))
            gears.append(1 if length > 0 else -1)
    found = np.array(poses)
    if len(found) > 1:
        turns = np.round((found[-1, 2] - goal[2]) / math.tau)
        found[-1] = goal[0], goal[1], goal[2] + math.tau * turns
    return MachinePath.of(found, gears=gears)
