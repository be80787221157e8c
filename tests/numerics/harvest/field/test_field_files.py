"""Fields from WKT and GeoJSON, and what is refused."""

import json

import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.field.field_files import read_field

SQUARE = [[0.0, 0.0], [100.0, 0.0], [100.0, 80.0], [0.0, 80.0], [0.0, 0.0]]
HOLE = [[40.0, 30.0], [50.0, 30.0], [50.0, 40.0], [40.0, 40.0], [40.0, 30.0]]


def write(tmp_path, name, content):
    path = tmp_path / name
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def test_wkt_in_metres_is_taken_as_it_is(tmp_path):
    path = write(tmp_path, "field.wkt", "POLYGON ((0 0, 100 0, 100 80, 0 80, 0 0))")
    field = read_field(path, coordinates="metres", margin=7.0)
    assert field.area == pytest.approx(8000.0)
    assert field.ground.area == pytest.approx(114.0 * 94.0)


def test_degrees_become_metres(tmp_path):
    """A thousandth of a degree is 111.32 m along the equator and 110.57 m across it (WGS 84)."""
    path = write(tmp_path, "field.wkt", "POLYGON ((6 0, 6.001 0, 6.001 0.001, 6 0.001, 6 0))")
    assert read_field(path).area == pytest.approx(111.32 * 110.57, rel=1e-4)


def test_a_feature_with_a_hole_has_an_obstacle(tmp_path):
    feature = {
        "type": "Feature",
        "properties": {},
        "geometry": {"type": "Polygon", "coordinates": [SQUARE, HOLE]},
    }
    path = write(tmp_path, "f.geojson", {"type": "FeatureCollection", "features": [feature]})
    field = read_field(path, coordinates="metres")
    assert field.area == pytest.approx(7900.0)
    assert [each.area for each in field.obstacles] == pytest.approx([100.0])


def test_of_several_polygons_those_inside_of_one_are_obstacles(tmp_path):
    shape = {"type": "MultiPolygon", "coordinates": [[HOLE], [SQUARE]]}
    field = read_field(write(tmp_path, "f.json", shape), coordinates="metres")
    assert field.area == pytest.approx(7900.0)


@pytest.mark.parametrize(
    ("name", "content", "match"),
    [
        ("f.wkt", "POLYGON ((0 0, 50 50, 50 0, 0 50, 0 0))", "valid polygons.*Self-intersection"),
        ("f.wkt", "POLYGON EMPTY", "polygons only; got an empty"),
        ("f.wkt", "LINESTRING (0 0, 50 50)", "polygons only; got a LineString"),
        ("f.wkt", "POLYGON ((0 0, nonsense", "readable WKT"),
        ("f.geojson", "{", "readable GeoJSON"),
        (
            "f.wkt",
            "MULTIPOLYGON (((0 0, 50 0, 50 50, 0 0)), ((90 0, 99 0, 99 9, 90 0)))",
            "one polygon that contains all",
        ),
        ("f.shp", "", "end in .wkt"),
    ],
)
def test_files_without_one_valid_region_are_refused_in_one_line(tmp_path, name, content, match):
    with pytest.raises(InvalidInput, match=match) as caught:
        read_field(write(tmp_path, name, content), coordinates="metres")
    assert str(caught.value).startswith("`field file` must")
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(InvalidInput, match=r"`field file` must exist; got .*gone\.wkt"):
        read_field(tmp_path / "gone.wkt")


@pytest.mark.parametrize("sides", [(0.0, 5.0), (5.0, -1.0), (float("nan"), 1.0)])
def test_rectangles_have_positive_sides(sides):
    with pytest.raises(InvalidInput, match=r"`(width|height)` must"):
        Field.rectangle(*sides)


def test_margins_are_not_negative():
    with pytest.raises(InvalidInput, match="`margin` must"):
        Field.rectangle(5.0, 5.0, margin=-1.0)


def test_metres_taken_for_degrees_are_refused_with_a_hint(tmp_path):
    path = tmp_path / "field.wkt"
    path.write_text("POLYGON ((0 0, 300 0, 300 200, 0 200, 0 0))")
    with pytest.raises(InvalidInput, match="coordinates has to be metres"):
        read_field(path)
