"""Combines on adjacent rows cover fields of all shapes, along ways that can be driven."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.field.coverage import CoveragePlan, plan_coverage
from sightfield.systems.numerics.harvest.field.field import Field

THESIS = Field.rectangle(400.0, 275.0)
BOX = [(0, 0), (200, 0), (200, 150), (0, 150)]


@pytest.fixture(scope="module", params=[2, 3])
def thesis_plan(request) -> CoveragePlan:
    """The field of Figure 3.8, with two and with three combines."""
    return plan_coverage(THESIS, 25.0, 10.0, request.param)


def swept_polygon(plan: CoveragePlan) -> shapely.Geometry:
    """What the headers sweep over, as polygons."""
    quads = []
    for path in plan.paths:
        poses = np.column_stack([path.points, np.unwrap(path.headings)])
        half = plan.header_width / 2
        for k in np.flatnonzero(path.gears > 0):
            bars = []
            for x, y, theta in poses[k : k + 2]:
                aside = half * np.array([-math.sin(theta), math.cos(theta)])
                bars.append([np.array([x, y]) + aside, np.array([x, y]) - aside])
            quads.append(shapely.Polygon([*bars[0], *bars[1][::-1]]).buffer(1e-6))
    return shapely.union_all(quads)


def test_the_thesis_field_is_five_rings_and_a_middle_row(thesis_plan):
    assert thesis_plan.rings == (0, 1, 2, 3, 4, -1)
    assert thesis_plan.reasons == ()


def test_the_thesis_field_is_covered(thesis_plan, check_plan):
    check_plan(thesis_plan)
    assert thesis_plan.covered_fraction > 0.999


def test_polygons_agree_with_the_cells_about_the_area_covered(thesis_plan):
    covered = swept_polygon(thesis_plan).intersection(THESIS.polygon).area
    assert covered == pytest.approx(thesis_plan.covered_area, rel=1e-3)


def test_combines_start_in_order_at_the_edge_with_open_ground_on_the_left(thesis_plan):
    delays = [path.start_delay for path in thesis_plan.paths]
    assert delays[0] == 0
    assert (np.diff(delays) > 0).all()
    for n, path in enumerate(thesis_plan.paths):
        assert THESIS.outline.exterior.distance(shapely.Point(path.points[0])) < 1e-6
        left = path.alongside(25.0 * (n + 0.5), 0.0)
        assert THESIS.outline.exterior.distance(shapely.Point(left[:2])) < 1e-6


def test_the_left_of_combines_stays_open_on_the_thesis_field(thesis_plan):
    for rows in thesis_plan.gaps:
        assert (rows[:, 1] > 25.0).all()


def test_coarser_cells_are_cut_alike(thesis_plan):
    cells = thesis_plan.crop_cells(4.0)
    assert cells.crop_area[cells.cut_by >= 0].sum() == pytest.approx(
        thesis_plan.covered_area, rel=0.01
    )
    ends = np.array([path.length for path in thesis_plan.paths])
    assert cells.standing(0.0 * ends - 1.0).sum() == cells.has_crop.sum()
    assert cells.standing(ends).sum() == (cells.has_crop & (cells.cut_by < 0)).sum()


def test_area_cut_grows_to_the_whole_along_a_path(thesis_plan):
    for path in thesis_plan.paths:
        cut = path.area_cut(np.linspace(0.0, path.length, 500))
        assert cut[0] == 0
        assert (np.diff(cut) >= 0).all()
        assert cut[-1] == pytest.approx(path.cut_area.sum())


def test_straights_of_the_first_lap_are_cut_at_full_width(thesis_plan):
    """25 m2 for each metre of the first combine's first side."""
    cut = thesis_plan.paths[0].area_cut(np.array([50.0, 350.0]))
    assert np.diff(cut)[0] == pytest.approx(300.0 * 25.0, rel=0.01)


