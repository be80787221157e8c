"""Steps that lead a cart into a wall, and the free room that a word leaves it."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ...geometry.world import World
from ..arc_words.quickest import ArcWord
from ..arc_words.shortened import advance, normalised_in_radii
from ..arc_words.words import control_set
from ..footprint import TRACTOR, TRAILER, Discs, signed_distance
from ..trailer import Trailer, hold_beta
from .grid import StateGrid

# Checks for walls along a step, per angle between theta nodes.
LOOKS = 2
# Headings at which a body's free room is tabulated, per angle between theta nodes.
HEADINGS = 8
# Nodes of the raster of free distances, per step of the grid.
FINENESS = 2
# The same for the raster that a table keeps, against which driven paths are checked.
FINER = 4


class Walls(NamedTuple):
    """Free distance on a raster, and the discs that must keep it.

    Attributes:
        distance: Signed, shape (n_y, n_x) [m].
        origin: (x, y) of its first node [m].
        step: Of the raster [m].
        discs: Offset, radius, and 1 for the trailer, shape (n, 3) [m], [m].
        length, hitch: Of the trailer [m].
    """

    distance: np.ndarray
    origin: np.ndarray
    step: float
    discs: np.ndarray
    length: float
    hitch: float


def make_walls(world: World, discs: Discs, grid: StateGrid, fineness: int = FINENESS) -> Walls:
    """Sample the free distance over the grid, at a fraction of its step.

    Args:
        world: With the walls.
        discs: What the cart covers.
        grid: Where to sample.
        fineness: Samples per step of the grid.
    """
    x_min, y_min, _, _ = grid.bounds
    step = grid.step / fineness
    x = x_min + step * np.arange(fineness * (grid.x_count - 1) + 1)
    y = y_min + step * np.arange(fineness * (grid.y_count - 1) + 1)
    points = np.stack([each.ravel() for each in np.meshgrid(x, y)], axis=1)
    distance = signed_distance(world, points).reshape(len(y), len(x))
    table = np.column_stack([discs.offsets, discs.radii, discs.bodies]).astype(float)
    return Walls(distance, np.array([x_min, y_min]), step, table, discs.length, discs.hitch_offset)


def with_spare(walls: Walls, spare: float) -> Walls:
    """The same walls for a cart with larger discs.

    Args:
        walls: What is in the way.
        spare: What is added to every radius [m].
    """
    discs = walls.discs.copy()
    discs[:, 1] += spare
    return walls._replace(discs=discs)


@compiled
def overlaps(walls, x, y, theta, beta):
    """Whether a disc reaches into a wall, or beyond the raster.

    Args:
        walls: Free distances, from `make_walls`.
        x, y, theta, beta: State of the cart [m], [m], [rad], [rad].
    """
    return least_room(walls, x, y, theta, beta, 0.0) < 0.0


@compiled
def room_at(walls, x, y, theta, beta):
    """Least free room around the discs; it keeps falling with distance beyond the raster [m].

    Args:
        walls, x, y, theta, beta: As for `overlaps`.
    """
    return least_room(walls, x, y, theta, beta, -np.inf)


@kernel
def least_room(walls, x, y, theta, beta, enough):
    """Least room over all discs, or the first one found that is below `enough` [m].

    Args:
        walls, x, y, theta, beta: As for `overlaps`.
        enough: Room below which the other discs are not looked at [m].
    """
    c, s = math.cos(theta), math.sin(theta)
    heading = theta - beta
    ahead_c, ahead_s = math.cos(heading), math.sin(heading)
    back_x = x - walls.hitch * c - walls.length * ahead_c
    back_y = y - walls.hitch * s - walls.length * ahead_s
    rows, columns = walls.distance.shape
    least = np.inf
    for n in range(len(walls.discs)):
        offset = walls.discs[n, 0]
        if walls.discs[n, 2] == 0.0:
            px, py = x + offset * c, y + offset * s
        else:
            px, py = back_x + offset * ahead_c, back_y + offset * ahead_s
        u = (px - walls.origin[0]) / walls.step
        w = (py - walls.origin[1]) / walls.step
        inner_u, inner_w = min(max(u, 0.0), columns - 1.0), min(max(w, 0.0), rows - 1.0)
        beyond = abs(u - inner_u) + abs(w - inner_w)
        i = min(math.floor(inner_u), columns - 2)
        j = min(math.floor(inner_w), rows - 2)
        a, b = inner_u - i, inner_w - j
        low = (1 - a) * walls.distance[j, i] + a * walls.distance[j, i + 1]
        high = (1 - a) * walls.distance[j + 1, i] + a * walls.distance[j + 1, i + 1]
        room = (1 - b) * low + b * high - beyond * walls.step - walls.discs[n, 1]
        least = min(least, room)
        if least < enough:
            break
    return least


def shut_ways(
    grid: StateGrid, trailer: Trailer, walls: Walls, scale: float, multiples: tuple[int, ...]
) -> np.ndarray:
    """Which steps lead through a wall, one bit for each control of `make_motions`.

    The room around a body depends on its position and heading alone, so it is tabulated once. For
    each pair of angles, a check of the whole plane is then this table shifted by a constant.

    Args:
        grid: Where the nodes are [m].
        trailer: Normalised.
        walls: What is in the way, at `FINENESS`.
        scale: Length of a turning radius [m].
        multiples: Durations of the steps, see `make_motions`.

    Returns:
        Shape of the grid, uint32; all bits at nodes that overlap a wall themselves.
    """
    shut = np.zeros(grid.shape, dtype=np.uint32)
    _, _, thetas, betas = grid.axes()
    longest = max(multiples)
    headings = math.tau / (HEADINGS * grid.theta_count) * np.arange(HEADINGS * grid.theta_count)
    tractor, towed = (_rooms(walls, body, headings) for body in (TRACTOR, TRAILER))
    radius = scale / grid.step
    hitch = walls.hitch / grid.step
    for group, (v, omega) in enumerate(control_set(trailer)):
        path = hold_beta(betas, v, omega, longest * grid.theta_step, 8 * longest, trailer)
        path = path[:: 8 // LOOKS]
        # Bits of the steps that an overlap at each check blocks: all that are at least so long.
        looks = LOOKS * np.array(multiples)
        bits = np.uint32(1) << np.arange(len(looks), dtype=np.uint32) + len(looks) * group
        lost = np.array([bits[looks >= k].sum() for k in range(len(path))], dtype=np.uint32)
        pace = grid.theta_step / LOOKS
        held = (path, int(v), int(omega), pace)
        _shut(shut, tractor, towed, thetas, *held, radius, hitch, lost)
    return shut


def _rooms(walls: Walls, body: int, headings: np.ndarray) -> np.ndarray:
    """Free room around the discs of one body, by heading and place of its rear axle or hitch.

    Returns:
        Shape (len(headings), n_y, n_x), float32; negative: a disc is in a wall, or beyond the
        raster [m].
    """
    discs = walls.discs[walls.discs[:, 2] == body]
    ahead = discs[:, 0] - (walls.length if body == TRAILER else 0.0)
    rooms = np.empty((len(headings), *walls.distance.shape), dtype=np.float32)
    distance = walls.distance.astype(np.float32)
    _fill_rooms(rooms, distance, headings, ahead / walls.step, discs[:, 1].astype(np.float32))
    return rooms


@compiled
def _fill_rooms(rooms, distance, headings, offsets, radii):
    plane = np.empty(distance.shape, dtype=np.float32)
    rooms[:] = np.float32(np.inf)
    for h in range(len(headings)):
        for n in range(len(offsets)):
            dx = offsets[n] * math.cos(headings[h])
            dy = offsets[n] * math.sin(headings[h])
            _shifted(distance, dx, dy, 1, plane)
            rooms[h] = np.minimum(rooms[h], plane - radii[n])


@kernel
def _shifted(raster, dx, dy, stride, out):
    """Interpolate a raster bilinearly at every `stride`-th node plus a shift; -1 beyond it.

    Args:
        raster: Shape (n_y, n_x), float32.
        dx, dy: Shift, in nodes of the raster.
        stride: Nodes of the raster from one node of the answer to the next.
        out: The answer, float32.
    """
    # A point on the last node must not need a neighbour beyond it.
    near_x, near_y = np.rint(dx), np.rint(dy)
    dx = near_x if abs(dx - near_x) < 1e-6 else dx
    dy = near_y if abs(dy - near_y) < 1e-6 else dy
    left, low = math.floor(dx), math.floor(dy)
    a, b = np.float32(dx - left), np.float32(dy - low)
    right, up = left + (1 if a > 0 else 0), low + (1 if b > 0 else 0)
    rest = np.float32(1.0) - a
    rows, columns = raster.shape
    first = max(0, -(left // stride))
    last = min(out.shape[1], (columns - 1 - right) // stride + 1)
    for j in range(out.shape[0]):
        one, two = stride * j + low, stride * j + up
        line = out[j]
        line[:] = np.float32(-1.0)
        if one < 0 or two >= rows:
            continue
        under, over = raster[one], raster[two]
        for i in range(first, last):
            k, m = stride * i + left, stride * i + right
            below = rest * under[k] + a * under[m]
            above = rest * over[k] + a * over[m]
            line[i] = below + b * (above - below)


@compiled
def _shut(shut, tractor, trailer, thetas, path, v, omega, pace, radius, hitch, lost):
    """Set bits for one held v and omega. Lengths are in steps of the grid."""
    theta_count, beta_count, y_count, x_count = shut.shape
    count = len(tractor)
    room = np.empty((y_count, x_count), dtype=np.float32)
    towed = np.empty((y_count, x_count), dtype=np.float32)
    for t in range(theta_count):
        for k in range(len(path)):
            half = omega * k * pace / 2
            chord = v * k * pace * (math.sin(half) / half if half != 0.0 else 1.0) * radius
            theta = thetas[t] + 2 * half
            dx, dy = chord * math.cos(thetas[t] + half), chord * math.sin(thetas[t] + half)
            turn = round(theta / (2 * math.pi) * count) % count
            _shifted(tractor[turn], FINENESS * dx, FINENESS * dy, FINENESS, room)
            dx -= hitch * math.cos(theta)
            dy -= hitch * math.sin(theta)
            for b in range(beta_count):
                turn = round((theta - path[k, b]) / (2 * math.pi) * count) % count
                _shifted(trailer[turn], FINENESS * dx, FINENESS * dy, FINENESS, towed)
                _set_bits(room, towed, lost[k], shut[t, b])


@kernel
def _set_bits(room, towed, bits, shut):
    for j in range(len(shut)):
        for i in range(len(shut[j])):
            blocked = room[j, i] < 0 or towed[j, i] < 0
            shut[j, i] |= bits if blocked else np.uint32(0)


# Room kept to allow for errors of the raster and of sampling, in lengths of the trailer.
SPARE = 2e-3
# Time between samples of an arc [1 / turn rate], and the least and largest number of them.
SAMPLE = 0.15
FEWEST, MOST = 2, 400
# Change of a duration for finite-difference slopes [1 / turn rate].
_NUDGE = 1e-6

# Durations [s] -> free room at places along a word, shape (m,) [m], and its slopes, shape (m, n).
RoomOfDurations = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def room_of(walls: Walls, state) -> float:
    """Least free room around a cart; negative: its depth in a wall [m].

    Args:
        walls: What is in the way.
        state: x, y, theta, beta [m], [m], [rad], [rad].
    """
    return float(room_at(walls, *(float(value) for value in state)))


def room_along(
    walls: Walls, trailer: Trailer, start, word: ArcWord, fine: bool = True
) -> RoomOfDurations:
    """The free room along a word as a function of its durations.

    Each arc is divided into equal parts, their number fixed by its duration in `word`. With `fine`,
    they are so short that a wall's corner between two samples costs at most half of `SPARE`.

    Args:
        walls: What is in the way.
        trailer: Which drives.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        word: Its arcs.
        fine: Whether to sample so densely; a first search needs few samples.
    """
    rate = trailer.turn_rate
    radius = trailer.speed / rate
    # At s past a corner the smallest disc, of radius r, is s^2 / (2 r) farther from it.
    beside = math.sqrt(SPARE * trailer.length * walls.discs[:, 1].min()) / radius
    sample = min(2 * beside, SAMPLE) if fine else SAMPLE
    counts = np.ceil(word.durations * rate / sample).clip(FEWEST, MOST).astype(np.int64)
    cart, local = normalised_in_radii(trailer, start)
    controls = word.controls / [trailer.speed, rate]

    def room(durations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rooms = np.empty(int(counts.sum()))
        slopes = np.zeros((len(rooms), len(counts)))
        held = np.maximum(durations, 0.0) * rate
        _rooms_and_slopes(local, controls, held, counts, cart, radius, walls, rooms, slopes)
        return rooms, slopes * rate

    return room


@compiled
def _rooms_and_slopes(start, controls, durations, counts, cart, radius, walls, rooms, slopes):
    state, nudged, before = np.empty(5), np.empty(5), np.empty(5)
    _begin(start, state)
    first = 0
    for k in range(len(durations)):
        before[:] = state
        n = first
        for part in range(1, counts[k] + 1):
            state[:] = before
            advance(state, controls[k, 0], controls[k, 1], durations[k] * part / counts[k], cart)
            rooms[n] = _room(walls, state, radius)
            n += 1
        # A longer arc shifts its own places and all that come after.
        nudged[:] = before
        longer = durations[k] + _NUDGE
        n = first
        for part in range(1, counts[k] + 1):
            nudged[:] = before
            advance(nudged, controls[k, 0], controls[k, 1], longer * part / counts[k], cart)
            slopes[n, k] = (_room(walls, nudged, radius) - rooms[n]) / _NUDGE
            n += 1
        for later in range(k + 1, len(durations)):
            before[:] = nudged
            for part in range(1, counts[later] + 1):
                nudged[:] = before
                time = durations[later] * part / counts[later]
                advance(nudged, controls[later, 0], controls[later, 1], time, cart)
                slopes[n, k] = _room(walls, nudged, radius)
                n += 1
        first += counts[k]
    # For later arcs `slopes` still holds rooms after the nudge; the rooms before it are known now.
    first = 0
    for k in range(len(durations)):
        first += counts[k]
        for n in range(first, len(rooms)):
            slopes[n, k] = (slopes[n, k] - rooms[n]) / _NUDGE


@kernel
def _begin(start, state):
    state[0], state[1], state[2] = start[0], start[1], start[2]
    state[3], state[4] = math.sin(start[3] / 2), math.cos(start[3] / 2)


@kernel
def _room(walls, state, radius):
    beta = 2.0 * math.atan2(state[3], state[4])
    return least_room(walls, state[0] * radius, state[1] * radius, state[2], beta, -np.inf)
