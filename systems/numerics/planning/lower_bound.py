"""A lower bound of the cart's travel time: that of a car, with the trailer's angle left free.

To a point it is the Dubins length, or the Reeds-Shepp length for a cart that may reverse. Into a
box it is the least such length to any pose of the box, by branch and bound: certain, and below the
least length by at most a stated tolerance, or by a few hundredths where x or y are free and many
paths are equally short. The words are taken family by family: each has three lengths to choose, and
the other pieces are tied to them.

Source: Dubins 1957; Reeds and Shepp 1990, section 8.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import require, require_finite, require_positive
from .car_paths import advance, dubins_lengths, reeds_shepp_lengths
from .goal import Goal
from .trailer import Trailer


@dataclass(frozen=True, eq=False)
class WordFamily:
    """Pieces in units of the turning radius: lengths = coefficients @ choice + fixed.

    Attributes:
        turns: Of each piece: 1 left, 0 straight, -1 right.
        coefficients: Shape (pieces, 3); in a row at most one entry, 1 or -1.
        fixed: Shape (pieces,).
        limits: The choice lies in [0, limits], shape (3,); infinite for straights.
    """

    turns: tuple[int, ...]
    coefficients: np.ndarray
    fixed: np.ndarray
    limits: np.ndarray


# Turns, and of each piece its sign and which of the choices it is; Q: a quarter turn.
Q = -1
CAR_WITH_REVERSE = (
    ((1, 0, 1), (1, 1, 1), (0, 1, 2)),
    ((1, 0, -1), (1, 1, 1), (0, 1, 2)),
    ((1, -1, 1), (1, -1, 1), (0, 1, 2)),
    ((1, -1, 1), (1, -1, -1), (0, 1, 2)),
    ((1, -1, 1), (1, 1, -1), (0, 1, 2)),
    ((1, -1, 1, -1), (1, 1, -1, -1), (0, 1, 1, 2)),
    ((1, -1, 1, -1), (1, -1, -1, 1), (0, 1, 1, 2)),
    ((1, -1, 0, 1), (1, -1, -1, -1), (0, Q, 1, 2)),
    ((1, -1, 0, -1), (1, -1, -1, -1), (0, Q, 1, 2)),
    ((1, 0, -1, 1), (1, 1, 1, -1), (0, 1, Q, 2)),
    ((1, 0, 1, -1), (1, 1, 1, -1), (0, 1, Q, 2)),
    ((1, -1, 0, 1, -1), (1, -1, -1, -1, 1), (0, Q, 1, Q, 2)),
)
CAR_WITHOUT_REVERSE = (
    ((1, 0, 1), (1, 1, 1), (0, 1, 2)),
    ((1, 0, -1), (1, 1, 1), (0, 1, 2)),
    ((1, -1, 1), (1, 1, 1), (0, 1, 2)),
)


def word_families(reverse: bool) -> Iterator[WordFamily]:
    """The six Dubins families, or the 48 of Reeds and Shepp.

    Args:
        reverse: Whether the car may drive backwards: Reeds and Shepp.
    """
    # Backwards round the rest of the circle is shorter than an arc beyond half a turn.
    longest = math.pi if reverse else math.tau
    for turns, signs, choices in CAR_WITH_REVERSE if reverse else CAR_WITHOUT_REVERSE:
        coefficients = np.zeros((len(turns), 3))
        fixed = np.zeros(len(turns))
        limits = np.full(3, longest)
        for piece, (turn, sign, choice) in enumerate(zip(turns, signs, choices, strict=True)):
            if choice == Q:
                fixed[piece] = sign * math.pi / 2
            else:
                coefficients[piece, choice] = sign
            if turn == 0:
                limits[choice] = math.inf
        for side in (1, -1):
            for time in (1, -1) if reverse else (1,):
                sided = tuple(side * turn for turn in turns)
                yield WordFamily(sided, time * coefficients, time * fixed, limits)


# Cells per word beyond which they are not divided further: the bound stays certain, but is looser.
MOST_CELLS = 20_000


def lower_bound(
    trailer: Trailer, start: Sequence[float], goal: Goal, tolerance: float = 1e-3
) -> float:
    """Least travel time with the trailer's angle left free [s].

    For a cart that only drives forwards the speed is taken as held; for one that may reverse, the
    bound holds for every speed within [-speed, speed].

    Args:
        trailer: Parameters; the trailer itself plays no part.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: Point, box, or with free entries.
        tolerance: For boxes: how far below the least time the bound may be [1 / turn_rate].

    Raises:
        InvalidInput: The start is not four finite numbers or the tolerance is not positive.
    """
    require(len(start) == 4, "start", "be (x, y, theta, beta)", start)
    for value in start:
        require_finite("start", float(value))
    require_positive("tolerance", tolerance)
    radius = trailer.radius
    scale = np.array([radius, radius, 1.0])
    # In the goal's own frame, where the box lies along the axes.
    pose = goal.to_frame(start)[:3] / scale
    box_centre = np.zeros(3)
    widths = np.array(goal.tolerance[:3]) / scale
    widths[2] = min(widths[2], math.pi)
    length = _searched_length(pose, box_centre, widths, trailer.reverse)
    if widths.any():
        length = _certain_length(pose, box_centre, widths, trailer.reverse, length, tolerance)
    return length / trailer.turn_rate


def _searched_length(start, centre, widths, reverse: bool) -> float:
    """Least length over a grid of poses in the box, refined four times round the best pose."""
    lengths = reeds_shepp_lengths if reverse else dubins_lengths
    # Free entries: as far as the start and a loop round it.
    reach = np.abs(centre - start) + math.tau
    low = centre - np.minimum(widths, reach)
    high = centre + np.minimum(widths, reach)
    best = math.inf
    middle, half = (low + high) / 2, (high - low) / 2
    for _ in range(5):
        axes = [
            np.clip(np.linspace(m - h, m + h, 9 if h > 0 else 1), lo, hi)
            for m, h, lo, hi in zip(middle, half, low, high, strict=True)
        ]
        poses = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        found = lengths(start, poses, 1.0)
        nearest = int(np.argmin(found))
        if found[nearest] < best:
            best, middle = float(found[nearest]), poses[nearest]
        half = half / 3
    return best


def _certain_length(start, centre, widths, reverse, best: float, tolerance: float) -> float:
    """Lower bound of the least length into the box, within the tolerance but for MOST_CELLS.

    `best` is the length of some path into the box.
    """
    certain = math.inf
    for family in word_families(reverse):
        weights = np.abs(family.coefficients).sum(axis=0)
        constant = float(np.abs(family.fixed).sum())
        half = np.minimum(family.limits, best) / 2
        cells = half[None, :].copy()
        while len(cells):
            least = (cells - half) @ weights + constant
            cells = cells[least < best - tolerance]
            if len(cells) == 0:
                break
            gaps, slacks = _gaps(start, family, cells, half, centre, widths)
            inside = (gaps == 0).all(axis=1)
            totals = cells[inside] @ weights + constant
            best = min(best, float(np.min(totals, initial=math.inf)))
            cells = cells[(gaps <= slacks).all(axis=1)]
            if len(cells) > MOST_CELLS:
                certain = min(certain, float(np.min((cells - half) @ weights)) + constant)
                break
            # Halve the side that matters most.
            side = int(np.argmax(half * np.maximum(weights, 1)))
            half = half.copy()
            half[side] /= 2
            step = np.zeros(3)
            step[side] = half[side]
            cells = np.concatenate([cells - step, cells + step])
    return max(min(certain, best - tolerance), 0.0)


def _gaps(start, family: WordFamily, cells, half, centre, widths):
    """How far the words of cells end from the box, and by how much that varies within a cell.

    Returns:
        Distance and angle outside the box at the cell's centre, and bounds of their changes
        within the cell, shape (n, 2) each.
    """
    poses = np.tile(start, (len(cells), 1))
    ways = cells @ family.coefficients.T + family.fixed
    pivots = []
    for turn, way in zip(family.turns, ways.T, strict=True):
        x, y, theta = poses.T
        pivots.append((x - turn * np.sin(theta), y + turn * np.cos(theta)))
        poses = advance(poses, float(turn), way)
    ends = poses
    # A piece that is longer or shorter shifts what follows along itself, or turns it about its
    # pivot; taken from the last piece to the first, what follows is already disturbed.
    spread = np.abs(family.coefficients) @ half
    shift, twist = np.zeros(len(cells)), 0.0
    for turn, (x, y), change in list(zip(family.turns, pivots, spread, strict=True))[::-1]:
        arm = np.hypot(ends[:, 0] - x, ends[:, 1] - y) + shift if turn else 1.0
        shift = shift + change * arm
        twist += abs(turn) * change
    away = np.maximum(np.abs(ends[:, :2] - centre[:2]) - widths[:2], 0)
    off = np.abs(np.remainder(ends[:, 2] - centre[2] + math.pi, math.tau) - math.pi)
    gaps = np.stack([np.hypot(*away.T), np.maximum(off - widths[2], 0)], axis=1)
    return gaps, np.stack([shift, np.full(len(cells), twist)], axis=1)
