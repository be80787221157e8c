"""What has been cut so far, while tours are put together."""

import numpy as np

from .swept_cells import CropCells, Sweeps, cut_cells_in_place
from .track import Track, split_track


class Stubble:
    """A field's cells, cut track by track; kept up while tours are put together.

    Attributes:
        cells: As they are by now; the stations in them say nothing.

    Args:
        bare: The cells, uncut.
        header: Its width [m].
    """

    def __init__(self, bare: CropCells, header: float) -> None:
        self.cells = CropCells(
            bare.origin, bare.size, bare.crop_area, bare.cut_by.copy(), bare.cut_at.copy()
        )
        self._header = header

    def drive(self, track: Track) -> None:
        """Cut what a track cuts."""
        track, _ = split_track(track, self._header)
        poses = np.column_stack([track.points, track.headings])
        pieces = np.flatnonzero(track.gears > 0)
        who = np.zeros(len(pieces), dtype=int)
        sweeps = Sweeps(poses[:-1][pieces], poses[1:][pieces], np.zeros((len(pieces), 2)), who)
        cut_cells_in_place(self.cells, sweeps, self._header)

    def stands_behind(self, poses: np.ndarray) -> np.ndarray:
        """Whether crop stands a cell's size behind poses, shape (n, 3) -> (n,).

        A cell whose middle is still before the header stands, though the header is in it.
        """
        x, y, theta = poses.T
        size = self.cells.size
        behind = np.stack([x - size * np.cos(theta), y - size * np.sin(theta)], axis=1)
        row, column, on = self.cells.cell_of(behind)
        uncut = self.cells.cut_by[row, column] < 0
        return on & uncut & (self.cells.crop_area[row, column] > 0)
