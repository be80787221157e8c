"""Meshes fill the shapes that they stand for."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from sightfield.diagrams.visuals.meshes import (
    Mesh,
    arrow_mesh,
    bar_mesh,
    disc_mesh,
    extruded_mesh,
    fan_mesh,
    flat_mesh,
    line_mesh,
    nose_mesh,
    unit_bar_mesh,
)

ELL = shapely.Polygon([[0, 0], [3, 0], [3, 1], [1, 1], [1, 3], [0, 3]])
HOLED = shapely.box(0, 0, 4, 4).difference(shapely.box(1, 1, 2, 3))


def cover(mesh: Mesh) -> shapely.Geometry:
    """The union of a flat mesh's triangles."""
    corners = mesh.vertices[:2].T[mesh.faces.T]
    return shapely.union_all(shapely.polygons(corners))


@pytest.mark.parametrize("shape", [ELL, HOLED, shapely.union_all([ELL, shapely.box(5, 5, 6, 6)])])
def test_a_flat_mesh_covers_its_shape_and_nothing_else(shape):
    mesh = flat_mesh(shape, height=0.5)
    assert mesh.area == pytest.approx(shape.area)
    assert cover(mesh).symmetric_difference(shape).area == pytest.approx(0.0, abs=1e-9)
    assert set(mesh.vertices[2]) == {0.5}


def test_a_shape_that_touches_itself_by_rounding_is_filled():
    """A patch of crop of a real field, turned and stretched to a unit."""
    corners = [
        (0.9751600577439168, 4.499927956753303),
        (0.9753977775686652, -4.5010668957336275),
        (0.0316000335276739, -4.541940328199351),
        (0.0057873916090965, -4.523126721332753),
        (-0.0347711346717897, -4.390495080706786),
        (-0.0144109783604465, 4.573669886032442),
        (0.0341455241047584, 4.4591750579115645),
        (0.9998548915608553, 4.500997425957527),
    ]
    patch = shapely.Polygon(corners)
    assert not patch.is_valid
    assert flat_mesh(patch).area == pytest.approx(patch.area, rel=1e-9)
    # Two patches and a spike, which is left out.
    far = shapely.transform(patch, lambda points: points + np.array([3.0, 0.0]))
    spiked = shapely.Polygon([*corners[:3], (-5.0, -4.541940328199351), *corners[2:]])
    several = shapely.MultiPolygon([far, spiked])
    assert not several.is_valid
    assert flat_mesh(several).area == pytest.approx(2 * patch.area, rel=1e-9)


@pytest.mark.parametrize("shape", [ELL, HOLED])
def test_an_extruded_mesh_has_a_roof_and_walls(shape):
    mesh = extruded_mesh(shape, 0.0, 2.0)
    assert mesh.area == pytest.approx(shape.area + 2.0 * shape.length)
    assert set(mesh.vertices[2]) == {0.0, 2.0}


def test_a_closed_line_is_a_band_with_sharp_corners():
    mesh = line_mesh([np.array([[0, 0], [4, 0], [4, 3], [0, 3]])], width=0.2)
    expected = shapely.box(-0.1, -0.1, 4.1, 3.1).difference(shapely.box(0.1, 0.1, 3.9, 2.9))
    assert cover(mesh).symmetric_difference(expected).area == pytest.approx(0.0, abs=1e-9)


@given(
    angle=st.floats(-3.0, 3.0), length=st.floats(0.1, 10.0), x=st.floats(-5, 5), y=st.floats(-5, 5)
)
def test_a_bar_is_a_rectangle_along_its_segment(angle, length, x, y):
    start = np.array([[x, y]])
    end = start + length * np.array([[np.cos(angle), np.sin(angle)]])
    mesh = bar_mesh(start, end, 0.1)
    expected = shapely.LineString(np.vstack([start, end])).buffer(0.05, cap_style="flat")
    assert cover(mesh).symmetric_difference(expected).area == pytest.approx(0.0, abs=1e-9)


def test_a_bar_without_length_has_no_area():
    point = np.array([[1.0, 2.0]])
    assert bar_mesh(point, point, 0.1).area == 0.0


def test_the_unit_bar_lies_on_the_x_axis_from_0_to_1():
    assert cover(unit_bar_mesh(0.2)).bounds == (0.0, -0.1, 1.0, 0.1)


def test_a_fan_fills_what_its_apex_sees():
    star = shapely.Polygon([[2, 0], [0.5, 0.5], [0, 2], [-0.5, 0.5], [-2, 0], [0, -1]])
    mesh = fan_mesh(shapely.get_coordinates(star)[:-1], np.array([0.0, 0.1]))
    assert cover(mesh).symmetric_difference(star).area == pytest.approx(0.0, abs=1e-9)
    assert mesh.area == pytest.approx(star.area)


def test_the_longest_arrow_has_the_length_asked_for_and_the_others_are_in_proportion():
    points = np.array([[0.0, 0.0], [5.0, 0.0], [0.0, 5.0]])
    mesh = arrow_mesh(points, np.array([[2.0, 0.0], [0.0, 1.0], [0.0, 0.0]]), length=0.5)
    first, second = mesh.vertices[:2].T.reshape(-1, 4, 2)
    assert np.ptp(first[:, 0]) == pytest.approx(0.5)
    assert np.ptp(second[:, 1]) == pytest.approx(0.25)
    assert first[:, 0].argmax() == second[:, 1].argmax() == 0


def test_a_disc_may_have_a_hole():
    assert disc_mesh(2.0).area == pytest.approx(4 * np.pi, rel=0.01)
    assert disc_mesh(2.0, hole=1.0).area == pytest.approx(3 * np.pi, rel=0.01)


def test_a_nose_points_ahead_and_ends_where_the_body_does():
    places = nose_mesh(0.16, 0.2).vertices
    reach = np.hypot(places[0], places[1])
    assert reach.max() == pytest.approx(0.16)
    assert places[:, reach.argmax()][0] > 0.0
    assert places[0].max() == pytest.approx(0.16)
    # The middle is left to a number.
    assert places[0].min() > 0.5 * 0.16
    assert places[2].max() == pytest.approx(0.2)
