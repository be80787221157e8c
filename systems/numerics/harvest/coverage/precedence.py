"""Crop precedence: what must be cut before a body is somewhere, told from paths alone."""

import math
from typing import NamedTuple

import numpy as np

from ...compiled import compiled
from ..field.field import Field
from ..machines.combine import Combine
from ..paths.machine_path import MachinePath
from ..turns.standing_crop import CELL, StandingCrop

# Spacing of the stations for which precedence is told [m].
SPACING = 1.0

# How far beyond the header's ends crop counts as cut, for cells on the border of two swaths [m].
BESIDE = 0.3

# Cut by nobody.
NEVER = 1e18


class CropPrecedence(NamedTuple):
    """What each combine waits for.

    Attributes:
        needs: needs[m][n][i]: station that combine n must have passed before combine m is at
            station i of `stations[m]` [m]; 0 where nothing; never decreasing along the way.
        stations: stations[m], shape (S_m,) [m].
        crop_under_bodies: Area over which bodies drive before anybody has cut it [m^2].
    """

    needs: tuple[tuple[np.ndarray, ...], ...]
    stations: tuple[np.ndarray, ...]
    crop_under_bodies: float

    def needed_at(self, m: int, n: int, stations: np.ndarray) -> np.ndarray:
        """The station that combine n must have passed before combine m is at others, -inf for none.

        Args:
            m, n: Numbers of the combines.
            stations: Of combine m, shape (k,) [m].

        Returns:
            Shape (k,) [m].
        """
        # What is needed up to a station is told at the one before it.
        before = np.searchsorted(self.stations[m], stations, side="right") - 1
        needed = self.needs[m][n]
        return np.where(needed > 0, needed, -np.inf)[np.maximum(before, 0)]


def find_precedence(
    field: Field, paths: tuple[MachinePath, ...], combine: Combine
) -> CropPrecedence:
    """Crop precedence between paths.

    Where more than one other combine cuts what a body drives on, the one counts that has cut it
    after the least way.

    Args:
        field: The field.
        paths: Of the combines.
        combine: Each of them.
    """
    crop = StandingCrop(field.polygon)
    rows, columns = crop.cells.shape
    cut_at = np.full((len(paths), rows, columns), NEVER, dtype=np.float64)
    half = combine.header_width / 2 + BESIDE
    fine = 0.25
    for n, path in enumerate(paths):
        stations = path.stations_every(fine)
        poses = path.pose_at(stations)
        down = path.cutting[path.piece_at(stations)]
        _cut(cut_at[n], crop.origin, poses[down], stations[down], half, combine.header_depth / 2)
    under = np.zeros((rows, columns), dtype=np.bool_)
    every, needs = [], []
    # The body behind the header; points nearer to its sides than half a cell would tell of cells
    # that are mostly beside it.
    half_cell = CELL / 2
    box = np.array(
        [
            -combine.length + half_cell,
            -combine.header_depth / 2 - half_cell,
            combine.width / 2 - half_cell,
        ]
    )
    for m, path in enumerate(paths):
        stations = path.stations_every(SPACING)
        every.append(stations)
        # What lies between two stations counts for the first of them.
        fine_stations = path.stations_every(SPACING / 2)
        needed = np.zeros((len(paths), len(fine_stations)))
        _needed(
            cut_at,
            crop.cells,
            under,
            crop.origin,
            path.pose_at(fine_stations),
            fine_stations,
            m,
            box,
            needed,
        )
        mine = []
        for n in range(len(paths)):
            ahead = np.maximum.accumulate(needed[n])
            at = np.searchsorted(fine_stations, stations + SPACING, side="right") - 1
            mine.append(ahead[np.clip(at, 0, len(ahead) - 1)])
        needs.append(tuple(mine))
    return CropPrecedence(tuple(needs), tuple(every), float(under.sum()) * CELL**2)


@compiled
def _cut(cut_at, origin, poses, stations, half, ahead_half):
    """Mark when the header passes over cells; those before its middle count as it comes."""
    rows, columns = cut_at.shape
    across = math.ceil(2 * half / (0.5 * CELL))
    for k in range(len(poses)):
        c, s = math.cos(poses[k, 2]), math.sin(poses[k, 2])
        for i in range(across + 1):
            side = -half + 2 * half * i / across
            x, y = poses[k, 0] - s * side, poses[k, 1] + c * side
            column = math.floor((x - origin[0]) / CELL)
            row = math.floor((y - origin[1]) / CELL)
            if 0 <= row < rows and 0 <= column < columns and stations[k] < cut_at[row, column]:
                cut_at[row, column] = stations[k]


@compiled
def _needed(cut_at, crop, under, origin, poses, stations, me, box, needed):
    machines, rows, columns = cut_at.shape
    rear, front, half = box
    along = math.ceil((front - rear) / CELL)
    across = math.ceil(2 * half / CELL)
    for k in range(len(poses)):
        c, s = math.cos(poses[k, 2]), math.sin(poses[k, 2])
        for i in range(along + 1):
            ahead = rear + (front - rear) * i / along
            for j in range(across + 1):
                side = -half + 2 * half * j / across
                x = poses[k, 0] + c * ahead - s * side
                y = poses[k, 1] + s * ahead + c * side
                column = math.floor((x - origin[0]) / CELL)
                row = math.floor((y - origin[1]) / CELL)
                if row < 0 or row >= rows or column < 0 or column >= columns:
                    continue
                if not crop[row, column] or cut_at[me, row, column] <= stations[k]:
                    continue
                best, when = -1, 1e17
                for n in range(machines):
                    if n != me and cut_at[n, row, column] < when:
                        best, when = n, cut_at[n, row, column]
                if best < 0:
                    under[row, column] = True
                else:
                    needed[best, k] = max(needed[best, k], when)


def can_finish(precedence: CropPrecedence) -> bool:
    """Whether combines that wait for nothing but their precedence all arrive."""
    stations, needs = precedence.stations, precedence.needs
    reached = [0.0] * len(stations)
    moving = True
    while moving:
        moving = False
        for m, mine in enumerate(needs):
            at = len(stations[m]) - 1
            for n, needed in enumerate(mine):
                if n != m:
                    # The last station at which no more is needed than the other has driven.
                    upto = int(np.searchsorted(needed, reached[n], side="right")) - 1
                    at = min(at, upto)
            if at >= 0 and stations[m][at] > reached[m]:
                reached[m], moving = float(stations[m][at]), True
    return all(reached[m] >= each[-1] for m, each in enumerate(stations))
