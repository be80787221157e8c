"""A world from an occupancy map: clean polygons in place of cells."""

from dataclasses import dataclass
from typing import Annotated

import cv2
import numpy as np
import shapely

from ..checked import Checked, NonNegative, one_of
from ..errors import require_positive
from .cell_outline import simplify_outline, trace_cells
from .occupancy_map import FREE, UNKNOWN, OccupancyMap
from .world import World, ring_area, world_from_polygon

# An obstacle whose length is at least this many times its mean thickness has a wall's shape.
WALL_SLENDERNESS = 4.0

# Columns of OpenCV's table of components.
_WIDTH, _HEIGHT, _AREA = cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT, cv2.CC_STAT_AREA


@dataclass(frozen=True, eq=False)
class FreeCells:
    """The cells of one free region, framed by a ring of cells that are not free.

    Attributes:
        inside: True for the cells of the region, shape (rows + 2, columns + 2); 4-connected. The
            other cells are 8-connected to the frame or fill a hole.
        speckle_area: Number of cells that were turned free [cells].
        unreachable_area: Number of free cells outside the region [cells].
    """

    inside: np.ndarray
    speckle_area: int
    unreachable_area: int


def select_free_cells(
    occupancy: OccupancyMap, unknown_is_free: bool, speckle: float, wall_length: float
) -> FreeCells:
    """Choose the largest free region of a map and remove speckle from it.

    Two free cells are connected when they share a side, two occupied cells also when they share
    only a corner, so that neither sight nor motion leaks through a diagonal wall. Of several
    regions the one with most cells KNOWN to be free is taken: where unknown cells count as free,
    the unexplored outside must not win. Everything that the region encloses is an obstacle,
    including unreachable free pockets.

    An obstacle smaller than `speckle` is dropped, unless it has the shape of a wall: a bounding
    box with a diagonal of at least `wall_length`, and at least WALL_SLENDERNESS times as long as
    its mean thickness (area / length).

    Args:
        occupancy: The map; at least one cell of it is free.
        unknown_is_free: Whether unknown cells count as free.
        speckle: Smallest area of an obstacle without a wall's shape [cells].
        wall_length: Smallest length of a wall [cell sides].
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
    # Areas converted from m^2 to cells are rounded.
    small = (table[:, _AREA] < speckle * (1.0 - 1e-9)) & ~wall
    small[rest[0, 0]] = False  # the frame and everything connected to it
    small[0] = False  # OpenCV's label of the region itself
    dropped = small[rest] if count > 1 else np.zeros_like(inside)
    inside |= dropped
    return FreeCells(inside, int(dropped.sum()), int((free & ~inside).sum()))


# A guarded cell keeps a diamond of this half diagonal around its centre [cells].
GUARD = 0.25


def wall_guards(inside: np.ndarray, tolerance: float) -> np.ndarray:
    """Guard points that a simplified outline of a region must keep on their side.

    Each face of a wall may move by the tolerance, so a wall up to two tolerances thick could
    lose all its thickness. Along the ridge of such walls every cell is guarded by four points
    around its centre, so that about half a cell of thickness remains. A part that grows out of
    something thicker and reaches no further than the tolerance is a bump, not a wall, and is not
    guarded.

    Narrow places of the region itself are not guarded (they never close, but may become narrower),
    except when the region is nowhere wider than two tolerances.

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
    """Ridge cells of the parts of a set of cells thinner than a block, of the shape of `cells`."""
    # Parts that touch the border are continued beyond it.
    margin = block + 1
    cells = np.pad(cells, margin, mode="edge")
    depth = cv2.distanceTransform(cells.astype(np.uint8), cv2.DIST_C, 3)
    ridge = cells & (depth >= cv2.dilate(depth, np.ones((3, 3), np.uint8)))
    # A bump may grow out of a part that is itself thinner than the block: test all scales.
    side = 2
    while side < block:
        ridge &= _thick(cells, side) | _walls(cells, side, tolerance)
        side *= 2
    return (ridge & _walls(cells, block, tolerance))[margin:-margin, margin:-margin]


def _walls(cells: np.ndarray, block: int, tolerance: float) -> np.ndarray:
    """The cells of parts that are thinner than a block and not bumps on something thicker."""
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
    # Opposite anchors, so that a block with an even side is not shifted; no block fits across
    # the border of the picture.
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


