"""Whatever the cells, the world keeps their topology and stays within the tolerance."""

import cv2
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sightfield.systems.numerics.geometry.cell_outline import trace_cells
from sightfield.systems.numerics.geometry.occupancy_map import (
    FREE,
    OCCUPIED,
    UNKNOWN,
    OccupancyMap,
)
from sightfield.systems.numerics.geometry.occupancy_outline import (
    OutlineOptions,
    outline_occupancy_map,
    select_free_cells,
)
from sightfield.systems.numerics.geometry.world import ring_area

KEEP_ALL = {"min_obstacle_area": 0.0, "min_wall_length": 0.0}


def from_cells(cells: np.ndarray) -> OccupancyMap:
    """A map of cells of 1 m from classes, its first row at the bottom."""
    return OccupancyMap(np.asarray(cells, dtype=np.uint8), 1.0, (0.0, 0.0, 0.0))


# Anything from noise to rooms: every cell is drawn, then solid blocks are laid over.
@st.composite
def grids(draw):
    shape = draw(st.tuples(st.integers(1, 14), st.integers(1, 14)))
    cells = draw(arrays(np.uint8, shape, elements=st.sampled_from([FREE, FREE, OCCUPIED, UNKNOWN])))
    for _ in range(draw(st.integers(0, 4))):
        row, column = (draw(st.integers(0, size - 1)) for size in shape)
        height, width = draw(st.integers(1, 8)), draw(st.integers(1, 8))
        cells[row : row + height, column : column + width] = draw(st.sampled_from([FREE, OCCUPIED]))
    cells[draw(st.integers(0, shape[0] - 1)), draw(st.integers(0, shape[1] - 1))] = FREE
    return cells


@given(cells=grids(), unknown_is_free=st.booleans())
def test_traced_rings_bound_exactly_the_cells(cells, unknown_is_free):
    chosen = select_free_cells(from_cells(cells), unknown_is_free, 0.0, 0.0)
    rings = trace_cells(chosen.inside).rings
    assert sum(ring_area(ring) for ring in rings) == chosen.inside.sum()
    free = (cells == FREE) | (unknown_is_free & (cells == UNKNOWN))
    _, regions = cv2.connectedComponents(free.astype(np.uint8), connectivity=4)
    known = [int(((regions == k) & (cells == FREE)).sum()) for k in range(1, regions.max() + 1)]
    sizes = [int((regions == k).sum()) for k in range(1, regions.max() + 1)]
    assert chosen.inside.sum() in [
        size for size, count in zip(sizes, known, strict=True) if count == max(known)
    ]
    assert chosen.unreachable_area == free.sum() - chosen.inside.sum()


@given(
    cells=grids(),
    unknown=st.sampled_from(["occupied", "free"]),
    tolerance=st.sampled_from([0.02, 0.25, 0.5, 1.0, 1.5, 3.0, 40.0]),
)
def test_any_map_becomes_a_world_of_the_same_topology_within_the_tolerance(
    cells, unknown, tolerance
):
    options = OutlineOptions(unknown=unknown, tolerance=tolerance, **KEEP_ALL)
    outline = outline_occupancy_map(from_cells(cells), options)
    world = outline.world
    assert world.polygon.is_valid
    assert outline.simplification_error <= tolerance
    # As many obstacles as holes, and no two rings touch.
    inside = select_free_cells(from_cells(cells), unknown == "free", 0.0, 0.0).inside
    holes, _ = cv2.connectedComponents((~inside).astype(np.uint8), connectivity=8)
    assert len(world.obstacles) == holes - 2
    lines = [shapely.LinearRing(ring) for ring in world.rings]
    assert all(line.is_simple for line in lines)
    assert all(lines[i].distance(lines[j]) > 0 for i in range(len(lines)) for j in range(i))
    # The reported error is the distance to the exact outline.
    exact = shapely.union_all([shapely.box(x - 1, y - 1, x, y) for y, x in np.argwhere(inside)])
    samples = (
        shapely.segmentize(world.polygon.boundary, 0.01),
        shapely.segmentize(exact.boundary, 0.01),
    )
    expected = max(
        shapely.distance(shapely.points(shapely.get_coordinates(samples[0])), exact.boundary).max(),
        shapely.distance(
            shapely.points(shapely.get_coordinates(samples[1])), world.polygon.boundary
        ).max(),
    )
    assert outline.simplification_error == pytest.approx(expected, abs=6e-3)


@given(cells=grids())
def test_a_fine_tolerance_keeps_every_cell(cells):
    tolerance = 1e-3
    options = OutlineOptions(tolerance=tolerance, **KEEP_ALL)
    outline = outline_occupancy_map(from_cells(cells), options)
    inside = select_free_cells(from_cells(cells), False, 0.0, 0.0).inside
    perimeter = outline.world.polygon.length
    assert abs(outline.world.free_area - inside.sum()) <= tolerance * perimeter
    # Two occupied cells that share only a corner block the view between the free ones.
    a, b, c, d = inside[:-1, :-1], inside[:-1, 1:], inside[1:, :-1], inside[1:, 1:]
    for row, column in np.argwhere(a & d & ~b & ~c):
        centre = np.array([column, row])
        ends = np.array([centre - 0.5, centre + 0.5])
        assert not outline.world.polygon.covers(shapely.LineString(ends))
