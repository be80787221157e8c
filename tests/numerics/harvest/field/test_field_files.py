"""Fields from WKT and GeoJSON, and what is refused."""

import json
import math

import numpy as np
import pytest
import shapefile
import shapely
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.field.field import Field, Place
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
    # The four corners together are a circle, but for what its chords leave out.
    assert field.ground.area == pytest.approx(114.0 * 94.0 - (4 - math.pi) * 7**2, rel=1e-4)


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
            "GEOMETRYCOLLECTION (POLYGON ((0 0, 50 0, 50 50, 0 0)),"
            " POLYGON ((20 0, 99 0, 99 9, 20 0)))",
            "parts that do not overlap",
        ),
        ("f.kml", "", "end in .wkt"),
        ("f.shp", "", "readable Shapefile"),
        ("f.shp", "nonsense " * 40, "readable Shapefile"),
        ("f.wkt", "POLYGON ((0 0, 1e308 0, 1e308 1e308, 0 0))", "coordinates within"),
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


def test_degrees_taken_for_metres_are_refused_without_a_hint_to_take_metres(tmp_path):
    path = write(tmp_path, "f.wkt", shapely.Polygon(degrees(SQUARE)).wkt)
    with pytest.raises(InvalidInput, match=r"must be wgs84 .* looks like degrees$"):
        read_field(path, coordinates="metres")


def test_metres_taken_for_degrees_are_refused_with_a_hint(tmp_path):
    path = tmp_path / "field.wkt"
    path.write_text("POLYGON ((0 0, 300 0, 300 200, 0 200, 0 0))")
    with pytest.raises(InvalidInput, match="coordinates has to be metres"):
        read_field(path)


def feature(kind, shape, name=""):
    return {"type": "Feature", "properties": {"kind": kind, "name": name}, "geometry": shape}


def polygon(*rings):
    return {"type": "Polygon", "coordinates": list(rings)}


def moved(ring, x, y=0.0):
    return [[a + x, b + y] for a, b in ring]


def collection(*features):
    return {"type": "FeatureCollection", "features": list(features)}


def test_of_several_parts_one_is_chosen_and_none_is_dropped_in_silence(tmp_path):
    parts = [polygon(SQUARE), polygon(moved(SQUARE, 108), moved(HOLE, 108))]
    features = [feature("field", each, name) for each, name in zip(parts, "AB", strict=True)]
    path = write(tmp_path, "f.geojson", collection(*features))
    with pytest.raises(InvalidInput, match=r"`part` must .* \(1: A 0\.800 ha, 2: B 0\.790 ha\)"):
        read_field(path, coordinates="metres")
    with pytest.raises(InvalidInput, match=r"`part` must .* got 3"):
        read_field(path, coordinates="metres", part=3)
    second = read_field(path, coordinates="metres", part=2)
    assert (second.name, len(second.obstacles)) == ("B", 1)
    assert second.outline.bounds == (108.0, 0.0, 208.0, 80.0)
    # The margin is 12 m wide, but for the crop of the other part, 8 m away.
    assert second.ground.bounds[0] == pytest.approx(96.0)
    assert second.ground.intersection(shapely.box(0, 0, 100, 80)).area < 1e-9


def test_features_of_a_kind_are_no_go_areas_gates_and_trucks(tmp_path):
    ditch = [[0.0, 84.0], [100.0, 84.0], [100.0, 86.0], [0.0, 86.0], [0.0, 84.0]]
    path = write(
        tmp_path,
        "f.geojson",
        collection(
            feature("field", polygon(SQUARE)),
            feature("no-go", polygon(HOLE)),
            feature("No-Go", polygon(ditch)),
            feature("gate", {"type": "Point", "coordinates": [100.0, 5.0]}),
            feature("truck", {"type": "Point", "coordinates": [105.0, 70.0]}),
        ),
    )
    field = read_field(path, coordinates="metres", gates=[(0.0, 1.0)])
    assert field.area == pytest.approx(7900.0)
    assert field.gates.tolist() == [[100.0, 5.0], [0.0, 1.0]]
    assert field.trucks.tolist() == [[105.0, 70.0]]
    # The ditch parts off all of the margin behind it, but at its ends.
    assert field.ground.intersection(shapely.Polygon(ditch)).area < 1e-9
    round_corners = (4 - math.pi) * 12**2
    assert field.ground.area == pytest.approx(124 * 104 - round_corners - 100 - 200, rel=1e-4)


