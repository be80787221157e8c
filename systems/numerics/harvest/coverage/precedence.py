"""Crop precedence: which crop must be cut before a body gets to it, from paths alone.

**Rings of waiting.** The tail of a body swings out of a curve that is narrower than the header's
cutting radius, over slivers of crop that another combine cuts later. If combines would wait for
such crop in a ring, and so for ever, the one that waits for the least crop drives over it: this
crop is given up, and counted as crop under bodies, as long as its total is small. On request,
slivers that hold up combines elsewhere are given up too.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ..field.field import Field
from ..machines import CombineSize
from ..paths import MachinePath, TimedPath
from ..raster import cell_under, lattice
from ..turns.borders import CROP_CELL, StandingCrop
from .cut_ground import LEAST_PATCH, header_down

# Spacing of the stations for which precedence is computed [m].
SPACING = 1.0

# How far beyond the header's ends crop counts as cut, for cells on the border of two swaths [m].
BESIDE = 0.3

# Station at which a cell is cut that no combine cuts.
NEVER = 1e18

# Side of the cells that mark what a body drives over before its own header has cut it [m], and how
# many of them there are at most: the tail that swings out of a curve treads on strips that are
# narrower than the cells of the crop.
FINE = 0.2
MOST_CELLS = 5e6

# Largest share of the crop that bodies may drive over [-]. The audit, which looks closer, finds a
# quarter more, and allows a fifth of a percent.
MOST_UNDER_BODIES = 0.0015


class CropPrecedence(NamedTuple):
    """What each combine waits for.

    Attributes:
        needs: needs[m][n][i]: station that combine n must have passed before combine m is at
            station i of `stations[m]` [m]; 0 for none; never decreasing along the way.
        stations: stations[m], shape (S_m,) [m].
        crop_under_bodies: Area of crop that bodies drive over before it is cut, if all that other
            combines cut is cut in time, and of crop that is given up [m^2].
        given_up: Whether bodies drive over crop that others cut, without waiting for it.
    """

    needs: tuple[tuple[np.ndarray, ...], ...]
    stations: tuple[np.ndarray, ...]
    crop_under_bodies: float
    given_up: bool

    def needed_at(self, m: int, n: int, stations: np.ndarray) -> np.ndarray:
        """What combine n must have passed before combine m is at its stations, -inf for none.

        Args:
            m, n: Numbers of the combines.
            stations: Of combine m, shape (k,) [m].

        Returns:
            Shape (k,) [m].
        """
        # What is needed between two stations is stored at the first of them.
        before = np.searchsorted(self.stations[m], stations, side="right") - 1
        needed = self.needs[m][n]
        return np.where(needed > 0, needed, -np.inf)[np.maximum(before, 0)]


def find_precedence(
    field: Field, paths: tuple[MachinePath, ...], combine: CombineSize, *, slivers: float = 0.0
) -> CropPrecedence:
    """Crop precedence between paths.

    If several other combines cut what a body drives on, the one counts that cuts it after the
    shortest way. Crop that combines would wait for in a ring is given up, up to MOST_UNDER_BODIES.

    Args:
        field: The field.
        paths: Of the combines.
        combine: Each of them.
        slivers: Part of what MOST_UNDER_BODIES still allows after that for giving up patches
            smaller than LEAST_PATCH that hold up combines, the smallest first, no unit.
    """
    crop = StandingCrop(field.polygon)
    rows, columns = crop.cells.shape
    cut_at = np.full((len(paths), rows, columns), NEVER, dtype=np.float64)
    header = _header(combine.header_width / 2 + BESIDE, CROP_CELL)
    for n, path in enumerate(paths):
        _mark_cut(cut_at[n], crop.origin, CROP_CELL, *header_down(path, CROP_CELL / 2), header)
    given_up = np.zeros(cut_at.shape, dtype=np.bool_)
    every = tuple(path.stations_every(SPACING) for path in paths)
    box = _body(combine, CROP_CELL)

    fines = [path.stations_every(SPACING / 2) for path in paths]

    def needed_by(m: int) -> np.ndarray:
        needed = np.zeros((len(paths), len(fines[m])))
        ground = cut_at, crop.cells & ~given_up[m], crop.origin
        _needed(*ground, paths[m].pose_at(fines[m]), fines[m], m, box, needed)
        return needed

    def needs_of(m: int) -> tuple[np.ndarray, ...]:
        # What lies between two stations counts for the first of them.
        at = np.searchsorted(fines[m], every[m] + SPACING, side="right") - 1
        at = np.clip(at, 0, len(fines[m]) - 1)
        return tuple(np.maximum.accumulate(each)[at] for each in needed_by(m))

    def waited_for(m: int, begin: float, reached: np.ndarray) -> np.ndarray:
        # Numbers of the cells that it drives over from a station on if it does not wait there.
        fine = fines[m][fines[m] >= begin]
        marked = np.zeros(crop.cells.shape, dtype=np.bool_)
        ground = cut_at, crop.cells & ~given_up[m], crop.origin
        poses = paths[m].pose_at(fine)
        _mark_waited_for(*ground, poses, fine, m, box, reached, combine.length, marked)
        return np.flatnonzero(marked)

    most = MOST_UNDER_BODIES * crop.area / CROP_CELL**2
    needs = [needs_of(m) for m in range(len(paths))]
    while True:
        reached, blockers = _standstill(every, needs)
        held_up = {m: waited_for(m, reached[m], reached) for m in _ring(blockers)}
        if not held_up:
            break
        m = min(held_up, key=lambda each: len(held_up[each]))
        cells = held_up[m]
        if len(cells) == 0 or np.count_nonzero(given_up) + len(cells) > most:
            break
        given_up[m].ravel()[cells] = True
        needs[m] = needs_of(m)
    under = _trodden_area(paths, crop, cut_at, given_up, combine)
    if slivers > 0.0:
        found = []
        for m, fine in enumerate(fines):
            waits = fine[needed_by(m).any(axis=0)]
            begins = waits[np.diff(waits, prepend=-np.inf) > combine.length]
            found += [(m, waited_for(m, begin, np.full(len(paths), -1.0))) for begin in begins]
        left = slivers * (most - under / CROP_CELL**2)
        for m, cells in sorted(found, key=lambda each: len(each[1])):
            if len(cells) * CROP_CELL**2 < LEAST_PATCH and len(cells) <= left:
                given_up[m].ravel()[cells] = True
                left -= len(cells)
        needs = [needs_of(m) for m in range(len(paths))]
        under = _trodden_area(paths, crop, cut_at, given_up, combine)
    return CropPrecedence(tuple(needs), every, under, bool(given_up.any()))


def _standstill(
    stations: tuple[np.ndarray, ...], needs: Sequence[tuple[np.ndarray, ...]]
) -> tuple[np.ndarray, list[int]]:
    """How far combines get that wait for nothing but crop, shape (N,) [m], and what stops each.

    Args:
        stations, needs: See `CropPrecedence`.

    Returns:
        The stations; for each combine the number of the one that it waits for there, or -1.
    """
    reached = np.zeros(len(stations))
    blockers = [-1] * len(stations)
    moving = True
    while moving:
        moving = False
        for m, mine in enumerate(needs):
            at, blockers[m] = len(stations[m]) - 1, -1
            for n, needed in enumerate(mine):
                # The last station at which no more is needed than the other has driven.
                upto = int(np.searchsorted(needed, reached[n], side="right")) - 1
                if n != m and upto < at:
                    at, blockers[m] = upto, n
            if at >= 0 and stations[m][at] > reached[m]:
                reached[m], moving = stations[m][at], True
    return reached, blockers


def _ring(blockers: list[int]) -> list[int]:
    """Numbers of combines that wait for one another in a ring; empty if there is no ring.

    Args:
        blockers: Number of the combine that each waits for, or -1.
    """
    for first in range(len(blockers)):
        seen: list[int] = []
        m = first
        while m >= 0 and m not in seen:
            seen.append(m)
            m = blockers[m]
        if m >= 0:
            return seen[seen.index(m) :]
    return []


def _trodden_area(
    paths: tuple[MachinePath, ...],
    crop: StandingCrop,
    cut_at: np.ndarray,
    given_up: np.ndarray,
    combine: CombineSize,
) -> float:
    """Standing crop that bodies drive over without waiting for another combine to cut it.

    Args:
        paths: Of the combines.
        crop: What stands at first.
        cut_at: The station at which each combine cuts each of its cells, shape (N, rows, columns).
        given_up: Whether each drives over a cell that another cuts, shape (N, rows, columns).
        combine: Each of them.

    Returns:
        Its area [m^2].
    """
    size, shape = _fine_cells(crop)
    under = np.zeros(shape, dtype=np.bool_)
    header, box = _header(combine.header_width / 2 + size / 2, size), _body(combine, size)
    cuts = cut_at != NEVER
    cutters = cuts.sum(axis=0)
    for m, path in enumerate(paths):
        own = np.full(shape, np.inf, dtype=np.float32)
        _mark_cut(own, crop.origin, size, *header_down(path, size / 2), header)
        stands = crop.cells & ((cutters == cuts[m]) | given_up[m])
        stations = path.stations_every(size)
        _tread(own, stands, under, crop.origin, size, path.pose_at(stations), stations, box)
    return float(under.sum()) * size**2


def crop_under_bodies(field: Field, timed: Sequence[TimedPath], combine: CombineSize) -> float:
    """Area of crop that bodies drive over before it is cut, by the times of all combines [m^2].

    Args:
        field: The field.
        timed: Of all combines.
        combine: Each of them.
    """
    crop = StandingCrop(field.polygon)
    size, shape = _fine_cells(crop)
    cut, under = np.full(shape, np.inf, dtype=np.float32), np.zeros(shape, dtype=np.bool_)
    # Both reach half a cell too far, on the mean. Points on the edges of cells would miss some.
    header, inside = _header(combine.header_width / 2, size), 5e-3 * size
    rear, front = inside - combine.length, -combine.header_depth / 2 - inside
    box = lattice(rear, front, combine.width / 2 - inside, size)
    for each in timed:
        poses, stations = header_down(each.path, size / 2)
        _mark_cut(cut, crop.origin, size, poses, _arrivals(each, stations), header)
    for each in timed:
        stations = each.path.stations_every(size)
        poses, times = each.path.pose_at(stations), _arrivals(each, stations)
        _tread(cut, crop.cells, under, crop.origin, size, poses, times, box)
    return float(under.sum()) * size**2


def _arrivals(timed: TimedPath, stations: np.ndarray) -> np.ndarray:
    """Approximate times at which a machine comes to stations in order, shape (n,) [s]."""
    fine = np.unique(np.concatenate([timed.times, np.arange(timed.times[0], timed.end, 0.5)]))
    at, first = np.unique(timed.station_at(fine), return_index=True)
    return np.interp(stations, at, fine[first])


def _fine_cells(crop: StandingCrop) -> tuple[float, np.ndarray]:
    """Side of cells [m], and their rows and columns; none reaches beyond the cells of the crop."""
    size = max(FINE, math.sqrt(crop.cells.sum() * CROP_CELL**2 / MOST_CELLS))
    return size, np.floor(np.array(crop.cells.shape) * CROP_CELL / size).astype(int)


def _header(half: float, size: float) -> np.ndarray:
    """Points on the middle line of a header, half a cell apart at most, shape (n, 2) [m]."""
    return lattice(0.0, 0.0, half, 0.5 * size)


def _body(combine: CombineSize, size: float) -> np.ndarray:
    """Points on the body behind the header, about a cell's side apart, shape (n, 2) [m].

    Points nearer to its sides than half a cell would fall on cells that are mostly beside it.
    """
    front = -combine.header_depth / 2
    return lattice(-combine.length + size / 2, front - size / 2, (combine.width - size) / 2, size)


@compiled
def _mark_cut(cut_at, origin, size, poses, stations, points):
    """Mark when points of a header pass over cells."""
    rows, columns = cut_at.shape
    for k in range(len(poses)):
        c, s = math.cos(poses[k, 2]), math.sin(poses[k, 2])
        for point in points:
            row, column = cell_under(origin, size, poses[k], c, s, point)
            if 0 <= row < rows and 0 <= column < columns and stations[k] < cut_at[row, column]:
                cut_at[row, column] = stations[k]


@compiled
def _tread(cut_at, stands, under, origin, size, poses, stations, points):
    """Mark cells under a body whose crop stands and is cut later, if at all."""
    rows, columns = cut_at.shape
    for k in range(len(poses)):
        c, s = math.cos(poses[k, 2]), math.sin(poses[k, 2])
        for point in points:
            row, column = cell_under(origin, size, poses[k], c, s, point)
            inside = 0 <= row < rows and 0 <= column < columns
            if not inside or cut_at[row, column] <= stations[k]:
                continue
            if stands[cell_under(origin, CROP_CELL, poses[k], c, s, point)]:
                under[row, column] = True


@kernel
def _awaited(cut_at, crop, me, station, row, column):
    """The combine that a body awaits on a cell of crop that its own header has not cut by then.

    Returns:
        The number of the combine that cuts the cell after the shortest way, or -1 if none is
        awaited, and the station of that combine then [m].
    """
    machines, rows, columns = cut_at.shape
    best, when = -1, 1e17
    if row < 0 or row >= rows or column < 0 or column >= columns:
        return best, when
    if crop[row, column] and cut_at[me, row, column] > station:
        for n in range(machines):
            if n != me and cut_at[n, row, column] < when:
                best, when = n, cut_at[n, row, column]
    return best, when


@compiled
def _needed(cut_at, crop, origin, poses, stations, me, points, needed):
    for k in range(len(poses)):
        c, s = math.cos(poses[k, 2]), math.sin(poses[k, 2])
        for point in points:
            cell = cell_under(origin, CROP_CELL, poses[k], c, s, point)
            best, when = _awaited(cut_at, crop, me, stations[k], *cell)
            if best >= 0:
                needed[best, k] = max(needed[best, k], when)


@compiled
def _mark_waited_for(cut_at, crop, origin, poses, stations, me, points, reached, clear, marked):
    """Mark crop that a body would drive over if it stopped waiting, up to the next clear stretch.

    Args:
        cut_at, crop, origin: The ground.
        poses, stations: Of the body from where it waits, shapes (k, 3) and (k,).
        me: Its number.
        points: Of the body, shape (n, 2) [m].
        reached: Where all combines stand, shape (N,) [m].
        clear: Length of a stretch without any such crop that ends the marking [m].
        marked: Written, shape (rows, columns).
    """
    last = stations[0] if len(stations) else 0.0
    for k in range(len(poses)):
        if stations[k] > last + clear:
            break
        c, s = math.cos(poses[k, 2]), math.sin(poses[k, 2])
        for point in points:
            cell = cell_under(origin, CROP_CELL, poses[k], c, s, point)
            best, when = _awaited(cut_at, crop, me, stations[k], *cell)
            if best >= 0 and when > reached[best]:
                marked[cell] = True
                last = stations[k]


def can_finish(precedence: CropPrecedence) -> bool:
    """Whether all combines arrive if they wait for nothing but crop precedence."""
    _, blockers = _standstill(precedence.stations, precedence.needs)
    return all(n < 0 for n in blockers)
