"""Sizes and outlines of machines, what an auger reaches, hulls, and cells of the ground."""

import math

import numpy as np
import pytest
import shapely
from scipy.spatial import ConvexHull

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.machines import (
    ACROSS,
    ALONG,
    STANDING,
    STANDS,
    TURNED,
    Cart,
    Combine,
    Hitch,
    cart_outline,
    combine_outline,
    convex_hull,
    drive_team,
    hitch_of,
    is_alongside,
    pair_up,
    size_of,
)
from sightfield.systems.numerics.harvest.raster import cell_under, cells_inside, lattice
from sightfield.systems.numerics.harvest.trucks import FULL, Filling, TruckFleet, TruckPool


def test_outlines_are_boxes_of_the_machines_sizes_as_recorded(as_recorded):
    combine = combine_outline(Combine(header_width=7.4, header_depth=1.8, length=8.3, width=3.1))
    assert combine.header.tolist() == [[-0.9, -3.7], [0.9, -3.7], [0.9, 3.7], [-0.9, 3.7]]
    assert combine.body.tolist() == [[-8.3, -1.55], [0.9, -1.55], [0.9, 1.55], [-8.3, 1.55]]
    cart = Cart(length=6.0, width=2.7, hitch_offset=0.4, speed=5.0, turning_radius=4.0)
    tractor, trailer = cart_outline(cart)
    assert tractor[[0, 2]] == pytest.approx(np.array([[-0.72, -1.35], [3.0, 1.35]]))
    assert trailer[[0, 2]] == pytest.approx(np.array([[-1.68, -1.35], [3.48, 1.35]]))
    towed = cart.trailer
    assert (towed.speed, towed.turn_rate, towed.length, towed.hitch_offset) == (5.0, 1.25, 6.0, 0.4)
    assert hitch_of(cart) == Hitch(6.0, 0.4)
    assert Combine(header_width=8.0, speed=1.5).fill_rate(0.7) == pytest.approx(8.4)
    # What is not told is as it is documented.
    as_recorded([Combine(), Cart(), TruckFleet(), STANDS])


@pytest.mark.parametrize(
    "wrong",
    [
        (Combine, {name: 0.0})
        for name in (
            "header_width",
            "header_depth",
            "turning_radius",
            "length",
            "width",
            "speed",
            "acceleration",
            "capacity",
            "unload_rate",
            "engine_power",
            "mass",
        )
    ]
    + [(Combine, {"cart_gap": -0.1}), (Combine, {"when_full": "wait"})]
    + [
        (Cart, {name: 0.0})
        for name in (
            "speed",
            "acceleration",
            "lateral_acceleration",
            "turning_radius",
            "length",
            "width",
            "capacity",
            "engine_power",
            "mass",
        )
    ]
    + [(Cart, {"hitch_offset": -0.1})],
    ids=str,
)
def test_machines_of_no_size_are_refused(wrong):
    kind, values = wrong
    with pytest.raises(InvalidInput, match=next(iter(values))):
        kind(**values)


def test_what_machines_may_just_be_is_taken():
    assert Combine(cart_gap=0.0).cart_gap == 0.0
    assert Cart(hitch_offset=0.0, capacity=1e-3).capacity == 1e-3


def test_a_team_has_one_size_whatever_its_speeds():
    one, other = Combine(speed=1.3, cart_gap=0.7), Combine(speed=1.9, cart_gap=0.7, capacity=5e3)
    assert size_of([one, other]) == size_of([other])
    assert size_of([one]).cart_gap == 0.7
    with pytest.raises(InvalidInput, match="`length` must be the same for all combines, 8; got 9"):
        size_of([one, Combine(cart_gap=0.7, length=9)])
    with pytest.raises(InvalidInput, match="at least 1"):
        size_of([])


@pytest.mark.parametrize("count", [1, 2, 3, 4, 9, 40])
def test_a_hull_has_the_corners_of_the_hull_in_order(count):
    rng = np.random.default_rng(1)
    for grid in (False, True):
        cloud = rng.uniform(-3, 3, (count + 2, 2))
        if grid:
            # Many in one line, and twice the same.
            cloud = np.round(cloud)
        hull = np.full((2 * count + 1, 2), np.nan)
        points = cloud[:count].copy()
        size = convex_hull(cloud, count, hull)
        wanted = shapely.MultiPoint(points).convex_hull
        if wanted.geom_type == "Polygon":
            found = shapely.Polygon(hull[:size])
            assert size == len(wanted.exterior.coords) - 1
            assert found.exterior.is_ccw
            assert found.equals(wanted)
            if not grid:
                assert size == len(ConvexHull(points).vertices)
        elif count > 1:
            assert shapely.LineString(hull[:2]).equals(wanted) or wanted.geom_type == "Point"
        assert cloud[:count].tolist() == sorted(points.tolist())