@pytest.mark.parametrize("turn", [0.4, 1.9])
def test_a_turned_and_moved_field_is_covered_as_well(turn, check_plan):
    c, s = math.cos(turn), math.sin(turn)
    corners = np.array(BOX) @ np.array([[c, s], [-s, c]]) + [3000.0, -500.0]
    plan = plan_coverage(Field(make_world(corners)), 9.0, 7.0, 2)
    check_plan(plan)
    assert plan.covered_fraction > 0.99


def test_a_single_combine_waits_for_nobody(check_plan):
    plan = plan_coverage(Field.rectangle(150.0, 100.0), 9.0, 7.0, 1)
    check_plan(plan)
    assert plan.holds == ()
    assert plan.timeline.waits.sum() == 0
    assert plan.covered_fraction > 0.99


def test_more_combines_than_rings_leave_some_without_work(check_plan):
    plan = plan_coverage(Field.rectangle(90.0, 60.0), 20.0, 8.0, 5)
    check_plan(plan)
    assert 1 <= len(plan.paths) < 5
    assert plan.covered_fraction > 0.97


def test_a_strip_as_wide_as_the_header_is_one_row():
    plan = plan_coverage(Field.rectangle(300.0, 12.0), 12.0, 7.0, 2)
    assert plan.rings == (-1,)
    assert plan.covered_fraction > 0.999


def test_a_pond_amid_the_field_is_driven_round(check_plan):
    """All but a strip round it, as wide as the turning radius exceeds half of the header."""
    pond = [(90, 60), (110, 60), (110, 80), (90, 80)]
    field = Field(make_world(BOX, [pond]))
    plan = plan_coverage(field, 8.0, 6.0, 2)
    check_plan(plan)
    assert plan.covered_fraction > 0.985
    for path in plan.paths:
        line = shapely.LineString(path.points)
        assert line.intersection(shapely.Polygon(pond)).length < 0.2


def test_poles_and_a_hedge_at_the_edge_are_passed(check_plan):
    pole = [(60, 60), (61, 60), (61, 61), (60, 61)]
    hedge = [(20, 4), (24, 4), (24, 8), (20, 8)]
    plan = plan_coverage(Field(make_world(BOX, [pole, hedge])), 8.0, 6.0, 2)
    check_plan(plan)
    assert plan.covered_fraction > 0.98


def test_an_l_shaped_field_is_covered(check_plan):
    corners = [(0, 0), (160, 0), (160, 70), (70, 70), (70, 150), (0, 150)]
    plan = plan_coverage(Field(make_world(corners)), 8.0, 6.0, 2)
    check_plan(plan)
    assert plan.covered_fraction > 0.985


@settings(max_examples=12)
@given(
    st.lists(st.floats(0.55, 1.2), min_size=5, max_size=9),
    st.floats(0.0, math.tau),
    st.integers(1, 3),
)
def test_star_shaped_fields_are_covered_but_for_a_few_tips(check_plan, reaches, turn, combines):
    angles = turn + math.tau * np.arange(len(reaches)) / len(reaches)
    corners = 70.0 * np.array(reaches)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    plan = plan_coverage(Field(make_world(corners)), 6.0, 5.0, combines)
    check_plan(plan)
    assert plan.covered_fraction > 0.97


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"header_width": 0.0}, "header_width"),
        ({"header_width": 300.0}, "field"),
        ({"turning_radius": -1.0}, "turning_radius"),
        ({"combines": 0}, "combines"),
        ({"combines": 2.5}, "combines"),
        ({"spacing": -1.0}, "spacing"),
        ({"least_gap": float("inf")}, "least_gap"),
        ({"least_pass": 0.0}, "least_pass"),
    ],
)
def test_absurd_plans_are_refused_by_name(change, name):
    wanted = {"header_width": 25.0, "turning_radius": 10.0, "combines": 2} | change
    with pytest.raises(InvalidInput, match=rf"^`{name}` must"):
        plan_coverage(THESIS, **wanted)
