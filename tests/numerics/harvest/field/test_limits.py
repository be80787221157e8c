"""Fields, files of them and maps of yields, up to the limits of what they may be."""

import json
import math

import numpy as np
import pytest
import shapefile
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world, world_from_polygon
from sightfield.systems.numerics.harvest.field.field import MARGIN, Field, Place
from sightfield.systems.numerics.harvest.field.field_files import read_field
from sightfield.systems.numerics.harvest.field.yield_map import (
    YieldMap,
    grain_on_cells,
    known_part,
    mean_density,
    read_yields,
)

BOUNDARY = [[3.1, 1.2], [203.4, 7.7], [197.9, 151.3], [88.0, 160.2], [-4.3, 140.6], [3.1, 1.2]]
POND = [[60.3, 50.1], [72.7, 51.4], [69.9, 63.2], [60.3, 50.1]]
COPSE = [[120.0, 90.0], [133.1, 92.2], [128.7, 104.5], [120.0, 90.0]]
DITCH = [[-30.0, 60.0], [30.0, 62.3], [30.0, 64.0], [-30.0, 61.9], [-30.0, 60.0]]
OTHER = [[230.0, 10.0], [300.0, 14.0], [290.0, 70.0], [230.0, 10.0]]
FAR_OFF = [[900.0, 10.0], [950.0, 14.0], [940.0, 70.0], [900.0, 10.0]]


def feature(shape, **told):
    return {"type": "Feature", "properties": told, "geometry": shape}


def area(*rings):
    return {"type": "Polygon", "coordinates": list(rings)}


def point(x, y):
    return {"type": "Point", "coordinates": [x, y, 512.0]}


FEATURES = [
    feature(area(BOUNDARY, POND), KIND=" Field ", Name=" Hof "),
    feature(area(COPSE), kind=3),
    feature(area(DITCH), kind=" NO-GO"),
    feature(area([[99.0, 60.0], [101.0, 60.0], [101.0, 62.0], [99.0, 60.0]]), kind="no-go"),
    feature({"type": "LineString", "coordinates": [[150, 20], [171.2, 33.3]]}, kind="no-go"),
    feature(point(40.0, 120.0), kind="no-go"),
    feature(point(-4.0, 20.0), kind="gate"),
    feature(point(210.0, 20.0), kind="truck"),
    feature(area(OTHER), kind="field", name=None),
    feature(area(FAR_OFF), name="Feld"),
]


def written(folder, content, name="f.geojson"):
    text = content if isinstance(content, str) else json.dumps(content)
    (folder / name).write_text(text, encoding="utf-8-sig")
    return folder / name


def collection(features):
    return {"type": "FeatureCollection", "features": features}


def told(field):
    """All that is known of a field."""
    return {
        "boundary": field.world.boundary,
        "obstacles": list(field.world.obstacles),
        "area": field.area,
        "ground": [field.ground.area, field.ground.bounds, field.ground.centroid.coords[0]],
        "no-go": [[each.area, each.centroid.coords[0]] for each in field.no_go],
        "places": [field.gates, field.trucks],
        "place": field.place,
        "name": field.name,
        "margin": field.margin,
    }


@pytest.mark.parametrize("part", [1, 2, 3, 4])
def test_parts_of_a_field_with_all_there_is_are_as_recorded(tmp_path, as_recorded, part):
    path = written(tmp_path, collection(FEATURES))
    with pytest.raises(InvalidInput, match="one of") as refused:
        read_field(path, coordinates="metres", margin=14.5, part=5)
    as_recorded(str(refused.value).replace(str(tmp_path), ""), "parts")
    if part <= 3:
        field = read_field(
            path, coordinates="metres", margin=14.5, part=part, trucks=[(215.0, 33.0)]
        )
        as_recorded(told(field))


