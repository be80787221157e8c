"""Headers cut what they move forwards over, once."""

import math

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.field.swept_cells import Sweeps, bare_cells, cut_cells


def sweeps_along(poses, who=0):
    """Sweeps from pose to pose, shape (n, 3)."""
    poses = np.asarray(poses, dtype=float)
    ways = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    stations = np.concatenate([[0.0], np.cumsum(ways)])
    pieces = np.column_stack([stations[:-1], stations[1:]])
    return Sweeps(poses[:-1], poses[1:], pieces, np.full(len(ways), who))


@pytest.fixture
def square():
    return bare_cells(make_world([(0, 0), (40, 0), (40, 40), (0, 40)]), 0.25)


def test_the_cells_hold_all_the_crop_of_a_field_with_a_hole():
    world = make_world([(0, 0), (40, 0), (31, 35), (0, 40)], [[(5, 5), (9, 5), (7, 12)]])
    cells = bare_cells(world, 0.5)
    assert cells.crop_area.sum() == pytest.approx(world.free_area)
    x, y = np.meshgrid(*cells.middles())
    inside = shapely.contains_xy(world.polygon, x, y)
    assert (cells.has_crop == inside).mean() > 0.9999


def test_a_straight_cuts_its_length_times_the_header(square):
    cells, areas = cut_cells(
        square, sweeps_along([(5, 20, 0.0), (15, 20, 0.0), (30, 20, 0.0)]), 6.0
    )
    np.testing.assert_allclose(areas, [60.0, 90.0])
    row, column, on = cells.cell_of(np.array([20.0, 21.0]))
    assert on
    assert cells.cut_at[row, column] == pytest.approx(15.0, abs=0.25)


def test_the_second_one_over_the_same_ground_cuts_nothing(square):
    once, _ = cut_cells(square, sweeps_along([(5, 20, 0.0), (30, 20, 0.0)]), 6.0)
    twice, areas = cut_cells(once, sweeps_along([(30, 20, math.pi), (5, 20, math.pi)], 1), 6.0)
    assert areas.sum() == 0
    assert (twice.cut_by == once.cut_by).all()


def test_backing_up_would_cut_nothing(square):
    _, areas = cut_cells(square, sweeps_along([(30, 20, 0.0), (5, 20, 0.0)]), 6.0)
    assert areas.sum() == 0


@pytest.mark.parametrize(("radius", "header"), [(10.0, 6.0), (5.0, 12.0)])
def test_an_arc_cuts_a_sector_of_a_ring(square, radius, header):
    """Even where the header's inner end moves backwards, radius < header / 2."""
    angles = np.linspace(0.0, math.pi / 2, 60)
    poses = np.column_stack(
        [
            20 + radius * np.sin(angles),
            20 - radius * np.cos(angles),
            angles,
        ]
    )
    _, areas = cut_cells(square, sweeps_along(poses), header)
    outer, inner = radius + header / 2, max(radius - header / 2, 0.0)
    assert areas.sum() == pytest.approx(math.pi / 4 * (outer**2 - inner**2), rel=0.02)


@pytest.mark.parametrize("turn", [0.3, 1.2, 2.5])
def test_turned_fields_are_cut_alike(turn):
    """A straight over a square, both turned."""
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    corners = np.array([(-20, -20), (20, -20), (20, 20), (-20, 20)]) @ rotation.T
    ends = np.array([(-30.0, 2.0), (30.0, 2.0)]) @ rotation.T
    poses = np.column_stack([ends, [turn, turn]])
    _, areas = cut_cells(bare_cells(make_world(corners), 0.2), sweeps_along(poses), 7.0)
    assert areas.sum() == pytest.approx(280.0, rel=0.01)


def test_what_stands_depends_on_everybodys_progress(square):
    cells, _ = cut_cells(square, sweeps_along([(0, 10, 0.0), (40, 10, 0.0)], 0), 8.0)
    cells, _ = cut_cells(cells, sweeps_along([(0, 30, 0.0), (40, 30, 0.0)], 1), 8.0)
    crop = cells.crop_area
    for progress in ([0.0, 0.0], [10.0, 0.0], [10.0, 40.0], [40.0, 40.0]):
        standing = cells.standing(np.array(progress))
        assert crop[standing].sum() == pytest.approx(1600.0 - 8.0 * sum(progress))
