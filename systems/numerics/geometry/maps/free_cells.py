"""Which cells of an occupancy map make up the world: one free region, rid of speckle."""

from dataclasses import dataclass

import cv2
import numpy as np

from ..occupancy_map import FREE, UNKNOWN, OccupancyMap

# An obstacle whose length is at least this many times its mean thickness has a wall's shape.
WALL_SLENDERNESS = 4.0

# Columns of OpenCV's table of components.
_WIDTH, _HEIGHT, _AREA = cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT, cv2.CC_STAT_AREA


@dataclass(frozen=True, eq=False)
class FreeCells:
    """The cells of one free region, framed by a ring of cells that are not free.

    Attributes:
        inside: True for the cells of the region, shape (rows + 2, columns + 2); 4-connected. The
            others are 8-connected to the frame or fill a hole.
        speckle_area: Cells that were turned free [cells].
        unreachable_area: Free cells outside of the region [cells].
    """

    inside: np.ndarray
    speckle_area: int
    unreachable_area: int


def select_free_cells(
    occupancy: OccupancyMap, unknown_is_free: bool, speckle: float, wall_length: float
) -> FreeCells:
    """Choose the largest free region of a map and clear it of speckle.

    Two free cells belong together when they share a side; occupied ones also when they share
    only a corner, so that neither sight nor motion leaks through a diagonal wall. Of several
    regions the one with most cells that are KNOWN to be free is taken: where unknown cells count
    as free, the unexplored outside must not win. What the region encloses is an obstacle, free
    pockets that cannot be reached included.

    An obstacle smaller than `speckle` is dropped, unless it has the shape of a wall: a bounding
    box with a diagonal of at least `wall_length`, and at least WALL_SLENDERNESS times as long as
    its mean thickness (area / length).

    Args:
        occupancy: The map; at least one cell of it is free.
        unknown_is_free: What unknown cells count as.
        speckle: [cells].
        wall_length: [cell sides].
    """
    known_free = np.pad(occupancy.cells == FREE, 1)
    free = known_free | np.pad(unknown_is_free & (occupancy.cells == UNKNOWN), 1)
    _, regions = cv2.connectedComponents(free.astype(np.uint8), connectivity=4)
    largest = int(np.argmax(np.bincount(regions[known_free])))
    inside = regions == largest

    count, rest, table, _ = cv2.connectedComponentsWithStats(
        (~inside).astype(np.uint8), connectivity=8
    )
    length = np.hypot(table[:, _WIDTH], table[:, _HEIGHT])
    wall = (length >= wall_length) & (length**2 >= WALL_SLENDERNESS * table[:, _AREA])
    # Areas stated in m^2 have lost a few bits on the way to cells.
    small = (table[:, _AREA] < speckle * (1.0 - 1e-9)) & ~wall
    small[rest[0, 0]] = False  # the frame and all that hangs on it
    small[0] = False  # OpenCV's label of the region itself
    dropped = small[rest] if count > 1 else np.zeros_like(inside)
    inside |= dropped
    return FreeCells(inside, int(dropped.sum()), int((free & ~inside).sum()))
