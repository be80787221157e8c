"""Swaths, the straights that cut the inside of a field: their layout, lands and order.

The order and the directions are found by annealing. A cart drives on the left of a combine, on
ground that is cut. So a swath is driven with crop on its left only where the way that this saves is
worth it, and runs of such swaths that fill much of a tank are avoided: a cart would have to come
shortly before each of them.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from shapely.affinity import rotate
from shapely.geometry.base import BaseGeometry

from ...compiled import compiled, kernel
from ..machines import CombineSize
from ..paths import MachinePath
from .loops import CLEAR

# Pieces of a strip that are smaller than this share of the header squared are left [-].
LEAST_PIECE = 0.02

# Number of annealing runs, steps of each run per swath, and the first and last temperatures [s].
TRIES = 10
STEPS = 1500
HOT, COLD = 40.0, 0.3

# Cost of filling a tank where no cart can come: nothing up to a part of the tank [-], beyond it a
# factor times the square of the excess [s]; a whole tank costs about as much as a stop for a cart.
UNTROUBLED = 0.4
FILLED = 300.0

# In place of the number of the swath on the left: no crop there, or crop that none of these cuts.
OPEN, STANDS = -1, -2


@dataclass(frozen=True, eq=False)
class Swath:
    """A straight of a header's middle from where the crop begins to where it ends.

    Attributes:
        ends: Shape (2, 2) [m].
        strip: Number of the strip, across all swaths of the direction.
        cell: Number of the cell that it belongs to: a chain of one-to-one neighbours.
    """

    ends: np.ndarray
    strip: int
    cell: int

    @property
    def length(self) -> float:
        """[m]."""
        return float(np.hypot(*(self.ends[1] - self.ends[0])))

    def pose(self, end: int, *, outwards: bool) -> np.ndarray:
        """x, y, theta at an end, driving out of the swath there or into it.

        Args:
            end: 0 or 1.
            outwards: Whether it drives out of the swath there.
        """
        along = self.ends[1] - self.ends[0]
        theta = math.atan2(along[1], along[0]) + (math.pi if end == 0 else 0.0)
        return np.array([*self.ends[end], theta if outwards else theta + math.pi])

    def path(self, *, back: bool) -> MachinePath:
        """The path from its first end to its second, or back.

        Args:
            back: Whether it is driven from its second end to its first.
        """
        end = 0 if back else 1
        poses = np.array([self.pose(1 - end, outwards=False), self.pose(end, outwards=True)])
        poses[0, 2] = poses[1, 2]
        return MachinePath.of(poses, cutting=True)


def lay_out_swaths(inside: BaseGeometry, direction: float, combine: CombineSize) -> list[Swath]:
    """Swaths that cover a region, strip by strip; each piece of a strip is a swath.

    Args:
        inside: What is left inside of the rounds.
        direction: Of the swaths [rad].
        combine: The combine.
    """
    width = combine.header_width
    clear = combine.header_depth / 2 + CLEAR
    found: list[tuple[int, float, float, float]] = []
    number = 0
    turned = rotate(inside, -direction, origin=(0, 0), use_radians=True)
    # Parts that overlap across the direction share one grid of bands; others have their own.
    for low, high in _spans(turned):
        count = max(1, math.ceil((high - low) / width - 0.01))
        spacing = (high - low) / count
        middles = low + spacing * (np.arange(count) + 0.5)
        x0, _, x1, _ = turned.bounds
        bands = [
            shapely.box(x0 - 1, float(y) - width / 2, x1 + 1, float(y) + width / 2) for y in middles
        ]
        pieces, which = shapely.get_parts(shapely.intersection(bands, turned), return_index=True)
        for piece, band in zip(pieces, which, strict=True):
            if piece.area < LEAST_PIECE * width**2:
                continue
            left, _, right, _ = piece.bounds
            found.append((number + int(band), float(middles[band]), left - clear, right + clear))
        # One number is left out: strips on both sides of a gap are no neighbours.
        number += count + 1
    cells = _cells([(strip, left, right) for strip, _, left, right in found])
    c, s = math.cos(direction), math.sin(direction)
    turn = np.array([[c, s], [-s, c]])
    return [
        Swath(np.array([[left, y], [right, y]]) @ turn, strip, cell)
        for (strip, y, left, right), cell in zip(found, cells, strict=True)
    ]


def left_neighbour(swaths: tuple[Swath, ...], number: int, *, back: bool) -> int | None:
    """The swath on the left of one that is driven, beside more than half of it; None for none.

    Args:
        swaths: All of a direction.
        number: Of the swath that is driven.
        back: Whether it is driven from its second end to its first.
    """
    swath = swaths[number]
    along = (swath.ends[1] - swath.ends[0]) / swath.length
    for other, beside in enumerate(swaths):
        if beside.strip == swath.strip + (-1 if back else 1):
            begin, end = (beside.ends - swath.ends[0]) @ along
            if min(end, swath.length) - max(begin, 0.0) > swath.length / 2:
                return other
    return None


def _spans(region: BaseGeometry) -> list[tuple[float, float]]:
    """Intervals in y that the parts of a region cover, merged where they overlap."""
    bounds = sorted((b[1], b[3]) for b in shapely.bounds(shapely.get_parts(region)))
    spans: list[tuple[float, float]] = []
    for low, high in bounds:
        if spans and low < spans[-1][1]:
            spans[-1] = (spans[-1][0], max(high, spans[-1][1]))
        else:
            spans.append((low, high))
    return spans


def _cells(pieces: list[tuple[int, float, float]]) -> list[int]:
    """The chain that each piece belongs to: in it, successive pieces are one-to-one neighbours."""
    above: list[list[int]] = [[] for _ in pieces]
    below: list[list[int]] = [[] for _ in pieces]
    for a, (strip, left, right) in enumerate(pieces):
        for b, (other, left_b, right_b) in enumerate(pieces):
            if other == strip + 1 and left < right_b and left_b < right:
                above[a].append(b)
                below[b].append(a)
    cells = [-1] * len(pieces)
    count = 0
    for a in range(len(pieces)):
        before = below[a]
        if len(before) == 1 and len(above[before[0]]) == 1:
            cells[a] = cells[before[0]]
        else:
            cells[a], count = count, count + 1
    return cells


def chain_swaths(swaths: tuple[Swath, ...]) -> list[int]:
    """Numbers of all swaths, neighbours one after the other: cell by cell, strip by strip."""
    cells: dict[int, list[int]] = {}
    for number, swath in enumerate(swaths):
        cells.setdefault(swath.cell, []).append(number)
    for members in cells.values():
        members.sort(key=lambda number: swaths[number].strip)
    middles = np.array([swath.ends.mean(axis=0) for swath in swaths])
    order: list[int] = []
    left = dict(cells)
    while left:
        if not order:
            # The cell of the outermost strip.
            cell = min(left, key=lambda each: swaths[left[each][0]].strip)
            members = left.pop(cell)
        else:
            at = middles[order[-1]]
            cell = min(
                left,
                key=lambda each: min(np.hypot(*(middles[left[each][k]] - at)) for k in (0, -1)),
            )
            members = left.pop(cell)
            first, last = middles[members[0]], middles[members[-1]]
            if np.hypot(*(last - at)) < np.hypot(*(first - at)):
                members = members[::-1]
        order.extend(members)
    return order


def split_chain(times: np.ndarray, budgets: np.ndarray) -> list[slice]:
    """Split a chain of tasks into parts, in order, so that the last ends as early as possible.

    Args:
        times: Of the tasks for the worker of each part, shape (count, m) [s].
        budgets: When the worker of each part begins, shape (count,) [s].
    """
    count = len(budgets)
    low, high = float(budgets.max()), float(budgets.max() + times.max(axis=0).sum())
    ends: list[int] = []
    for _ in range(50):
        middle = (low + high) / 2
        trial = _fill(times, budgets, middle)
        if trial is None:
            low = middle
        else:
            high, ends = middle, trial
    if not ends:
        ends = [times.shape[1]] * count
    begins = [0, *ends[:-1]]
    return [slice(begin, end) for begin, end in zip(begins, ends, strict=True)]


def _fill(times: np.ndarray, budgets: np.ndarray, deadline: float) -> list[int] | None:
    ends, at, last = [], 0, times.shape[1]
    for own, begin in zip(times, budgets, strict=True):
        clock = begin
        while at < last and clock + own[at] <= deadline:
            clock += own[at]
            at += 1
        ends.append(at)
    return ends if at == last else None


class SwathTimes(NamedTuple):
    """Times between swaths; swath i driven to its second end is node 2 i, back it is 2 i + 1.

    Attributes:
        between: From the end of a node to the beginning of another, shape (2 m, 2 m) [s].
        first: From where the combine is to the beginning of each node, shape (2 m,) [s].
        left: Number of the swath on the left of each node, OPEN or STANDS, shape (2 m,).
        closed: Cost of driving each node while crop stands on its left, shape (2 m,) [s].
        fill: Part of a tank that each swath fills, shape (m,) [-].
    """

    between: np.ndarray
    first: np.ndarray
    left: np.ndarray
    closed: np.ndarray
    fill: np.ndarray


def order_swaths(times: SwathTimes, seed: int) -> list[int]:
    """Nodes in the best order found, by the time between swaths and the cost of closed ones.

    A swath is closed while crop stands on its left; a run of them that fills much of a tank costs
    more than each by itself.

    Args:
        times: Of m swaths.
        seed: Of the annealing.
    """
    count = len(times.first) // 2
    if count == 0:
        return []
    random, least, found = np.random.default_rng(seed), np.inf, []
    for _ in range(TRIES):
        order = 2 * np.arange(count)
        best = np.empty_like(order)
        total = _anneal(order, best, times, random.random((STEPS * count, 5)), HOT, COLD)
        if total < least:
            least, found = total, best.tolist()
    return found


@kernel
def _trouble(filled):
    """Cost of filling a part of a tank where no cart can come [s]."""
    return FILLED * max(filled - UNTROUBLED, 0.0) ** 2


@kernel
def _total(order, times, done):
    total, filled = times.first[order[0]], 0.0
    done[:] = False
    for k in range(len(order)):
        node = order[k]
        if k > 0:
            total += times.between[order[k - 1], node]
        left = times.left[node]
        if left == STANDS or (left != OPEN and not done[left]):
            total += times.closed[node]
            total -= _trouble(filled)
            filled += times.fill[node // 2]
            total += _trouble(filled)
        else:
            filled = 0.0
        done[node // 2] = True
    return total


@compiled
def _anneal(order, best, times, draws, hot, cold):
    """Write the best order found into `best`, and return its cost [s]."""
    count, steps = len(order), len(draws)
    done = np.zeros(count, dtype=np.bool_)
    now = _total(order, times, done)
    best[:] = order
    least = now
    trial = order.copy()
    for step in range(steps):
        heat = hot * (cold / hot) ** (step / steps)
        trial[:] = order
        kind, flip = int(4 * draws[step, 0]), int(2 * draws[step, 3])
        i, j = int(count * draws[step, 1]), int(count * draws[step, 2])
        if i > j:
            i, j = j, i
        if kind == 0:
            trial[i] ^= 1
        elif kind == 1:
            # A run of swaths is driven the other way round.
            for k in range(i, j + 1):
                trial[k] = order[i + j - k] ^ 1
        elif kind == 2:
            # One swath is moved elsewhere, reversed or not.
            moved = order[i] ^ flip
            for k in range(i, j):
                trial[k] = order[k + 1]
            trial[j] = moved
        else:
            moved = order[j] ^ flip
            for k in range(i, j):
                trial[k + 1] = order[k]
            trial[i] = moved
        time = _total(trial, times, done)
        if time <= now or draws[step, 4] < math.exp((now - time) / heat):
            order[:] = trial
            now = time
            if now < least:
                least = now
                best[:] = order
    return least
