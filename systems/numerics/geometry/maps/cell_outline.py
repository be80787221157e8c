"""The exact outline of a set of cells: one closed chain along cell sides for each ring."""

from dataclasses import dataclass

import numpy as np
from numba import njit


@dataclass(frozen=True, eq=False)
class CellOutline:
    """Rings of lattice corners with the region on the left: its rim, then its holes.

    Where two cells of the region share only a corner, two rings, or two turns of one ring, meet.
    Such a corner is `pinched`. Every ring turns left there, so that the cells that are not in the
    region stay connected across it.

    Attributes:
        corners: [column, row] in cell units, ring after ring, shape (n, 2).
        pinched: Shape (n,).
        starts: Where each ring starts in `corners`, and their end, shape (rings + 1,).
    """

    corners: np.ndarray
    pinched: np.ndarray
    starts: np.ndarray

    @property
    def rings(self) -> list[np.ndarray]:
        """Corners of each ring, shape (m, 2)."""
        return np.split(self.corners, self.starts[1:-1])


def trace_cells(inside: np.ndarray) -> CellOutline:
    """Follow the sides between cells of a region and others.

    Args:
        inside: True for the cells of the region, shape (rows, columns); False in the outermost
            rows and columns.
    """
    around = [inside[:-1, :-1], inside[:-1, 1:], inside[1:, :-1], inside[1:, 1:]]
    odd = np.logical_xor.reduce(around)
    diagonal = (around[0] == around[3]) & (around[1] == around[2]) & (around[0] != around[1])
    count = int(odd.sum() + 2 * diagonal.sum())
    corners = np.empty((count, 2), dtype=np.int64)
    pinched = np.empty(count, dtype=np.bool_)
    starts = np.zeros(count // 4 + 1, dtype=np.int64)
    rings = _trace(np.ascontiguousarray(inside), corners, pinched, starts)
    return CellOutline(corners.astype(float), pinched, starts[: rings + 1].copy())


def without_pinches(outline: CellOutline, leg: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut the region's tip off at every pinched corner, and offer more places for a vertex.

    The cut joins the points `leg` before and after the corner: what meets there diagonally is
    joined by a bridge 2^0.5 `leg` wide. The points half a cell from either end of a side are
    added: an oblique wall runs through those, not through the corners of its stairs.

    Args:
        outline: As traced.
        leg: In (0, 0.5] [cells].

    Returns:
        points: Corners and added points in order along the rings, shape (n, 2) [cells].
        on_ring: False for the pinched corners, which are now beside the ring, shape (n,).
        starts: Where each ring starts in `points`, and their end, shape (rings + 1,).
    """
    following = np.concatenate([np.roll(np.arange(a, b), -1) for a, b in _spans(outline.starts)])
    here, there = outline.corners, outline.corners[following]
    length = np.abs(there - here).sum(axis=1)
    along = (there - here) / length[:, None]
    leaves, meets = outline.pinched, outline.pinched[following]
    # Up to five points along each side; where two coincide, only the first is kept.
    half = np.full(len(here), 0.5)
    steps = np.stack([0 * half, leg + 0 * half, half, length - half, length - leg], axis=1)
    used = np.stack(
        [
            np.ones(len(here), dtype=bool),
            leaves & (leg < 0.5),
            np.ones(len(here), dtype=bool),
            length > 1,
            meets & (leg < 0.5),
        ],
        axis=1,
    )
    points = here[:, None] + steps[:, :, None] * along[:, None]
    on_ring = np.ones(used.shape, dtype=bool)
    on_ring[:, 0] = ~leaves
    ends = np.concatenate([[0], np.cumsum(used.sum(axis=1))])
    return points[used], on_ring[used], ends[outline.starts]


def _spans(starts: np.ndarray) -> list[tuple[int, int]]:
    return list(zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True))


@njit(cache=True)
def _trace(inside, corners, pinched, starts):
    """Write the rings, each from its first side that runs east; return their number."""
    rows, columns = inside.shape
    seen = np.zeros((rows, columns), dtype=np.bool_)
    count, rings = 0, 0
    for first_row in range(1, rows):
        for first_column in range(columns):
            if (
                seen[first_row, first_column]
                or not inside[first_row, first_column]
                or inside[first_row - 1, first_column]
            ):
                continue
            row, column, heading = first_row, first_column, 0
            while True:
                # One step along a side, then the two cells ahead: on the left, on the right.
                if heading == 0:
                    seen[row, column] = True
                    column += 1
                    left, right = inside[row, column], inside[row - 1, column]
                elif heading == 1:
                    row += 1
                    left, right = inside[row, column - 1], inside[row, column]
                elif heading == 2:
                    column -= 1
                    left, right = inside[row - 1, column - 1], inside[row, column - 1]
                else:
                    row -= 1
                    left, right = inside[row - 1, column], inside[row - 1, column - 1]
                if not left or right:
                    corners[count, 0] = column
                    corners[count, 1] = row
                    pinched[count] = right and not left
                    count += 1
                    heading = (heading + (3 if left else 1)) % 4
                if row == first_row and column == first_column and heading == 0:
                    break
            rings += 1
            starts[rings] = count
    return rings
