"""What is cut and what is driven over, against areas in closed form and Shapely."""

import math

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.harvest.audit.crop import ANGLE, crop_record
from sightfield.systems.numerics.harvest.audit.harvest_log import HarvestLog, Machine, Site
from sightfield.systems.numerics.harvest.audit.motion import moving_outline, polygons_at

FIELD = shapely.box(0, 0, 120, 60)


def drive(shapes, combines=(), carts=(), cutting=1.0, crop=FIELD, front=None):
    """What becomes of the crop: combines and carts are poses by sample, a second apart."""
    count = len((*combines, *carts)[0])
    poses = np.stack(combines, axis=1) if combines else np.zeros((count, 0, 3))
    carts_ = np.stack(carts, axis=1) if carts else np.zeros((count, 0, 3))
    none = np.zeros((count, carts_.shape[1]))
    log = HarvestLog(
        np.arange(count, dtype=float),
        poses,
        np.zeros(poses.shape[:2]),
        carts_,
        # The trailer is left where it is in no crop.
        np.zeros_like(carts_) - 50.0,
        np.zeros(poses.shape[:2]),
        none,
        np.broadcast_to(np.asarray(cutting, dtype=float), poses.shape[:2]).copy(),
        np.zeros(count),
    )
    header = shapes.header if front is None else front
    site = Site(
        (Machine(front=header, rear=shapes.body),) * poses.shape[1],
        (Machine(front=shapes.tractor, rear=shapes.trailer),) * carts_.shape[1],
        (),
        0.0,
    )
    return crop_record(log, site, crop)


def straight(begin, end, samples, theta):
    ends = np.linspace(begin, end, samples)
    return np.column_stack([ends, np.full(samples, theta)])


def test_a_header_cuts_its_width_along_its_way_and_its_body_finds_no_crop(shapes):
    theta = 0.4
    way = 40 * np.array([math.cos(theta), math.sin(theta)])
    path = straight(np.array([20.0, 15.0]), np.array([20.0, 15.0]) + way, 31, theta)
    # The header is level with the body's front, and was let down on what it stands on.
    found = drive(shapes, [path])
    assert found.cut[-1] == pytest.approx(9.0 * (40 + 2), rel=0.005)
    assert found.area == 7200.0
    # It stood on 7 m of its body's 9 m at first, and drove on none.
    assert found.crushed["combine 0"].sum() == pytest.approx(3.6 * 7, rel=0.05)
    assert found.crushed["combine 0"][1:].sum() == 0.0


def test_area_cut_grows_with_time(shapes):
    path = straight(np.array([-30.0, 20.0]), np.array([110.0, 20.0]), 141, 0.0)
    found = drive(shapes, [path])
    # From the moment at which the header's front, 1 m ahead, is in the field.
    way = np.clip(np.arange(141) - 30 + 1, 0, 120)
    assert found.cut == pytest.approx(9.0 * way, abs=9.0 * 0.25)


def test_a_strip_of_five_centimetres_between_two_rows_is_left_standing(shapes):
    rows = [straight(np.array([-20.0, y]), np.array([140.0, y]), 161, 0.0) for y in (20.0, 29.05)]
    found = drive(shapes, rows)
    assert 2 * 9 * 120 + 9.05 - found.cut[-1] == pytest.approx(9.05, abs=1.5)
    whole = drive(shapes, rows, crop=shapely.box(0, 15.5, 120, 33.55))
    assert whole.area - whole.cut[-1] == pytest.approx(0.05 * 120, rel=0.2)


def test_rows_that_adjoin_leave_nothing(shapes):
    rows = [straight(np.array([-20.0, y]), np.array([140.0, y]), 161, 0.0) for y in (19.5, 28.5)]
    found = drive(shapes, rows, crop=shapely.box(0, 15, 120, 33))
    assert found.cut[-1] == found.area


def test_a_header_that_is_up_cuts_nothing_and_its_body_drives_over_crop(shapes):
    path = straight(np.array([-20.0, 20.0]), np.array([60.0, 20.0]), 81, 0.0)
    found = drive(shapes, [path], cutting=0.0)
    assert found.cut[-1] == 0.0
    # The body's front is 1 m ahead.
    assert found.crushed["combine 0"].sum() == pytest.approx(3.6 * 61, rel=0.01)


