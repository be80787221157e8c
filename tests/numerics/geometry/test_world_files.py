"""Worlds come out of WKT, GeoJSON and ROS maps as they went in, or not at all."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.occupancy_outline import OutlineOptions
from sightfield.systems.numerics.geometry.world_files import (
    from_local_plane,
    load_world,
    local_plane,
)

PLACES = [(0.0, 0.0), (6.06, 51.51), (-88.2, 40.1), (151.2, -33.9), (179.99, 78.0)]

# 1 / 298.257223563 and its squared eccentricity, worked out apart from the code.
SEMI_MAJOR, ECCENTRICITY_SQUARED = 6378137.0, 0.0066943799901413165


@pytest.mark.parametrize("place", PLACES)
def test_the_origin_is_zero(place):
    assert np.abs(local_plane(np.array([place]), np.array(place))).max() == 0.0


@pytest.mark.parametrize("place", PLACES)
def test_a_small_step_is_as_long_as_the_radii_of_curvature_say(place):
    longitude, latitude = place
    step = 1e-5
    east, north = local_plane(
        np.array([[longitude + step, latitude], [longitude, latitude + step]]), np.array(place)
    )
    root = np.sqrt(1.0 - ECCENTRICITY_SQUARED * np.sin(np.radians(latitude)) ** 2)
    across = SEMI_MAJOR / root * np.cos(np.radians(latitude))
    along = SEMI_MAJOR * (1.0 - ECCENTRICITY_SQUARED) / root**3
    np.testing.assert_allclose(east, [np.radians(step) * across, 0.0], atol=1e-6)
    np.testing.assert_allclose(north, [0.0, np.radians(step) * along], atol=1e-6)


def test_a_degree_of_latitude_is_longest_at_the_poles():
    lengths = [
        local_plane(np.array([[0.0, latitude + 0.5]]), np.array([0.0, latitude - 0.5]))[0, 1]
        for latitude in (0.5, 45.0, 89.0)
    ]
    # Published lengths of a degree: 110.574, 111.132, 111.694 km; a chord is a little shorter.
    np.testing.assert_allclose(lengths, [110574.0, 111132.0, 111694.0], rtol=2e-4)
    assert lengths == sorted(lengths)


def test_distances_do_not_depend_on_where_the_origin_is():
    place = np.array([6.06, 51.51])
    field = place + np.array([[0.0, 0.0], [0.02, 0.0], [0.02, 0.015]])
    for origin in (place, place + 0.01, place - [0.02, -0.01]):
        sides = np.linalg.norm(np.diff(local_plane(field, origin), axis=0), axis=1)
        np.testing.assert_allclose(
            sides, np.linalg.norm(np.diff(local_plane(field, place), axis=0), axis=1), rtol=1e-6
        )


@pytest.mark.parametrize("place", PLACES[1:-1])
def test_metres_become_the_degrees_that_they_came_from(place):
    """To a tenth of a millimetre within 9 km, about 1e-9 degrees."""
    origin = np.array(place)
    away = np.random.default_rng(0).uniform(-0.05, 0.05, (200, 2))
    degrees = from_local_plane(local_plane(origin + away, origin), origin)
    np.testing.assert_allclose(degrees, origin + away, atol=1e-9)


BOUNDARY = [[0, 0], [10, 0], [10, 8], [0, 8], [0, 0]]
PILLAR = [[2, 2], [2, 3], [3, 3], [3, 2], [2, 2]]
SHED = [[5, 5], [7, 5], [7, 6], [5, 6], [5, 5]]
WALL = [[6, 0], [6.5, 0], [6.5, 8], [6, 8], [6, 0]]
YARD = [[5.5, 5.25], [6.5, 5.25], [6.5, 5.75], [5.5, 5.75], [5.5, 5.25]]

# About 1.1 km by 0.7 km, with a pond.
FIELD = [[6.06, 51.51], [6.07, 51.51], [6.07, 51.52], [6.06, 51.52], [6.06, 51.51]]
POND = [[6.062, 51.513], [6.062, 51.514], [6.063, 51.514], [6.063, 51.513], [6.062, 51.513]]


def polygon(*rings) -> dict:
    return {"type": "Polygon", "coordinates": list(rings)}


def collection(*geometries) -> dict:
    features = [{"type": "Feature", "properties": {}, "geometry": each} for each in geometries]
    return {"type": "FeatureCollection", "features": features}


def wkt(*rings) -> str:
    texts = ["(" + ", ".join(f"{x} {y}" for x, y in ring) + ")" for ring in rings]
    return f"POLYGON ({', '.join(texts)})"


@pytest.fixture(scope="module")
def load(tmp_path_factory):
    """A function that writes content to a file of some name and loads it."""
    folder = tmp_path_factory.mktemp("worlds")

    def write_and_load(content, name=None, **arguments):
        path = folder / (name or ("world.wkt" if isinstance(content, str) else "world.geojson"))
        text = content if isinstance(content, str) else json.dumps(content)
        path.write_text(text, encoding="utf-8")
        return load_world(path, **arguments)

    return write_and_load


def summary(loaded) -> tuple[int, int, int, float]:
    world = loaded.world
    return len(world.obstacles), world.vertex_count, len(world.corners), world.free_area


@pytest.mark.parametrize(
    "content",
    [
        wkt(BOUNDARY, PILLAR, SHED),
        f"\n GEOMETRYCOLLECTION({wkt(BOUNDARY, PILLAR)}, {wkt(SHED)})\n",
        polygon(BOUNDARY, PILLAR, SHED),
        {"type": "Feature", "properties": {"a": 1}, "geometry": polygon(BOUNDARY, PILLAR, SHED)},
        collection(polygon(BOUNDARY, PILLAR, SHED)),
        collection(polygon(SHED), polygon(BOUNDARY), polygon(PILLAR)),
        collection(polygon(BOUNDARY, SHED), polygon(PILLAR)),
        {"type": "MultiPolygon", "coordinates": [[BOUNDARY], [PILLAR], [SHED]]},
        {"type": "GeometryCollection", "geometries": [polygon(BOUNDARY, SHED), polygon(PILLAR)]},
    ],
)
def test_every_way_of_writing_it_gives_the_same_world(load, content):
    loaded = load(content)
    assert summary(loaded) == (2, 12, 8, pytest.approx(77.0))
    assert (loaded.simplification_error, loaded.unreachable_area) == (0.0, 0.0)
    assert loaded.geographic_origin is None


def test_heights_are_left_out(load):
    raised = [[x, y, 12.5] for x, y in BOUNDARY]
    assert summary(load(polygon(raised))) == (0, 4, 0, pytest.approx(80.0))


def test_what_an_obstacle_encloses_cannot_be_reached(load):
    loaded = load(collection(polygon(BOUNDARY), polygon(SHED, YARD)))
    assert summary(loaded) == (1, 8, 4, pytest.approx(78.0))
    assert loaded.unreachable_area == pytest.approx(0.5)


def test_obstacles_of_a_file_may_overlap(load):
    # Half of the barn stands beside the shed, a quarter in its yard.
    barn = [[4, 5.25], [6, 5.25], [6, 5.75], [4, 5.75], [4, 5.25]]
    loaded = load(collection(polygon(BOUNDARY), polygon(SHED, YARD), polygon(barn)))
    assert summary(loaded) == (1, 12, 6, pytest.approx(77.5))
    assert loaded.unreachable_area == pytest.approx(0.25)
    # The same, the shed being a hole of the boundary.
    swapped = load(collection(polygon(BOUNDARY, barn), polygon(SHED, YARD)))
    assert summary(swapped) == summary(loaded)
    assert swapped.unreachable_area == pytest.approx(0.25)


@pytest.mark.parametrize("name", ["a.wkt", "a.WKT"])
def test_the_suffix_decides(load, name):
    assert load(wkt(BOUNDARY), name).source == "wkt"


def test_json_is_taken_for_geojson(load):
    assert load(polygon(BOUNDARY), "a.json").source == "geojson"


@pytest.mark.parametrize("content", [wkt(FIELD, POND), polygon(FIELD, POND)])
def test_degrees_become_metres_around_the_centroid(load, content):
    loaded = load(content, coordinates="wgs84")
    assert loaded.geographic_origin == pytest.approx((6.065, 51.515))
    # A degree measures 69.41 km east and 111.26 km north at 51.5 degrees.
    np.testing.assert_allclose(np.ptp(loaded.world.boundary, axis=0), [694.1, 1112.6], rtol=1e-3)
    (pond,) = loaded.world.obstacles
    np.testing.assert_allclose(np.ptp(pond, axis=0), [69.41, 111.26], rtol=1e-3)
    # The pond is west and south of the middle.
    assert (pond < 0).all()


def test_degrees_are_not_taken_for_metres(load):
    with pytest.raises(InvalidInput, match=r"`coordinates` must be wgs84 .*looks like degrees"):
        load(wkt(FIELD))
    with pytest.raises(InvalidInput, match=r"`coordinates` must be wgs84 .*looks like degrees"):
        load("POLYGON ((5.1 52.1, 5.7 52.1, 5.7 52.4, 5.1 52.1))")


def test_metres_are_not_taken_for_degrees(load):
    with pytest.raises(InvalidInput, match=r"`world file` must be within \+-180, \+-90 degrees"):
        load("POLYGON ((0 0, 0.5 0, 0.5 95, 0 0))", coordinates="wgs84")
    with pytest.raises(
        InvalidInput, match=r"`world file` must span at most 1\.0 degree; got 10\.0"
    ):
        load(wkt(BOUNDARY), coordinates="wgs84")


def test_a_small_world_away_from_the_globe_s_numbers_is_in_metres(load):
    loaded = load("POLYGON ((500 0, 500.05 0, 500.05 0.05, 500 0))")
    assert loaded.world.free_area == pytest.approx(0.00125)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "`world file` must be readable WKT"),
        ("POLYGON ((0 0, 1 0", "`world file` must be readable WKT"),
        ("POLYGON ((0 0, 1 0, 1 1))", "`world file` must be readable WKT"),
        ("POINT (1 2)", "`world file` must hold polygons only; got a Point"),
        ("POLYGON EMPTY", "`world file` must hold polygons only; got an empty Polygon"),
        ("GEOMETRYCOLLECTION EMPTY", "`world file` must hold a polygon; got an empty"),
        ("POLYGON ((0 0, 4 4, 0 4, 4 0, 0 0))", "`world file` must hold valid polygons; got Self"),
        ("POLYGON ((0 0, nan 4, 0 4, 0 0))", "`world file` must hold valid polygons; got Invalid"),
        ({}, "`world file` must be readable GeoJSON"),
        ([1, 2], "`world file` must be readable GeoJSON"),
        ({"type": "Polygon"}, "`world file` must be readable GeoJSON"),
        ({"type": "Polygon", "coordinates": [[["a", 0]]]}, "`world file` must be readable GeoJSON"),
        (collection(), "`world file` must hold a polygon; got an empty GeometryCollection"),
        (
            collection(polygon(BOUNDARY), {"type": "Point", "coordinates": [1, 1]}),
            "`world file` must hold polygons only; got a Point",
        ),
        (
            {"type": "MultiPolygon", "coordinates": [[PILLAR], [SHED]]},
            "one polygon that contains all the others; got polygon 1 of 2",
        ),
        (
            # A wall and a shed that stands in it part the place in two.
            collection(polygon(BOUNDARY), polygon(SHED), polygon(WALL)),
            "`free region` must be one connected polygon; got MultiPolygon",
        ),
    ],
)
def test_what_is_no_world_is_refused_in_one_line(load, content, message):
    with pytest.raises(InvalidInput, match=message) as raised:
        load(content)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("world.shp", "`world file` must end in .wkt, .geojson, .json, .yaml, .yml; got world.shp"),
        ("nowhere.wkt", "`world file` must exist; got .*nowhere.wkt"),
        ("folder.wkt", "`world file` must be a file; got .*folder.wkt"),
        ("latin.wkt", "`world file` must be readable WKT; got .*latin.wkt"),
    ],
)
def test_a_file_that_cannot_be_read_is_named(tmp_path, name, message):
    (tmp_path / "folder.wkt").mkdir()
    (tmp_path / "latin.wkt").write_bytes(b"\xe9t\xe9")
    with pytest.raises(InvalidInput, match=message):
        load_world(tmp_path / name)


def test_coordinates_are_metres_or_wgs84(load):
    with pytest.raises(InvalidInput, match="`coordinates` must be one of metres, wgs84; got utm"):
        load(wkt(BOUNDARY), coordinates="utm")


@given(text=st.text(alphabet="POLYGN MUTI(),.-0123456789eEnaif\n", max_size=60))
def test_rubbish_in_wkt_is_refused_and_nothing_worse(load, text):
    try:
        loaded = load(text, "rubbish.wkt")
    except InvalidInput:
        return
    assert loaded.world.polygon.is_valid


scalars = st.one_of(st.none(), st.booleans(), st.integers(-9, 9), st.floats(), st.text(max_size=3))
types = st.sampled_from(["Polygon", "MultiPolygon", "Feature", "FeatureCollection", "Point"])
nested = st.recursive(
    scalars,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.fixed_dictionaries(
            {"type": types},
            optional={
                "coordinates": inner,
                "geometry": inner,
                "features": inner,
                "properties": inner,
            },
        ),
    ),
    max_leaves=12,
)


@given(content=nested)
def test_rubbish_in_geojson_is_refused_and_nothing_worse(load, content):
    try:
        loaded = load(json.dumps(content), "rubbish.geojson")
    except InvalidInput:
        return
    assert loaded.world.polygon.is_valid


@pytest.fixture
def map_file(tmp_path):
    """A room of 18 x 8 cells of 0.5 m around a box of 2 x 2, with a white stripe cut off."""
    pixels = np.zeros((12, 20), dtype=np.uint8)
    pixels[1:9, 1:19] = 254
    pixels[4:6, 8:10] = 0
    pixels[10, 1:19] = 254
    (tmp_path / "map.pgm").write_bytes(b"P5 20 12 255\n" + pixels.tobytes())
    path = tmp_path / "map.yaml"
    path.write_text(
        "image: map.pgm\nresolution: 0.5\norigin: [1.0, 2.0, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        encoding="utf-8",
    )
    return path


def test_a_ros_map_is_outlined(map_file):
    loaded = load_world(map_file)
    assert summary(loaded) == (1, 8, 4, pytest.approx((18 * 8 - 4) * 0.25))
    assert loaded.source == "map_server"
    assert loaded.unreachable_area == pytest.approx(18 * 0.25)
    # The room's lower edge is 3 rows above that of the picture.
    np.testing.assert_allclose(loaded.world.bounds, [1.5, 3.5, 10.5, 7.5])


def test_options_reach_the_map(map_file):
    loaded = load_world(map_file, options=OutlineOptions(min_obstacle_area=2.0))
    assert len(loaded.world.obstacles) == 0
    assert loaded.speckle_area == pytest.approx(1.0)


@pytest.mark.parametrize("option", [{"min_obstacle_area": 0.5}, {"unknown": "free"}])
def test_options_of_a_map_are_refused_for_what_is_none(load, option):
    (name,) = option
    with pytest.raises(InvalidInput, match=f"`{name}` must be left out for what is no ROS map"):
        load(wkt(BOUNDARY), options=OutlineOptions(**option))


def test_a_map_is_never_in_degrees(map_file):
    with pytest.raises(InvalidInput, match="`coordinates` must be metres for a map; got wgs84"):
        load_world(map_file, coordinates="wgs84")
