"""Where carts may drive, and when: a raster of crop, cut ground, and what is out of bounds."""

import math
from typing import NamedTuple

import numpy as np
import shapely

from ...compiled import compiled
from ..field.field import Field
from ..field.swept_cells import CropCells
from .others import NOBODY, Others

# Codes of cells without crop: one may drive there always, or never.
FREE, BARRED = -1, -2


class Ground(NamedTuple):
    """Square cells; row j, column i has its middle at corner + cell (i + 1/2, j + 1/2).

    Attributes:
        corner: Lower left corner, shape (2,) [m].
        cell: Side of a cell [m].
        code: FREE, BARRED, or the number of the combine that cuts it, shape (rows, columns).
        cut_at: Station of that combine from which on the cell is cut, same shape [m].
    """

    corner: np.ndarray
    cell: float
    code: np.ndarray
    cut_at: np.ndarray


class Traffic(NamedTuple):
    """Where the combines will be: each drives on along its path, as fast as it does.

    Attributes:
        starts: Where each path's samples begin in the arrays below, shape (N + 1,).
        stations: Of all paths, one after the other, shape (n,) [m].
        poses: x, y, theta at them, theta unwrapped, shape (n, 3).
        progress: Station of each combine, shape (N,) [m].
        waits: How long each waits before it drives on, shape (N,) [s].
        time: When that is [s].
        speed: Of the combines [m/s].
        size: Of a combine: half its header, half its body's width, its body's length, shape (3,)
            [m].
        others: The other carts, from `time` on.
    """

    starts: np.ndarray
    stations: np.ndarray
    poses: np.ndarray
    progress: np.ndarray
    waits: np.ndarray
    time: float
    speed: float
    size: np.ndarray
    others: Others = NOBODY


def stations_at(traffic: Traffic, combine: int, times: np.ndarray) -> np.ndarray:
    """As `station_at` for many times, shape (n,) [s] -> (n,) [m].

    Args:
        combine: Its number.
    """
    driven = np.maximum(times - traffic.time - traffic.waits[combine], 0.0) * traffic.speed
    last = traffic.stations[traffic.starts[combine + 1] - 1]
    return np.minimum(traffic.progress[combine] + driven, last)


@compiled
def station_at(traffic, combine, time):
    """Where a combine will be along its path at a time [s] -> [m].

    Args:
        traffic: The combines.
    """
    driven = max(time - traffic.time - traffic.waits[combine], 0.0) * traffic.speed
    last = traffic.stations[traffic.starts[combine + 1] - 1]
    return min(traffic.progress[combine] + driven, last)


@compiled
def pose_on_path(traffic, combine, station):
    """x, y, theta of a combine at a station of its path.

    Args:
        traffic: The combines.
    """
    low, high = traffic.starts[combine], traffic.starts[combine + 1]
    k = low + np.searchsorted(traffic.stations[low:high], station, side="right") - 1
    k = min(max(k, low), high - 2)
    step = traffic.stations[k + 1] - traffic.stations[k]
    share = min(max((station - traffic.stations[k]) / step, 0.0), 1.0) if step > 0 else 0.0
    a, b = traffic.poses[k], traffic.poses[k + 1]
    return (
        a[0] + share * (b[0] - a[0]),
        a[1] + share * (b[1] - a[1]),
        a[2] + share * (b[2] - a[2]),
    )


@compiled
def drivable(ground, traffic, x, y, time, early):
    """Whether there is no crop at a point at a time, and would not be so much earlier [s].

    Args:
        traffic: The combines.
        x: Of the point [m].
        y: Of the point [m].
        early: By how much sooner crop has to be gone [s].
    """
    i = int(np.floor((x - ground.corner[0]) / ground.cell))
    j = int(np.floor((y - ground.corner[1]) / ground.cell))
    rows, columns = ground.code.shape
    if i < 0 or j < 0 or i >= columns or j >= rows:
        return False
    code = ground.code[j, i]
    if code < 0:
        return code == FREE
    return ground.cut_at[j, i] <= station_at(traffic, code, max(time - early, traffic.time))


def barred_cells(ground: shapely.Geometry, corner: np.ndarray, cell: float, shape) -> np.ndarray:
    """Cells whose middle is not on some ground, shape (rows, columns).

    Args:
        corner: Of the raster, shape (2,) [m].
        cell: Its side [m].
    """
    rows, columns = shape
    x = corner[0] + cell * (np.arange(columns) + 0.5)
    y = corner[1] + cell * (np.arange(rows) + 0.5)
    shapely.prepare(ground)
    return ~shapely.contains_xy(ground, *np.meshgrid(x, y))


def ground_of(field: Field, cells: CropCells) -> Ground:
    """The raster of a field with its margin, from the cells in which its crop is cut.

    Crop that nobody cuts is never to be driven on.
    """
    around = math.ceil(field.margin / cells.size) + 2
    corner = cells.origin - around * cells.size
    code = np.where(cells.has_crop, np.where(cells.cut_by >= 0, cells.cut_by, BARRED), FREE)
    code = np.pad(code, around, constant_values=FREE).astype(np.int16)
    cut_at = np.pad(cells.cut_at, around, constant_values=np.inf)
    code[barred_cells(field.ground, corner, cells.size, code.shape)] = BARRED
    return Ground(corner, float(cells.size), code, cut_at)