LENGTH, OFFSET, REACH = 5.3, 0.8, 7.9
POSE = np.array([12.0, -7.0, 0.6])


def cart_at(ahead, left, turned, beta=0.3):
    """A cart whose box is ahead and to the left of the combine."""
    c, s = math.cos(POSE[2]), math.sin(POSE[2])
    heading = POSE[2] + turned
    theta = heading + beta
    behind = 0.85 * LENGTH
    x = POSE[0] + c * ahead - s * left + behind * math.cos(heading) + OFFSET * math.cos(theta)
    y = POSE[1] + s * ahead + c * left + behind * math.sin(heading) + OFFSET * math.sin(theta)
    return np.array([x, y, theta, beta])


def reached(*place, stands=False):
    return is_alongside(POSE, cart_at(*place), LENGTH, OFFSET, REACH, stands)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_driving_combine_reaches_a_box_up_to_its_tolerances(way):
    assert (ALONG, ACROSS, TURNED, STANDING) == (2.5, 1.2, 0.2, 2.0)
    assert reached(0.0, REACH, 0.0)
    assert reached(way * 2.49, REACH + way * 1.19, way * 0.19)
    assert not reached(way * 2.51, REACH, 0.0)
    assert not reached(0.0, REACH + way * 1.21, 0.0)
    assert not reached(0.0, REACH, way * 0.21)
    assert not reached(0.0, REACH, math.pi)
    assert not reached(0.0, -REACH, 0.0)


def test_exactly_at_its_tolerances_a_box_is_in_reach():
    pose, length, reach = np.zeros(3), 0.0, 8.0

    def at(x, y, heading, stands=False):
        return is_alongside(pose, np.array([x, y, heading, 0.0]), length, 0.0, reach, stands)

    assert at(2.5, 8.0, 0.0)
    assert not at(np.nextafter(2.5, 3), 8.0, 0.0)
    across = np.array([0.0, 1.2, 0.0, 0.0])
    assert is_alongside(pose, across, length, 0.0, 0.0, False)
    assert at(16.0, 0.0, 1.0, True)
    assert not at(np.nextafter(16.0, 17), 0.0, 1.0, True)


def test_a_standing_combine_reaches_a_box_at_any_heading_up_to_twice_as_far():
    for angle in np.arange(0.0, 6.3, 0.7):
        ahead, left = 2 * REACH * math.cos(angle), 2 * REACH * math.sin(angle)
        assert reached(0.999 * ahead, 0.999 * left, angle, stands=True)
        assert not reached(1.001 * ahead, 1.001 * left, angle, stands=True)


def test_of_two_carts_beside_a_combine_the_first_takes_and_nobody_is_asked_for_one_that_is_none():
    states = np.array([cart_at(0.3, REACH, 0.0), cart_at(-0.4, REACH, 0.1)])
    poses, stands = POSE[None], np.array([False])

    def pairs(*wanted):
        told = np.array(wanted, dtype=float)
        return pair_up(poses, states, told, stands, LENGTH, OFFSET, REACH).tolist()

    assert pairs(0, 0) == [0.0]
    assert pairs(-1, 0) == [1.0]
    assert pairs(1, 2) == [-1.0]


def test_carts_drive_on_their_own_and_are_held_within_both_bounds():
    rng = np.random.default_rng(2)
    hitch, states = Hitch(5.3, 0.8), rng.uniform(-1.0, 1.0, 8)

    def driven(*control, count=4):
        return drive_team(states, np.array(control), 6.0, 1.1, hitch, 0.4, count)

    far = driven(-9.0, 3.0, 0.0, -3.0)
    assert far == pytest.approx(driven(-6.0, 1.1, 0.0, -1.1), abs=0.0)
    assert driven(0.0, 0.0, 2.0, 0.0)[:4] == pytest.approx(states[:4], abs=0.0)
    # One that turns on the spot keeps its place, and its trailer comes round.
    turned = driven(0.0, 0.5, 0.0, 0.0)
    assert turned[:3] == pytest.approx(states[:3] + np.array([0.0, 0.0, 0.2]))
    assert turned[3] != states[3]
    # Of the fourth order: with half the step a sixteenth of the error.
    exact = driven(5.0, 0.9, 3.0, -1.0, count=200)
    errors = [np.abs(driven(5.0, 0.9, 3.0, -1.0, count=n) - exact).max() for n in (2, 4)]
    assert 10.0 < errors[0] / errors[1] < 25.0


def shape_with_holes():
    outer = [(1.3, 0.2), (9.7, 1.1), (12.4, 8.3), (6.0, 5.1), (2.2, 9.6)]
    hole = [(4.1, 2.2), (6.3, 2.4), (5.2, 4.4)]
    return shapely.MultiPolygon([shapely.Polygon(outer, [hole]), shapely.box(-3.1, -2.2, 0.4, 1.7)])