def test_task_data_with_all_that_they_know_are_as_recorded(tmp_path, as_recorded):
    def place(kind, x, y):
        return f'<PNT A="{kind}" C="{48.1 + y / 1e5:.9f}" D="{11.3 + x / 1e5:.9f}"/>'

    def line(kind, ring, extra=""):
        return f'<LSG A="{kind}">' + "".join(place(2, *each) for each in ring) + f"{extra}</LSG>"

    rings = [line(1, BOUNDARY), line(2, POND)]
    parts = [f'<PLN A="1">{"".join(rings)}</PLN>']
    kinds = {kind: 20.0 * number for number, kind in enumerate((2, 3, 4, 5, 6, 7, 12))}
    for kind, x in kinds.items():
        ring = [[20 + x, 100], [31 + x, 101], [28 + x, 113], [20 + x, 100]]
        parts.append(f'<PLN A="{kind}">{line(1, ring)}</PLN>')
    parts += [line(kind, [[20 + 9 * kind, 30], [22 + 9 * kind, 44]]) for kind in (5, 6, 7, 9)]
    parts += [place(kind, -3 + 7 * kind, 25 + kind) for kind in (1, 2, 3, 4, 5, 6)]
    whole = f'<PFD A="PFD7">{"".join(parts)}</PFD><XFR A="PFD00002"/><XFR A="TSK00001"/>'
    written(tmp_path, f"<ISO11783_TaskData>{whole}</ISO11783_TaskData>", "TaskData.xml")
    second = f'<PFD A="PFD8" C="Süd"><PLN A="1">{line(1, OTHER)}</PLN></PFD>'
    written(tmp_path, f"<XFC>{second}</XFC>", "PFD00002.XML")
    for part in (1, 2):
        field = read_field(tmp_path, margin=9.5, part=part, gates=[(11.2999, 48.1001)])
        assert field.place.geographic
        as_recorded(told(field), str(part))
    short = line(9, [[20, 30]])
    one = f'<ISO11783_TaskData><PFD A="PFD7">{parts[0]}{short}</PFD></ISO11783_TaskData>'
    with pytest.raises(InvalidInput, match="lines of two points in PFD7"):
        read_field(written(tmp_path, one, "f.xml"))


def test_shapefiles_without_a_projection_and_with_nothing_in_them_are_read_as_recorded(
    tmp_path, as_recorded
):
    with shapefile.Writer(str(tmp_path / "f.shp")) as writer:
        writer.field("Kind", "C", 10)
        writer.poly([BOUNDARY[::-1], POND])
        writer.record("x")
        writer.null()
        writer.record("gate")
        writer.poly([COPSE[::-1]])
        writer.record("No-Go")
    as_recorded(told(read_field(tmp_path / "f.shp", coordinates="metres")), "all")
    for head in ("GEOGCS[", " geogcrs["):
        (tmp_path / "f.prj").write_text(head)
        with pytest.raises(InvalidInput, match=r"must be wgs84 for f\.shp; got metres"):
            read_field(tmp_path / "f.shp", coordinates="metres")
    with shapefile.Writer(str(tmp_path / "g.shp")) as writer:
        writer.field("KIND", "C", 10)
        writer.null()
        writer.record("")
    with pytest.raises(InvalidInput, match=r"hold a polygon; got nothing in .*g\.shp"):
        read_field(tmp_path / "g.shp", coordinates="metres")


@pytest.mark.parametrize(
    ("longitude", "latitude", "fits"),
    [(180, 0, True), (-180, 88.99, True), (180.01, 0, False), (0, 89, False), (0, -89, False)],
)
def test_fields_lie_on_the_globe_but_not_at_its_poles(longitude, latitude, fits):
    if fits:
        assert Place((longitude, latitude)).geographic
    else:
        with pytest.raises(InvalidInput, match="`origin`"):
            Place((longitude, latitude))


def test_where_the_place_is_not_known_metres_are_shifted():
    place, points = Place(offset=(300.0, -70.0)), np.array([[1.5, 2.5], [-3.0, 9.0]])
    assert not place.geographic
    assert place.outwards(points).tolist() == [[301.5, -67.5], [297.0, -61.0]]
    assert place.inwards(place.outwards(points)).tolist() == points.tolist()


@pytest.mark.parametrize("name", ["gates", "trucks"])
def test_places_lie_within_200_kilometres(name):
    world = make_world([(0, 0), (9, 0), (9, 9)])
    assert len(getattr(Field(world, **{name: np.array([[200e3, -200e3]])}), name)) == 1
    for x, y in ((200001.0, 0.0), (0.0, -200001.0)):
        with pytest.raises(InvalidInput, match=f"`{name}`"):
            Field(world, **{name: np.array([[0.0, 1.0], [x, y]])})


