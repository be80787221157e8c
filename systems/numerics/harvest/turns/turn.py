"""Turns: the quickest way found from one pose to another that stays on the ground."""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from ..machines.combine import Combine, CombineSize
from ..machines.outlines import combine_outline
from ..paths.machine_path import TRANSIT, MachinePath
from .fitting_word import PIECES, fitting_word
from .footprint import Footprint, make_footprint
from .ground import Ground
from .lattice import EXPANSIONS, search_lattice
from .site import Motion
from .standing_crop import StandingCrop
from .sweep import drive, path_stays
from .words import word_times

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
    expansions: int = EXPANSIONS,
) -> MachinePath | None:
    """The quickest turn found whose outline stays on the ground; None where none is found.

    Words are tried, quickest first, then words with straights before and after them, and where
    none of them fits, a search on a lattice.

    Args:
        start: x, y, theta [m], [m], [rad].
        goal: The same.
        ground: Which no part of the outline leaves.
        combine: Which turns.
        crop: Where its body must not be; the raised header may be over it.
        gears: In which the combine arrives at the start at full speed and goes on from the goal;
            0: it stands there.
        expansions: Bound of the search; 0: there is none.
    """
    site = ground.site(combine_footprint(combine), crop)
    motion = Motion(combine.turning_radius, combine.speed, combine.acceleration)
    first, last = np.array(start, dtype=float), np.array(goal, dtype=float)
    still = np.zeros(0)
    if not (path_stays(site, first, still, still) and path_stays(site, last, still, still)):
        return None
    curvatures, lengths = np.zeros(PIECES), np.zeros(PIECES)
    task = site, motion, first, last, gears
    time = fitting_word(*task, np.inf, False, curvatures, lengths)
    if time > turn_times(first, last, combine, gears) + 1e-9:
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
    count = len(gears)
    return MachinePath(
        found,
        np.array(gears, dtype=int),
        np.zeros(count, dtype=bool),
        np.full(count, TRANSIT, dtype=int),
    )