@pytest.mark.parametrize("corner", [(-4.03, -3.11), (0.07, 0.9), (3.0, -9.0)])
@pytest.mark.parametrize("side", [0.31, 0.9])
def test_cells_are_inside_if_their_middles_are(corner, side):
    region, shape = shape_with_holes(), (31, 27)
    rows, columns = np.indices(shape)
    x, y = corner[0] + side * (columns + 0.5), corner[1] + side * (rows + 0.5)
    found = cells_inside(region, np.array(corner), side, shape)
    assert (found == shapely.contains_xy(region, x, y)).all()
    assert found.any()


def test_of_two_regions_that_touch_each_cell_is_in_one():
    # Middles of cells lie on the line between them, and on their corners.
    corner, shape = np.zeros(2), (12, 12)
    cut = [(2.25, 0.25), (3.25, 5.25)]
    left = shapely.Polygon([(0.25, 0.25), *cut, (0.25, 5.25)])
    right = shapely.Polygon([*cut, (5.25, 5.25), (5.25, 0.25)])
    parts = [cells_inside(each, corner, 0.5, shape).astype(int) for each in (left, right)]
    both = cells_inside(shapely.box(0.25, 0.25, 5.25, 5.25), corner, 0.5, shape)
    assert (sum(parts) == both).all()
    assert both.sum() == 10 * 10


@pytest.mark.parametrize(
    ("spacing", "along", "across"), [(1.0, 5, 4), (2.5, 3, 3), (0.9, 6, 5), (9.0, 2, 2)]
)
def test_a_lattice_has_points_on_all_edges_no_farther_apart_than_asked(spacing, along, across):
    points = lattice(-1.0, 3.0, 1.5, spacing)
    assert points.shape == (along * across, 2)
    assert np.unique(points[:, 0]) == pytest.approx(np.linspace(-1.0, 3.0, along))
    assert np.unique(points[:, 1]) == pytest.approx(np.linspace(-1.5, 1.5, across))
    assert lattice(2.0, 2.0, 0.0, spacing).tolist() == [[2.0, 0.0]]


def test_a_cell_under_a_point_of_a_machine_is_where_the_point_is():
    rng = np.random.default_rng(3)
    corner, side = np.array([-3.7, 2.9]), 0.7
    for _ in range(100):
        pose, point = rng.uniform(-9, 9, 3), rng.uniform(-3, 3, 2)
        c, s = math.cos(pose[2]), math.sin(pose[2])
        there = pose[:2] + np.array([[c, -s], [s, c]]) @ point
        column, row = np.floor((there - corner) / side)
        assert cell_under(corner, side, pose, c, s, point) == (row, column)


def test_trucks_are_away_for_their_road_and_come_back_empty():
    pool = TruckPool(TruckFleet(count=2, capacity=1000.0, road_time=50.0))
    # The first one is filled, the second begun.
    assert pool.empty(0.0, 1300.0, 10.0) == [
        Filling(0, 0.0, 100.0, 1000.0),
        Filling(1, 100.0, 130.0, 300.0),
    ]
    # Until the first one is back the second one takes; of two that are there the first one does.
    assert pool.empty(149.0, 100.0, 10.0) == [Filling(1, 149.0, 159.0, 100.0)]
    assert pool.empty(170.0, 200.0, 10.0) == [Filling(0, 170.0, 190.0, 200.0)]


def test_a_truck_that_has_time_to_be_back_between_two_carts_is_empty_again():
    fleet = TruckFleet(capacity=1000.0, road_time=50.0)
    early, just = TruckPool(fleet), TruckPool(fleet)
    for pool in (early, just):
        assert pool.empty(0.0, 600.0, 10.0) == [Filling(0, 0.0, 60.0, 600.0)]
    assert early.empty(109.0, 600.0, 10.0)[0] == Filling(0, 109.0, 149.0, 400.0)
    assert just.empty(110.0, 600.0, 10.0) == [Filling(0, 110.0, 170.0, 600.0)]


def test_less_than_a_milligram_of_room_or_of_grain_is_none():
    assert FULL == 1e-6
    pool = TruckPool(TruckFleet(capacity=1000.0, road_time=50.0))
    assert pool.empty(0.0, FULL, 10.0) == []
    assert len(pool.empty(0.0, 1000.0 - FULL / 2, 10.0)) == 1
    # It is full, and has left.
    assert pool.empty(101.0, 100.0, 10.0)[0].begin == pytest.approx(150.0)
    settled = [Filling(0, 20.0, 70.0, 500.0), Filling(0, 0.0, 20.0, 200.0)]
    told = TruckPool(TruckFleet(capacity=1000.0, road_time=50.0), settled)
    assert told.empty(80.0, 400.0, 10.0)[0] == Filling(0, 80.0, 110.0, 300.0)


def test_a_fleet_may_have_no_road_and_one_truck():
    assert TruckFleet(count=1, road_time=0.0, capacity=0.1).count == 1