def hausdorff_distance(rings: list[np.ndarray], others: list[np.ndarray], accuracy: float) -> float:
    """Largest distance from a point of either outline to the other outline [cells].

    The maximum need not be at a vertex. Along a straight piece the distance to ONE edge of the
    other outline is convex, so the larger of the two ends' distances to that edge is an upper
    bound of the distance to the outline. Pieces for which this bound, with the edge nearest to
    either end, exceeds the largest distance found so far are halved.

    Args:
        rings, others: Closed rings without repeated ends, each shape (n, 2) [cells].
        accuracy: The result is at most this much below the true value [cells].
    """
    return max(_directed(rings, others, accuracy), _directed(others, rings, accuracy))


def _edges(rings: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    return np.concatenate(rings), np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])


def _directed(rings: list[np.ndarray], others: list[np.ndarray], accuracy: float) -> float:
    edges = np.asarray(shapely.linestrings(np.stack(_edges(others), axis=1)))
    tree = shapely.STRtree(edges)
    start, end = _edges(rings)
    largest = 0.0
    while len(start):
        bound = np.full(len(start), np.inf)
        tips = shapely.points(start), shapely.points(end)
        for tip in tips:
            nearest = edges[tree.query_nearest(tip, all_matches=False)[1]]
            away = [shapely.distance(other, nearest) for other in tips]
            largest = max(largest, float(shapely.distance(tip, nearest).max()))
            bound = np.minimum(bound, np.maximum(*away))
        open_ = bound > largest + accuracy
        start, end = start[open_], end[open_]
        middle = (start + end) / 2
        start, end = np.concatenate([start, middle]), np.concatenate([middle, end])
    return largest


# How far the reported Hausdorff distance may be below the true one [cells].
ERROR_ACCURACY = 1e-4


@dataclass(frozen=True, kw_only=True)
class OutlineOptions(Checked):
    """How cells become polygons.

    Raises:
        InvalidInput: A number is out of its range.
    """

    # Whether unknown cells count as "occupied" or "free".
    unknown: Annotated[str, one_of(("occupied", "free"))] = "occupied"
    # A smaller obstacle without a wall's shape is speckle [m^2].
    min_obstacle_area: NonNegative = 0.02
    # A slender obstacle at least this long is a wall, however small its area [m].
    min_wall_length: NonNegative = 0.3
    # Largest distance between cells and polygons [m]; None: the side of a cell.
    tolerance: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tolerance is not None:
            require_positive("tolerance", self.tolerance)


@dataclass(frozen=True, eq=False)
class OccupancyOutline:
    """A world made from an occupancy map, and how it differs from the map.

    Attributes:
        world: The free region.
        simplification_error: Hausdorff distance between its outline and that of the cells [m].
        cell_area: Area of the free region in cells, before simplification [m^2].
        speckle_area: Area of the obstacles that were dropped [m^2]; counts as free.
        unreachable_area: Area of free cells outside of the free region [m^2]; now occupied.
    """

    world: World
    simplification_error: float
    cell_area: float
    speckle_area: float
    unreachable_area: float


def outline_occupancy_map(
    occupancy: OccupancyMap, options: OutlineOptions | None = None
) -> OccupancyOutline:
    """Make the largest free region of a map into a world.

    Free cells are connected through sides only, occupied ones through corners as well. Speckle is
    dropped. Outlines are simplified within the tolerance; their topology is preserved, and thin
    walls keep some of their thickness. See `select_free_cells`, `simplify_outline` and
    `wall_guards` for the rules.

    Args:
        occupancy: The map; at least one cell of it is free.
        options: None: the defaults.
    """
    options = options or OutlineOptions()
    side = occupancy.resolution
    cells = select_free_cells(
        occupancy,
        options.unknown == "free",
        options.min_obstacle_area / side**2,
        options.min_wall_length / side,
    )
    tolerance = 1.0 if options.tolerance is None else options.tolerance / side
    # A larger tolerance would have the same effect, and cost time.
    tolerance = min(tolerance, float(sum(cells.inside.shape)))
    outline = trace_cells(cells.inside)
    simplified = simplify_outline(outline, wall_guards(cells.inside, tolerance), tolerance)
    error = hausdorff_distance(outline.rings, simplified, ERROR_ACCURACY)
    if error < tolerance * (1.0 + 1e-9):
        error = min(error, tolerance)  # an exact distance may be rounded up a little
    # The map has a frame one cell wide around it.
    rings = [occupancy.to_world(ring - 1.0) for ring in simplified]
    rim = int(np.argmax([ring_area(ring) for ring in simplified]))
    holes = rings[:rim] + rings[rim + 1 :]
    return OccupancyOutline(
        world=world_from_polygon(shapely.Polygon(rings[rim], holes)),
        simplification_error=error * side,
        cell_area=float(cells.inside.sum()) * side**2,
        speckle_area=cells.speckle_area * side**2,
        unreachable_area=cells.unreachable_area * side**2,
    )
