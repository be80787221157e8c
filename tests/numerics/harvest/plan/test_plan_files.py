"""Plans as GeoJSON and as task data, read back by other libraries: Shapely and isoxml."""

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest
import shapely
from isoxml.models.base.v4 import GuidancePatternType, LineStringType, PointType
from isoxml.util.isoxml_io import isoxml_from_text

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.field.field import Field, Place
from sightfield.systems.numerics.harvest.field.field_files import read_field
from sightfield.systems.numerics.harvest.machines import Cart, Combine
from sightfield.systems.numerics.harvest.plan.harvest_plan import plan_harvest
from sightfield.systems.numerics.harvest.plan.plan_files import (
    CHORD_ERROR,
    NOWHERE,
    plan_geojson,
    plan_taskdata,
    swaths_of,
)

ORIGIN = (11.5, 48.1)
CENTIMETRE = 0.01


@pytest.fixture(scope="module")
def plan():
    """One combine and one cart on a field with a pond and a gate, and no right angle."""
    rim = [(0, 0), (140, 10), (130, 105), (8, 95)]
    pond = [(60, 45), (75, 45), (75, 57), (60, 57)]
    world = make_world(rim, [pond])
    gate = np.array([[70.0, 5.0]])
    field = Field(world, gates=gate, place=Place(origin=ORIGIN), name="Hof & <Berg>")
    return plan_harvest(field, [Combine(capacity=4e3)], Cart(), carts=1, density=0.8)


@pytest.fixture(scope="module")
def nowhere(plan):
    """The same plan, but nobody knows where the field lies."""
    field = replace(plan.combines.field, place=Place(offset=(1e5, 2e5)))
    return replace(plan, combines=replace(plan.combines, field=field))


def metres(points):
    return Place(origin=ORIGIN).inwards(np.asarray(points, dtype=float))


def line_of(pattern):
    """Kinds of points and points of a guidance pattern as isoxml reads it [m]."""
    (line,) = pattern.line_strings
    assert line.type is LineStringType.GuidancePattern
    points = [(float(each.east), float(each.north)) for each in line.points]
    return [each.type for each in line.points], metres(points)


def test_swaths_are_what_is_cut_and_follow_on_each_other(plan):
    swaths = swaths_of(plan)
    path = plan.service.plans[0].path
    assert sum(each.length for each in swaths) == pytest.approx(path.lengths[path.cutting].sum())
    assert [each.number for each in swaths] == list(range(1, len(swaths) + 1))
    for here, there in itertools.pairwise(swaths):
        assert here.begin < here.end <= there.begin + 1e-3
    poses = plan.service.plans[0].pose_at(np.array([each.begin for each in swaths]))
    starts = np.array([each.points[0] for each in swaths])
    np.testing.assert_allclose(poses[:, :2], starts, atol=1e-3)
    cut = shapely.union_all([shapely.LineString(each.points).buffer(4.6) for each in swaths])
    polygon = plan.combines.field.polygon
    assert polygon.difference(cut).area < 0.02 * polygon.area


def test_chords_of_curves_are_within_a_centimetre_of_them(plan):
    path = plan.service.plans[0].path
    fine = path.pose_at(path.stations_every(0.05))[:, :2]
    for swath in swaths_of(plan):
        line = shapely.LineString(swath.points)
        near = shapely.distance(line, shapely.points(fine)) < 0.5
        assert near.any()
        assert swath.length == pytest.approx(line.length, rel=1e-3)
    assert CHORD_ERROR < CENTIMETRE


