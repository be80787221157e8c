"""Plans of coverage on whole fields, looked at with Shapely on true outlines."""

import itertools

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world, world_from_polygon
from sightfield.systems.numerics.harvest.coverage import plan_coverage
from sightfield.systems.numerics.harvest.coverage.loops import crop_to_offset
from sightfield.systems.numerics.harvest.coverage.plan_coverage import (
    LEAST_COVERAGE,
    LEAST_COVERAGE_AT_ALL,
    find_coverages,
)
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Combine, combine_outline

COMBINE = Combine(header_width=8.0, turning_radius=5.5)

# Fields, a part of the lengths that they have, and how many combines cut them.
CASES = [
    ("l_9", 0.7, 3),
    ("pole_6", 1.0, 2),
    ("banana_4", 0.8, 1),
    ("pond_edge_9", 0.6, 2),
    ("strip_3", 1.0, 2),
]


@pytest.fixture(scope="module", params=CASES, ids=[f"{name} {count}" for name, _, count in CASES])
def planned(request, smaller):
    name, part, count = request.param
    field = smaller(name, part)
    return field, next(find_coverages(field, [COMBINE] * count))


def _placed(part: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """Polygons of an outline's part at poses, shape (n,)."""
    c, s = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
    x = poses[:, 0, None] + c * part[:, 0] - s * part[:, 1]
    y = poses[:, 1, None] + s * part[:, 0] + c * part[:, 1]
    return shapely.polygons(np.stack([x, y], axis=-1))


def _sweeps(path, spacing):
    """What the header's middle passes between stations, and the later of the stations."""
    stations = path.stations_every(spacing)
    poses = path.pose_at(stations)
    line = np.array([[0.0, -COMBINE.header_width / 2], [0.0, COMBINE.header_width / 2]])
    c, s = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
    ends = np.stack(
        [poses[:, 0, None] - s * line[:, 1], poses[:, 1, None] + c * line[:, 1]], axis=-1
    )
    quads = np.concatenate([ends[:-1], ends[1:]], axis=1)
    down = path.cutting[path.piece_at((stations[1:] + stations[:-1]) / 2)]
    return shapely.convex_hull(shapely.multipoints(quads))[down], stations[1:][down]


def test_the_headers_pass_over_the_crop_as_much_as_is_told(planned):
    field, plan = planned
    sweeps = np.concatenate([_sweeps(path, 2.0)[0] for path in plan.paths])
    missed = field.polygon.difference(shapely.union_all(sweeps)).area
    assert missed == pytest.approx(field.area - plan.covered_area, abs=0.0005 * field.area)
    assert plan.coverage >= 0.995


def test_outlines_keep_to_the_ground_and_off_obstacles(planned):
    field, plan = planned
    ground = field.ground.buffer(0.05)
    shapely.prepare(ground)
    for path in plan.paths:
        poses = path.pose_at(path.stations_every(1.0))
        for part in combine_outline(COMBINE):
            assert shapely.covers(ground, _placed(part, poses)).all()


def test_a_no_go_area_on_a_corner_is_gone_round():
    corner = shapely.box(162, 113, 185, 136)
    left = shapely.box(0, 0, 180, 130).difference(corner)
    field = Field(world_from_polygon(left), no_go=(corner,))
    plan = next(find_coverages(field, [COMBINE]))
    assert plan.coverage > 0.995
    path = plan.paths[0]
    poses = path.pose_at(path.stations_every(0.5))
    for part in combine_outline(COMBINE):
        assert shapely.distance(_placed(part, poses), corner).min() > 0.0


def test_who_begins_beside_a_bulging_edge_keeps_to_the_margin(field_makers):
    field, combine = field_makers["blob_12"](), Combine()
    plan = next(find_coverages(field, [combine] * 2))
    ground = field.ground.buffer(0.05)
    for path in plan.paths:
        poses = path.pose_at(np.arange(0.0, 60.0, 0.5))
        for part in combine_outline(combine):
            assert shapely.covers(ground, _placed(part, poses)).all()


def test_paths_are_driven_forwards_where_they_cut_and_no_turn_is_too_tight(planned):
    _, plan = planned
    for path in plan.paths:
        assert (path.gears[path.cutting] == 1).all()
        long = path.lengths > 0.05
        assert np.abs(path.curvatures[long]).max() <= 1.02 / COMBINE.turning_radius


def test_bodies_drive_over_what_is_cut_where_precedence_is_kept(planned):
    field, plan = planned
    sweeps, stations, owners = [], [], []
    for n, path in enumerate(plan.paths):
        quads, at = _sweeps(path, 1.0)
        sweeps.append(quads)
        stations.append(at)
        owners.append(np.full(len(at), n))
    quads, at, who = map(np.concatenate, (sweeps, stations, owners))
    tree = shapely.STRtree(quads)
    behind = combine_outline(COMBINE).body.copy()
    behind[:, 0] = np.minimum(behind[:, 0], -COMBINE.header_depth / 2)
    crop = field.polygon
    over = []
    for m, path in enumerate(plan.paths):
        mine = plan.precedence.stations[m]
        chosen = np.arange(0, len(mine), 3)
        bodies = shapely.intersection(_placed(behind, path.pose_at(mine[chosen])), crop)
        for body, i in zip(bodies, chosen, strict=True):
            passed = np.array([needs[i] for needs in plan.precedence.needs[m]])
            passed[m] = mine[i]
            near = tree.query(body, predicate="intersects")
            # A sweep counts from its end on; half a metre is lost at most.
            cut = near[at[near] <= passed[who[near]] + 1.0]
            over.append(body.difference(shapely.union_all(quads[cut])))
    # Cells are told by their middles: slivers along borders are no crop under bodies.
    under = shapely.union_all([each.buffer(-0.4) for each in over]).area
    assert under <= 0.002 * field.area


def test_combines_that_are_told_to_be_off_all_other_paths_are(planned):
    _, plan = planned
    for m, path in enumerate(plan.paths):
        for end, station in ((0, 0.0), (1, path.length)):
            if not plan.off_paths[m, end]:
                continue
            mine = shapely.union_all(
                [_placed(part, path.pose_at([station]))[0] for part in combine_outline(COMBINE)]
            )
            for n, other in enumerate(plan.paths):
                if n != m:
                    poses = other.pose_at(other.stations_every(1.0))
                    for part in combine_outline(COMBINE):
                        assert shapely.distance(mine, _placed(part, poses)).min() > 0.5


@pytest.mark.parametrize(("name", "count"), [("blob_5", 5), ("blob_7", 3)])
def test_combines_start_beside_the_crop_and_stay_within_the_margin(field_makers, name, count):
    """Where the boundary is hollow a bay beside it may have crop behind."""
    field = field_makers[name]()
    within = field.outline.buffer(field.margin, quad_segs=64).buffer(0.01)
    header, body = combine_outline(Combine())
    for path in next(find_coverages(field, [Combine()] * count)).paths:
        start = _placed(body, path.pose_at([0.0]))[0]
        assert start.intersection(field.polygon).area < 0.5
        poses = path.pose_at(path.stations_every(0.25))
        for part in (header, body):
            assert within.covers(_placed(part, poses)).all()


def test_headers_as_wide_as_the_margin_begin_in_bays_with_the_body_beside_the_crop(field_makers):
    field, wide = field_makers["blob_12"](), Combine(header_width=12.0)
    within = field.outline.buffer(field.margin, quad_segs=64).buffer(0.01)
    header, body = combine_outline(wide)
    plan = next(find_coverages(field, [wide] * 2))
    assert plan.coverage > 0.995
    for path in plan.paths:
        begin = path.pose_at([0.0])
        assert _placed(body, begin)[0].intersection(field.polygon).area < 0.5
        assert within.covers(_placed(header, begin)).all()


def test_rounds_go_no_farther_outside_of_a_reflex_corner_than_half_the_margin(field_makers):
    """Headers little wider than the body turn on wide circles, which the margin has no room for."""
    field, narrow = field_makers["l_9"](), Combine(header_width=4.5)
    region = crop_to_offset(field, narrow)
    assert region.covers(field.outline.buffer(-1e-6))
    outside = region.difference(field.outline)
    assert outside.area > 1.0
    assert field.outline.buffer(field.margin / 2 + 1e-6).covers(region)
    # With a header that is much wider the least circle that it drives does.
    easy = crop_to_offset(field, Combine(header_width=14.0))
    assert easy.difference(field.outline).area < outside.area


@pytest.mark.parametrize(
    ("field", "count", "word"),
    [
        (Field.rectangle(14.0, 9.0), 1, "field"),
        (Field.rectangle(100.0, 70.0, margin=0.0), 1, "field"),
        (Field.rectangle(200.0, 150.0), 0, "combines"),
    ],
)
def test_what_cannot_be_cut_is_refused_in_one_line(field, count, word):
    with pytest.raises(InvalidInput, match=f"`{word}` must") as refused:
        next(find_coverages(field, [COMBINE] * count))
    assert "\n" not in str(refused.value)


def test_whoever_has_too_narrow_a_margin_is_told_which_has_room():
    with pytest.raises(InvalidInput, match=r"margin of 2 m .*; a margin of 6 m has room for"):
        next(find_coverages(Field.rectangle(120.0, 90.0, margin=2.0), [COMBINE]))
    with pytest.raises(InvalidInput) as refused:
        next(find_coverages(Field.rectangle(14.0, 9.0), [COMBINE]))
    assert "has room" not in str(refused.value)


def test_where_no_way_cuts_all_but_half_a_percent_the_one_that_cuts_most_is_taken(monkeypatch):
    """A pond in a small field left no plan at all, for 0.6% of the crop."""
    monkeypatch.setattr(plan_coverage, "MOST_TRIED", 8)
    pond = [(60.0, 50.0), (80.0, 50.0), (80.0, 65.0), (60.0, 65.0)]
    field = Field(make_world([(0.0, 0.0), (160.0, 0.0), (160.0, 120.0), (0.0, 120.0)], [pond]))
    combine = Combine(header_width=7.5, turning_radius=6.5, length=7.5, width=3.4)
    first, *others = itertools.islice(find_coverages(field, [combine] * 2), 3)
    assert LEAST_COVERAGE_AT_ALL <= first.coverage < LEAST_COVERAGE
    assert all(LEAST_COVERAGE_AT_ALL <= other.coverage < LEAST_COVERAGE for other in others)
