"""When each place of the ground is cut, and from when on a cart may stand on it.

The ground is divided into square cells, each represented by its middle. A look-up grows the outline
by half the diagonal of a cell, so that no part of it lies on a cell that was not checked.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from scipy import ndimage

from ...compiled import compiled, kernel
from ..field.field import Field
from ..machines import CombineSize
from ..paths import TimedPath, runs_of
from ..raster import cells_inside

# Side of a cell [m].
CELL = 0.5
# How far a cell reaches from its middle [m].
REACH = CELL / math.sqrt(2.0)
# Spacing of the places that are looked up under an outline: less than the width of anything that
# stays uncut, and of an obstacle with the gap round it [m].
LOOKS = 0.9
# What rounding may add to the number of a cell.
EDGE = 1e-6
# Largest distance between the poses of a header between which its strip is marked [m].
STEP = 0.5
# Least distance from a cart to an obstacle [m].
GAP = 0.5


class CutTimes(NamedTuple):
    """When the ground is cut, and by whom.

    Attributes:
        times: Of the first header over each cell, infinite where crop stays, minus infinity where
            there is none; shape (rows, columns) [s].
        cutter: Number of that combine, -1 for none; shape (rows, columns).
        corner: x, y of the corner of the first cell, shape (2,) [m].
        slivers: Cells of narrow strips that no header covers, numbered row by row, shape (s,).
    """

    times: np.ndarray
    cutter: np.ndarray
    corner: np.ndarray
    slivers: np.ndarray


class OpenGround(NamedTuple):
    """When each cell opens to carts.

    Attributes:
        times: When it was cut; minus infinity where there never was crop, infinite where crop
            stays, in and near obstacles and beyond the margin; shape (rows, columns) [s].
        corner: x, y of the corner of the first cell, shape (2,) [m].
    """

    times: np.ndarray
    corner: np.ndarray


def cut_times(
    field: Field,
    combine: CombineSize,
    plans: Sequence[TimedPath],
    before: CutTimes | None = None,
    since: float = 0.0,
) -> CutTimes:
    """Compute when each place of a field is cut, and by whom.

    Crop that stays in strips narrower than three cells counts as cut with what is beside it.

    Args:
        field: The field, whose margin is covered too.
        combine: The size of the combines.
        plans: Of all combines.
        before: For whole plans on the same paths, with the same times until `since`.
        since: The time until which plans are the same [s].
    """
    low_x, low_y, high_x, high_y = field.ground.bounds
    corner = np.array([low_x - 2 * CELL, low_y - 2 * CELL])
    shape = (
        math.ceil((high_y - corner[1]) / CELL) + 2,
        math.ceil((high_x - corner[0]) / CELL) + 2,
    )
    if before is None or since <= 0.0:
        crop = cells_inside(field.polygon, corner, CELL, shape)
        times = np.where(crop, np.inf, -np.inf)
        cutter = np.full(shape, -1, dtype=np.int16)
    else:
        crop = before.times > -np.inf
        later = before.times > since
        times = np.where(later, np.inf, before.times)
        cutter = np.where(later, np.int16(-1), before.cutter)
    for number, plan in enumerate(plans):
        path = plan.path
        for first, last in runs_of(path.cutting):
            begin, end = path.stations[first], path.stations[last]
            if before is not None and float(plan.station_at(since)) > end + STEP:
                continue
            count = max(1, math.ceil((end - begin) / STEP))
            stations = np.linspace(begin, end, count + 1)
            _mark_strip(
                times,
                cutter,
                number,
                path.pose_at(stations),
                _passing_times(plan, stations),
                corner,
                combine.header_width / 2 + 1e-6,
                combine.header_depth / 2,
            )
    slivers = before.slivers if before else _slivers_of(crop & np.isinf(times))
    _close_slivers(times, cutter, slivers)
    return CutTimes(times, cutter, corner, slivers)


def _slivers_of(left: np.ndarray) -> np.ndarray:
    """Numbers, row by row, of cells in strips of remaining crop narrower than three cells."""
    wide = np.asarray(ndimage.binary_opening(left, np.ones((3, 3), dtype=bool)))
    return np.flatnonzero(left & np.logical_not(wide))


@kernel
def _close_slivers(times, cutter, slivers):
    """Give each sliver the latest time at which a cell within two cells of it is cut."""
    rows, columns = times.shape
    for number in slivers:
        row, column = number // columns, number % columns
        latest = -np.inf
        for i in range(max(row - 2, 0), min(row + 3, rows)):
            for j in range(max(column - 2, 0), min(column + 3, columns)):
                if cutter[i, j] >= 0:
                    latest = max(latest, times[i, j])
        times[row, column] = latest if latest > -np.inf else np.inf


def free_cells(field: Field, cut: CutTimes) -> np.ndarray:
    """Cells on which carts may be at some time, shape (rows, columns)."""
    free = field.ground
    if field.obstacles:
        free = free.difference(shapely.union_all([each.buffer(GAP) for each in field.obstacles]))
    return cells_inside(free, cut.corner, CELL, cut.times.shape)


def opened(free: np.ndarray, cut: CutTimes) -> OpenGround:
    """When cells open to carts, which some of them never do.

    Args:
        free: Cells on which they may be at some time, shape (rows, columns).
        cut: When the ground is cut.
    """
    return OpenGround(np.where(free, cut.times, np.inf), cut.corner)


def _passing_times(plan: TimedPath, stations: np.ndarray) -> np.ndarray:
    """When a machine first is at each station, infinite if it never is; shape (n,) [s]."""
    # While the speed changes, the station is quadratic in time: samples are fine enough to be
    # interpolated linearly.
    fine = np.unique(np.concatenate([plan.times, np.arange(plan.times[0], plan.times[-1], 0.5)]))
    ways = plan.station_at(fine)
    first = np.concatenate([[True], np.diff(ways) > 1e-9])
    return np.interp(stations - 1e-6, ways[first], fine[first], right=np.inf)


@kernel
def _mark_strip(times, cutter, number, poses, passed, corner, half, depth):
    """Mark the cells that a header covers, with the moment at which its front is over them."""
    rows, columns = times.shape
    far = half + depth + STEP
    for k in range(len(poses) - 1):
        x, y, theta = poses[k]
        c, s = math.cos(theta), math.sin(theta)
        after_x, after_y, after = poses[k + 1]
        after_c, after_s = math.cos(after), math.sin(after)
        wide = abs(s) * half + abs(c) * (depth + STEP) + STEP
        high = abs(c) * half + abs(s) * (depth + STEP) + STEP
        wide, high = min(wide, far), min(high, far)
        for row in range(
            max(0, int((y - high - corner[1]) / CELL)),
            min(rows, int((y + high - corner[1]) / CELL) + 1),
        ):
            cell_y = corner[1] + (row + 0.5) * CELL
            for column in range(
                max(0, int((x - wide - corner[0]) / CELL)),
                min(columns, int((x + wide - corner[0]) / CELL) + 1),
            ):
                if times[row, column] <= passed[k + 1]:
                    continue
                cell_x = corner[0] + (column + 0.5) * CELL
                ahead = c * (cell_x - x) + s * (cell_y - y)
                beyond = after_c * (cell_x - after_x) + after_s * (cell_y - after_y)
                aside = c * (cell_y - y) - s * (cell_x - x)
                if ahead >= -depth and beyond <= depth and abs(aside) <= half:
                    times[row, column] = passed[k + 1]
                    cutter[row, column] = number


@kernel
def opens(ground, box, x, y, theta):
    """When the ground under a box at a pose is open [s].

    Args:
        ground: OpenGround.
        box: Rear, front and half width in the frame of its pose [m].
        x, y, theta: Its pose [m], [m], [rad].
    """
    times, corner = ground
    rows, columns = times.shape
    c, s = math.cos(theta) / CELL, math.sin(theta) / CELL
    rear, front, half = box[0] - REACH, box[1] + REACH, box[2] + REACH
    along = math.ceil((front - rear) / LOOKS)
    across = math.ceil(2 * half / LOOKS)
    # Column and row of the first place, and the steps from one to the next ahead and to the left.
    column = (x - corner[0]) / CELL + c * rear + s * half
    row = (y - corner[1]) / CELL + s * rear - c * half
    ahead, aside = (front - rear) / along, 2 * half / across
    # If all four corners are on the grid, so is every place between them.
    for i, j in ((0, 0), (along, 0), (0, across), (along, across)):
        at_column = column + c * ahead * i - s * aside * j
        at_row = row + s * ahead * i + c * aside * j
        if not (0.0 <= at_row < rows - EDGE and 0.0 <= at_column < columns - EDGE):
            return np.inf
    latest = -np.inf
    for i in range(along + 1):
        first_column, first_row = column + c * ahead * i, row + s * ahead * i
        for j in range(across + 1):
            at_row, at_column = first_row + c * aside * j, first_column - s * aside * j
            latest = max(latest, times[int(at_row), int(at_column)])
        if latest == np.inf:
            return latest
    return latest


@compiled
def opens_along(ground, box, poses):
    """When the ground under a box is open, for each of some poses, shape (n, 3) -> (n,) [s]."""
    found = np.empty(len(poses))
    for k in range(len(poses)):
        found[k] = opens(ground, box, poses[k, 0], poses[k, 1], poses[k, 2])
    return found
