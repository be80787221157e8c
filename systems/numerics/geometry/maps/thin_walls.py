"""Points that keep thin walls from being simplified away."""

import cv2
import numpy as np

# A guarded cell keeps a diamond of this half diagonal around its centre [cells].
GUARD = 0.25


def wall_guards(inside: np.ndarray, tolerance: float) -> np.ndarray:
    """Points that a simplified outline of a region must leave on the side where they are.

    Two faces of a wall may each move by the tolerance, so a wall up to two tolerances thick could
    lose all its thickness. Along the ridge of such walls every cell is guarded by four points
    around its centre; a wall keeps about half a cell of thickness there. What grows out of
    something thicker and reaches no further than the tolerance is a bump, not a wall, and is not
    guarded.

    The region's own narrow places are not guarded (they never close, but may become narrower),
    except when it is nowhere wider than two tolerances.

    Args:
        inside: True for the cells of the region, False in the outermost rows and columns;
            shape (rows, columns).
        tolerance: [cells].

    Returns:
        Shape (n, 2), [column, row] in cell units, multiples of GUARD.
    """
    # The smallest block of cells that is thicker than two tolerances.
    block = int(np.floor(2.0 * tolerance)) + 1
    guarded = _thin_ridge(~inside, block, tolerance)
    if not _thick(inside, block).any():
        guarded |= _thin_ridge(inside, block, tolerance)
    centres = np.argwhere(guarded)[:, ::-1] + 0.5
    diamond = GUARD * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    return (centres[:, None] + diamond).reshape(-1, 2)


def _thin_ridge(cells: np.ndarray, block: int, tolerance: float) -> np.ndarray:
    """Middle cells of what is thinner than a block in a set of cells, of the shape of `cells`."""
    # What touches the border goes on beyond it.
    margin = block + 1
    cells = np.pad(cells, margin, mode="edge")
    depth = cv2.distanceTransform(cells.astype(np.uint8), cv2.DIST_C, 3)
    ridge = cells & (depth >= cv2.dilate(depth, np.ones((3, 3), np.uint8)))
    # A bump may grow out of something that is itself thinner than the block: look at all scales.
    side = 2
    while side < block:
        ridge &= _thick(cells, side) | _walls(cells, side, tolerance)
        side *= 2
    return (ridge & _walls(cells, block, tolerance))[margin:-margin, margin:-margin]


def _walls(cells: np.ndarray, block: int, tolerance: float) -> np.ndarray:
    """The cells that are thinner than a block and no bump on something thicker."""
    thick = _thick(cells, block)
    thin = cells & ~thick
    count, labels = cv2.connectedComponents(thin.astype(np.uint8), connectivity=8)
    parts = np.asarray(labels, dtype=np.int32)
    is_wall = np.ones(count, dtype=bool)
    is_wall[parts[thin & _grown(thick, 1)]] = False
    is_wall[parts[thin & ~_grown(thick, int(np.ceil(tolerance)))]] = True
    return thin & is_wall[parts]


def _thick(cells: np.ndarray, block: int) -> np.ndarray:
    """The cells covered by square blocks that fit into a set of cells."""
    square = np.ones((block, block), np.uint8)
    # Opposite anchors, so that a block of an even side returns to its place; nothing fits
    # across the border of the picture.
    fits = cv2.erode(
        cells.astype(np.uint8),
        square,
        anchor=(0, 0),
        borderType=cv2.BORDER_CONSTANT,
        borderValue=0,
    )
    return cv2.dilate(fits, square, anchor=(block - 1, block - 1)).astype(bool)


def _grown(cells: np.ndarray, by: int) -> np.ndarray:
    """Cells within a number of steps, diagonal ones too, of a set of cells."""
    square = np.ones((2 * by + 1, 2 * by + 1), np.uint8)
    return cv2.dilate(cells.astype(np.uint8), square).astype(bool)