def test_a_body_is_on_crop_until_it_is_cut_and_not_after(shapes):
    over = straight(np.array([40.0, 10.0]), np.array([40.0, 50.0]), 60, math.pi / 2)
    late = np.concatenate([np.repeat(over[:1], 140, axis=0), over])
    early = np.concatenate([over, np.repeat(over[-1:], 140, axis=0)])
    path = straight(np.array([-20.0, 20.0]), np.array([140.0, 20.0]), 200, 0.0)
    # The row is cut from y = 15.5 to 24.5, at x = 40 about 75 s after the beginning.
    tractor = 40 + 2.5 + 0.6
    before = drive(shapes, [path], [early]).crushed["cart 0"].sum()
    after = drive(shapes, [path], [late]).crushed["cart 0"].sum()
    assert before == pytest.approx(2.5 * tractor, rel=0.02)
    assert before - after == pytest.approx(2.5 * 9, rel=0.03)


@pytest.mark.parametrize("curved", [False, True])
def test_a_turning_machine_covers_what_shapely_unites(shapes, curved):
    angles = np.linspace(0.2, 2.9, 12)
    path = np.column_stack([60 + 14 * np.sin(angles), 30 - 14 * np.cos(angles), angles])
    front = shapes.header
    if curved:
        # A header with a notch, which is not convex.
        front = np.array([[-1, -4], [2, -4], [2, 4], [-1, 4], [0.5, 0.0]], dtype=float)
    found = drive(shapes, [path], front=front)
    outline = moving_outline("it", front, path)
    number, share = np.divmod(np.arange(0, 11, 0.02), 1.0)
    polygons = polygons_at(outline, number.astype(int), share)
    assert found.cut[-1] == pytest.approx(shapely.union_all(polygons).area, rel=0.01)


def test_holes_and_the_ground_outside_are_no_crop(shapes):
    crop = shapely.Polygon(FIELD.exterior, [shapely.box(50, 18, 58, 40).exterior.coords])
    path = straight(np.array([-20.0, 20.0]), np.array([140.0, 20.0]), 161, 0.0)
    found = drive(shapes, [path], crop=crop)
    assert found.area == pytest.approx(7200 - 8 * 22)
    assert found.cut[-1] == pytest.approx(9 * 120 - 8 * 6.5, rel=0.003)


def test_a_header_let_down_between_two_samples_counts_as_down_from_the_first(shapes):
    path = straight(np.array([20.0, 20.0]), np.array([60.0, 20.0]), 41, 0.0)
    down = np.zeros((41, 1))
    down[20:30] = 1.0
    found = drive(shapes, [path], cutting=down)
    # Samples are 1 m apart: from that at 39 m to that at 50 m, and the header's depth.
    assert found.cut[-1] == pytest.approx(9 * (50 - 39 + 2), rel=0.01)


def test_a_wide_field_is_looked_at_in_coarser_squares(shapes):
    crop = shapely.box(0, 0, 2000, 1000)
    path = straight(np.array([-20.0, 20.0]), np.array([2020.0, 20.0]), 400, 0.0)
    found = drive(shapes, [path], crop=crop)
    assert found.side == pytest.approx(math.sqrt(2e6 / 5e6))
    assert found.cut[-1] == pytest.approx(9 * 2000, rel=0.005)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_header_wider_than_the_field_leaves_nothing_at_its_edges(shapes, sign):
    """Not even where a whole edge of the field lies along the last points of the raster."""
    side = math.pi / 2 + sign * ANGLE
    slant = 60 * np.array([math.cos(side), math.sin(side)])
    crop = shapely.Polygon([(0, 0), (120, 0), (120 + slant[0], slant[1]), tuple(slant)])
    front = np.array([[-1.0, -90.0], [1.0, -90.0], [1.0, 90.0], [-1.0, 90.0]])
    path = straight(np.array([-40.0, 30.0]), np.array([160.0, 30.0]), 201, 0.0)
    found = drive(shapes, [path], crop=crop, front=front)
    assert found.cut[-1] == pytest.approx(found.area, rel=1e-12)
