"""Single steps of coverage, by their geometry: loops, bays, swaths, drivers, passes and waits."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.harvest.coverage.candidates import Passes, find_candidates
from sightfield.systems.numerics.harvest.coverage.cut_ground import (
    LEAST_PATCH,
    CutGround,
    covered_area,
    header_down,
)
from sightfield.systems.numerics.harvest.coverage.driver import (
    OTHER_LOOP,
    Driver,
    NoWay,
    curve_path,
    detours,
    lay_out_roads,
    path_time,
    ring_groups,
    stop_time,
)
from sightfield.systems.numerics.harvest.coverage.lands import share_ground
from sightfield.systems.numerics.harvest.coverage.loops import (
    CLEAR,
    Loop,
    crop_to_offset,
    cutting_radius,
    drive_edge,
    drive_on,
    lay_out_loops,
    rings_inside,
    room_beyond,
    turned_ring,
)
from sightfield.systems.numerics.harvest.coverage.precedence import (
    CropPrecedence,
    can_finish,
)
from sightfield.systems.numerics.harvest.coverage.rounds import (
    ahead_on,
    bay_shifts,
    entry_length,
    entry_path,
    split_loops,
)
from sightfield.systems.numerics.harvest.coverage.swaths import Swath, lay_out_swaths
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Combine
from sightfield.systems.numerics.harvest.paths import MachinePath
from sightfield.systems.numerics.planning.car_paths import dubins_paths

COMBINE = Combine(
    header_width=7.0, header_depth=1.6, turning_radius=4.2, length=7.5, width=3.2, speed=1.7
)
# A rectangle of 30 m by 20 m from (2, 1), begun at its corner at the lower right, clockwise.
RING = shapely.LineString([(32, 1), (2, 1), (2, 21), (32, 21), (32, 1)])
LOOP = Loop(RING, np.array([0.0, 30.0, 50.0, 80.0]), np.full(4, math.pi / 2), 1, False)


def test_the_cutting_radius_is_infinite_for_headers_as_wide_as_the_body():
    assert cutting_radius(replace(COMBINE, header_width=3.2)) == math.inf
    assert cutting_radius(replace(COMBINE, turning_radius=50.0)) == 50.0
    # (r + 1.6)^2 + 7.5^2 = (r + 3.5)^2
    assert cutting_radius(COMBINE) == pytest.approx((1.6**2 + 7.5**2 - 3.5**2) / 3.8)


def test_a_loop_knows_its_poses_corners_and_parts_all_the_way_round():
    assert LOOP.length == 100.0
    assert LOOP.pose(10.0) == pytest.approx([22.0, 1.0, math.pi])
    assert LOOP.pose(10.0, -1) == pytest.approx([22.0, 1.0, 0.0])
    assert LOOP.pose(30.0) == pytest.approx([2.0, 1.0, math.pi / 2])
    assert LOOP.pose(30.0, arriving=True) == pytest.approx([2.0, 1.0, math.pi])
    assert LOOP.pose(30.0, -1, arriving=True) == pytest.approx([2.0, 1.0, -math.pi / 2])
    assert LOOP.pose(100.0) == pytest.approx([32.0, 1.0, math.pi])
    assert LOOP.pose(-10.0) == pytest.approx([32.0, 11.0, -math.pi / 2])
    assert LOOP.station(np.array([25.0, -3.0, 9.9])) == pytest.approx(7.0)
    assert LOOP.corners_within(0.0, 100.0).tolist() == [30.0, 50.0, 80.0]
    assert LOOP.corners_within(-25.0, 31.0).tolist() == [-20.0, 0.0, 30.0]
    assert LOOP.corners_within(79.0, 231.0).tolist() == [80, 100, 130, 150, 180, 200, 230]
    assert LOOP.corners_within(30.0, 30.0).tolist() == []
    assert LOOP.part(45.0, 55.0) == pytest.approx(np.array([[2, 16], [2, 21], [7, 21]]))
    across = LOOP.part(90.0, 110.0)
    np.testing.assert_allclose(across, [[32, 11], [32, 1], [32, 1], [22, 1]])
    assert LOOP.part(110.0, 120.0) == pytest.approx(np.array([[22, 1], [12, 1]]))


def test_rings_lie_inside_and_are_turned_by_what_they_go_round():
    region = shapely.box(0, 0, 60, 40) - shapely.box(25, 15, 33, 22)
    (outer, first), (inner, second) = rings_inside(region, 3.0)
    assert (first, second) == (False, True)
    assert outer.area == pytest.approx(54 * 34)
    # Round the corners of a hole they are arcs.
    assert inner.area == pytest.approx(8 * 7 + 3 * 30 + math.pi * 9, rel=1e-3)
    assert len(list(rings_inside(region, 12.0))) == 2
    assert list(rings_inside(region, 21.0)) == []
    points = np.array([[0.0, 0], [4, 0], [4, 3]])
    assert turned_ring(points, hole=True).tolist() == points.tolist()
    assert turned_ring(points, hole=False).tolist() == points[::-1].tolist()


@pytest.mark.parametrize("turn", [0.9, 2.0, math.radians(150.0), math.radians(170.0)])
def test_past_a_corner_a_header_drives_on_until_its_end_is_past_it(turn):
    asked = 3.5 * math.tan(min(turn, math.radians(150.0)) / 2) + 0.8 + CLEAR
    assert drive_on(turn, COMBINE) == pytest.approx(asked)


def test_beyond_a_corner_there_is_room_as_far_as_the_ground_goes():
    asked = drive_on(math.pi / 2, COMBINE)
    told = []

    def room(pose):
        told.append(pose)
        return pose[0] > -1.3 and pose[1] > -1.2

    # The edge that ends there goes west, the one that begins there north: backwards it goes south.
    ways = np.arange(asked, 0.0, -1.0)
    fits = [way for way in ways if 2.0 - way > -1.3]
    assert room_beyond(LOOP, 30.0, 1, COMBINE, room) == pytest.approx(fits[0])
    assert told[-1] == pytest.approx([2.0 - fits[0], 1.0, math.pi])
    fits = [way for way in ways if 1.0 - way > -1.2]
    assert room_beyond(LOOP, 30.0, -1, COMBINE, room) == pytest.approx(fits[0])
    assert told[-1] == pytest.approx([2.0, 1.0 - fits[0], math.pi / 2])
    assert room_beyond(LOOP, 30.0, 1, COMBINE, lambda pose: True) == pytest.approx(asked)
    assert room_beyond(LOOP, 30.0, 1, COMBINE, lambda pose: False) is None


@pytest.mark.parametrize("extensions", [(0.0, 0.0), (2.5, 0.0), (0.0, 3.5), (1.5, 4.5)])
def test_an_edge_is_driven_with_straights_at_its_ends(extensions):
    path = drive_edge(LOOP, 0.0, 30.0, extensions, COMBINE)
    before, behind = extensions
    np.testing.assert_allclose(path.poses[0], [32 + before, 1, math.pi], atol=1e-9)
    np.testing.assert_allclose(path.poses[-1], [2 - behind, 1, math.pi], atol=1e-9)
    assert path.cutting.all()


@pytest.mark.parametrize("shift", [3.0, 7.0, 31.0])
def test_a_change_of_lanes_comes_from_the_left_in_two_equal_arcs(shift):
    goal = np.array([5.0, -3.0, 0.8])
    along, radius = entry_length(shift, COMBINE)
    assert radius == max(cutting_radius(COMBINE), shift)
    path = entry_path(goal, shift, COMBINE)
    assert path.poses[-1] == pytest.approx(goal)
    assert path.cutting.all()
    assert path.curvatures == pytest.approx([-1 / radius, 1 / radius])
    c, s = math.cos(0.8), math.sin(0.8)
    start = [5 - along * c - shift * s, -3 - along * s + shift * c, 0.8]
    assert path.poses[0] == pytest.approx(start)


@pytest.mark.parametrize(("margin", "outside"), [(5.0, None), (6.2, 2.2), (9.0, 5.0), (30.0, 5.0)])
def test_bays_lie_beside_the_crop_where_the_margin_has_room(margin, outside):
    field = Field.rectangle(90.0, 70.0, margin=margin)
    shifts = bay_shifts(CutGround.of(field, COMBINE))
    if outside is None:
        # Half a header and two gaps less than half a body.
        assert shifts == []
        return
    # From half a header beside the crop, with three gaps between, to half a body and a gap.
    assert shifts == pytest.approx([3.5 + outside, 3.5 + (outside + 2.1) / 2, 3.5 + 2.1])


def test_the_next_round_begins_a_hundred_metres_ahead_or_a_fifth_of_a_round():
    assert ahead_on(LOOP) == 20.0
    long = Loop(shapely.LineString([(0, 0), (0, 300), (1, 300), (0, 0)]), *[np.zeros(0)] * 2, 0, 0)
    assert ahead_on(long) == 100.0


def test_arcs_share_a_loop_by_the_speeds_of_combines():
    field = Field.rectangle(160.0, 110.0, margin=14.0)
    ground = CutGround.of(field, COMBINE)
    (loop,) = lay_out_loops(crop_to_offset(field, COMBINE), COMBINE, 0, ground.has_room)
    arcs = split_loops([loop], np.array([1.0, 2.0]), ground, preferred=None, corners=False)
    lengths = [arc.end - arc.begin for arc in arcs]
    assert sum(lengths) == pytest.approx(loop.length + 2 * 2.0)
    # As near as bays have room.
    assert max(lengths) / min(lengths) == pytest.approx(2.0, abs=0.35)
    at_corners = split_loops([loop], np.ones(3), ground, preferred=None, corners=True)
    assert all(arc.from_corner for arc in at_corners)
    assert sum(arc.end - arc.begin for arc in at_corners) == pytest.approx(loop.length)


def test_swaths_are_driven_from_either_end():
    swath = Swath(np.array([[1.0, 2.0], [4.0, 6.0]]), 0, 0)
    assert swath.length == 5.0
    course = math.atan2(4, 3)
    turned = [
        (swath.pose(end, outwards=out)[2] - course) / math.pi
        for end in (0, 1)
        for out in (True, False)
    ]
    assert np.mod(turned, 2.0) == pytest.approx([1.0, 0.0, 0.0, 1.0])
    assert swath.path(back=False).poses[:, :2].tolist() == [[1, 2], [4, 6]]
    back = swath.path(back=True)
    assert back.poses[:, :2].tolist() == [[4, 6], [1, 2]]
    assert math.remainder(back.poses[0, 2] - course - math.pi, math.tau) == pytest.approx(0)
    assert back.cutting.all()
    assert back.curvatures == pytest.approx([0.0])


def test_strips_are_as_few_as_the_header_allows_and_reach_beyond_the_crop():
    # 28.05 m are four strips of 7 m but for a hundredth of a strip, 28.1 m are five.
    for height, count in ((28.05, 4), (28.1, 5), (3.0, 1)):
        swaths = lay_out_swaths(shapely.box(3.0, 2.0, 40.0, 2.0 + height), 0.0, COMBINE)
        middles = 2.0 + height / count * (np.arange(count) + 0.5)
        beyond = 0.8 + CLEAR
        for swath, y in zip(swaths, middles, strict=True):
            expected = np.array([[3.0 - beyond, y], [40.0 + beyond, y]])
            assert swath.ends == pytest.approx(expected)
        assert [swath.strip for swath in swaths] == list(range(count))
    # Parts on both sides of a gap have grids, strips and cells of their own.
    apart = shapely.box(0, 0, 50, 10) | shapely.box(5, 12, 60, 20)
    found = lay_out_swaths(apart, 0.0, COMBINE)
    assert [swath.strip for swath in found] == [0, 1, 3, 4]
    assert [swath.cell for swath in found] == [0, 0, 1, 1]


def test_a_piece_of_a_strip_that_is_a_fiftieth_of_a_header_squared_is_a_swath():
    for area, count in ((0.99, 1), (1.01, 2)):
        notch = shapely.box(40.0, 0.0, 40.0 + area * 0.02 * 49.0 / 7.0, 7.0)
        region = shapely.box(0, 0, 30, 7) | notch
        assert len(lay_out_swaths(region, 0.0, COMBINE)) == count


def test_times_of_paths_count_stops():
    path = MachinePath.of([[0.0, 0, 0], [10.0, 0, 0], [4.0, 0, 0]], gears=[1, -1])
    stop = 1.7 / 0.5
    assert path_time(path, COMBINE) == pytest.approx(16.0 / 1.7 + 2 * stop)


def test_a_curve_is_driven_in_pieces_of_four_metres_at_most():
    curve = dubins_paths((0.0, 0.0, 0.3), (30.0, 9.0, 2.0), 6.0)[0]
    path = curve_path(curve)
    assert path.length == pytest.approx(curve.length)
    assert path.lengths.max() <= 4.0 + 1e-9
    assert path.poses[-1, :2] == pytest.approx([30.0, 9.0])
    assert path.cutting.all()
    assert (path.gears == 1).all()
    assert np.abs(path.curvatures).max() == pytest.approx(1 / 6.0)


def test_a_driver_that_has_nothing_to_cut_is_nowhere():
    driver = Driver(CutGround.of(Field.rectangle(50.0, 40.0), COMBINE), [])
    for ask in ("pose", "path"):
        with pytest.raises(NoWay, match="nothing to cut"):
            getattr(driver, ask)
    driver.go(np.array([-6.0, 5.0, 1.5]))
    assert driver.pose.tolist() == [-6.0, 5.0, 1.5]
    driver.drive(MachinePath.of([[-6.0, 5.0, 1.5], [-6.0, 5.0 + 1e-7, 1.5]]))
    assert len(driver.paths) == 1
    driver.go(np.array([-6.0, 25.0, 1.5]))
    assert len(driver.paths) == 2
    assert driver.path.work.tolist() == [1] * len(driver.path.lengths)


def test_ways_along_the_headland_are_longer_than_straight_ones():
    field = Field.rectangle(90.0, 70.0)
    driver = Driver(CutGround.of(field, COMBINE), lay_out_roads(field.polygon, [3.5], 4.2))
    (road,) = driver.roads
    poses = np.array([[20.0, 3.5, 0.0], [70.0, 3.5, 0.0], [20.0, 66.5, 0.0]])
    extra = detours(poses[:1], poses, driver)
    way = road.length - 2 * abs(road.station(poses[0]) - road.station(poses[2]))
    length = min((road.length - way) / 2, (road.length + way) / 2)
    assert extra[0] == pytest.approx([0.0, 0.0, (length - 63.0 - 10.0) / 1.7])
    ring = Loop(shapely.Point(40, 30).buffer(9).exterior, *[np.zeros(0)] * 2, 0, True)
    driver.roads = [road, ring]
    assert detours(poses[:1], np.array([[49.0, 30.0, 0.0]]), driver).item() == OTHER_LOOP


def test_rings_round_one_hole_belong_together():
    def ring(x, radius):
        return Loop(shapely.Point(x, 0).buffer(radius).exterior, *[np.zeros(0)] * 2, 0, True)

    first, second = (ring(0, 5), ring(40, 6), LOOP), (ring(0, 12), ring(40, 13))
    # The outermost of each first.
    found = ring_groups((first, second))
    assert found == [(second[0], first[0]), (second[1], first[1])]


def test_machines_are_told_apart_where_they_pass():
    passes = Passes(Field.rectangle(80.0, 60.0), COMBINE)
    along = MachinePath.of([[5.0, 20.0, 0.0], [70.0, 20.0, 0.0]])
    passes.add(along, 2)
    beside = 20.0 + 3.5 + 3.5
    for y, clear in ((beside + 1.6, True), (beside - 0.1, False), (20.0, False)):
        pose = np.array([40.0, y, 0.0])
        assert passes.clear(pose, 0) == clear
        # It is not in its own way.
        assert passes.clear(pose, 2)
        assert passes.clear_path(along, [pose]) == clear
    assert passes.clear_path(along, [])
    assert passes.clear(np.array([500.0, 20.0, 0.0]), 0)


def test_of_two_ways_along_a_road_the_quicker_one_is_driven(monkeypatch):
    driver = Driver(CutGround.of(Field.rectangle(50.0, 40.0), COMBINE), [LOOP])
    stop = stop_time(COMBINE)
    # Between as long as the stops would say in metres, and in metres at 1.7 m/s.
    smooth = MachinePath.of([[0.0, 0.0, 0.0], [60.0 + 2.7 * stop, 0.0, 0.0]])
    there_and_back = [[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [0.0, 0.0, 0.0], [20.0, 0.0, 0.0]]
    with_stops = MachinePath.of(there_and_back, gears=[1, -1, 1])
    assert (with_stops.length, len(with_stops.cusps)) == (60.0, 2)
    monkeypatch.setattr(
        driver, "_along", lambda road, side, *ends: smooth if side > 0 else with_stops
    )
    monkeypatch.setattr(driver.ground, "turn", lambda *ends: None)
    assert driver.way_to(np.zeros(3), np.array([40.0, 0.0, 0.0])) is smooth


def test_small_patches_may_be_given_up_and_what_one_cuts_all_know():
    field = Field.rectangle(60.0, 50.0)
    first, second = (Driver(CutGround.of(field, COMBINE), []) for _ in range(2))
    assert LEAST_PATCH == 20.0
    crop = first.ground.crop
    crop.cells[:] = False
    crop.cells[2:10, 3:13] = True
    crop.cells[20:28, 3:12] = True
    crop.cells[20, 12:19] = True
    first.ground.give_up_patches()
    # 80 cells are 20 m^2, 79 are not.
    assert crop.cells[2:10, 3:13].all()
    assert not crop.cells[11:].any()
    second.ground.cut(MachinePath.of([[0.0, 3.0, 0.0], [4.0, 3.0, 0.0]], cutting=True))
    share_ground([first, second])
    assert (first.ground.crop.cells == second.ground.crop.cells).all()
    assert 0 < crop.cells.sum() < 80


def test_what_headers_sweep_is_told_by_where_they_are_down():
    field = Field.rectangle(60.0, 50.0)
    there = MachinePath.of([[2.0, 10.0, 0.0], [42.0, 10.0, 0.0]], cutting=True)
    back = MachinePath.of([[42.0, 13.0, 0.0], [12.0, 13.0, 0.0]], gears=-1, cutting=True)
    up = MachinePath.of([[2.0, 30.0, 0.0], [42.0, 30.0, 0.0]])
    assert covered_area(field, (there, up), COMBINE) == pytest.approx(40 * 7)
    assert covered_area(field, (there, back), COMBINE) == pytest.approx(40 * 7 + 30 * 3)
    poses, stations = header_down(there, 3.0)
    assert stations == pytest.approx(there.stations_every(3.0))
    assert poses == pytest.approx(there.pose_at(stations))
    assert len(header_down(up, 3.0)[1]) == 0


def test_waits_for_crop_are_told_between_stations_and_lead_to_rings():
    stations = np.arange(0.0, 6.0)
    needs = np.array([0.0, 0.0, 2.0, 2.0, 4.0, 4.0])
    none = np.zeros(6)
    easy = CropPrecedence(((none, needs), (none, none)), (stations, stations), 0.0, False)
    told = easy.needed_at(0, 1, np.array([0.0, 1.9, 2.0, 3.5, 9.0]))
    assert told.tolist() == [-np.inf, -np.inf, 2.0, 2.0, 4.0]
    assert can_finish(easy)
    # Each needs the station of the other at which that one needs it.
    ring = CropPrecedence(((none, needs), (needs, none)), (stations, stations), 0.0, False)
    assert not can_finish(ring)
    late = np.array([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])
    assert can_finish(CropPrecedence(((none, needs), (late, none)), (stations,) * 2, 0.0, False))
    for most, finish in ((5.0, True), (5.1, False)):
        # The last stations of the third need all that the first drives, or more.
        last = np.minimum(2 * needs, most)
        about = ((none, late, none), (none, none, late), (last, none, none))
        assert can_finish(CropPrecedence(about, (stations,) * 3, 0.0, False)) == finish


def test_swaths_lie_along_long_edges_and_in_steps_of_fifteen_degrees():
    field = Field.rectangle(75.0, 39.0)
    ground = CutGround.of(field, COMBINE)
    found = find_candidates(field, crop_to_offset(field, COMBINE), ground)
    one = [each for each in found if len(each.rounds) == 1]
    courses = set()
    for each in one:
        along = each.swaths[0].ends[1] - each.swaths[0].ends[0]
        courses.add(round(math.degrees(math.atan2(along[1], along[0])) % 180.0))
    assert courses == set(range(0, 180, 15))


@pytest.mark.parametrize(("width", "alone"), [(83.0, 6), (97.0, None), (41.0, 3)])
def test_rounds_alone_cut_a_field_if_six_are_enough(width, alone):
    field = Field.rectangle(width, 110.0)
    ground = CutGround.of(field, COMBINE)
    found = find_candidates(field, crop_to_offset(field, COMBINE), ground)
    assert [len(each.rounds) for each in found if not each.swaths] == ([alone] if alone else [])
    assert {len(each.rounds) for each in found if each.swaths} == {1, 2, 3} - {alone}
    assert [each.time for each in found] == sorted(each.time for each in found)
