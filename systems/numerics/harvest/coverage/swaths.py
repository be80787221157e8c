"""Swaths: the straights, all in one direction, in which the inside of a field is cut."""

import math
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.affinity import rotate
from shapely.geometry.base import BaseGeometry

from ..machines.combine import CombineSize
from ..paths.machine_path import MachinePath
from .loops import CLEAR

# Pieces of a strip that are smaller than this share of the header squared are left [-].
LEAST_PIECE = 0.02


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

    def path(self, work: int, *, back: bool) -> MachinePath:
        """The path from its first end to its second, or back.

        Args:
            work: Number of the piece of work.
            back: Whether it is driven from its second end to its first.
        """
        end = 0 if back else 1
        poses = np.array([self.pose(1 - end, outwards=False), self.pose(end, outwards=True)])
        poses[0, 2] = poses[1, 2]
        return MachinePath(poses, np.array([1]), np.array([True]), np.array([work]))


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
    # Bands of all parts in one grid where they overlap; apart otherwise.
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
    """The swath that is beside more than half of another one, on the left of who drives that.

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
    """Where the parts of a region lie across, joined where they overlap."""
    bounds = sorted((b[1], b[3]) for b in shapely.bounds(shapely.get_parts(region)))
    spans: list[tuple[float, float]] = []
    for low, high in bounds:
        if spans and low < spans[-1][1]:
            spans[-1] = (spans[-1][0], max(high, spans[-1][1]))
        else:
            spans.append((low, high))
    return spans


def _cells(pieces: list[tuple[int, float, float]]) -> list[int]:
    """Numbers of chains of pieces that have one neighbour each in the strip before and behind."""
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
