"""Turns: the quickest way found from one pose to another that stays on the ground."""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from ...compiled import compiled
from ..machines.combine import Combine
from ..machines.outlines import combine_outline
from ..paths.machine_path import TRANSIT, MachinePath
from .footprint import Footprint, make_footprint
from .ground import Ground, crop_arrays
from .standing_crop import StandingCrop
from .sweep import drive, stays_on_ground
from .words import WORD_COUNT, driving_time, word_times, write_words

# Straights before and after a word, negative backwards [radii]; the first is none.
RUNS = np.array([0.0, 0.5, 1.0, 2.0, -0.5, -1.0, -2.0])

# Words with straights before or after them that are compared with the ground.
_MOST_CHECKS = 1000

# Pieces of a turn: a straight, a word, a straight.
_PIECES = 5

# Longest arc between two poses of a path [rad].
_LONGEST_ARC = math.pi / 2


def turn_times(
    starts: np.ndarray,
    goals: np.ndarray,
    combine: Combine,
    gears: tuple[int, int] = (1, 1),
) -> np.ndarray:
    """Time of the quickest turn of each pair of poses where nothing is in the way, shape (...) [s].

    Args:
        starts: x, y, theta, shape (..., 3) [m], [m], [rad].
        goals: The same; shapes are broadcast.
        combine: Which turns.
        gears: In which it arrives at the start at full speed and goes on from the goal; 0: it
            stands there.
    """
    return word_times(
        starts, goals, combine.turning_radius, combine.speed, combine.acceleration, gears
    )


def turn_between(
    start: Sequence[float],
    goal: Sequence[float],
    ground: Ground,
    combine: Combine,
    *,
    crop: StandingCrop | None = None,
    gears: tuple[int, int] = (1, 1),
) -> MachinePath | None:
    """The quickest turn found whose outline stays on the ground; None where none is found.

    Words are tried, quickest first, and words with straights before and after them.

    Args:
        start: x, y, theta [m], [m], [rad].
        goal: The same.
        ground: Which no part of the outline leaves.
        combine: Which turns.
        crop: Where its body must not be; the raised header may be over it.
        gears: In which the combine arrives at the start at full speed and goes on from the goal;
            0: it stands there.
    """
    footprint = combine_footprint(combine)
    first, last = np.array(start, dtype=float), np.array(goal, dtype=float)
    curvatures, lengths = np.zeros(_PIECES), np.zeros(_PIECES)
    found = _quickest_word(
        ground.borders,
        *crop_arrays(crop),
        footprint,
        first,
        last,
        (combine.turning_radius, combine.speed, combine.acceleration),
        gears,
        curvatures,
        lengths,
    )
    return path_of_pieces(first, last, curvatures, lengths) if found else None


@lru_cache(maxsize=32)
def combine_footprint(combine: Combine) -> Footprint:
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
            poses.append(drive(*poses[-1], length / steps, curvature))
            gears.append(1 if length > 0 else -1)
    found = np.array(poses)
    if len(found) > 1:
        turns = np.round((found[-1, 2] - goal[2]) / math.tau)
        found[-1] = goal[0], goal[1], goal[2] + math.tau * turns
    count = len(gears)
    return MachinePath(
        found,
        np.array(gears, dtype=int),
        np.zeros(count, dtype=bool),
        np.full(count, TRANSIT, dtype=int),
    )


@compiled
def _quickest_word(
    borders, crop, crop_origin, footprint, start, goal, motion, gears, curvatures, lengths
):
    """Write the pieces of the quickest word that stays on the ground; whether there is one.

    Ten arguments: the ground, the machine, the task and where the answer is written.
    """
    radius, speed, acceleration = motion
    room = np.zeros((3, 20, 2))
    some_turns, some_lengths = np.zeros((WORD_COUNT, 3)), np.zeros((WORD_COUNT, 3))
    runs = len(RUNS)
    # Words alone, then with straights, of which only the quicker ones count.
    least = np.inf
    for stage in range(2):
        most = WORD_COUNT * (1 if stage == 0 else runs * runs - 1)
        bends, ways = np.zeros((most, _PIECES)), np.zeros((most, _PIECES))
        times = np.zeros(most)
        count = 0
        for before in range(1 if stage == 0 else runs):
            x, y, theta = drive(start[0], start[1], start[2], RUNS[before] * radius, 0.0)
            for after in range(1 if stage == 0 else runs):
                if stage == 1 and before == 0 and after == 0:
                    continue
                gx, gy, heading = drive(goal[0], goal[1], goal[2], -RUNS[after] * radius, 0.0)
                dx, dy = (gx - x) / radius, (gy - y) / radius
                c, s = math.cos(theta), math.sin(theta)
                words = write_words(
                    c * dx + s * dy, c * dy - s * dx, heading - theta, some_turns, some_lengths
                )
                for word in range(words):
                    ways[count, 0] = RUNS[before] * radius
                    ways[count, 4] = RUNS[after] * radius
                    for piece in range(3):
                        ways[count, piece + 1] = some_lengths[word, piece] * radius
                        bends[count, piece + 1] = some_turns[word, piece] / radius
                    times[count] = driving_time(
                        ways[count], _PIECES, speed, acceleration, gears[0], gears[1]
                    )
                    if times[count] < least:
                        count += 1
        checks = 0
        for word in np.argsort(times[:count], kind="mergesort"):
            checks += 1
            if checks > _MOST_CHECKS:
                break
            if stays_on_ground(
                borders,
                crop,
                crop_origin,
                footprint,
                start,
                bends[word],
                ways[word],
                _PIECES,
                room,
            ):
                least = times[word]
                curvatures[:] = bends[word]
                lengths[:] = ways[word]
                break
        if stage == 0 and checks == 1 and least < np.inf:
            break
    return least < np.inf
