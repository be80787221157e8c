"""The free room of a cart among walls along a word, and how its durations change it."""

import math
from collections.abc import Callable

import numpy as np

from ...compiled import compiled, kernel
from ..arc_words.quickest import ArcWord
from ..arc_words.shortened import advance, normalised_in_radii
from ..trailer import Trailer
from .obstacles import Walls, least_room, room_at

# Room that is kept beside errors of the raster and of samples, in lengths of the trailer.
SPARE = 2e-3
# Samples of an arc: one in so much of its duration [1 / turn rate], few and many at most.
SAMPLE = 0.15
FEWEST, MOST = 2, 400
# Difference of durations for slopes [1 / turn rate].
_NUDGE = 1e-6

# Durations [s] -> free room at places along a word, shape (m,) [m], and its slopes, shape (m, n).
RoomOfDurations = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def room_of(walls: Walls, state) -> float:
    """Least free room around a cart, negative: how deep it is in a wall [m].

    Args:
        walls: What is in the way.
        state: x, y, theta, beta [m], [m], [rad], [rad].
    """
    return float(room_at(walls, *(float(value) for value in state)))


def room_along(
    walls: Walls, trailer: Trailer, start, word: ArcWord, fine: bool = True
) -> RoomOfDurations:
    """The free room along a word as a function of its durations.

    Places are in equal parts of each arc, as many as its duration now asks for: finely, so many
    that half of `SPARE` is for what a corner of a wall has between two of them.

    Args:
        walls: What is in the way.
        trailer: Which drives.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        word: Its arcs.
        fine: Or a few, to begin with.
    """
    rate = trailer.turn_rate
    radius = trailer.speed / rate
    # At s beside a corner the smallest disc is s^2 / (2 r) farther from it.
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
    # What was noted for later arcs are rooms; only now are all of those known that they are from.
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