def test_features_that_lie_nowhere_are_none(tmp_path):
    # As RFC 7946 allows and QGIS writes them.
    polygon = {"type": "Polygon", "coordinates": [degrees(SQUARE)]}
    nowhere = {"type": "Feature", "properties": {"kind": "gate"}, "geometry": None}
    field = {"type": "Feature", "properties": {"name": "Hof"}, "geometry": polygon}
    whole = {"type": "FeatureCollection", "features": [nowhere, field, nowhere]}
    read = read_field(write(tmp_path, "f.geojson", json.dumps(whole)))
    assert (read.name, len(read.gates)) == ("Hof", 0)
    for features in ([nowhere], [], None):
        whole["features"] = features
        with pytest.raises(InvalidInput, match="`field file` must hold a polygon"):
            read_field(write(tmp_path, "f.geojson", json.dumps(whole)))


@pytest.mark.parametrize("place", [(1e308, 1e308), (50.0, 20.0), (np.nan, 48.0)])
@pytest.mark.parametrize("what", ["gates", "trucks"])
def test_gates_and_trucks_on_the_other_side_of_the_earth_are_none_of_the_field(
    tmp_path, what, place
):
    path = write(tmp_path, "f.wkt", shapely.Polygon(degrees(SQUARE)).wkt)
    with pytest.raises(InvalidInput, match=f"`{what}` must lie within 200 km of the field"):
        read_field(path, **{what: [place]})


def test_a_no_go_layer_in_a_file_of_its_own_may_part_a_field(tmp_path):
    path = write(tmp_path, "f.geojson", polygon(SQUARE))
    layer = write(tmp_path, "road.wkt", "LINESTRING (50 -9, 50 99)")
    with pytest.raises(InvalidInput, match="`no_go` must hold polygons only"):
        read_field(path, coordinates="metres", no_go=layer)
    layer = write(tmp_path, "road.wkt", "POLYGON ((45 -20, 55 -20, 55 99, 45 99, 45 -20))")
    with pytest.raises(InvalidInput, match="one of 2 parts"):
        read_field(path, coordinates="metres", no_go=layer)
    west = read_field(path, coordinates="metres", no_go=layer, part=1)
    assert west.area == pytest.approx(45.0 * 80.0)
    assert west.ground.bounds[2] == pytest.approx(45.0)
    layer = write(tmp_path, "all.wkt", "POLYGON ((-9 -9, 109 -9, 109 99, -9 99, -9 -9))")
    with pytest.raises(InvalidInput, match="`no_go` must leave something"):
        read_field(path, coordinates="metres", no_go=layer)


def test_metres_far_from_zero_get_a_zero_of_their_own(tmp_path):
    path = write(tmp_path, "f.geojson", polygon(moved(SQUARE, 5e5, 5.7e6)))
    field = read_field(path, coordinates="metres")
    assert abs(field.world.bounds).max() < 100.0
    corners = field.place.outwards(field.world.boundary)
    assert corners.min(axis=0).tolist() == [5e5, 5.7e6]


def write_shapefile(folder, projection, *records):
    with shapefile.Writer(str(folder / "f.shp")) as writer:
        writer.field("KIND", "C", 10)
        writer.field("NAME", "C", 20)
        for kind, name, rings in records:
            # Exteriors of a Shapefile run clockwise.
            writer.poly([rings[0][::-1], *rings[1:]])
            writer.record(kind, name)
    (folder / "f.prj").write_text(projection)
    return folder / "f.shp"


def test_shapefiles_have_holes_kinds_and_a_projection(tmp_path):
    records = [("", "Hof", [SQUARE, HOLE]), ("no-go", "", [moved(HOLE, 30)])]
    path = write_shapefile(tmp_path, 'PROJCS["ETRS89 / UTM zone 32N"]', *records)
    field = read_field(path, coordinates="metres")
    assert (field.name, len(field.obstacles)) == ("Hof", 2)
    assert field.area == pytest.approx(7800.0)
    with pytest.raises(InvalidInput, match=r"must be metres for f\.shp; got wgs84"):
        read_field(path)
    content = path.read_bytes()
    for end in range(0, len(content), 37):
        path.write_bytes(content[:end])
        with pytest.raises(InvalidInput, match="`field file` must"):
            read_field(path, coordinates="metres")


@pytest.mark.parametrize("gone", [(".dbf",), (".dbf", ".shx")])
def test_a_shapefile_without_attributes_is_a_field(tmp_path, gone):
    path = write_shapefile(tmp_path, 'PROJCS["ETRS89 / UTM zone 32N"]', ("", "", [SQUARE, HOLE]))
    for suffix in gone:
        path.with_suffix(suffix).unlink()
    field = read_field(path, coordinates="metres")
    assert (len(field.obstacles), field.area) == (1, pytest.approx(7900.0))


def taskdata(inner, head=""):
    return f'{head}<ISO11783_TaskData VersionMajor="4" VersionMinor="2">{inner}</ISO11783_TaskData>'


def ring(kind, points):
    inner = "".join(f'<PNT A="2" C="{lat:.9f}" D="{lon:.9f}"/>' for lon, lat in points)
    return f'<LSG A="{kind}">{inner}</LSG>'