def test_a_field_has_a_margin_of_twelve_metres_unless_told_and_may_have_none():
    assert (Field.rectangle(9.0, 5.0).margin, MARGIN) == (12.0, 12.0)
    bare = Field.rectangle(9.0, 5.0, margin=0.0)
    assert bare.ground.area == pytest.approx(45.0)
    assert bare.polygon.area == bare.area == 45.0


def test_bits_of_the_margin_that_are_cut_off_are_no_ground():
    crop = world_from_polygon(shapely.box(0, 0, 60, 40))
    # One fence off the field, one across it, which leaves more on the right.
    off = shapely.box(-20, -8, 80, -7)
    across = shapely.box(19, -30, 20, 70)
    assert Field(crop, 10.0, no_go=(off,)).ground.bounds[1] == pytest.approx(-7.0)
    assert Field(crop, 10.0, no_go=(across,)).ground.bounds == pytest.approx((20, -10, 70, 50))


def test_what_is_told_wrongly_is_refused(tmp_path):
    path = written(tmp_path, area(BOUNDARY))
    assert read_field(path, coordinates="metres", part=1).name == ""
    for more, said in (
        ({"coordinates": "feet"}, "`coordinates`"),
        ({"part": -1}, "`part`"),
        ({"part": 2}, "one of 1 parts"),
        ({"no_go": tmp_path / "gone.wkt"}, "`no_go` must exist"),
    ):
        with pytest.raises(InvalidInput, match=said):
            read_field(path, **{"coordinates": "metres", **more})
    gates = [feature(area(BOUNDARY)), feature(area(COPSE), kind="gate")]
    with pytest.raises(InvalidInput, match="have points as a gate; got Polygon"):
        read_field(written(tmp_path, collection(gates)), coordinates="metres")
    empty = [feature(area(BOUNDARY)), feature({"type": "Point", "coordinates": []}, kind="truck")]
    with pytest.raises(InvalidInput, match="have points as a truck; got Point"):
        read_field(written(tmp_path, collection(empty)), coordinates="metres")
    crossed = area([[0, 0], [9, 9], [9, 0], [0, 9], [0, 0]])
    with pytest.raises(InvalidInput, match="an invalid no-go area"):
        read_field(
            written(tmp_path, collection([*gates[:1], feature(crossed, kind="no-go")])),
            coordinates="metres",
        )
    with pytest.raises(InvalidInput, match="`field file` must hold a polygon; got none in"):
        read_field(
            written(tmp_path, collection([feature(point(1, 2), kind="gate")])),
            coordinates="metres",
        )


@pytest.mark.parametrize(
    ("name", "read"),
    [
        ("f.xml", read_field),
        ("f.geojson", lambda path: read_yields(path, Field.rectangle(9, 9), 0.5)),
    ],
)
def test_files_are_taken_up_to_fifty_megabytes(tmp_path, name, read):
    with open(tmp_path / name, "wb") as file:
        file.truncate(50_000_000)
    with pytest.raises(InvalidInput, match="readable"):
        read(tmp_path / name)
    with open(tmp_path / name, "ab") as file:
        file.truncate(50_000_001)
    with pytest.raises(InvalidInput, match="at most 50"):
        read(tmp_path / name)


@pytest.mark.parametrize(
    ("corners", "said"),
    [
        ([(179.5, 0), (180, 0), (180, 0.5)], ""),
        ([(179.5, 0), (180.1, 0), (180, 0.5)], r"\+-180"),
        ([(-180.1, 0), (-179.9, 0), (-179.9, 0.2)], r"\+-180"),
        ([(0, 89.8), (0.1, 90.1), (0.1, 89.8)], r"\+-90"),
        ([(0, -90.1), (0.1, -89.9), (0.1, -89.8)], r"\+-90"),
        ([(0, 0), (1, 0), (1, 0.4)], ""),
        ([(0, 0), (0.2, 0), (0.2, 1.01)], "span at most"),
        ([(0, 0), (1.01, 0), (0.2, 0.2)], "span at most"),
    ],
)
def test_degrees_are_within_the_globe_and_span_a_degree(tmp_path, corners, said):
    path = written(tmp_path, shapely.Polygon(corners).wkt, "f.wkt")
    if said:
        with pytest.raises(InvalidInput, match=said):
            read_field(path)
    else:
        centre = shapely.Polygon(corners).centroid
        assert read_field(path).place.origin == pytest.approx((centre.x, centre.y))


