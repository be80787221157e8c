"""A world from an occupancy map: clean polygons in place of cells."""

from dataclasses import dataclass

import numpy as np
import shapely

from ..errors import require_non_negative, require_one_of, require_positive
from .maps.cell_outline import trace_cells
from .maps.free_cells import select_free_cells
from .maps.hausdorff import hausdorff_distance
from .maps.outline_simplification import simplify_outline
from .maps.thin_walls import wall_guards
from .occupancy_map import OccupancyMap
from .rings import ring_area
from .world import World, world_from_polygon

# How far the reported Hausdorff distance may be below the true one [cells].
ERROR_ACCURACY = 1e-4


@dataclass(frozen=True, kw_only=True)
class OutlineOptions:
    """How cells become polygons.

    Raises:
        InvalidInput: A number is out of its range.
    """

    unknown: str = "occupied"  # what unknown cells count as: "occupied" or "free"
    min_obstacle_area: float = 0.02  # [m^2]; a smaller obstacle without a wall's shape is speckle
    min_wall_length: float = 0.3  # [m]; a slender obstacle this long is a wall, however small
    tolerance: float | None = None  # [m], between cells and polygons; None: the side of a cell

    def __post_init__(self) -> None:
        require_one_of("unknown", self.unknown, ("occupied", "free"))
        require_non_negative("min_obstacle_area", self.min_obstacle_area)
        require_non_negative("min_wall_length", self.min_wall_length)
        if self.tolerance is not None:
            require_positive("tolerance", self.tolerance)


@dataclass(frozen=True, eq=False)
class OccupancyOutline:
    """A world made from an occupancy map, and what making it has changed.

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
    dropped; outlines are simplified within the tolerance, without a change of topology, thin
    walls keeping some of their thickness. See `select_free_cells`, `simplify_outline` and
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
    # A coarser one would mean the same, and cost time.
    tolerance = min(tolerance, float(sum(cells.inside.shape)))
    outline = trace_cells(cells.inside)
    simplified = simplify_outline(outline, wall_guards(cells.inside, tolerance), tolerance)
    error = hausdorff_distance(outline.rings, simplified, ERROR_ACCURACY)
    if error < tolerance * (1.0 + 1e-9):
        error = min(error, tolerance)  # a distance of one cell may round to a little more
    # One cell of frame lies around the map.
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