def degrees(points):
    return [[11.0 + x / 1e5, 48.0 + y / 1e5] for x, y in points]


PARTFIELD = (
    '<PFD A="PFD1" C="Hof" D="7900"><PLN A="1">'
    + ring("1", degrees(SQUARE))
    + ring("2", degrees(HOLE))
    + "</PLN>"
    + f'<PLN A="6">{ring("1", degrees(moved(HOLE, 30)))}</PLN>'
    + '<PNT A="3" C="48.0" D="11.0005"/><PNT A="4" C="48.0" D="11.0009"/></PFD>'
)


def test_task_data_have_boundaries_obstacles_gates_and_places_of_trucks(tmp_path):
    write(tmp_path, "TASKDATA.XML", taskdata(PARTFIELD))
    field = read_field(tmp_path)
    assert (field.name, len(field.obstacles)) == ("Hof", 2)
    scale = shapely.transform(shapely.Polygon(degrees(SQUARE)), field.place.inwards).area / 8000.0
    assert field.area == pytest.approx(7800.0 * scale, rel=1e-6)
    gate, truck = (field.place.outwards(each)[0] for each in (field.gates, field.trucks))
    assert [*gate, *truck] == pytest.approx([11.0005, 48.0, 11.0009, 48.0], abs=1e-11)
    with pytest.raises(InvalidInput, match="`coordinates` must be wgs84"):
        read_field(tmp_path, coordinates="metres")


def test_partfields_in_files_of_their_own_are_read(tmp_path):
    write(tmp_path, "TASKDATA.XML", taskdata('<XFR A="PFD00001" B="1"/>'))
    write(tmp_path, "PFD00001.XML", f"<XFC>{PARTFIELD}</XFC>")
    assert read_field(tmp_path / "TASKDATA.XML").name == "Hof"


ENTITIES = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'


@pytest.mark.parametrize(
    ("content", "match"),
    [
        ("", "readable XML"),
        ("<", "readable XML"),
        ("nonsense", "readable XML"),
        ('<?xml version="1.0" encoding="klingon"?><a/>', "readable XML"),
        (taskdata(PARTFIELD)[:-30], "readable XML"),
        (taskdata(PARTFIELD, ENTITIES), "readable XML"),
        ("<KML/>", "ISO 11783 task data; got <KML>"),
        (taskdata(""), "hold a partfield with a boundary"),
        (taskdata('<PFD A="PFD1" C="x"><PLN A="1"/></PFD>'), "have an exterior in x"),
        (taskdata('<PFD A="PFD1"><PLN A="1"><LSG A="1"/></PLN></PFD>'), "rings of three points"),
        (taskdata(PARTFIELD.replace('LSG A="2"', 'LSG A="5"')), "exteriors and interiors only"),
        (taskdata(PARTFIELD.replace('C="48.000800000"', 'C="north"')), "degrees within .*north"),
        (taskdata(PARTFIELD.replace('C="48.000800000"', 'C="1e308"')), "degrees within .*1e308"),
        (taskdata(PARTFIELD.replace('C="48.000800000"', 'C="nan"')), "degrees within .*nan"),
        (taskdata('<XFR A="PFD00009"/>'), "exist"),
        (
            taskdata(
                PARTFIELD.replace(
                    ring("1", degrees(SQUARE)),
                    ring("1", degrees([[0, 0], [100, 80], [100, 0], [0, 80], [0, 0]])),
                )
            ),
            "do not cross themselves",
        ),
    ],
)
def test_broken_task_data_are_refused_in_one_line(tmp_path, content, match):
    with pytest.raises(InvalidInput, match=match) as caught:
        read_field(write(tmp_path, "TASKDATA.XML", content))
    assert str(caught.value).startswith("`field file` must")
    assert "\n" not in str(caught.value)


@given(cut=st.integers(0, 700), junk=st.binary(max_size=6))
def test_damaged_task_data_are_refused_and_nothing_worse(tmp_path_factory, cut, junk):
    whole = taskdata(PARTFIELD).encode()
    path = tmp_path_factory.mktemp("damaged") / "TASKDATA.XML"
    path.write_bytes(whole[:cut] + junk + whole[cut + len(junk) :])
    try:
        field = read_field(path)
    except InvalidInput:
        return
    assert field.polygon.is_valid


@given(
    origin=st.tuples(st.floats(-179, 179), st.floats(-80, 80)),
    point=st.tuples(st.floats(-9e3, 9e3), st.floats(-9e3, 9e3)),
)
def test_degrees_and_metres_are_inverse_to_each_other(origin, point):
    place = Place(origin=origin)
    there = place.outwards(np.array([point]))
    assert place.inwards(there)[0] == pytest.approx(point, abs=1e-6)