@pytest.mark.parametrize(
    ("corners", "offset"),
    [
        ([(0, 0), (1.01, 0), (1.01, 0.4)], (0.0, 0.0)),
        ([(0, 0), (0.2, 0), (0.2, 1.01)], (0.0, 0.0)),
        ([(19000, 0), (20000, 0), (20000, 900)], (0.0, 0.0)),
        ([(19000, -20001), (19900, -20001), (19900, -19000)], (19600, -19667)),
    ],
)
def test_metres_span_more_than_a_degree_and_get_a_zero_where_they_are_far(
    tmp_path, corners, offset
):
    path = written(tmp_path, shapely.Polygon(corners).wkt, "f.wkt")
    assert read_field(path, coordinates="metres").place == Place(offset=offset)


def test_coordinates_that_are_on_no_planet_are_refused(tmp_path):
    for most, fits in ((0.99e8, True), (1e8, False)):
        corners = [(most, 0), (most - 900, 0), (most, 900)]
        path = written(tmp_path, shapely.Polygon(corners).wkt, "f.wkt")
        if fits:
            assert read_field(path, coordinates="metres").area == pytest.approx(405e3)
        else:
            with pytest.raises(InvalidInput, match="coordinates within"):
                read_field(path, coordinates="metres")


def test_slivers_that_a_ditch_leaves_are_no_parts(tmp_path):
    ditch = [[0, 50.0], [100.0, 50.0], [100.0, 51.0], [0, 51.0], [0, 50.0]]
    for width, parts in ((1.99, 1), (2.03, 2)):
        wide = [[50.0, 0], [100.0, 0], [100.0, 100], [50.0, 100], [50.0, 0]]
        wide[0][0] = wide[3][0] = wide[4][0] = width
        whole = [[0, 0], [100.0, 0], [100.0, 100], [0, 100], [0, 0]]
        kinds = [feature(area(ring), kind="no-go") for ring in (ditch, wide)]
        # West of the wide one there are two strips of about half of its length.
        kinds = kinds[1:] if parts == 2 else kinds
        path = written(tmp_path, collection([feature(area(whole)), *kinds]))
        if parts == 2:
            assert read_field(path, coordinates="metres").area == pytest.approx(100 * width)
        else:
            with pytest.raises(InvalidInput, match="leave something"):
                read_field(path, coordinates="metres")


GRID = YieldMap(np.array([10.0, -5.0]), 4.0, np.arange(12.0).reshape(3, 4) / 10)


def test_grain_is_that_of_the_nearest_cell():
    places = np.array([[9.0, -6.0], [14.1, -1.1], [25.9, 6.9], [99.0, 0.0], [13.9, 99.0]])
    assert GRID.at(places).tolist() == [0.0, 0.1, 1.1, 0.7, 0.8]
    corner, shape = np.array([6.5, -9.3]), (13, 17)
    rows, columns = np.indices(shape)
    middles = corner + 1.7 * (np.stack([columns, rows], axis=-1) + 0.5)
    found = GRID.on_cells(corner, 1.7, shape)
    assert (found == GRID.at(middles.reshape(-1, 2)).reshape(shape)).all()
    assert grain_on_cells(GRID, corner, 1.7, shape) == pytest.approx(1.7**2 * found)
    assert grain_on_cells(0.8, corner, 1.5, (2, 3)).tolist() == [[1.8] * 3] * 2
    assert (known_part(GRID), known_part(0.8)) == (1.0, None)
    assert mean_density(0.8, shapely.box(0, 0, 1, 1)) == 0.8


@pytest.mark.parametrize("side", [4.0, 0.11])
def test_a_mean_is_taken_over_the_ground(side):
    values = np.random.default_rng(4).uniform(0.1, 1.3, (400, 300) if side < 4 else (3, 4))
    grown = YieldMap(np.array([10.0, -5.0]), side, values)
    ground = shapely.Polygon([(11, -4), (25, -2), (22, 6.5), (12, 5)])
    fine = np.stack(np.meshgrid(np.arange(10, 26, 0.02), np.arange(-5, 7, 0.02)), -1)
    fine = fine.reshape(-1, 2) + 0.01
    inside = shapely.contains_xy(ground, *fine.T)
    wanted = grown.at(fine[inside]).mean()
    assert mean_density(grown, ground) == pytest.approx(wanted, rel=2e-3)