def test_geojson_is_read_by_shapely_to_a_centimetre(plan):
    whole = json.loads(json.dumps(plan_geojson(plan)))
    assert whole["coordinates"] == "wgs84"
    shapes = shapely.from_geojson(json.dumps(whole)).geoms
    kinds = [each["properties"]["kind"] for each in whole["features"]]
    boundary = shapely.transform(shapes[kinds.index("field")], metres)
    polygon = plan.combines.field.polygon
    assert shapely.hausdorff_distance(boundary, polygon) < CENTIMETRE
    assert boundary.area == pytest.approx(polygon.area, rel=1e-5)
    assert boundary.exterior.is_ccw
    swaths = swaths_of(plan)
    read = [shape for shape, kind in zip(shapes, kinds, strict=True) if kind == "swath"]
    for shape, swath in zip(read, swaths, strict=True):
        np.testing.assert_allclose(metres(shape.coords), swath.points, atol=CENTIMETRE)
    ways = [each for each in whole["features"] if each["properties"]["kind"] == "way"]
    timed = [*plan.service.plans, *(motion.timed for motion in plan.service.motions)]
    for way, mine in zip(ways, timed, strict=True):
        there = mine.pose_at(np.array(way["properties"]["times"]))[:, :2]
        np.testing.assert_allclose(metres(way["geometry"]["coordinates"]), there, atol=0.05)
    assert kinds.count("visit") == len(plan.service.visits)
    assert kinds.count("trip") == len(plan.service.trips)


def test_where_nobody_knows_the_place_geojson_is_in_the_metres_of_the_file(nowhere):
    whole = plan_geojson(nowhere)
    assert whole["coordinates"] == "metres"
    swath = next(each for each in whole["features"] if each["properties"]["kind"] == "swath")
    expected = swaths_of(nowhere)[0].points + np.array([1e5, 2e5])
    np.testing.assert_allclose(swath["geometry"]["coordinates"], expected, atol=1e-4)


def test_guidance_lines_are_read_by_isoxml_to_a_centimetre(plan):
    data = isoxml_from_text(plan_taskdata(plan).decode())
    (part,) = data.partfields
    assert part.designator == "Hof & <Berg>"
    (group,) = part.guidance_groups
    swaths = swaths_of(plan)
    for pattern, swath in zip(group.guidance_patterns, swaths, strict=True):
        kinds, points = line_of(pattern)
        curve, line = GuidancePatternType.Curve, GuidancePatternType.AB
        assert pattern.type is (line if swath.straight else curve)
        assert (len(points) == 2) == swath.straight
        assert kinds[0] is PointType.GuidanceReferenceA
        assert kinds[-1] is PointType.GuidanceReferenceB
        np.testing.assert_allclose(points, swath.points, atol=CENTIMETRE)
        if swath.straight:
            east, north = points[1] - points[0]
            heading = np.degrees(np.arctan2(east, north)) % 360
            assert float(pattern.heading) == pytest.approx(heading, abs=0.05)
        assert pattern.line_strings[0].width == 9000
    gate, truck = part.points
    assert (gate.type, truck.type) == (PointType.FieldAccess, PointType.Storage)
    there = metres([(float(gate.east), float(gate.north))])
    np.testing.assert_allclose(there, [[70.0, 5.0]], atol=CENTIMETRE)


def test_our_own_reader_takes_the_field_from_both_files(plan, tmp_path):
    (tmp_path / "TASKDATA.XML").write_bytes(plan_taskdata(plan))
    whole = plan_geojson(plan)
    kept = ("field", "no-go", "gate")
    whole["features"] = [each for each in whole["features"] if each["properties"]["kind"] in kept]
    (tmp_path / "plan.geojson").write_text(json.dumps(whole))
    for name in ("TASKDATA.XML", "plan.geojson"):
        field = read_field(tmp_path / name)
        again = shapely.transform(field.polygon, field.place.outwards)
        mine = shapely.transform(again, metres)
        assert shapely.hausdorff_distance(mine, plan.combines.field.polygon) < CENTIMETRE
        there = metres(field.place.outwards(field.gates))
        np.testing.assert_allclose(there, [[70.0, 5.0]], atol=CENTIMETRE)


def test_a_field_that_lies_nowhere_is_put_into_the_sea_and_says_so(nowhere):
    (part,) = isoxml_from_text(plan_taskdata(nowhere).decode()).partfields
    assert part.designator == NOWHERE
    points = part.polygons[0].line_strings[0].points
    assert max(abs(float(each.north)) for each in points) < 0.01
