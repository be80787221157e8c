"""Which piece of whose path cuts which cell of a field."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...compiled import compiled
from ...geometry.world import World

# Of a bar's end, so that rounding leaves no cells between two rows [m].
OVERLAP = 1e-6


@dataclass(frozen=True, eq=False)
class CropCells:
    """A field in square cells, each cut as a whole when the header passes its middle.

    Attributes:
        origin: Corner of the cell [0, 0], shape (2,) [m].
        size: Side of a cell [m].
        crop_area: Crop in each cell, 0 outside of the field; shape (rows, columns) [m^2].
        cut_by: Number of the combine that cuts it; -1 if none does, or there is no crop;
            shape (rows, columns).
        cut_at: Station of that combine, infinite where there is none; shape
            (rows, columns) [m].
    """

    origin: np.ndarray
    size: float
    crop_area: np.ndarray
    cut_by: np.ndarray
    cut_at: np.ndarray

    @property
    def has_crop(self) -> np.ndarray:
        """Where crop grows, shape (rows, columns)."""
        return self.crop_area > 0

    def standing(self, progress: np.ndarray) -> np.ndarray:
        """Where crop stands when combines are at stations, shape (N,) -> (rows, columns).

        Args:
            progress: Stations of the combines, shape (N,) [m].
        """
        reached = np.append(np.asarray(progress, dtype=float), -np.inf)[self.cut_by]
        return self.has_crop & (reached < self.cut_at)

    def cell_of(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows and columns of points, clipped, and whether they are on the grid; (..., 2)."""
        number = np.floor((np.asarray(points) - self.origin) / self.size).astype(int)
        column, row = number[..., 0], number[..., 1]
        rows, columns = self.crop_area.shape
        on = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        return np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1), on

    def middles(self) -> tuple[np.ndarray, np.ndarray]:
        """x of the columns and y of the rows [m]."""
        rows, columns = self.crop_area.shape
        x = self.origin[0] + self.size * (np.arange(columns) + 0.5)
        return x, self.origin[1] + self.size * (np.arange(rows) + 0.5)


def bare_cells(world: World, size: float) -> CropCells:
    """Cells of which none is cut; the crop's area is spread evenly over those inside.

    Args:
        world: Where the crop grows.
        size: Side of a cell, which is made smaller to fit the width [m].
    """
    low, high = world.bounds[:2], world.bounds[2:]
    columns = max(1, int(np.ceil((high[0] - low[0]) / size - 1e-9)))
    size = float((high[0] - low[0]) / columns)
    rows = max(1, int(np.ceil((high[1] - low[1]) / size - 1e-9)))
    edges = np.concatenate([np.hstack([r, np.roll(r, -1, axis=0)]) for r in world.rings])
    inside = _fill(edges, low, size, rows, columns)
    area = world.free_area / max(1, int(inside.sum()))
    return CropCells(
        low,
        size,
        np.where(inside, area, 0.0),
        np.full((rows, columns), -1),
        np.full((rows, columns), np.inf),
    )


@dataclass(frozen=True, eq=False)
class Sweeps:
    """Pieces of paths in the order in which they are driven.

    Attributes:
        begins: Pose at which each begins: x, y, theta; shape (n, 3).
        ends: The same where it ends; shape (n, 3).
        stations: Where it begins and ends, shape (n, 2) [m].
        who: Number of the combine, shape (n,).
    """

    begins: np.ndarray
    ends: np.ndarray
    stations: np.ndarray
    who: np.ndarray


def cut_cells(cells: CropCells, sweeps: Sweeps, header: float) -> tuple[CropCells, np.ndarray]:
    """Cut cells by headers that sweep over them.

    A cell is cut where the header's bar moves forwards across its middle, by whoever comes first.

    Returns:
        The cells, and the area newly cut on each piece, shape (n,) [m^2].
    """
    after = CropCells(
        cells.origin, cells.size, cells.crop_area, cells.cut_by.copy(), cells.cut_at.copy()
    )
    return after, cut_cells_in_place(after, sweeps, header)


def cut_cells_in_place(cells: CropCells, sweeps: Sweeps, header: float) -> np.ndarray:
    """For the rest see `cut_cells`; writing into the cells' own arrays."""
    areas = np.zeros(len(sweeps.who))
    _sweep(
        sweeps.begins,
        sweeps.ends,
        sweeps.stations,
        sweeps.who.astype(np.int64),
        header / 2 + OVERLAP,
        cells.origin,
        cells.size,
        cells.crop_area,
        cells.cut_by,
        cells.cut_at,
        areas,
    )
    return areas


def join_sweeps(parts: Sequence[Sweeps]) -> Sweeps:
    """Several, one after the other."""
    return Sweeps(
        np.concatenate([part.begins for part in parts]),
        np.concatenate([part.ends for part in parts]),
        np.concatenate([part.stations for part in parts]),
        np.concatenate([part.who for part in parts]),
    )


@compiled
def _fill(edges, low, size, rows, columns):
    """Cells whose middles lie inside of rings, by the crossings of each row."""
    inside = np.zeros((rows, columns), dtype=np.bool_)
    for row in range(rows):
        y = low[1] + size * (row + 0.5)
        for k in range(len(edges)):
            x0, y0, x1, y1 = edges[k, 0], edges[k, 1], edges[k, 2], edges[k, 3]
            if (y0 <= y) == (y1 <= y):
                continue
            x = x0 + (y - y0) * (x1 - x0) / (y1 - y0)
            first = max(0, int(np.ceil((x - low[0]) / size - 0.5)))
            for column in range(first, columns):
                inside[row, column] = not inside[row, column]
    return inside


@compiled
def _sweep(begins, ends, stations, who, half, origin, size, crop, cut_by, cut_at, areas):
    rows, columns = crop.shape
    for k in range(len(who)):
        x0, y0, a0 = begins[k]
        x1, y1, a1 = ends[k]
        c0, s0, c1, s1 = np.cos(a0), np.sin(a0), np.cos(a1), np.sin(a1)
        wide = max(abs(s0), abs(s1), abs(np.sin((a0 + a1) / 2))) * half
        high = max(abs(c0), abs(c1), abs(np.cos((a0 + a1) / 2))) * half
        left = int(np.floor((min(x0, x1) - wide - origin[0]) / size - 0.5))
        right = int(np.ceil((max(x0, x1) + wide - origin[0]) / size - 0.5))
        bottom = int(np.floor((min(y0, y1) - high - origin[1]) / size - 0.5))
        top = int(np.ceil((max(y0, y1) + high - origin[1]) / size - 0.5))
        for row in range(max(0, bottom), min(rows, top + 1)):
            y = origin[1] + size * (row + 0.5)
            for column in range(max(0, left), min(columns, right + 1)):
                if crop[row, column] == 0.0 or cut_by[row, column] >= 0:
                    continue
                x = origin[0] + size * (column + 0.5)
                ahead0 = (x - x0) * c0 + (y - y0) * s0
                ahead1 = (x - x1) * c1 + (y - y1) * s1
                if ahead0 < 0.0 or ahead1 > 0.0 or ahead0 == ahead1:
                    continue
                part = ahead0 / (ahead0 - ahead1)
                beside0 = (y - y0) * c0 - (x - x0) * s0
                beside1 = (y - y1) * c1 - (x - x1) * s1
                if abs(beside0 + part * (beside1 - beside0)) > half:
                    continue
                cut_by[row, column] = who[k]
                cut_at[row, column] = stations[k, 0] + part * (stations[k, 1] - stations[k, 0])
                areas[k] += crop[row, column]