def test_a_mean_over_a_strip_is_as_recorded(as_recorded):
    strip = shapely.Polygon([(11, -4), (25, -3.4), (25, -3.1), (11, -3.6)])
    values = np.random.default_rng(4).uniform(0.1, 1.3, (400, 400))
    sides = (4.0, 0.06, 0.031, 0.012)
    as_recorded([mean_density(YieldMap(np.array([9.0, -5]), s, values), strip) for s in sides])


@pytest.mark.parametrize(
    "wrong",
    [
        {"side": 0.0},
        {"values": np.zeros((0, 3))},
        {"values": np.zeros(3)},
        {"values": np.array([[1.0, -1e-9]])},
        {"values": np.array([[1.0, np.inf]])},
        {"known": 1.01},
        {"known": -0.01},
    ],
    ids=str,
)
def test_maps_that_cannot_be_are_refused(wrong):
    with pytest.raises(InvalidInput):
        YieldMap(**{"corner": np.zeros(2), "side": 1.0, "values": np.ones((1, 1)), **wrong})


FIELD = Field(world_from_polygon(shapely.Polygon([(0, 0), (81, 3), (77, 59), (4, 63)])), 5.0)


def box(value, *bounds, **more):
    shape = json.loads(shapely.to_geojson(shapely.box(*bounds)))
    return feature(shape, **{"Yield": value, **more})


def test_maps_from_files_are_as_recorded(tmp_path, as_recorded):
    path = written(
        tmp_path,
        collection(
            [box(7.7, 0, 0, 40, 40), feature(None), box(3.3, 20, 10, 60, 50), box(0, 50, 0, 90, 20)]
        ),
    )
    found = read_yields(path, FIELD, 0.61)
    as_recorded([found, mean_density(found, FIELD.polygon)], "polygons")
    head = "NCOLS 5 nrows 3 XLLCENTER 9 yllcorner -3 cellsize 17.5 "
    grid = written(tmp_path, head + "1 2 3 4 5 6 7 -9999 9 8 7 6 5 4 3", "y.asc")
    as_recorded([read_yields(grid, FIELD, 0.61), read_yields(grid, FIELD, 0.3).known], "grid")
    wide = Field.rectangle(1500.0, 700.0)
    coarse = read_yields(written(tmp_path, collection([box(5, 0, 0, 900, 900)])), wide, 0.4)
    assert coarse.side == pytest.approx(math.sqrt(1500 * 700 / 250_000))
    as_recorded(coarse, "coarse")


@pytest.mark.parametrize(
    ("value", "said"),
    [(0, "positive somewhere"), (100.0, ""), (100.1, "between 0"), (True, "a number"), (-0.1, "0")],
)
def test_yields_are_those_of_grain(tmp_path, value, said):
    path = written(tmp_path, collection([box(value, -9, -9, 99, 99)]))
    if said:
        with pytest.raises(InvalidInput, match=said):
            read_yields(path, FIELD, 0.61)
    else:
        assert read_yields(path, FIELD, 0.61).values.max() == value / 10


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("ncols 2 nrows 1 xllcorner 0 yllcorner 0 cellsize 0 5 5", "cellsize"),
        ("ncols 0 nrows 1 xllcorner 0 yllcorner 0 cellsize 9", "0 numbers"),
        ("ncols -1 nrows -2 xllcorner 0 yllcorner 0 cellsize 9 5 5", "have rows"),
        ("ncols 4 nrows 0.5 xllcorner 0 yllcorner 0 cellsize 9 5 5", "have rows"),
        ("ncols 2 nrows 1 yllcorner 0 cellsize 9 5 5", "tell xllcorner"),
        ("ncols 2 nrows 1 xllcorner inf yllcorner 0 cellsize 9 5 5", "lie somewhere"),
        ("ncols", "readable|ncols"),
    ],
)
def test_grids_that_cannot_be_are_refused(tmp_path, text, said):
    with pytest.raises(InvalidInput, match=said):
        read_yields(written(tmp_path, text, "y.asc"), FIELD, 0.61)
